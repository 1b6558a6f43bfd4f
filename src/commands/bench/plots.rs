//! The plots of a benchmark: time against error, and time, memory and inner iterations against the degrees of freedom.

use super::plan::{Benchmark, Measured, is_of_mesh};
use crate::commands::rows::CaseRow;
use crate::linalg::fit;
use crate::output::{Color, Plot, PlotAxis, Series, Style, safe_name};

/// Return all plots for which the rows have numbers, with the names of their files. With several scenes a name has the
/// scene in it.
pub(super) fn plots(rows: &[Measured], bench: &Benchmark) -> Vec<(String, Plot)> {
    let mut plots = Vec::new();
    for (name, scene) in bench.names.iter().zip(&bench.scenes) {
        let is_shown = |measured: &&Measured| measured.case.key[0] == *name && measured.row.is_good();
        let rows: Vec<&Measured> = rows.iter().filter(is_shown).collect();
        let chart = Chart { rows: &rows, bench, title: &scene.title };
        let list = [
            chart.time_error(),
            chart.against_dofs(|row| chart.time(row), chart.time_label()),
            chart.against_dofs(|row| row.memory_mb, "peak memory, MB"),
            chart.against_dofs(iterations, "inner iterations"),
        ];
        let files = KINDS.map(|what| file(what, name, bench));
        plots.extend(files.into_iter().zip(list).filter_map(|(file, plot)| Some((file, plot?))));
    }
    plots
}

/// What is drawn for each scene.
const KINDS: [&str; 4] = ["time-error", "time-dofs", "memory-dofs", "iterations-dofs"];

/// Return the inner iterations of a run; none if its solvers are direct.
fn iterations(row: &CaseRow) -> Option<f64> {
    row.inner_iterations.filter(|count| *count > 0).map(|count| count as f64)
}

/// Return the names of the files of all plots.
pub(super) fn names(bench: &Benchmark) -> impl Iterator<Item = String> {
    bench.names.iter().flat_map(|name| KINDS.map(|what| file(what, name, bench)))
}

/// Return the name of the file of a plot. With several scenes it has the name of the scene in it.
fn file(what: &str, name: &str, bench: &Benchmark) -> String {
    if bench.names.len() == 1 { format!("{what}.svg") } else { format!("{what}-{}.svg", safe_name(name)) }
}

struct Chart<'a> {
    rows: &'a [&'a Measured],
    bench: &'a Benchmark,
    title: &'a str,
}

impl Chart<'_> {
    /// Return a plot with logarithmic axes; none without points.
    fn plot(&self, x: &str, y: &str, series: Vec<Series>) -> Option<Plot> {
        let has_points = series.iter().any(|series| !series.points.is_empty());
        has_points.then(|| Plot { title: self.title.to_owned(), x: PlotAxis::log(x), y: PlotAxis::log(y), series })
    }

    /// Return whether all runs are on one rank. Their CPU time is then that of an idle machine, whatever else runs on
    /// it.
    fn is_serial(&self) -> bool {
        self.rows.iter().all(|measured| self.bench.plan.value(&measured.case, "ranks") == "1")
    }

    /// Return the time of a run that plots show.
    fn time(&self, row: &CaseRow) -> Option<f64> {
        if self.is_serial() { row.cpu_seconds } else { row.seconds }
    }

    fn time_label(&self) -> &'static str {
        if self.is_serial() { "CPU time, s" } else { "wall time, s" }
    }

    /// Return the plot of time against error. The dashed line joins the runs that no other run beats in both.
    fn time_error(&self) -> Option<Plot> {
        let mut series = self.series(|row| Some((row.error?, self.time(row)?)));
        let all: Vec<(f64, f64)> = series.iter().flat_map(|series| series.points.iter().copied()).collect();
        series.push(Series::new("Pareto front", pareto(all), Style::Dashed).color(Color::Grey));
        let mut of = self.rows.iter().map(|measured| measured.row.error_of.as_str()).filter(|of| !of.is_empty());
        let first = of.next()?;
        // keys other than those of the mesh may give several references
        let of = if of.all(|other| other == first) { first } else { "pressure, finest mesh" };
        self.plot(&format!("relative error ({of})"), self.time_label(), series)
    }

    /// Return the plot of a number against the dofs, with the exponent of the fitted power law in the name of each
    /// curve.
    fn against_dofs(&self, number: impl Fn(&CaseRow) -> Option<f64>, label: &str) -> Option<Plot> {
        let mut series = self.series(|row| Some((row.dofs? as f64, number(row)?)));
        for series in &mut series {
            let power = exponent(&series.points).map(|power| format!(" (dofs^{power:.2})"));
            series.label += &power.unwrap_or_default();
        }
        self.plot("degrees of freedom", label, series)
    }

    /// Return the points (x, y) of each curve, sorted by x. The rows of a curve differ only in the keys of the mesh,
    /// and its name has the other values that differ between rows, with the method that ran.
    fn series(&self, point: impl Fn(&CaseRow) -> Option<(f64, f64)>) -> Vec<Series> {
        let plan = &self.bench.plan;
        let keys: Vec<Vec<String>> = self.rows.iter().map(|measured| self.key(measured)).collect();
        let mut named = plan.varied(keys.iter());
        named.retain(|&column| !is_of_mesh(&plan.columns[column]));
        if named.is_empty() {
            named.extend(plan.columns.iter().position(|column| column == "solver"));
        }
        let mut all: Vec<Series> = Vec::new();
        for (measured, key) in self.rows.iter().zip(&keys) {
            let Some(point) = point(&measured.row) else { continue };
            let label = plan.label(key, &named);
            match all.iter_mut().find(|series| series.label == label) {
                Some(series) => series.points.push(point),
                None => all.push(Series::new(label, vec![point], Style::LineMarkers)),
            }
        }
        all.iter_mut().for_each(|series| series.points.sort_by(|a, b| a.0.total_cmp(&b.0)));
        all
    }

    /// Return the key of a row, with the method that ran in place of the one that was asked for.
    fn key(&self, measured: &Measured) -> Vec<String> {
        let column = |(value, column): (&String, &String)| match column.as_str() {
            "asked" => measured.row.method.clone(),
            _ => value.clone(),
        };
        measured.case.key.iter().zip(&self.bench.plan.columns).map(column).collect()
    }
}

/// Relative difference of errors below which two runs are those of different solvers on one mesh. Solvers of one mesh
/// have errors with the same two digits (docs/benchmarks.md); halving the size of linear elements halves the error.
const ALIKE: f64 = 0.01;

/// Return the points (error, time) that no other point beats, sorted by the error. Each is faster than all points with
/// a smaller error, and more accurate than all faster ones by more than [`ALIKE`].
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

/// Return the exponent of the power law through points (size, value) sorted by their sizes, by least squares of the
/// logarithms; none with fewer than three sizes, since it would be no more than the slope of a line between two
/// measured times.
fn exponent(points: &[(f64, f64)]) -> Option<f64> {
    if points.chunk_by(|a, b| a.0 == b.0).count() < 3 {
        return None;
    }
    let (x, y): (Vec<f64>, Vec<f64>) = points.iter().map(|(x, y)| (x.ln(), y.ln())).unzip();
    Some(fit(&[vec![1.0; x.len()], x], &y)[1]).filter(|slope| slope.is_finite())
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
        assert_eq!(exponent(&[(2.0, 1.0), (2.0, 1.1), (4.0, 3.0)]), None);
    }
}
