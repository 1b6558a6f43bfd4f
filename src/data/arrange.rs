//! The step from numbers in rows to a function of one coordinate or two.

use super::grid::{Axis, Grid};
use super::knots::Knots;
use super::rows::{Frame, Rows};
use super::rule::{DataSpec, Interpolation, Outside};
use super::scattered::Scattered;
use super::trend::Trend;
use super::{fill, gaps, trend};
use crate::error::Result;

/// A function of one coordinate or two, by the places of its points.
#[derive(Debug, Clone)]
pub enum Shape {
    /// Points at equal distances.
    Grid(Grid),
    /// Points of one coordinate at any distances.
    Knots(Knots),
    /// Points of two coordinates at any places, with the range of each coordinate.
    Scattered(Scattered, [[f64; 2]; 2]),
}

/// A function with what was done to the heights of its file.
#[derive(Debug, Clone)]
pub struct Arranged {
    /// The function.
    pub shape: Shape,
    /// Number of points of the file without a height.
    pub missing: usize,
    /// The polynomial that was subtracted, if any.
    pub trend: Option<Trend>,
}

/// Largest distance of a point from its place on a regular grid, as a multiple of the spacing.
///
/// Coordinates in files are rounded. A place that is wrong by so much changes a height by a hundredth of the difference to the next height.
const ROUNDED: f64 = 1e-2;

/// Return the function that the numbers of a file give.
///
/// # Errors
/// Numbers that give no function, or not one that the scene asks for; points without a height that the scene does not expect.
pub fn shape(spec: &DataSpec, rows: Rows) -> Result<Arranged> {
    if rows.values.is_empty() {
        return Err(spec.refuse("has no numbers", "write heights in rows"));
    }
    if spec.points && !matches!(rows.columns, 2 | 3) {
        return Err(spec.refuse(
            format!("has {} numbers in a row", rows.columns),
            "a point is x and a height, or x, y and a height; for heights in rows and columns leave out `points`",
        ));
    }
    let missing = gaps::count(spec, &rows)?;
    let (shape, trend) = if spec.points { points(spec, &rows)? } else { matrix(spec, rows)? };
    Ok(Arranged { shape, missing, trend })
}

/// Return the function of heights in rows and columns. A single row or column is a profile.
fn matrix(spec: &DataSpec, rows: Rows) -> Result<(Shape, Option<Trend>)> {
    let mut counts = [rows.columns, rows.count()];
    if counts[0] == 1 {
        counts.swap(0, 1);
    }
    if counts[0] < 2 {
        return Err(spec.refuse("has one number", "two points or more make a function"));
    }
    let mut values: Vec<f64> = rows.values.iter().map(|value| spec.unit * value).collect();
    let frame = rows.frame.unwrap_or(Frame { origin: [0.0; 2], spacing: [1.0; 2] });
    let origin = |d: usize| spec.origin[d] + spec.spacing[d] * frame.origin[d];
    let axes =
        [0, 1].map(|d| Axis { origin: origin(d), spacing: spec.spacing[d] * frame.spacing[d], count: counts[d] });
    let place = |k: usize| {
        let index = [k % counts[0], k / counts[0]];
        [0, 1].map(|d| axes[d].origin + axes[d].spacing * index[d] as f64)
    };
    let trend = trend::subtract(spec.detrend, place, &mut values);
    Ok((grid(spec, axes, values)?, trend))
}

/// Return a regular grid, with the interpolation that the scene asks for. Values that are NaN are gaps.
fn grid(spec: &DataSpec, axes: [Axis; 2], mut values: Vec<f64>) -> Result<Shape> {
    let thin = |axis: &Axis| axis.count != 1 && axis.count < 3;
    if spec.interpolation == Interpolation::Cubic && axes.iter().any(thin) {
        return Err(spec.refuse("has two points in a direction", "cubic interpolation needs three: take \"linear\""));
    }
    fill::grid(spec.fill, &axes, &mut values);
    Ok(Shape::Grid(Grid { axes, values, interpolation: spec.interpolation, outside: spec.outside }))
}

/// Return the function of points in any order: (x, height) or (x, y, height).
fn points(spec: &DataSpec, rows: &Rows) -> Result<(Shape, Option<Trend>)> {
    let point = |row: &[f64]| match *row {
        [x, y, height] => placed(spec, [x, y], height),
        _ => placed(spec, [row[0], 0.0], row[1]),
    };
    let mut points: Vec<[f64; 3]> = rows.values.chunks_exact(rows.columns).map(point).collect();
    refuse_twins(spec, &points, rows)?;
    let mut heights: Vec<f64> = points.iter().map(|point| point[2]).collect();
    let trend = trend::subtract(spec.detrend, |k| [points[k][0], points[k][1]], &mut heights);
    points.iter_mut().zip(heights).for_each(|(point, height)| point[2] = height);
    let shape = if rows.columns == 2 { profile(spec, points)? } else { surface(spec, points)? };
    Ok((shape, trend))
}

/// Return the function of points of a profile, (x, 0, height). Points without a height are gaps of a grid, and are left out elsewhere.
fn profile(spec: &DataSpec, mut points: Vec<[f64; 3]>) -> Result<Shape> {
    if points.len() < 2 {
        return Err(spec.refuse("has one point", "two points or more make a function"));
    }
    if let Some(axis) = regular(points.iter().map(|point| point[0])).filter(|axis| axis.count == points.len()) {
        let mut values = vec![0.0; axis.count];
        points.iter().for_each(|point| values[nearest(&axis, point[0])] = point[2]);
        return grid(spec, [axis, Axis { origin: 0.0, spacing: 1.0, count: 1 }], values);
    }
    only_linear(spec)?;
    points.retain(|point| !point[2].is_nan());
    if points.len() < 2 {
        return Err(spec.refuse("has one point with a height", "two points or more make a function"));
    }
    let mut knots: Vec<[f64; 2]> = points.iter().map(|&[x, _, height]| [x, height]).collect();
    knots.sort_by(|a, b| a[0].total_cmp(&b[0]));
    Ok(Shape::Knots(Knots(knots)))
}

/// Return the function of points (x, y, height). Points without a height are gaps of a grid, and are left out elsewhere.
fn surface(spec: &DataSpec, mut points: Vec<[f64; 3]>) -> Result<Shape> {
    let axes = [0, 1].map(|d| regular(points.iter().map(|point| point[d])));
    if let [Some(across), Some(down)] = axes
        && across.count.checked_mul(down.count) == Some(points.len())
        && across.count.min(down.count) > 1
    {
        let mut values = vec![None; points.len()];
        points.iter().for_each(|&[x, y, height]| {
            values[nearest(&across, x) + across.count * nearest(&down, y)] = Some(height);
        });
        if let Some(values) = values.into_iter().collect() {
            return grid(spec, [across, down], values);
        }
    }
    only_linear(spec)?;
    points.retain(|point| !point[2].is_nan());
    let range = [0, 1].map(|d| {
        let along = || points.iter().map(|point| point[d]);
        [along().fold(f64::INFINITY, f64::min), along().fold(f64::NEG_INFINITY, f64::max)]
    });
    match Scattered::new(&points) {
        Some(scattered) => Ok(Shape::Scattered(scattered, range)),
        None => Err(spec.refuse("has points on one line alone", "a surface needs three points that make a triangle")),
    }
}

/// Return a point of the file in the units of the scene.
fn placed(spec: &DataSpec, place: [f64; 2], height: f64) -> [f64; 3] {
    let [x, y] = [0, 1].map(|d| spec.origin[d] + spec.spacing[d] * place[d]);
    [x, y, spec.unit * height]
}

/// Refuse settings that need a regular grid.
fn only_linear(spec: &DataSpec) -> Result<()> {
    const HELP: &str = "scattered points have interpolate = \"linear\" and outside = \"clamp\" or \"error\"; or resample them on a grid";
    match (spec.interpolation, spec.outside) {
        (Interpolation::Cubic, _) => {
            Err(spec.refuse("has points that are on no regular grid: no cubic interpolation", HELP))
        }
        (_, Outside::Periodic) => Err(spec.refuse("has points that are on no regular grid: no period", HELP)),
        _ => Ok(()),
    }
}

/// Largest distance of two points that are meant to be at one place, as a multiple of the roundoff of the largest coordinate.
///
/// Each of both places has an error of half a unit for the number read, for its product with the spacing, and for the sum with the origin.
/// Slopes between such points are those of roundoff.
const TWINS: f64 = 3.0;

/// Refuse two points at one place: the function would have two heights there.
fn refuse_twins(spec: &DataSpec, points: &[[f64; 3]], rows: &Rows) -> Result<()> {
    let largest = |d: usize| points.iter().fold(spec.origin[d].abs(), |most, point| most.max(point[d].abs()));
    let near = [0, 1].map(|d| TWINS * f64::EPSILON * largest(d));
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by(|&a, &b| points[a][0].total_cmp(&points[b][0]));
    // each chunk has points of about the same x, which are then sorted by y
    for column in order.chunk_by_mut(|&a, &b| points[b][0] - points[a][0] <= near[0]) {
        column.sort_by(|&a, &b| points[a][1].total_cmp(&points[b][1]));
        let is_near = |d: usize, a: usize, b: usize| (points[a][d] - points[b][d]).abs() <= near[d];
        let Some(two) = column.windows(2).find(|two| is_near(0, two[0], two[1]) && is_near(1, two[0], two[1])) else {
            continue;
        };
        let (first, second) = (two[0].min(two[1]), two[0].max(two[1]));
        let places = match points[first][..2] == points[second][..2] {
            true => "is at the place of",
            false => "is, but for rounding, at the place of",
        };
        let what = format!("{} {places} {}", rows.line(second), rows.line(first));
        return Err(spec.refuse(what, "every point needs a place of its own"));
    }
    Ok(())
}

/// Return the regular axis on which coordinates lie; none if there is no such axis. Several coordinates may lie on one point.
fn regular(coordinates: impl Iterator<Item = f64>) -> Option<Axis> {
    let mut sorted: Vec<f64> = coordinates.collect();
    sorted.sort_by(f64::total_cmp);
    let (first, last) = (*sorted.first()?, *sorted.last()?);
    // sorted coordinates differ by about a spacing between points of the axis, and by roundoff within one point
    let widest = sorted.windows(2).map(|two| two[1] - two[0]).fold(0.0, f64::max);
    let steps = sorted.windows(2).filter(|two| two[1] - two[0] > 0.5 * widest).count();
    let axis = Axis { origin: first, spacing: (last - first) / steps as f64, count: steps + 1 };
    let is_on = |&x: &f64| (x - axis.origin - axis.spacing * nearest(&axis, x) as f64).abs() <= ROUNDED * axis.spacing;
    (axis.spacing > 0.0 && axis.spacing.is_finite() && sorted.iter().all(is_on)).then_some(axis)
}

/// Return the index of the point of an axis that is nearest to a coordinate.
fn nearest(axis: &Axis, x: f64) -> usize {
    ((x - axis.origin) / axis.spacing).round().clamp(0.0, (axis.count - 1) as f64) as usize
}
