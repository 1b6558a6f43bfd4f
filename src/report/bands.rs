//! Bands of equal value on deformed bodies of the plane, as SVG.

use super::body::Part;
use crate::linalg::bounds;
use minijinja::context;
use plotters::style::colors::colormaps::{ColorMap, ViridisRGB};
use serde::Serialize;
use std::collections::{HashMap, HashSet};
use std::fmt::Write;

/// Colours of a picture.
pub const BANDS: usize = 12;
/// Width of a picture, and its largest height.
const SIZE: [f64; 2] = [760.0, 620.0];
/// Steps of the coordinates in a pixel: pictures can be enlarged.
const FINE: f64 = 50.0;

/// The colours from the least value to the largest one: viridis, which colour-blind readers can follow.
pub fn colors() -> [String; BANDS] {
    std::array::from_fn(|band| {
        let color = ViridisRGB.get_color_normalized(band as f32, 0.0, (BANDS - 1) as f32);
        format!("#{:02x}{:02x}{:02x}", color.0, color.1, color.2)
    })
}

/// Least and largest of all values that are numbers; never equal.
pub fn range<'a>(values: impl Iterator<Item = &'a f64>) -> [f64; 2] {
    let finite = values.filter(|value| value.is_finite());
    let [low, high] = finite.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], &v| [low.min(v), high.max(v)]);
    if low < high {
        [low, high]
    } else if low == high {
        [low, low + low.abs().max(1e-300)]
    } else {
        [0.0, 1.0]
    }
}

/// The band of a value in a range; what is no number is in the first.
pub fn band(value: f64, [least, most]: [f64; 2], squares: bool) -> usize {
    let share = ((value - least) / (most - least)).max(0.0);
    ((if squares { share.sqrt() } else { share } * BANDS as f64) as usize).min(BANDS - 1)
}

/// A part of a picture in one colour.
#[derive(Serialize)]
pub struct Piece {
    /// Its colour.
    pub fill: String,
    /// Its outline as SVG has it.
    pub path: String,
}

/// What pictures of bodies share: their size, colours and legend.
pub struct Canvas {
    low: [f64; 3],
    high: [f64; 3],
    pixel: f64,
    /// Least and largest value.
    pub range: [f64; 2],
    squares: bool,
}

impl Canvas {
    /// For points within a box, of which two coordinates are seen, and values in a range; see [`svg`].
    pub fn new([low, high]: [[f64; 3]; 2], range: [f64; 2], squares: bool) -> Self {
        let pixel = ((high[0] - low[0]) / SIZE[0]).max((high[1] - low[1]) / SIZE[1]);
        Self { low, high, pixel, range, squares }
    }

    /// Where a point is seen, in steps of the picture.
    pub fn place(&self, x: &[f64; 3]) -> [f64; 2] {
        [(x[0] - self.low[0]) / self.pixel * FINE, (self.high[1] - x[1]) / self.pixel * FINE]
    }

    /// The value where a band begins.
    fn level(&self, band: usize) -> f64 {
        let [least, most] = self.range;
        let share = band as f64 / BANDS as f64;
        least + (most - least) * if self.squares { share * share } else { share }
    }

    /// The picture of bodies: of each its name, its pieces from back to front and its outline.
    pub fn draw(
        &self,
        bodies: Vec<(String, Vec<Piece>, String)>,
        title: &str,
        scale: f64,
        alone: bool,
    ) -> Result<String, minijinja::Error> {
        let [width, height] = [0, 1].map(|k| (self.high[k] - self.low[k]) / self.pixel);
        super::words::environment().render_named_str(
            "bands.svg.html",
            include_str!("bands.svg"),
            context! {
                bodies, title, alone, scale, width, height, fine => FINE, colors => colors().to_vec(),
                levels => (0..=BANDS).map(|band| self.level(band)).collect::<Vec<_>>(),
            },
        )
    }
}

/// The picture of one value, given at the points of all parts; `title` says what it is, with its unit. With `squares` the
/// levels grow as squares: a stress peaks at contacts, and with equal steps most of a body would have the first colour.
/// A picture that stands alone has a white ground.
pub fn svg(
    parts: &[Part],
    values: &[Vec<f64>],
    squares: bool,
    title: &str,
    scale: f64,
    alone: bool,
) -> Result<String, minijinja::Error> {
    let places: Vec<Vec<[f64; 3]>> = parts.iter().map(|part| part.moved(scale)).collect();
    let canvas = Canvas::new(bounds(places.iter().flatten().copied()), range(values.iter().flatten()), squares);
    let colors = colors();
    let body = |((part, places), values): ((&Part, &Vec<[f64; 3]>), &Vec<f64>)| {
        let places: Vec<[f64; 2]> = places.iter().map(|x| canvas.place(x)).collect();
        let pieces = (0..BANDS).map(|band| {
            // all of the body is in the first band, whatever its values are
            let level = if band == 0 { f64::NEG_INFINITY } else { canvas.level(band) };
            Piece { fill: colors[band].clone(), path: path(&part.triangles, &places, values, level) }
        });
        let pieces: Vec<Piece> = pieces.collect();
        let outline = pieces[0].path.clone();
        (part.name.clone(), pieces, outline)
    };
    canvas.draw(parts.iter().zip(&places).zip(values).map(body).collect(), title, scale, alone)
}

/// The picture of the pressure on a contact surface in space, seen along its shortest direction; grey where there is none.
pub fn pressure(surface: &Part, axes: [usize; 2], title: &str, alone: bool) -> Result<String, minijinja::Error> {
    let flat: Vec<[f64; 3]> = surface.points.iter().map(|x| [x[axes[0]], x[axes[1]], 0.0]).collect();
    let pressures: Vec<f64> = surface.value.iter().map(|p| p.max(0.0)).collect();
    let [_, most] = range(pressures.iter());
    let canvas = Canvas::new(bounds(flat.iter().copied()), [0.0, most], false);
    let places: Vec<[f64; 2]> = flat.iter().map(|x| canvas.place(x)).collect();
    let region = |level: f64| path(&surface.triangles, &places, &pressures, level);
    let outline = region(f64::NEG_INFINITY);
    let mut pieces = vec![Piece { fill: "#b8b8b8".to_owned(), path: outline.clone() }];
    for (band, fill) in colors().into_iter().enumerate() {
        pieces.push(Piece { fill, path: region(canvas.level(band).max(1e-9 * most)) });
    }
    canvas.draw(vec![(surface.name.clone(), pieces, outline)], title, 0.0, alone)
}

/// A corner of a region: a point of the mesh, twice, or the place between two of them where the level is.
type Corner = (u32, u32);

/// Outline of the region in which a value is at least `level`, linear in each triangle. Edges that two triangles share
/// are left out, so that a region is as long as its border.
fn path(triangles: &[[u32; 3]], places: &[[f64; 2]], values: &[f64], level: f64) -> String {
    let is_in = |node: u32| values[node as usize] >= level || level == f64::NEG_INFINITY;
    let mut edges: HashSet<(Corner, Corner)> = HashSet::new();
    let mut corners: Vec<Corner> = Vec::with_capacity(4);
    for &[a, b, c] in triangles {
        let [p, q, r] = [a, b, c].map(|node| places[node as usize]);
        // all outlines turn the same way
        let turned = (q[0] - p[0]) * (r[1] - p[1]) < (r[0] - p[0]) * (q[1] - p[1]);
        let nodes = if turned { [a, c, b] } else { [a, b, c] };
        corners.clear();
        for k in 0..3 {
            let (from, to) = (nodes[k], nodes[(k + 1) % 3]);
            if is_in(from) {
                corners.push((from, from));
            }
            if is_in(from) != is_in(to) {
                corners.push((from.min(to), from.max(to)));
            }
        }
        for k in 0..corners.len() {
            let (from, to) = (corners[k], corners[(k + 1) % corners.len()]);
            if !edges.remove(&(to, from)) {
                edges.insert((from, to));
            }
        }
    }
    let at = |(i, j): Corner| {
        let (x, y, v, w) = (places[i as usize], places[j as usize], values[i as usize], values[j as usize]);
        let share = if i == j { 0.0 } else { (level - v) / (w - v) };
        [0, 1].map(|k| (x[k] + share * (y[k] - x[k])).round() as i64)
    };
    let mut next: HashMap<Corner, Vec<Corner>> = HashMap::new();
    let mut sorted: Vec<_> = edges.into_iter().collect();
    sorted.sort_unstable();
    sorted.iter().for_each(|&(from, to)| next.entry(from).or_default().push(to));
    let mut text = String::new();
    for (start, _) in sorted {
        let mut last = at(start);
        let mut corner = start;
        let mut is_first = true;
        while let Some(to) = next.get_mut(&corner).and_then(Vec::pop) {
            if is_first {
                let _ = write!(text, "M{},{}l", last[0], last[1]);
            }
            let place = at(to);
            let step = [place[0] - last[0], place[1] - last[1]];
            if step != [0, 0] {
                let gap = if is_first { "" } else { " " };
                let _ = write!(text, "{gap}{},{}", step[0], step[1]);
                is_first = false;
            } else if is_first {
                let _ = write!(text, "0,0");
                is_first = false;
            }
            (corner, last) = (to, place);
        }
        if !is_first {
            text.push('z');
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Area inside a path.
    fn area(path: &str) -> f64 {
        let mut twice = 0.0;
        for outline in path.split('z').filter(|outline| !outline.is_empty()) {
            let (start, steps) = outline[1..].split_once('l').unwrap();
            let pair = |text: &str| {
                let (x, y) = text.split_once(',').unwrap();
                [x.parse::<f64>().unwrap(), y.parse::<f64>().unwrap()]
            };
            let mut at = pair(start);
            for step in steps.split(' ').map(pair) {
                let to = [at[0] + step[0], at[1] + step[1]];
                twice += at[0] * to[1] - at[1] * to[0];
                at = to;
            }
        }
        twice.abs() / 2.0
    }

    #[test]
    fn a_region_has_the_area_that_its_level_cuts_off_and_no_edge_inside() {
        // a square of 8 triangles, some turned the other way, with the value x
        let places: Vec<[f64; 2]> = (0..9).map(|k| [500.0 * f64::from(k % 3), 500.0 * f64::from(k / 3)]).collect();
        let squares = [0, 1, 3, 4].map(|k| [[k, k + 1, k + 4], [k, k + 3, k + 4]]);
        let triangles = squares.concat();
        let values: Vec<f64> = places.iter().map(|place| place[0]).collect();
        for (level, expected) in
            [(f64::NEG_INFINITY, 1e6), (250.0, 750e3), (500.0, 500e3), (900.0, 100e3), (1001.0, 0.0)]
        {
            let path = path(&triangles, &places, &values, level);
            assert!((area(&path) - expected).abs() < 1.0, "{level}: {path}");
            assert!(path.matches('z').count() <= 1, "{path}");
        }
    }
}
