//! The step from numbers in rows to a function of one coordinate or two: points without a height are counted, a trend is subtracted, and
//! gaps of grids are filled.

use super::grid::{Grid, GridAxis};
use super::rule::{DataSpec, Detrend, Fill, GridFrame, Interpolation, NumberRows, Outside};
use super::scattered::{Knots, Scattered};
use crate::error::{Result, shown};
use crate::linalg::{bounds, range};
use nalgebra::{DMatrix, DVector};
use rstar::RTree;
use rstar::primitives::GeomWithData;

/// A function of one coordinate or two, by the places of its points.
#[derive(Debug, Clone)]
pub enum PointLayout {
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
    pub shape: PointLayout,
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
pub fn shape(spec: &DataSpec, rows: NumberRows) -> Result<Arranged> {
    if rows.values.is_empty() {
        return Err(spec.refuse("has no numbers", "write heights in rows"));
    }
    if spec.points && !matches!(rows.columns, 2 | 3) {
        return Err(spec.refuse(
            format!("has {} numbers in a row", rows.columns),
            "a point is x and a height, or x, y and a height; for heights in rows and columns leave out `points`",
        ));
    }
    let missing = count_missing(spec, &rows)?;
    let (shape, trend) = if spec.points { points(spec, &rows)? } else { matrix(spec, rows)? };
    Ok(Arranged { shape, missing, trend })
}

/// Return the function of heights in rows and columns. A single row or column is a profile.
fn matrix(spec: &DataSpec, rows: NumberRows) -> Result<(PointLayout, Option<Trend>)> {
    let mut counts = [rows.columns, rows.count()];
    if counts[0] == 1 {
        counts.swap(0, 1);
    }
    if counts[0] < 2 {
        return Err(spec.refuse("has one number", "two points or more make a function"));
    }
    let mut values: Vec<f64> = rows.values.iter().map(|value| spec.unit * value).collect();
    let frame = rows.frame.unwrap_or(GridFrame { origin: [0.0; 2], spacing: [1.0; 2] });
    let origin = |d: usize| spec.origin[d] + spec.spacing[d] * frame.origin[d];
    let axes =
        [0, 1].map(|d| GridAxis { origin: origin(d), spacing: spec.spacing[d] * frame.spacing[d], count: counts[d] });
    let place = |k: usize| {
        let index = [k % counts[0], k / counts[0]];
        [0, 1].map(|d| axes[d].origin + axes[d].spacing * index[d] as f64)
    };
    let trend = subtract(spec.detrend, place, &mut values);
    Ok((grid(spec, axes, values)?, trend))
}

/// Return a regular grid, with the interpolation that the scene asks for. Values that are NaN are gaps.
fn grid(spec: &DataSpec, axes: [GridAxis; 2], mut values: Vec<f64>) -> Result<PointLayout> {
    let thin = |axis: &GridAxis| axis.count != 1 && axis.count < 3;
    if spec.interpolation == Interpolation::Cubic && axes.iter().any(thin) {
        return Err(spec.refuse("has two points in a direction", "cubic interpolation needs three: take \"linear\""));
    }
    fill_gaps(spec.fill, &axes, &mut values);
    Ok(PointLayout::Grid(Grid { axes, values, interpolation: spec.interpolation, outside: spec.outside }))
}

/// Return the function of points in any order: (x, height) or (x, y, height).
fn points(spec: &DataSpec, rows: &NumberRows) -> Result<(PointLayout, Option<Trend>)> {
    let point = |row: &[f64]| match *row {
        [x, y, height] => placed(spec, [x, y], height),
        _ => placed(spec, [row[0], 0.0], row[1]),
    };
    let mut points: Vec<[f64; 3]> = rows.values.chunks_exact(rows.columns).map(point).collect();
    refuse_twins(spec, &points, rows)?;
    let mut heights: Vec<f64> = points.iter().map(|point| point[2]).collect();
    let trend = subtract(spec.detrend, |k| [points[k][0], points[k][1]], &mut heights);
    points.iter_mut().zip(heights).for_each(|(point, height)| point[2] = height);
    let shape = if rows.columns == 2 { profile(spec, points)? } else { surface(spec, points)? };
    Ok((shape, trend))
}

/// Return the function of points of a profile, (x, 0, height). Points without a height are gaps of a grid, and are left out elsewhere.
fn profile(spec: &DataSpec, mut points: Vec<[f64; 3]>) -> Result<PointLayout> {
    if points.len() < 2 {
        return Err(spec.refuse("has one point", "two points or more make a function"));
    }
    if let Some(axis) = regular(points.iter().map(|point| point[0])).filter(|axis| axis.count == points.len()) {
        let mut values = vec![0.0; axis.count];
        points.iter().for_each(|point| values[nearest(&axis, point[0])] = point[2]);
        return grid(spec, [axis, GridAxis { origin: 0.0, spacing: 1.0, count: 1 }], values);
    }
    only_linear(spec)?;
    points.retain(|point| !point[2].is_nan());
    if points.len() < 2 {
        return Err(spec.refuse("has one point with a height", "two points or more make a function"));
    }
    let mut knots: Vec<[f64; 2]> = points.iter().map(|&[x, _, height]| [x, height]).collect();
    knots.sort_by(|a, b| a[0].total_cmp(&b[0]));
    Ok(PointLayout::Knots(Knots(knots)))
}

/// Return the function of points (x, y, height). Points without a height are gaps of a grid, and are left out elsewhere.
fn surface(spec: &DataSpec, mut points: Vec<[f64; 3]>) -> Result<PointLayout> {
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
    let range = [0, 1].map(|d| range(points.iter().map(|point| point[d])));
    match Scattered::new(&points) {
        Some(scattered) => Ok(PointLayout::Scattered(scattered, range)),
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
fn refuse_twins(spec: &DataSpec, points: &[[f64; 3]], rows: &NumberRows) -> Result<()> {
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
fn regular(coordinates: impl Iterator<Item = f64>) -> Option<GridAxis> {
    let mut sorted: Vec<f64> = coordinates.collect();
    sorted.sort_by(f64::total_cmp);
    let (first, last) = (*sorted.first()?, *sorted.last()?);
    // sorted coordinates differ by about a spacing between points of the axis, and by roundoff within one point
    let widest = sorted.windows(2).map(|two| two[1] - two[0]).fold(0.0, f64::max);
    let steps = sorted.windows(2).filter(|two| two[1] - two[0] > 0.5 * widest).count();
    let axis = GridAxis { origin: first, spacing: (last - first) / steps as f64, count: steps + 1 };
    let is_on = |&x: &f64| (x - axis.origin - axis.spacing * nearest(&axis, x) as f64).abs() <= ROUNDED * axis.spacing;
    (axis.spacing > 0.0 && axis.spacing.is_finite() && sorted.iter().all(is_on)).then_some(axis)
}

/// Return the index of the point of an axis that is nearest to a coordinate.
fn nearest(axis: &GridAxis, x: f64) -> usize {
    ((x - axis.origin) / axis.spacing).round().clamp(0.0, (axis.count - 1) as f64) as usize
}

/// Return the number of points without a height.
///
/// # Errors
/// Points without a height, if the scene does not say how to fill them; a suspicious height, if the scene does not name what stands for
/// points without one.
fn count_missing(spec: &DataSpec, rows: &NumberRows) -> Result<usize> {
    let total = heights(spec, rows).count();
    let missing = heights(spec, rows).filter(|height| height.is_nan()).count();
    if missing > 0 && missing == total {
        let what = format!("has no height at any of its {total} points");
        return Err(spec.refuse(what, "look at `missing`, and at the file"));
    }
    if missing > 0 && spec.fill == Fill::Error {
        let what =
            format!("has no height at {missing} of {total} points, the first {}", place(spec, rows, f64::is_nan));
        let help = "write fill = \"linear\" or \"nearest\", or fill the gaps with the program of the instrument";
        return Err(spec.refuse(what, help));
    }
    let suspect = if spec.missing.is_none() { suspect(|| heights(spec, rows)) } else { None };
    let Some(Suspect { value, count, others }) = suspect else { return Ok(missing) };
    let [low, high, number] = [others[0], others[1], value].map(shown);
    let first = place(spec, rows, |height| height == value);
    let what =
        format!("has {number} at {count} of {total} points, the first {first}; all others are from {low} to {high}");
    let help = format!(
        "if {number} stands for a point without a height, write missing = {number} and fill = \"linear\" or \"nearest\"; if it is a \
         height, write missing = []"
    );
    Err(spec.refuse(what, &help))
}

/// Return all heights in the order of the file.
fn heights<'a>(spec: &DataSpec, rows: &'a NumberRows) -> impl Iterator<Item = f64> + use<'a> {
    let first = rows.first_height(spec.points);
    rows.values.chunks(rows.columns.max(1)).flat_map(move |row| row[first..].iter().copied())
}

/// Return, as a text, where in the file the first such height is.
fn place(spec: &DataSpec, rows: &NumberRows, is_such: impl Fn(f64) -> bool) -> String {
    let wide = rows.columns.max(1) - rows.first_height(spec.points);
    let at = heights(spec, rows).position(is_such).unwrap_or(0);
    format!("in {}, column {} (from 0)", rows.line(at / wide), rows.first_height(spec.points) + at % wide)
}

/// A height that probably stands for no height.
#[derive(Debug, PartialEq)]
struct Suspect {
    value: f64,
    count: usize,
    /// The least and the largest of all other heights.
    others: [f64; 2],
}

/// Least number of different other heights in a file that is taken as measured: three bits, fewer than any instrument has. A step that is
/// written by hand is a table of a few numbers.
const LEVELS: usize = 8;

/// How far a single height must be from all others, as a multiple of their range. A picture of the surface to three digits then shows this
/// one spike and nothing else.
const SPIKE: f64 = 1e3;

/// Return a height that probably stands for points without one; none if there is none.
///
/// It is the least or the largest height, and it is farther from all others than these are from each other. A real step of this height would
/// pass the whole gap between two neighbouring points, everywhere along its flank. Measured heights also do not repeat to the last digit,
/// unless they have few digits, and then they do so close to each other. A height that occurs once must be [`SPIKE`] times as far away.
fn suspect<I: Iterator<Item = f64>>(heights: impl Fn() -> I) -> Option<Suspect> {
    let finite = || heights().filter(|height| !height.is_nan());
    let [low, high] = range(finite());
    [low, high].into_iter().find_map(|value| {
        let others = || finite().filter(|&height| height != value);
        let [least, largest] = range(others());
        let count = finite().filter(|&height| height == value).count();
        let distance = (least - value).max(value - largest);
        let far = if count == 1 { SPIKE * (largest - least) } else { largest - least };
        (distance > far && has_levels(others())).then_some(Suspect { value, count, others: [least, largest] })
    })
}

/// Return whether there are at least [`LEVELS`] different heights.
fn has_levels(heights: impl Iterator<Item = f64>) -> bool {
    let mut levels: Vec<f64> = Vec::new();
    for height in heights {
        if !levels.contains(&height) {
            levels.push(height);
        }
        if levels.len() == LEVELS {
            return true;
        }
    }
    false
}

/// A polynomial that was subtracted, by its derivatives at the middle of the data, in the units of the scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trend {
    /// First derivatives.
    pub slope: [f64; 2],
    /// Second derivatives by x, by x and y, and by y; zero for a plane.
    pub second: [f64; 3],
}

/// Subtract from the heights the polynomial that is nearest to them in the mean square, and return it. `places` gives the place of each
/// height. Heights that are NaN stay so, and do not count.
fn subtract(detrend: Detrend, places: impl Fn(usize) -> [f64; 2], heights: &mut [f64]) -> Option<Trend> {
    let terms = match detrend {
        Detrend::None => return None,
        Detrend::Plane => 3,
        Detrend::Parabola => 6,
    };
    // places from -1 to 1 in each direction have powers of one size
    let [low, high] = bounds((0..heights.len()).map(&places));
    let half = [0, 1].map(|d| if high[d] > low[d] { 0.5 * (high[d] - low[d]) } else { 1.0 });
    let powers = |k: usize| {
        let [x, y] = [0, 1].map(|d| (places(k)[d] - 0.5 * (low[d] + high[d])) / half[d]);
        [1.0, x, y, x * x, x * y, y * y]
    };
    let (mut matrix, mut right) = (DMatrix::zeros(terms, terms), DVector::zeros(terms));
    for (k, height) in heights.iter().enumerate().filter(|(_, height)| !height.is_nan()) {
        let powers = powers(k);
        for i in 0..terms {
            right[i] += powers[i] * height;
            (0..terms).for_each(|j| matrix[(i, j)] += powers[i] * powers[j]);
        }
    }
    // points on a line, or too few, leave terms undetermined: these become as small as possible
    let least = f64::EPSILON * heights.len() as f64;
    let found = matrix.svd(true, true).solve(&right, least).ok()?;
    for (k, height) in heights.iter_mut().enumerate() {
        let powers = powers(k);
        *height -= (0..terms).map(|i| found[i] * powers[i]).sum::<f64>();
    }
    let term = |i: usize| if i < terms { found[i] } else { 0.0 };
    let [a, b] = half;
    let second = [2.0 * term(3) / (a * a), term(4) / (a * b), 2.0 * term(5) / (b * b)];
    Some(Trend { slope: [term(1) / a, term(2) / b], second })
}

/// Replace the values of a grid that are NaN; at least one is not.
///
/// Only the points beside a gap are used. The nearest point of any place in the gap is among them, because one step further into the gap
/// there is a point that is still nearer.
fn fill_gaps(fill: Fill, axes: &[GridAxis; 2], values: &mut [f64]) {
    let gaps: Vec<usize> = (0..values.len()).filter(|&k| values[k].is_nan()).collect();
    if gaps.is_empty() {
        return;
    }
    let place = |k: usize| {
        let index = [k % axes[0].count, k / axes[0].count];
        [0, 1].map(|d| axes[d].origin + axes[d].spacing * index[d] as f64)
    };
    let mut rim: Vec<usize> = gaps.iter().flat_map(|&k| around(axes, k)).filter(|&k| !values[k].is_nan()).collect();
    rim.sort_unstable();
    rim.dedup();
    let is_profile = axes[1].count == 1;
    let rim: Vec<[f64; 3]> = rim.iter().map(|&k| [place(k)[0], place(k)[1], values[k]]).collect();
    let between = between(fill, is_profile, &rim);
    gaps.iter().for_each(|&k| values[k] = between(place(k)));
}

/// Return a function that gives heights between points and beyond them.
///
/// Heights are linear between the points of a profile and on triangles of a surface. A single point has no line, and points on one line have
/// no triangles. The nearest point is then as good, as no place is between them.
fn between(fill: Fill, is_profile: bool, points: &[[f64; 3]]) -> Box<dyn Fn([f64; 2]) -> f64> {
    if fill == Fill::Linear && is_profile && points.len() > 1 {
        let knots = Knots(points.iter().map(|&[x, _, height]| [x, height]).collect());
        return Box::new(move |place| knots.sample(place[0], true).value);
    }
    if fill == Fill::Linear
        && !is_profile
        && let Some(planes) = Scattered::new(points)
    {
        return Box::new(move |place| planes.sample(place, true).value);
    }
    let points = RTree::bulk_load(points.iter().map(|&[x, y, height]| GeomWithData::new([x, y], height)).collect());
    Box::new(move |place| points.nearest_neighbor(place).map_or(f64::NAN, |point| point.data))
}

/// Return the points around a point of a grid: eight inside, fewer at the border.
fn around(axes: &[GridAxis; 2], k: usize) -> Vec<usize> {
    let [columns, rows] = [axes[0].count, axes[1].count];
    let near = |at: usize, count: usize| at.saturating_sub(1)..=(at + 1).min(count - 1);
    let row = |j: usize| near(k % columns, columns).map(move |i| i + columns * j);
    near(k / columns, rows).flat_map(row).filter(|&other| other != k).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Waves of range 2, with some heights replaced.
    fn waves(replaced: &[(usize, f64)]) -> Option<Suspect> {
        let mut heights: Vec<f64> = (0..100).map(|k| (0.37 * f64::from(k)).sin()).collect();
        replaced.iter().for_each(|&(at, height)| heights[at] = height);
        suspect(|| heights.iter().copied())
    }

    #[test]
    fn values_far_from_all_others_are_suspicious() {
        for value in [-9999.0, 1e38, -32768.0, 4.0, -4.0] {
            let found = waves(&[(3, value), (77, value)]).expect("suspicious");
            assert_eq!((found.value, found.count), (value, 2));
        }
        assert_eq!(waves(&[(3, -9999.0)]).map(|found| found.count), Some(1));
        // nearer than the others are to each other, or alone
        assert_eq!(waves(&[]), None);
        assert_eq!(waves(&[(3, 2.9), (77, 2.9)]), None);
        assert_eq!(waves(&[(3, 50.0)]), None);
        // a step by hand
        let step = [0.0, 0.0, 0.0, 0.1, 5.0, 5.0, 5.0, 5.0, 5.0, 5.0];
        assert_eq!(suspect(|| step.into_iter()), None);
        assert_eq!(waves(&[(3, f64::NAN), (77, f64::NAN)]), None);
    }

    #[test]
    fn polynomials_are_found_and_subtracted() {
        let place = |k: usize| [100.0 + 0.5 * (k % 7) as f64, -3.0 + 2.0 * (k / 7) as f64];
        let parabola = |k: usize| {
            let [x, y] = [place(k)[0] - 101.5, place(k)[1] - 2.0];
            1.0 + 2.0 * x - 3.0 * y + 0.5 * x * x + 0.25 * x * y
        };
        let mut heights: Vec<f64> = (0..42).map(parabola).collect();
        heights[17] = f64::NAN;
        let found = subtract(Detrend::Parabola, place, &mut heights).expect("a trend");
        let error = [
            found.slope[0] - 2.0,
            found.slope[1] + 3.0,
            found.second[0] - 1.0,
            found.second[1] - 0.25,
            found.second[2],
        ];
        assert!(error.iter().all(|error| error.abs() < 1e-11), "{found:?}");
        assert!(heights[17].is_nan());
        assert!(heights.iter().filter(|height| !height.is_nan()).all(|height| height.abs() < 1e-11), "{heights:?}");
        // a profile, whose second coordinate is the same everywhere
        let mut line: Vec<f64> = (0..5).map(|k| 7.0 - 3.0 * f64::from(k)).collect();
        let along = |k: usize| [k as f64, 0.0];
        let found = subtract(Detrend::Plane, along, &mut line).expect("a trend");
        assert!((found.slope[0] + 3.0).abs() < 1e-12 && line.iter().all(|height| height.abs() < 1e-12), "{line:?}");
        assert_eq!(subtract(Detrend::None, along, &mut line), None);
    }

    fn axes(counts: [usize; 2]) -> [GridAxis; 2] {
        let axis = |origin, spacing, count| GridAxis { origin, spacing, count };
        [axis(5.0, 0.5, counts[0]), axis(-1.0, 2.0, counts[1])]
    }

    #[test]
    fn gaps_are_filled_from_their_rims() {
        let plane = |k: usize| 3.0 + (k % 6) as f64 - 10.0 * (k / 6) as f64;
        let gaps = [7, 8, 13, 14, 15, 0, 29];
        let holed: Vec<f64> = (0..30).map(|k| if gaps.contains(&k) { f64::NAN } else { plane(k) }).collect();
        let mut linear = holed.clone();
        fill_gaps(Fill::Linear, &axes([6, 5]), &mut linear);
        for k in [8, 13, 14, 15] {
            assert!((linear[k] - plane(k)).abs() < 1e-12, "{k}: {} {}", linear[k], plane(k));
        }
        // the corners are beyond all others
        assert!(linear.iter().all(|height| height.is_finite()));
        let mut nearest = holed;
        fill_gaps(Fill::Nearest, &axes([6, 5]), &mut nearest);
        // along a row points are 0.5 apart, from row to row 2
        assert_eq!([nearest[7], nearest[8], nearest[15], nearest[0]], [plane(6), plane(9), plane(16), plane(1)]);
    }

    #[test]
    fn profiles_and_rims_on_a_line() {
        let gap = f64::NAN;
        let mut profile = [gap, 1.0, gap, gap, 4.0, gap];
        fill_gaps(Fill::Linear, &axes([6, 1]), &mut profile);
        assert_eq!(profile, [1.0, 1.0, 2.0, 3.0, 4.0, 4.0]);
        // one row beside the gap is all that there is
        let mut half: Vec<f64> = (0..12).map(|k| if k < 6 { f64::from(k) } else { gap }).collect();
        fill_gaps(Fill::Linear, &axes([3, 4]), &mut half);
        assert_eq!(half[6..], [3.0, 4.0, 5.0, 3.0, 4.0, 5.0]);
    }
}
