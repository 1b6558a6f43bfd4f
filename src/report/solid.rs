//! Bodies in space as one picture: the triangles of their surfaces that face the viewer, from back to front, coloured by a value.

use super::bands::{BANDS, Canvas, Piece, band, range};
use super::body::Part;
use crate::linalg::bounds;
use nalgebra::Vector3;
use plotters::style::colors::colormaps::{ColorMap, ViridisRGB};
use std::fmt::Write;

/// Towards the viewer: from above, with x to the right and y away from him.
const TOWARDS: [f64; 3] = [0.52, -0.74, 0.43];

/// Brightnesses by which a surface looks bent. Of 3, 6 and 12 in the picture of `flange` (406, 414 and 421 kB), 3 show a pipe as strips.
const SHADES: usize = 6;

/// Share of its brightness that a surface keeps at the rim, where it turns away. Of 0.3, 0.6 and 0.9 on `flange`, at 0.3 the levels are no
/// longer the colours of the legend, and at 0.9 edges are not seen.
const RIM: f64 = 0.6;

/// The picture of one value, given at the points of all parts: see [`super::bands::svg`].
pub fn svg(
    parts: &[Part],
    values: &[Vec<f64>],
    squares: bool,
    title: &str,
    scale: f64,
    alone: bool,
) -> Result<String, minijinja::Error> {
    let towards = Vector3::from(TOWARDS).normalize();
    let right = Vector3::z().cross(&towards).normalize();
    let axes = [right, towards.cross(&right), towards];
    let turned = |&x: &[f64; 3]| axes.map(|axis| axis.dot(&Vector3::from(x)));
    let seen: Vec<Vec<[f64; 3]>> = parts.iter().map(|part| part.moved(scale).iter().map(turned).collect()).collect();
    let canvas = Canvas::new(bounds(seen.iter().flatten().copied()), range(values.iter().flatten()), squares);
    let mut triangles: Vec<(f64, usize, [[i64; 2]; 3])> = Vec::new();
    for ((part, seen), values) in parts.iter().zip(&seen).zip(values) {
        for corners in &part.triangles {
            let [a, b, c] = corners.map(|corner| seen[corner as usize]);
            let along = |to: [f64; 3]| Vector3::from(to) - Vector3::from(a);
            let normal = along(b).cross(&along(c)).normalize();
            // what turns away is hidden by what does not
            if normal.z <= 0.0 || normal.z.is_nan() {
                continue;
            }
            let value = corners.iter().map(|&corner| values[corner as usize]).sum::<f64>() / 3.0;
            let shade = ((normal.z * SHADES as f64) as usize).min(SHADES - 1);
            let color = band(value, canvas.range, squares) * SHADES + shade;
            triangles.push((a[2] + b[2] + c[2], color, [a, b, c].map(|x| canvas.place(&x).map(|x| x.round() as i64))));
        }
    }
    triangles.sort_by(|a, b| a.0.total_cmp(&b.0));
    let pieces = triangles.chunk_by(|a, b| a.1 == b.1).map(|alike| {
        let mut path = String::new();
        for (_, _, [a, b, c]) in alike {
            // texts take what is written
            let _ = write!(path, "M{},{}L{},{} {},{}z", a[0], a[1], b[0], b[1], c[0], c[1]);
        }
        Piece { fill: color(alike[0].1), path }
    });
    canvas.draw(vec![(String::new(), pieces.collect(), String::new())], title, scale, alone)
}

/// The colour of a band in a brightness.
fn color(number: usize) -> String {
    let (band, shade) = (number / SHADES, number % SHADES);
    let color = ViridisRGB.get_color_normalized(band as f32, 0.0, (BANDS - 1) as f32);
    let share = RIM + (1.0 - RIM) * shade as f64 / (SHADES - 1) as f64;
    let [r, g, b] = [color.0, color.1, color.2].map(|part| (f64::from(part) * share).round() as u8);
    format!("#{r:02x}{g:02x}{b:02x}")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tetrahedron shows the faces that look at the viewer, the nearest last.
    #[test]
    fn what_faces_the_viewer_is_drawn_from_back_to_front() {
        let points = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let triangles = vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];
        let (displacement, value) = (vec![[0.0; 3]; 4], vec![0.0, 1.0, 2.0, 3.0]);
        let part = Part { name: "a".into(), points, triangles, displacement, value: value.clone(), is_solid: true };
        let svg = svg(&[part], &[value], false, "v", 1.0, true).expect("a picture");
        // y = 0 and x + y + z = 1 face (0.52, -0.74, 0.43); z = 0 and x = 0 do not
        assert_eq!(svg.matches("z\"").count(), 2, "{svg}");
        let fills: Vec<&str> = svg.split("<path fill=\"").skip(1).map(|rest| &rest[..7]).collect();
        // mean values 2 and 4/3 of 3: bands 8 and 5 of 12; cosines 0.12 and 0.74: shades 0 and 4 of 6
        assert_eq!(fills, [color(8 * SHADES), color(5 * SHADES + 4)]);
    }
}
