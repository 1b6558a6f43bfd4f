//! Pictures of deformed bodies in the plane with bands of equal value, as SVG.

use super::body::Part;
use crate::linalg::bounds;
use minijinja::context;
use plotters::style::colors::colormaps::{ColorMap, ViridisRGB};
use serde::Serialize;
use std::collections::{HashMap, HashSet};
use std::fmt::Write;

/// Number of colours in a picture.
pub const BANDS: usize = 12;
/// Width of a picture, and its largest height, in pixels.
const SIZE: [f64; 2] = [760.0, 620.0];
/// Colour of surfaces without pressure.
const OPEN: &str = "#b8b8b8";
/// Steps of the integer coordinates per pixel, so that pictures can be enlarged.
const FINE: f64 = 50.0;

/// Return the colours from the smallest to the largest value: viridis, which colour-blind readers can follow.
pub fn colors() -> [String; BANDS] {
    std::array::from_fn(|band| {
        let color = ViridisRGB.get_color_normalized(band as f32, 0.0, (BANDS - 1) as f32);
        format!("#{:02x}{:02x}{:02x}", color.0, color.1, color.2)
    })
}

/// Return the smallest and the largest finite value. They are never equal.
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

/// Return the band of a value in a range; NaN belongs to the first band. For `squares` see [`svg`].
pub fn band(value: f64, [least, most]: [f64; 2], squares: bool) -> usize {
    let fraction = ((value - least) / (most - least)).max(0.0);
    ((if squares { fraction.sqrt() } else { fraction } * BANDS as f64) as usize).min(BANDS - 1)
}

/// A region of a picture in one colour.
#[derive(Serialize)]
pub struct Piece {
    /// Colour.
    pub fill: String,
    /// Outline as an SVG path.
    pub path: String,
}

/// A body in a picture.
#[derive(Serialize)]
pub struct Shape {
    /// Name, shown under the pointer; empty for none.
    pub name: String,
    /// Regions from back to front.
    pub pieces: Vec<Piece>,
    /// Outline as an SVG path; empty for none.
    pub outline: String,
}

/// The size, colours and legend of a picture of bodies.
pub struct Canvas {
    low: [f64; 3],
    high: [f64; 3],
    /// Length of a pixel in the units of the scene.
    pixel: f64,
    /// Smallest and largest value.
    pub range: [f64; 2],
    squares: bool,
}

impl Canvas {
    /// Return the canvas for points in a box `[low, high]`, seen along the third coordinate, and values in a range. For
    /// `squares` see [`svg`].
    pub fn new([low, high]: [[f64; 3]; 2], range: [f64; 2], squares: bool) -> Self {
        let pixel = ((high[0] - low[0]) / SIZE[0]).max((high[1] - low[1]) / SIZE[1]);
        Self { low, high, pixel, range, squares }
    }

    /// Return the position of a point in steps of the picture.
    pub fn place(&self, x: &[f64; 3]) -> [f64; 2] {
        [(x[0] - self.low[0]) / self.pixel * FINE, (self.high[1] - x[1]) / self.pixel * FINE]
    }

    /// Return the smallest value of a band.
    fn level(&self, band: usize) -> f64 {
        let [least, most] = self.range;
        let fraction = band as f64 / BANDS as f64;
        least + (most - least) * if self.squares { fraction * fraction } else { fraction }
    }

    /// Return the SVG picture of bodies with title and legend. For `scale` and `alone` see [`svg`].
    pub fn draw(&self, bodies: Vec<Shape>, title: &str, scale: f64, alone: bool) -> Result<String, minijinja::Error> {
        let is_open = bodies.iter().flat_map(|body| &body.pieces).any(|piece| piece.fill == OPEN);
        let [width, height] = [0, 1].map(|k| (self.high[k] - self.low[k]) / self.pixel);
        super::words::environment().render_named_str(
            "bands.svg.html",
            include_str!("bands.svg"),
            context! {
                bodies, title, alone, scale, width, height, is_open, fine => FINE, colors => colors().to_vec(),
                levels => (0..=BANDS).map(|band| self.level(band)).collect::<Vec<_>>(),
            },
        )
    }
}

/// Return the picture of one scalar field, given at the points of all parts.
///
/// The `title` names the field with its unit. Displacements are magnified by `scale`. With `squares` the levels grow as squares:
/// a stress peaks at contacts, and with equal steps most of a body would have the first colour. A picture that stands
/// `alone` has a white background.
pub fn svg(
    parts: &[Part],
    values: &[Vec<f64>],
    squares: bool,
    title: &str,
    scale: f64,
    alone: bool,
) -> Result<String, minijinja::Error> {
    let moved: Vec<Vec<[f64; 3]>> = parts.iter().map(|part| part.moved(scale)).collect();
    let canvas = Canvas::new(bounds(moved.iter().flatten().copied()), range(values.iter().flatten()), squares);
    let mut shapes = Vec::new();
    for (k, part) in parts.iter().enumerate() {
        let places: Vec<[f64; 2]> = moved[k].iter().map(|x| canvas.place(x)).collect();
        let region = |level: f64| path(&part.triangles, &places, &values[k], level);
        // the first band covers the whole body, whatever its values are
        let outline = region(f64::NEG_INFINITY);
        let path = |band: usize| if band == 0 { outline.clone() } else { region(canvas.level(band)) };
        let pieces = colors().into_iter().enumerate().map(|(band, fill)| Piece { fill, path: path(band) }).collect();
        shapes.push(Shape { name: part.name.clone(), pieces, outline });
    }
    canvas.draw(shapes, title, scale, alone)
}

/// Return the picture of the pressure on a contact surface in space. It shows the two coordinates `axes`; points without pressure
/// are grey.
pub fn pressure(surface: &Part, axes: [usize; 2], title: &str, alone: bool) -> Result<String, minijinja::Error> {
    let flat: Vec<[f64; 3]> = surface.points.iter().map(|x| [x[axes[0]], x[axes[1]], 0.0]).collect();
    let pressures: Vec<f64> = surface.value.iter().map(|p| p.max(0.0)).collect();
    let [_, most] = range(pressures.iter());
    let canvas = Canvas::new(bounds(flat.iter().copied()), [0.0, most], false);
    let places: Vec<[f64; 2]> = flat.iter().map(|x| canvas.place(x)).collect();
    let region = |level: f64| path(&surface.triangles, &places, &pressures, level);
    let outline = region(f64::NEG_INFINITY);
    let mut pieces = vec![Piece { fill: OPEN.to_owned(), path: outline.clone() }];
    for (band, fill) in colors().into_iter().enumerate() {
        pieces.push(Piece { fill, path: region(canvas.level(band).max(1e-9 * most)) });
    }
    canvas.draw(vec![Shape { name: surface.name.clone(), pieces, outline }], title, 0.0, alone)
}

/// A corner of a region: a node, written twice, or the point between two nodes at which the value is the level.
type Corner = (u32, u32);

/// A directed edge of a region.
type Edge = (Corner, Corner);

/// Return the outline of the region in which a value is at least `level`, as an SVG path. The value is linear in each triangle.
fn path(triangles: &[[u32; 3]], places: &[[f64; 2]], values: &[f64], level: f64) -> String {
    let is_in = |node: u32| values[node as usize] >= level || level == f64::NEG_INFINITY;
    let position = |(i, j): Corner| {
        let (x, y, v, w) = (places[i as usize], places[j as usize], values[i as usize], values[j as usize]);
        let fraction = if i == j { 0.0 } else { (level - v) / (w - v) };
        [0, 1].map(|k| (x[k] + fraction * (y[k] - x[k])).round() as i64)
    };
    path_of(&border(triangles, places, is_in), position)
}

/// Return the sorted border edges of the region with the nodes that are in it. Edges that two triangles share are left out, so
/// that the size of the path grows with the border of the region alone.
fn border(triangles: &[[u32; 3]], places: &[[f64; 2]], is_in: impl Fn(u32) -> bool) -> Vec<Edge> {
    let mut edges: HashSet<Edge> = HashSet::new();
    let mut corners: Vec<Corner> = Vec::with_capacity(4);
    for &[a, b, c] in triangles {
        let [p, q, r] = [a, b, c].map(|node| places[node as usize]);
        // all triangles get the same orientation
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
            // a neighbour has the shared edge in the other direction
            if !edges.remove(&(to, from)) {
                edges.insert((from, to));
            }
        }
    }
    let mut sorted: Vec<Edge> = edges.into_iter().collect();
    sorted.sort_unstable();
    sorted
}

/// Join edges to closed outlines and return them as an SVG path.
fn path_of(edges: &[Edge], position: impl Fn(Corner) -> [i64; 2]) -> String {
    let mut next: HashMap<Corner, Vec<Corner>> = HashMap::new();
    edges.iter().for_each(|&(from, to)| next.entry(from).or_default().push(to));
    let mut text = String::new();
    for &(start, _) in edges {
        let begin = position(start);
        let (mut corner, mut last, mut steps) = (start, begin, Vec::new());
        while let Some(to) = next.get_mut(&corner).and_then(Vec::pop) {
            let here = position(to);
            let step = [here[0] - last[0], here[1] - last[1]];
            // an outline has one step at least, even if it is too small to be seen
            if step != [0, 0] || steps.is_empty() {
                steps.push(format!("{},{}", step[0], step[1]));
            }
            (corner, last) = (to, here);
        }
        if !steps.is_empty() {
            // writing to a String does not fail
            let _ = write!(text, "M{},{}l{}z", begin[0], begin[1], steps.join(" "));
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
