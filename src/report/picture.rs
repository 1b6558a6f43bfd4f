//! The one picture of triangles as SVG: bodies in the plane and in space after deformation, and contact surfaces, in bands of equal value.
//! The templates of pictures and of the page format values by the filters here.

use super::files::TriangleMesh;
use crate::linalg::bounds;
use crate::output::trimmed;
use minijinja::value::{Rest, ValueKind};
use minijinja::{Environment, Value, context};
use nalgebra::Vector3;
use plotters::style::colors::colormaps::{ColorMap, ViridisRGB};
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
    pub levels: Levels,
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
struct RegionGroup {
    /// Name, shown under the pointer; empty for none.
    name: String,
    regions: Vec<Region>,
    /// Outline as an SVG path; empty for none.
    outline: String,
}

/// A point of a picture in steps.
type Corner = [i64; 2];

/// A convex piece of a triangle in one colour.
struct ColoredPolygon {
    /// Three times the distance of the centre of its triangle towards the viewer.
    depth: f64,
    /// Its band and brightness level; none where a contact is open.
    color: Option<[usize; 2]>,
    corners: Vec<Corner>,
}

impl Picture<'_> {
    /// Return the picture of the values at the points of the parts as SVG.
    pub fn svg(&self, parts: &[TriangleMesh], values: &[Vec<f64>]) -> Result<String, minijinja::Error> {
        let View(axes) = &self.view;
        let turned = |&x: &[f64; 3]| axes.map(|axis| axis.dot(&Vector3::from(x)));
        let moved = |part: &TriangleMesh| part.moved(self.magnification.unwrap_or(0.0)).iter().map(turned).collect();
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
                shapes.push(RegionGroup { name: part.name.clone(), regions: regions(facets), outline });
            }
        }
        shapes.push(RegionGroup { name: String::new(), regions: regions(solid), outline: String::new() });
        let is_open = values.iter().flatten().any(|&value| self.levels.is_open(value));
        self.render(&shapes, is_open, [0, 1].map(|k| (high[k] - low[k]) / pixel))
    }

    /// Return shapes with title and legend as SVG.
    fn render(
        &self,
        shapes: &[RegionGroup],
        is_open: bool,
        [width, height]: [f64; 2],
    ) -> Result<String, minijinja::Error> {
        let colors = colors().map(hex).to_vec();
        let Self { title, alone, magnification, .. } = self;
        environment().render_named_str(
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
    part: &'a TriangleMesh,
    /// Points along the directions of the picture.
    seen: &'a [[f64; 3]],
    /// Points in steps of the picture.
    places: Vec<[f64; 2]>,
    values: Vec<f64>,
}

impl Surface<'_> {
    /// Return the triangles, cut by bands; with `overlap` each piece has all higher bands, too, so that no seams are seen. Triangles of a solid
    /// that face away are left out.
    fn facets(&self, bands: &[(Option<usize>, Band)], overlap: bool) -> Vec<ColoredPolygon> {
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
                    facets.push(ColoredPolygon {
                        depth: a.z + b.z + c.z,
                        color: band.map(|band| [band, shade]),
                        corners,
                    });
                }
            }
        }
        facets
    }

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
fn regions(mut facets: Vec<ColoredPolygon>) -> Vec<Region> {
    facets.sort_by(|a, b| a.depth.total_cmp(&b.depth).then(a.color.cmp(&b.color)));
    let alike = facets.chunk_by(|a, b| a.color == b.color);
    let region = |alike: &[ColoredPolygon]| Region {
        fill: fill(alike[0].color),
        path: path(alike.iter().map(|facet| facet.corners.clone())),
    };
    alike.map(region).collect()
}

/// Return the colour of a band at a brightness level.
fn fill(color: Option<[usize; 2]>) -> String {
    let Some([band, shade]) = color else { return OPEN.to_owned() };
    let brightness = RIM + (1.0 - RIM) * shade as f64 / (SHADES - 1) as f64;
    hex(colors()[band].map(|part| (f64::from(part) * brightness).round() as u8))
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

/// Number of colours in a picture.
const BANDS: usize = 12;

/// Fraction of the largest pressure below which a contact is shown as open. Open points have no pressure, and sums of ten facets leave a rounding of
/// 1e-15. The pressures of an iteration are known to 1e-8 of the largest by default, so that no smaller one means contact.
const LEAST_PRESSURE: f64 = 1e-9;

/// Return the colours from the smallest to the largest value: viridis, which colour-blind readers can follow.
pub fn colors() -> [[u8; 3]; BANDS] {
    std::array::from_fn(|band| {
        let color = ViridisRGB.get_color_normalized(band as f32, 0.0, (BANDS - 1) as f32);
        [color.0, color.1, color.2]
    })
}

/// Return a colour as `#rrggbb`.
pub fn hex([r, g, b]: [u8; 3]) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
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

/// The values of a band: from the first on, below the second.
type Band = [f64; 2];

/// The levels between the bands of a picture.
pub struct Levels {
    /// Smallest and largest value.
    pub range: [f64; 2],
    /// Whether the levels grow as squares. A stress peaks at contacts, and with equal steps most of a body would have the first colour.
    pub squares: bool,
    /// Whether values that are not positive have no band: contacts are open there.
    pub opens: bool,
}

impl Levels {
    /// Return the smallest value of each band, and the largest of all.
    pub fn levels(&self) -> Vec<f64> {
        let [least, most] = self.range;
        let fractions = (0..=BANDS).map(|band| band as f64 / BANDS as f64);
        fractions.map(|part| least + (most - least) * if self.squares { part * part } else { part }).collect()
    }

    /// Return whether a value is that of an open contact.
    pub fn is_open(&self, value: f64) -> bool {
        self.opens && value < LEAST_PRESSURE * self.range[1]
    }

    /// Return the bands with their numbers; an open contact is a band without a number, before the others. Together they have all values.
    pub fn bands(&self) -> Vec<(Option<usize>, Band)> {
        let levels = self.levels();
        let first = if self.opens { LEAST_PRESSURE * self.range[1] } else { f64::NEG_INFINITY };
        let open = self.opens.then_some((None, [f64::NEG_INFINITY, first]));
        let band = |band: usize| {
            let from = if band == 0 { first } else { levels[band] };
            (Some(band), [from, if band + 1 < BANDS { levels[band + 1] } else { f64::INFINITY }])
        };
        open.into_iter().chain((0..BANDS).map(band)).collect()
    }
}

/// Return an environment of templates with the filters `num`, `words` and `without`.
pub fn environment() -> Environment<'static> {
    let mut environment = Environment::new();
    environment.add_filter("num", number);
    environment.add_filter("words", words);
    environment.add_filter("without", without);
    environment
}

/// Format a number with five digits; other values become a dash.
fn number(value: &Value) -> String {
    let Ok(value) = f64::try_from(value.clone()) else { return "–".to_owned() };
    match value.abs() {
        0.0 => "0".to_owned(),
        size if !(1e-3..1e6).contains(&size) => {
            let text = format!("{value:.3e}");
            let (digits, power) = text.split_once('e').unwrap_or((&text, "0"));
            format!("{}e{power}", trimmed(digits)).replace('-', "−")
        }
        size => {
            let digits = (4.0 - size.log10().floor()).clamp(0.0, 7.0) as usize;
            trimmed(&format!("{value:.digits$}")).replace('-', "−")
        }
    }
}

/// Format a table as `key = value, ...` and a list as `(a, b)`, with the numbers of [`number`].
fn words(value: &Value) -> String {
    let list = || value.try_iter().into_iter().flatten();
    match value.kind() {
        ValueKind::Map => {
            let item = |key: Value| {
                let item = value.get_item(&key).unwrap_or_default();
                match item.kind() {
                    ValueKind::Map => format!("{key}: {}", words(&item)),
                    _ => format!("{key} = {}", words(&item)),
                }
            };
            list().map(item).collect::<Vec<_>>().join(", ")
        }
        ValueKind::Seq => format!("({})", list().map(|item| words(&item)).collect::<Vec<_>>().join(", ")),
        ValueKind::Number => number(value),
        ValueKind::Bool => if value.is_true() { "true" } else { "false" }.to_owned(),
        _ => value.to_string(),
    }
}

/// Return a table without some of its keys.
fn without(value: &Value, keys: Rest<String>) -> Value {
    let kept =
        value.try_iter().into_iter().flatten().filter(|key| !keys.iter().any(|other| key.as_str() == Some(other)));
    kept.map(|key| (key.to_string(), value.get_item(&key).unwrap_or_default())).collect()
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

    fn part(points: Vec<[f64; 3]>, triangles: Vec<[u32; 3]>, is_solid: bool) -> TriangleMesh {
        let (displacement, value) = (vec![[0.0; 3]; points.len()], vec![0.0; points.len()]);
        TriangleMesh { name: "a".into(), points, triangles, displacement, value, is_solid }
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

    #[test]
    fn values_are_short() {
        let number = |value: f64| number(&Value::from(value));
        assert_eq!(
            [0.0, 1.0, 93.108797, -5e-7, 2.1e5, 1e6, 0.05].map(number),
            ["0", "1", "93.109", "−5e−7", "210000", "1e6", "0.05"]
        );
        assert_eq!(super::number(&Value::from(())), "–");
        assert_eq!(words(&Value::from(false)), "false");
        let value = Value::from_serialize(serde_json::json!({ "power": { "B": 1e-3, "a": 0.5 }, "at": [1, 2.5] }));
        assert_eq!(words(&without(&value, Rest(vec!["at".into()]))), "power: B = 0.001, a = 0.5");
        assert_eq!(words(&value.get_attr("at").unwrap()), "(1, 2.5)");
    }
}
