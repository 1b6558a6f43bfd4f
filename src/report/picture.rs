//! The one picture of triangles as SVG: bodies in the plane and in space after deformation, and contact surfaces, in bands of equal value.

use super::bands::{self, Band, Levels};
use super::body::Part;
use crate::linalg::bounds;
use minijinja::context;
use nalgebra::Vector3;
use serde::Serialize;
use std::collections::{HashMap, HashSet};
use std::fmt::Write;

/// Width of a picture, and its largest height, in pixels.
const SIZE: [f64; 2] = [760.0, 620.0];
/// Steps of the integer coordinates per pixel. Rounding moves a point by a hundredth of a pixel at most, which a picture enlarged fifty times
/// shows as half a pixel.
const FINE: f64 = 50.0;
/// Colour of surfaces without pressure.
const OPEN: &str = "#b8b8b8";

/// The direction to the viewer of bodies in space, who looks from above, with x to the right and y away from them.
const TOWARDS: [f64; 3] = [0.52, -0.74, 0.43];

/// Number of brightness levels, which make a surface look curved. The picture of `flange` with 3, 6 and 12 levels has 936, 945 and
/// 956 kB, and with 3 levels a pipe shows strips.
const SHADES: usize = 6;

/// Relative brightness of a surface at the rim, where it turns away. The values 0.3, 0.6 and 0.9 were compared on `flange`: with 0.3
/// the colours no longer match the legend, and with 0.9 edges cannot be seen.
const RIM: f64 = 0.6;

/// The directions of a picture: to the right, upwards, and to the viewer, along which nearer triangles hide others.
pub struct View([Vector3<f64>; 3]);

impl View {
    /// Return the view of two coordinates, in which nothing hides anything.
    pub fn flat(axes: [usize; 2]) -> Self {
        let [right, up] = axes.map(|axis| Vector3::ith(axis, 1.0));
        Self([right, up, Vector3::zeros()])
    }

    /// Return the view of bodies in space from one side.
    pub fn space() -> Self {
        let towards = Vector3::from(TOWARDS).normalize();
        let right = Vector3::z().cross(&towards).normalize();
        Self([right, towards.cross(&right), towards])
    }
}

/// A picture of one scalar field.
pub struct Picture<'a> {
    /// Name of the field with its unit.
    pub title: &'a str,
    /// Levels between the colours.
    pub levels: Levels,
    /// Directions.
    pub view: View,
    /// Factor of the displacements; none for surfaces without displacements.
    pub magnification: Option<f64>,
    /// Whether the parts are whole surfaces with outlines, in which regions are painted over each other. Otherwise regions lie beside each other.
    pub outlines: bool,
    /// Whether it stands alone, on white.
    pub alone: bool,
}

/// A region of a picture in one colour.
#[derive(Serialize)]
struct Region {
    fill: String,
    /// Outline as an SVG path.
    path: String,
}

/// Regions that belong together.
#[derive(Serialize)]
struct Shape {
    /// Name, shown under the pointer; empty for none.
    name: String,
    /// Regions from back to front.
    regions: Vec<Region>,
    /// Outline as an SVG path; empty for none.
    outline: String,
}

/// A point of a picture in steps.
type Corner = [i64; 2];

/// A convex piece of a triangle in one colour.
struct Facet {
    /// Three times the distance of the centre of its triangle towards the viewer.
    depth: f64,
    /// Its band and brightness level; none where a contact is open.
    color: Option<[usize; 2]>,
    corners: Vec<Corner>,
}

impl Picture<'_> {
    /// Return the picture of the values at the points of the parts as SVG.
    pub fn svg(&self, parts: &[Part], values: &[Vec<f64>]) -> Result<String, minijinja::Error> {
        let View(axes) = &self.view;
        let turned = |&x: &[f64; 3]| axes.map(|axis| axis.dot(&Vector3::from(x)));
        let moved = |part: &Part| part.moved(self.magnification.unwrap_or(0.0)).iter().map(turned).collect();
        let seen: Vec<Vec<[f64; 3]>> = parts.iter().map(moved).collect();
        let [low, high] = bounds(seen.iter().flatten().copied());
        let pixel = ((high[0] - low[0]) / SIZE[0]).max((high[1] - low[1]) / SIZE[1]).max(f64::MIN_POSITIVE);
        let place = |x: &[f64; 3]| [(x[0] - low[0]) / pixel * FINE, (high[1] - x[1]) / pixel * FINE];
        let (mut shapes, mut solid) = (Vec::new(), Vec::new());
        for ((part, seen), values) in parts.iter().zip(&seen).zip(values) {
            // a point without a value belongs to the lowest band
            let values = values.iter().map(|&value| if value.is_nan() { f64::MIN } else { value }).collect();
            let surface = Surface { part, seen, places: seen.iter().map(place).collect(), values };
            let facets = surface.facets(&self.levels.bands(), self.outlines);
            if part.is_solid {
                // bodies hide each other
                solid.extend(facets);
            } else {
                let outline = if self.outlines { surface.outline() } else { String::new() };
                shapes.push(Shape { name: part.name.clone(), regions: regions(facets), outline });
            }
        }
        shapes.push(Shape { name: String::new(), regions: regions(solid), outline: String::new() });
        let is_open = values.iter().flatten().any(|&value| self.levels.is_open(value));
        self.render(&shapes, is_open, [0, 1].map(|k| (high[k] - low[k]) / pixel))
    }

    /// Return shapes with title and legend as SVG.
    fn render(&self, shapes: &[Shape], is_open: bool, [width, height]: [f64; 2]) -> Result<String, minijinja::Error> {
        let colors = bands::colors().map(bands::hex).to_vec();
        let Self { title, alone, magnification, .. } = self;
        super::words::environment().render_named_str(
            "picture.svg.html",
            include_str!("picture.svg"),
            context! {
                shapes, title, alone, magnification, width, height, is_open, colors, fine => FINE,
                levels => self.levels.levels(),
            },
        )
    }
}

/// The surface of a part in a picture.
struct Surface<'a> {
    part: &'a Part,
    /// Points along the directions of the picture.
    seen: &'a [[f64; 3]],
    /// Points in steps of the picture.
    places: Vec<[f64; 2]>,
    /// Values at the points.
    values: Vec<f64>,
}

impl Surface<'_> {
    /// Return the triangles, cut by bands; with `overlap` each piece has all higher bands, too, so that no seams are seen. Triangles of a solid
    /// that face away are left out.
    fn facets(&self, bands: &[(Option<usize>, Band)], overlap: bool) -> Vec<Facet> {
        let mut facets = Vec::new();
        for &nodes in &self.part.triangles {
            let [a, b, c] = nodes.map(|node| Vector3::from(self.seen[node as usize]));
            let normal = (b - a).cross(&(c - a)).normalize();
            // other triangles hide what faces away; flat surfaces are seen from both sides
            if normal.z.is_nan() || (self.part.is_solid && normal.z <= 0.0) {
                continue;
            }
            let shade = ((normal.z.abs() * SHADES as f64) as usize).min(SHADES - 1);
            for &(band, [from, to]) in bands {
                let corners = self.cut(nodes, [from, if overlap { f64::INFINITY } else { to }]);
                if !corners.is_empty() {
                    facets.push(Facet { depth: a.z + b.z + c.z, color: band.map(|band| [band, shade]), corners });
                }
            }
        }
        facets
    }

    /// Return the outline of all triangles.
    fn outline(&self) -> String {
        let all = [f64::NEG_INFINITY, f64::INFINITY];
        path(self.part.triangles.iter().map(|&nodes| self.cut(nodes, all)))
    }

    /// Return the corners of the part of a triangle with values in a band. Values are linear, and all triangles get the same orientation.
    fn cut(&self, [a, b, c]: [u32; 3], band: Band) -> Vec<Corner> {
        let [p, q, r] = [a, b, c].map(|node| self.places[node as usize]);
        let is_turned = (q[0] - p[0]) * (r[1] - p[1]) < (r[0] - p[0]) * (q[1] - p[1]);
        let nodes = if is_turned { [a, c, b] } else { [a, b, c] };
        let mut corners = Vec::new();
        for k in 0..3 {
            let (from, to) = (nodes[k], nodes[(k + 1) % 3]);
            let [v, w] = [from, to].map(|node| self.values[node as usize]);
            if band[0] <= v && v < band[1] {
                corners.push(self.places[from as usize].map(|x| x.round() as i64));
            }
            let along = if v < w { band } else { [band[1], band[0]] };
            let crossed = along.into_iter().filter(|level| (v < *level) != (w < *level));
            corners.extend(crossed.map(|level| self.crossing(from.min(to), from.max(to), level)));
        }
        corners
    }

    /// Return the point between two nodes at which the value is `level`. Both triangles at an edge get the same point.
    fn crossing(&self, i: u32, j: u32, level: f64) -> Corner {
        let [v, w] = [i, j].map(|node| self.values[node as usize]);
        let [x, y] = [i, j].map(|node| self.places[node as usize]);
        let fraction = (level - v) / (w - v);
        [0, 1].map(|k| (x[k] + fraction * (y[k] - x[k])).round() as i64)
    }
}

/// Return facets as regions from back to front. Neighbours in this order with the same colour are one region.
fn regions(mut facets: Vec<Facet>) -> Vec<Region> {
    facets.sort_by(|a, b| a.depth.total_cmp(&b.depth).then(a.color.cmp(&b.color)));
    let alike = facets.chunk_by(|a, b| a.color == b.color);
    let region = |alike: &[Facet]| Region {
        fill: fill(alike[0].color),
        path: path(alike.iter().map(|facet| facet.corners.clone())),
    };
    alike.map(region).collect()
}

/// Return the colour of a band at a brightness level.
fn fill(color: Option<[usize; 2]>) -> String {
    let Some([band, shade]) = color else { return OPEN.to_owned() };
    let brightness = RIM + (1.0 - RIM) * shade as f64 / (SHADES - 1) as f64;
    bands::hex(bands::colors()[band].map(|part| (f64::from(part) * brightness).round() as u8))
}

/// Return the border of the union of polygons of the same orientation as an SVG path. Edges that two polygons share are left out, so that the
/// size of the path grows with the border alone.
fn path(polygons: impl Iterator<Item = Vec<Corner>>) -> String {
    let mut edges: HashSet<[Corner; 2]> = HashSet::new();
    for corners in polygons {
        for (k, &from) in corners.iter().enumerate() {
            let to = corners[(k + 1) % corners.len()];
            // a neighbour has the shared edge in the other direction
            if from != to && !edges.remove(&[to, from]) {
                edges.insert([from, to]);
            }
        }
    }
    let mut sorted: Vec<[Corner; 2]> = edges.into_iter().collect();
    sorted.sort_unstable();
    let mut next: HashMap<Corner, Vec<Corner>> = HashMap::new();
    sorted.iter().for_each(|&[from, to]| next.entry(from).or_default().push(to));
    let mut text = String::new();
    for &[start, _] in &sorted {
        let (mut corner, mut steps) = (start, Vec::new());
        while let Some(to) = next.get_mut(&corner).and_then(Vec::pop) {
            steps.push(format!("{},{}", to[0] - corner[0], to[1] - corner[1]));
            corner = to;
        }
        // `z` closes the outline
        if steps.pop().is_some() {
            // writing to a String does not fail
            let _ = write!(text, "M{},{}l{}z", start[0], start[1], steps.join(" "));
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Twice the signed area inside a path.
    fn area(path: &str) -> f64 {
        let mut twice = 0.0;
        for outline in path.split('z').filter(|outline| !outline.is_empty()) {
            let (start, steps) = outline[1..].split_once('l').unwrap();
            let pair = |text: &str| {
                let (x, y) = text.split_once(',').unwrap();
                [x.parse::<f64>().unwrap(), y.parse::<f64>().unwrap()]
            };
            let start = pair(start);
            let mut at = start;
            for step in steps.split(' ').map(pair) {
                let to = [at[0] + step[0], at[1] + step[1]];
                twice += at[0] * to[1] - at[1] * to[0];
                at = to;
            }
            twice += at[0] * start[1] - at[1] * start[0];
        }
        twice.abs() / 2.0
    }

    fn part(points: Vec<[f64; 3]>, triangles: Vec<[u32; 3]>, is_solid: bool) -> Part {
        let (displacement, value) = (vec![[0.0; 3]; points.len()], vec![0.0; points.len()]);
        Part { name: "a".into(), points, triangles, displacement, value, is_solid }
    }

    #[test]
    fn a_region_has_the_area_that_its_levels_cut_off_and_no_edge_inside() {
        // a square of 8 triangles, some turned the other way, with the value x
        let points: Vec<[f64; 3]> = (0..9).map(|k| [500.0 * f64::from(k % 3), 500.0 * f64::from(k / 3), 0.0]).collect();
        let triangles = [0, 1, 3, 4].map(|k| [[k, k + 1, k + 4], [k, k + 3, k + 4]]).concat();
        let part = part(points, triangles, false);
        let places: Vec<[f64; 2]> = part.points.iter().map(|x| [x[0], x[1]]).collect();
        let values = places.iter().map(|place| place[0]).collect();
        let surface = Surface { part: &part, seen: &part.points, places, values };
        let infinite = f64::INFINITY;
        for (band, expected) in [
            ([-infinite, infinite], 1e6),
            ([250.0, infinite], 750e3),
            ([500.0, infinite], 500e3),
            ([900.0, infinite], 100e3),
            ([1001.0, infinite], 0.0),
            ([100.0, 300.0], 200e3),
            ([400.0, 900.0], 500e3),
        ] {
            let path = path(part.triangles.iter().map(|&nodes| surface.cut(nodes, band)));
            assert!((area(&path) - expected).abs() < 1.0, "{band:?}: {path}");
            assert!(path.matches('z').count() <= 1, "{path}");
        }
    }

    /// A tetrahedron shows the faces that face the viewer, the nearest last, each in the bands of its values.
    #[test]
    fn what_faces_the_viewer_is_drawn_from_back_to_front() {
        let points = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let part = part(points, vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]], true);
        let picture = Picture {
            title: "v",
            levels: Levels { range: [0.0, 12.0], squares: false, opens: false },
            view: View::space(),
            magnification: Some(1.0),
            outlines: false,
            alone: true,
        };
        // all of each face in one band
        let svg = picture.svg(&[part], &[vec![4.5; 4]]).expect("a picture");
        let fills: Vec<&str> = svg.split("<path fill=\"").skip(1).map(|rest| &rest[..7]).collect();
        // y = 0 and x + y + z = 1 face (0.52, -0.74, 0.43); z = 0 and x = 0 do not; cosines 0.74 and 0.12: shades 4 and 0 of 6
        assert_eq!(fills, [fill(Some([4, 0])), fill(Some([4, 4]))]);
    }
}
