//! Pictures of the pressures of pairs from their tables: curves in the plane, maps in space.

use super::bands::{self, BANDS, colors, range};
use super::body::Part;
use super::files::{Files, value};
use crate::error::{Error, Kind, Result};
use crate::linalg::bounds;
use crate::output::{Plot, Series, Style};
use crate::problem::units::{Units, label};
use minijinja::context;
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
    if files.path(&file).is_file() {
        let surface = Part::read(files, &file, &title, "pressure")?;
        let svg = bands::pressure(&surface, axes, &title, alone).map_err(failed)?;
        return Ok(Picture { kind: "map", svg, note: None });
    }
    map(&title, &points, &pressures, axes, alone)
}

/// Return a map of points, seen in two coordinates and coloured by the pressure. Points without pressure are grey.
fn map(title: &str, points: &[[f64; 3]], pressures: &[f64], axes: [usize; 2], alone: bool) -> Result<Picture> {
    let [low, high] = bounds(points.iter().copied());
    let size = axes.map(|k| high[k] - low[k]);
    let pixel = (size[0] / 400.0).max(size[1] / 400.0).max(f64::MIN_POSITIVE);
    let [width, height] = size.map(|size| size / pixel);
    let [_, most] = range(pressures.iter());
    let every = points.len().div_ceil(POINTS).max(1);
    let point = |(x, &p): (&[f64; 3], &f64)| {
        let band = if p > 0.0 { bands::band(p, [0.0, most], false) as i64 } else { -1 };
        ((x[axes[0]] - low[axes[0]]) / pixel, (high[axes[1]] - x[axes[1]]) / pixel, band)
    };
    let points: Vec<_> = points.iter().zip(pressures).step_by(every).map(point).collect();
    // the discs together cover about the box
    let radius = (width.max(1.0) * height.max(1.0) / points.len() as f64).sqrt().clamp(1.0, 12.0) * 0.62;
    let levels: Vec<f64> = (0..=BANDS).map(|band| most * band as f64 / BANDS as f64).collect();
    let is_open = points.iter().any(|&(_, _, band)| band < 0);
    let context =
        context! { title, alone, points, is_open, radius, width, height, levels, colors => colors().to_vec() };
    let svg = super::words::environment()
        .render_named_str("map.svg.html", include_str!("map.svg"), context)
        .map_err(failed)?;
    let note = (every > 1).then(|| format!("One of {every} contact points; the table has all."));
    Ok(Picture { kind: "map", svg, note })
}

/// Return the error for a picture that cannot be drawn.
pub fn failed(cause: impl std::fmt::Display) -> Error {
    Error::new(Kind::File, "a picture cannot be drawn").because(cause.to_string())
}
