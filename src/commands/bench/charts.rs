//! The plots of a benchmark.

use super::plan::{ASKED, Plan, is_of_mesh, part};
use super::row::Row;
use crate::linalg::fit;
use crate::output::{Axis, Color, Plot, Series, Style};

/// Return all plots for which the rows have numbers, with the names of their files. With several scenes a name has the scene in it.
pub(super) fn all(rows: &[Row], plan: &Plan) -> Vec<(String, Plot)> {
    let mut plots = Vec::new();
    for (name, scene) in plan.names.iter().zip(&plan.scenes) {
        let rows: Vec<&Row> =
            rows.iter().filter(|row| row.key[0] == *name && row.is_good() && !row.is_linear()).collect();
        let stem =
            |what: &str| if plan.scenes.len() == 1 { format!("{what}.svg") } else { format!("{what}-{name}.svg") };
        let chart = Chart { rows: &rows, plan, title: &scene.title };
        let list = [
            ("time-error", chart.time_error()),
            ("time-dofs", chart.against_dofs("seconds", "wall time, s")),
            ("memory-dofs", chart.against_dofs("memory_mb", "peak memory, MB")),
            ("iterations-theta", chart.iterations_theta()),
        ];
        plots.extend(list.into_iter().filter_map(|(what, plot)| Some((stem(what), plot?))));
    }
    plots
}

/// The rows of one scene.
struct Chart<'a> {
    rows: &'a [&'a Row],
    plan: &'a Plan,
    title: &'a str,
}

impl Chart<'_> {
    /// Return a plot with logarithmic axes; none without points.
    fn plot(&self, x: &str, y: &str, series: Vec<Series>) -> Option<Plot> {
        let has_points = series.iter().any(|series| !series.points.is_empty());
        has_points.then(|| Plot { title: self.title.to_owned(), x: Axis::log(x), y: Axis::log(y), series })
    }

    /// Return the plot of time against error. The dashed line joins the runs that no other run beats in both.
    fn time_error(&self) -> Option<Plot> {
        let mut series =
            self.series(is_of_mesh, |row| Some((row.number("error")?, row.number("seconds")?)), |_| String::new());
        let all: Vec<(f64, f64)> = series.iter().flat_map(|series| series.points.iter().copied()).collect();
        let front = Series::new("Pareto front", pareto(all), Style::Dashed).color(Color::Grey);
        series.push(front);
        let of = self.rows.iter().map(|row| row.error_of.as_str()).find(|of| !of.is_empty())?;
        self.plot(&format!("relative error ({of})"), "wall time, s", series)
    }

    /// Return the plot of a number against the dofs, with the exponent of the fitted power law in the name of each curve.
    fn against_dofs(&self, name: &str, label: &str) -> Option<Plot> {
        let slope =
            |points: &[(f64, f64)]| exponent(points).map_or(String::new(), |slope| format!(" (dofs^{slope:.2})"));
        let series = self.series(is_of_mesh, |row| Some((row.number("dofs")?, row.number(name)?)), slope);
        self.plot("degrees of freedom", label, series)
    }

    /// Return the plot of sweeps against 1/(1 - theta), with the coupling theta of the bodies; none if theta was not varied.
    fn iterations_theta(&self) -> Option<Plot> {
        let is_over = |column: &str| !is_of_mesh(column) && self.plan.keys.iter().any(|key| key == column);
        let point = |row: &Row| Some((1.0 / (1.0 - row.number("theta")?), row.number("sweeps")?));
        let series = self.series(is_over, point, |_| String::new());
        let varied = |series: &Series| series.points.windows(2).any(|pair| pair[1].0 > pair[0].0);
        if !series.iter().any(varied) {
            return None;
        }
        self.plot("1 / (1 - theta)", "sweeps", series)
    }

    /// Return the points (x, y) of each curve, sorted by x. The rows of a curve differ only in the columns for which `along` holds, and its name
    /// has the other values that differ between rows. The text of `suffix` is added to the name.
    fn series(
        &self,
        along: impl Fn(&str) -> bool,
        point: impl Fn(&Row) -> Option<(f64, f64)>,
        suffix: impl Fn(&[(f64, f64)]) -> String,
    ) -> Vec<Series> {
        let columns = self.plan.columns();
        // the method of a curve is the one that ran
        let value = |row: &Row, column: usize| -> String {
            if columns[column] == ASKED { row.method.clone() } else { row.key[column].clone() }
        };
        let differs = |&column: &usize| self.rows.iter().any(|row| value(row, column) != value(self.rows[0], column));
        let named: Vec<usize> = (1..columns.len()).filter(|&column| !along(&columns[column])).filter(differs).collect();
        let solver = columns.len() - 4;
        let mut all: Vec<Series> = Vec::new();
        for row in self.rows {
            let Some(point) = point(row) else { continue };
            let parts: Vec<String> = named.iter().map(|&k| part(&columns[k], &value(row, k), &columns)).collect();
            let label = if parts.is_empty() { row.key[solver].clone() } else { parts.join(", ") };
            match all.iter_mut().find(|series| series.label == label) {
                Some(series) => series.points.push(point),
                None => all.push(Series::new(label, vec![point], Style::LineMarkers)),
            }
        }
        for series in &mut all {
            series.points.sort_by(|a, b| a.0.total_cmp(&b.0));
            series.label += &suffix(&series.points);
        }
        all
    }
}

/// Relative difference of errors below which two runs are those of different solvers on one mesh.
const ALIKE: f64 = 0.01;

/// Return the points (error, time) that no other point beats, sorted by the error. Each is faster than all points with a smaller error, and more
/// accurate than all faster ones by more than [`ALIKE`].
fn pareto(mut points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    points.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.total_cmp(&b.0)));
    let mut front: Vec<(f64, f64)> = Vec::new();
    for point in points {
        if front.last().is_none_or(|last| point.0 < (1.0 - ALIKE) * last.0) {
            front.push(point);
        }
    }
    front.reverse();
    front
}

/// Fewest sizes for an exponent. With two it would be no more than the slope of a line between two measured times.
const FEWEST_SIZES: usize = 3;

/// Return the exponent of the power law through points (size, value), by least squares of the logarithms; none with fewer than
/// [`FEWEST_SIZES`] sizes.
fn exponent(points: &[(f64, f64)]) -> Option<f64> {
    let mut sizes: Vec<f64> = points.iter().map(|point| point.0).collect();
    sizes.sort_by(f64::total_cmp);
    sizes.dedup();
    if sizes.len() < FEWEST_SIZES {
        return None;
    }
    let [x, y] = [|point: &(f64, f64)| point.0.ln(), |point: &(f64, f64)| point.1.ln()]
        .map(|log| points.iter().map(log).collect::<Vec<f64>>());
    let slope = fit(&[vec![1.0; x.len()], x], &y)[1];
    slope.is_finite().then_some(slope)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_front_is_what_nothing_beats() {
        let points = vec![(1.0, 9.0), (2.0, 5.0), (3.0, 6.0), (2.0, 7.0), (4.0, 1.0)];
        assert_eq!(pareto(points), [(1.0, 9.0), (2.0, 5.0), (4.0, 1.0)]);
        // solvers of one mesh: the fastest is enough
        assert_eq!(pareto(vec![(1.0, 5.0), (1.002, 4.0), (0.999, 7.0), (3.0, 1.0)]), [(1.002, 4.0), (3.0, 1.0)]);
    }

    #[test]
    fn a_power_law_has_its_exponent() {
        let points: Vec<(f64, f64)> = [1.0, 2.0, 5.0, 9.0].iter().map(|&x: &f64| (x, 3.0 * x.powf(1.5))).collect();
        assert!(exponent(&points).is_some_and(|slope| (slope - 1.5).abs() < 1e-12));
        assert_eq!(exponent(&[(2.0, 1.0), (4.0, 3.0), (2.0, 1.1)]), None);
    }
}
