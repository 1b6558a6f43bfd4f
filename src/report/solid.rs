//! One picture of bodies in space: the triangles of their surfaces that face the viewer, from back to front, coloured by a value.

use super::bands::{BANDS, Canvas, Piece, Shape, band, range};
use super::body::Part;
use crate::linalg::bounds;
use nalgebra::Vector3;
use plotters::style::colors::colormaps::{ColorMap, ViridisRGB};
use std::fmt::Write;

/// The direction to the viewer, who looks from above, with x to the right and y away from them.
const TOWARDS: [f64; 3] = [0.52, -0.74, 0.43];

/// Number of brightness levels, which make a surface look curved. The picture of `flange` with 3, 6 and 12 levels has 406, 414 and
/// 421 kB, and with 3 levels a pipe shows strips.
const SHADES: usize = 6;

/// Relative brightness of a surface at the rim, where it turns away. The values 0.3, 0.6 and 0.9 were compared on `flange`: with 0.3
/// the colours no longer match the legend, and with 0.9 edges cannot be seen.
const RIM: f64 = 0.6;

/// A triangle that faces the viewer.
struct Facet {
    /// Three times the distance of its centre towards the viewer.
    depth: f64,
    /// Number of its colour, see [`color`].
    color: usize,
    /// Positions of its corners in steps of the picture.
    corners: [[i64; 2]; 3],
}

/// Return the picture of one scalar field, given at the points of all parts; for the arguments see [`super::bands::svg`].
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
    let mut facets: Vec<Facet> = Vec::new();
    for ((part, seen), values) in parts.iter().zip(&seen).zip(values) {
        for corners in &part.triangles {
            let [a, b, c] = corners.map(|corner| seen[corner as usize]);
            let along = |to: [f64; 3]| Vector3::from(to) - Vector3::from(a);
            let normal = along(b).cross(&along(c)).normalize();
            // a triangle that faces away is hidden by others
            if normal.z <= 0.0 || normal.z.is_nan() {
                continue;
            }
            let value = corners.iter().map(|&corner| values[corner as usize]).sum::<f64>() / 3.0;
            let shade = ((normal.z * SHADES as f64) as usize).min(SHADES - 1);
            let color = band(value, canvas.range, squares) * SHADES + shade;
            let corners = [a, b, c].map(|x| canvas.place(&x).map(|x| x.round() as i64));
            facets.push(Facet { depth: a[2] + b[2] + c[2], color, corners });
        }
    }
    facets.sort_by(|a, b| a.depth.total_cmp(&b.depth));
    let pieces = facets.chunk_by(|a, b| a.color == b.color).map(piece).collect();
    canvas.draw(vec![Shape { name: String::new(), pieces, outline: String::new() }], title, scale, alone)
}

/// Return facets of the same colour as one piece.
fn piece(alike: &[Facet]) -> Piece {
    let mut path = String::new();
    for Facet { corners: [a, b, c], .. } in alike {
        // writing to a String does not fail
        let _ = write!(path, "M{},{}L{},{} {},{}z", a[0], a[1], b[0], b[1], c[0], c[1]);
    }
    Piece { fill: color(alike[0].color), path }
}

/// Return the colour of a number, which is a band times [`SHADES`] plus a brightness level.
fn color(number: usize) -> String {
    let (band, shade) = (number / SHADES, number % SHADES);
    let color = ViridisRGB.get_color_normalized(band as f32, 0.0, (BANDS - 1) as f32);
    let brightness = RIM + (1.0 - RIM) * shade as f64 / (SHADES - 1) as f64;
    let [r, g, b] = [color.0, color.1, color.2].map(|part| (f64::from(part) * brightness).round() as u8);
    format!("#{r:02x}{g:02x}{b:02x}")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tetrahedron shows the faces that face the viewer, the nearest last.
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
