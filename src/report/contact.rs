//! Pictures of the pressures of pairs from their tables: curves in the plane, maps in space.

use super::bands::{Levels, range};
use super::body::Part;
use super::files::{Files, value};
use super::picture::{self, View};
use crate::error::{Error, Kind, Result};
use crate::linalg::bounds;
use crate::output::{Plot, Series, Style};
use crate::problem::units::{Units, label};
use serde::Serialize;

/// A picture of the pressure of a pair.
#[derive(Serialize)]
pub struct Picture {
    /// `plot` or `map`.
    pub kind: &'static str,
    /// The picture as SVG.
    pub svg: String,
    /// A note on points that the picture leaves out.
    pub note: Option<String>,
}

/// Most points in a map.
const POINTS: usize = 8000;

/// Return a picture of the pressure of each pair that has a table and touches, by the rows of `contacts.csv`.
pub fn pictures(files: &Files, is_space: bool, units: Option<&Units>, alone: bool) -> Result<Vec<Picture>> {
    let pairs = files.rows("contacts.csv")?;
    let mut pictures = Vec::new();
    for pair in pairs.iter().filter(|pair| value(pair, "peak_pressure") > 0.0) {
        let Some(table) = pair.get("table").filter(|table| !table.is_empty() && !table.contains('/')) else { continue };
        let name = |column: &str| pair.get(column).map_or("", String::as_str);
        let title = format!("{} – {}", name("a"), name("b"));
        pictures.push(picture(files, table, title, is_space, units, alone)?);
    }
    Ok(pictures)
}

/// Return the picture of the pressure in the table of a pair.
fn picture(
    files: &Files,
    table: &str,
    title: String,
    is_space: bool,
    units: Option<&Units>,
    alone: bool,
) -> Result<Picture> {
    let rows = files.rows(table)?;
    let points: Vec<[f64; 3]> = rows.iter().map(|row| ["x", "y", "z"].map(|axis| value(row, axis))).collect();
    let pressures: Vec<f64> = rows.iter().map(|row| value(row, "pressure")).collect();
    let [low, high] = bounds(points.iter().copied());
    let mut axes = [0, 1, 2];
    axes.sort_by(|&i, &j| (high[j] - low[j]).total_cmp(&(high[i] - low[i])).then(i.cmp(&j)));
    let pressure = label("contact pressure", units.map(|units| units.stress));
    if !is_space {
        let along = label(["x", "y", "z"][axes[0]], units.map(|units| units.length));
        let curve = points.iter().zip(&pressures).map(|(x, &p)| (x[axes[0]], p)).collect();
        let plot = Plot::pressure(&title, &along, &pressure, vec![Series::new("", curve, Style::Line)]);
        return Ok(Picture { kind: "plot", svg: plot.svg().map_err(failed)?, note: None });
    }
    // the two longest directions, in alphabetical order
    let axes = [axes[0].min(axes[1]), axes[0].max(axes[1])];
    let title = format!("{title}: {pressure}");
    // the facets show more than the points, if the run wrote them
    let file = format!("{}.vtu", table.strip_suffix(".csv").unwrap_or(table));
    let has_facets = files.path(&file).is_file();
    let every = if has_facets { 1 } else { points.len().div_ceil(POINTS).max(1) };
    let surface = match has_facets {
        true => Part::read(files, &file, &title, "pressure")?,
        false => discs(&title, points.iter().zip(&pressures).step_by(every), axes),
    };
    let values: Vec<f64> = surface.value.iter().map(|p| p.max(0.0)).collect();
    let [_, most] = range(values.iter());
    let (levels, view) = (Levels { range: [0.0, most], squares: false, opens: true }, View::flat(axes));
    let drawing = picture::Picture { title: &title, levels, view, magnification: None, outlines: has_facets, alone };
    let svg = drawing.svg(&[surface], &[values]).map_err(failed)?;
    let note = (every > 1).then(|| format!("One of {every} contact points; the table has all."));
    Ok(Picture { kind: "map", svg, note })
}

/// Return points with pressures as hexagons in the plane of two coordinates, which together cover about their box.
fn discs<'a>(title: &str, points: impl Iterator<Item = (&'a [f64; 3], &'a f64)>, axes: [usize; 2]) -> Part {
    let (points, pressures): (Vec<[f64; 3]>, Vec<f64>) = points.unzip();
    let [low, high] = bounds(points.iter().copied());
    let size = axes.map(|k| high[k] - low[k]);
    let longest = size[0].max(size[1]);
    // on a line of points the box has no area, and a single point has no size
    let spacing = (size[0] * size[1] / points.len() as f64).sqrt().clamp(longest / 400.0, longest / 30.0);
    let radius = if longest > 0.0 { 0.62 * spacing } else { 1.0 };
    let (corners, displacement) = (6 * points.len(), [0.0; 3]);
    let mut disc = Part {
        name: title.to_owned(),
        points: Vec::with_capacity(corners),
        triangles: Vec::new(),
        displacement: vec![displacement; corners],
        value: pressures.iter().flat_map(|&pressure| [pressure; 6]).collect(),
        is_solid: false,
    };
    for centre in points {
        let first = disc.points.len() as u32;
        disc.triangles.extend((1..5).map(|k| [first, first + k, first + k + 1]));
        disc.points.extend((0..6).map(|k| {
            let (sine, cosine) = (f64::from(k) * std::f64::consts::FRAC_PI_3).sin_cos();
            let mut corner = centre;
            corner[axes[0]] += radius * cosine;
            corner[axes[1]] += radius * sine;
            corner
        }));
    }
    disc
}

/// Return the error for a picture that cannot be drawn.
pub fn failed(cause: impl std::fmt::Display) -> Error {
    Error::new(Kind::File, "a picture cannot be drawn").because(cause.to_string())
}
