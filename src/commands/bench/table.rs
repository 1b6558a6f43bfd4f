//! The rows of a benchmark: what was measured in the runs of each case, in memory, in `bench.csv` and on the terminal; what only all of them
//! together tell; and their plots.

use super::compare::{self, References};
use super::plan::{ASKED, BenchArgs, BenchCase, BenchPlan, LINEAR, is_of_mesh, part};
use super::process::{ProcessRun, RUNS, folder_of, items};
use crate::error::Result;
use crate::linalg::fit;
use crate::output::{Color, Folder, Plot, PlotAxis, RowFile, Series, Style, sci, seconds};
use comfy_table::{CellAlignment, presets};
use serde_json::Value;
use std::collections::BTreeMap;

/// All rows and their file.
pub(super) struct BenchTable<'a> {
    folder: &'a Folder,
    plan: &'a BenchPlan,
    columns: Vec<String>,
    pub rows: Vec<BenchRow>,
    /// Rows of an earlier benchmark that can be reused.
    old: Vec<BenchRow>,
    file: RowFile,
}

/// The file of the rows.
const FILE: &str = "bench.csv";
/// The file with the settings of the rows in the folder.
const SETTINGS: &str = "bench.txt";

impl<'a> BenchTable<'a> {
    /// Open the file of a plan. With `--resume` its rows are read first, if they were made with the same settings.
    pub fn open(folder: &'a Folder, plan: &'a BenchPlan, request: &BenchArgs, reference: &References) -> Result<Self> {
        let columns: Vec<String> = plan.columns.iter().cloned().chain(BenchRow::columns().map(str::to_owned)).collect();
        let settings = settings(request, reference);
        let path = folder.path().join(SETTINGS);
        let is_known = request.resume && crate::file::read(&path).is_ok_and(|old| old == settings.as_bytes());
        let mut old = if is_known { read(folder, &columns) } else { Vec::new() };
        old.retain(|row| !matches!(row.text("status"), "killed" | "failed" | SKIPPED));
        folder.write(SETTINGS, |out| out.write_all(settings.as_bytes()))?;
        // the file has the old rows from the start, so that a benchmark that is killed loses none
        let file = RowFile::create(folder, FILE, &columns, &old.iter().map(BenchRow::fields).collect::<Vec<_>>())?;
        Ok(Self { folder, plan, columns, rows: Vec::new(), old, file })
    }

    /// Return the row of a case that an earlier benchmark made from the same inputs. Scenes, data and meshes may have been edited meanwhile.
    pub fn old_row(&self, case: &BenchCase, inputs: Option<&str>) -> Option<BenchRow> {
        let is_same = |row: &&BenchRow| row.key == case.key && Some(row.text("inputs")) == inputs;
        self.old.iter().find(is_same).cloned()
    }

    /// Return whether a case differs only by its mesh from a row that did not end in time. Lists of meshes go from coarse to fine.
    pub fn is_beyond(&self, case: &BenchCase) -> bool {
        let columns = &self.plan.columns;
        let is_like = |row: &BenchRow| (0..columns.len()).all(|k| is_of_mesh(&columns[k]) || row.key[k] == case.key[k]);
        self.rows.iter().any(|row| row.text("status") == "timeout" && is_like(row))
    }

    /// Add a row. A new row is written at once, so that it is kept whatever comes next. Return the message that the file lacks rows, once.
    pub fn add(&mut self, row: BenchRow, is_new: bool) -> Option<String> {
        if is_new {
            self.file.push(&row.fields());
        }
        self.rows.push(row);
        self.file.complaint()
    }

    /// Add the numbers that need the whole table, and write all rows again.
    pub fn complete(&mut self) -> Result<()> {
        self.compare_with_finest();
        self.compare_with_linear();
        let rows: Vec<_> = self.rows.iter().map(BenchRow::fields).collect();
        RowFile::create(self.folder, FILE, &self.columns, &rows)?.finish()
    }

    /// Set the error of every row that has none, against the row of the finest mesh with the same values of all keys that are not of the mesh.
    ///
    /// Rows of the finest mesh have no error. Of several rows with as many dofs and the same order, the one with the smallest residual is the
    /// reference.
    fn compare_with_finest(&mut self) {
        let (columns, order) = (&self.plan.columns, self.plan.column("order"));
        // the first columns of the table are the scene and the keys
        let is_alike = |a: &BenchRow, b: &BenchRow| {
            (0..=self.plan.keys().len()).all(|k| is_of_mesh(&columns[k]) || a.key[k] == b.key[k])
        };
        let is_comparable = |row: &BenchRow| row.is_good() && !row.is_linear();
        // dofs, and the order of the elements
        let fineness = |row: &BenchRow| (row.number("dofs").unwrap_or(0.0), row.key[order].clone());
        let residual = |row: &BenchRow| row.number("residual").unwrap_or(f64::INFINITY);
        let mut found = Vec::new();
        for (index, row) in self.rows.iter().enumerate() {
            if !is_comparable(row) || row.number("error").is_some() {
                continue;
            }
            let group = self.rows.iter().filter(|other| is_comparable(other) && is_alike(row, other));
            let finest = group.max_by(|a, b| {
                let (x, y) = (fineness(a), fineness(b));
                x.0.total_cmp(&y.0).then(x.1.cmp(&y.1)).then(residual(b).total_cmp(&residual(a)))
            });
            let Some(finest) = finest.filter(|finest| fineness(finest) != fineness(row)) else { continue };
            let of_finest = format!("pressure, mesh of {} dofs", finest.text("dofs"));
            found.extend(self.difference(row, finest).map(|error| (index, error, of_finest)));
        }
        for (index, error, of_finest) in found {
            self.rows[index].set_error(error, &of_finest);
        }
    }

    /// Return the relative difference of the pressures of two rows; none where their tables cannot be compared.
    fn difference(&self, row: &BenchRow, reference: &BenchRow) -> Option<f64> {
        let runs = self.folder.path().join(RUNS);
        let dimension = self.plan.scene(&row.key[0])?.dimension.value;
        let [own, other] = [row, reference].map(|row| compare::tables(&folder_of(&runs, &row.key)).ok());
        compare::difference(dimension, &own?, &other?)
    }

    /// Add to every row the number of linear factor-and-solves of the same bodies that take as long as its set-up and iteration.
    ///
    /// Their reference cost is that of the fastest solver with a row of the method `linear`.
    fn compare_with_linear(&mut self) {
        let others = ["solver", ASKED].map(|name| self.plan.column(name));
        let same = |a: &BenchRow, b: &BenchRow| (0..a.key.len()).all(|k| others.contains(&k) || a.key[k] == b.key[k]);
        let linear: Vec<BenchRow> = self.rows.iter().filter(|row| row.is_linear()).cloned().collect();
        for row in self.rows.iter_mut().filter(|row| row.is_good() && !row.is_linear()) {
            let alike = linear.iter().filter(|other| same(row, other));
            let cost = alike.filter_map(|other| other.number("linear_seconds")).fold(f64::INFINITY, f64::min);
            if cost.is_finite() && cost > 0.0 {
                let own = ["set_up_seconds", "iterate_seconds"].iter().filter_map(|name| row.number(name)).sum::<f64>();
                row.set("linear_solves", own / cost);
            }
        }
    }
}

/// Return what rows depend on beside their key and their inputs.
fn settings(request: &BenchArgs, reference: &References) -> String {
    format!(
        "winkler {}\n--set {:?}\nPETSc {:?} {:?}\n--repeat {}\n--timeout {}\n--against {:?} {}\n",
        env!("CARGO_PKG_VERSION"),
        request.overrides.clone(),
        request.petsc,
        std::env::var_os("PETSC_OPTIONS").unwrap_or_default(),
        request.repeat,
        request.timeout,
        request.against,
        reference.digest()
    )
}

/// Return the rows of the file in a folder that has these columns; none if it has others.
fn read(folder: &Folder, columns: &[String]) -> Vec<BenchRow> {
    let Ok(bytes) = crate::file::read(&folder.path().join(FILE)) else { return Vec::new() };
    let mut file = csv::Reader::from_reader(bytes.as_slice());
    if !file.headers().is_ok_and(|header| header.iter().eq(columns)) {
        return Vec::new();
    }
    // the last row of a benchmark that was killed may be incomplete
    file.records().map_while(|record| record.ok()).map(|record| BenchRow::parse(&record)).collect()
}

/// Columns of texts and of the number of runs, after the key.
const TEXTS: [&str; 4] = ["runs", "status", "message", "method"];

/// A function that returns a number of the runs of a case, if they have it.
type Measurement = fn(&Runs) -> Option<f64>;

/// Columns with a number, after the texts. Times are medians over the runs; counters are those of one run, and all runs have the same. The
/// numbers that need the whole table, or tables of contact, are set later.
const NUMBERS: [(&str, Measurement); 25] = [
    ("dofs", |runs| runs.shown.number("/dofs")),
    ("points", |runs| Some(runs.pairs()?.map(|pair| of(pair, "points")).sum())),
    ("theta", |runs| Some(runs.pairs()?.map(coupling).fold(0.0, f64::max))),
    ("seconds", |runs| runs.median(|run| Some(run.seconds))),
    ("spread", |runs| runs.spread()),
    ("mesh_seconds", |runs| runs.median(|run| run.number("/times/mesh"))),
    ("discretize_seconds", |runs| runs.median(|run| run.number("/times/discretize"))),
    ("set_up_seconds", |runs| runs.median(|run| run.number("/times/set-up"))),
    ("iterate_seconds", |runs| runs.median(|run| run.number("/times/iterate"))),
    ("factor_seconds", |runs| runs.median(|run| run.number("/inner_times/factor"))),
    ("solve_seconds", |runs| runs.solve_seconds()),
    ("cpu_seconds", |runs| runs.median(|run| Some(run.cpu))),
    ("memory_mb", |runs| runs.median(|run| Some(run.memory as f64 / 1e6))),
    ("iterations", |runs| runs.shown.number("/iterations")),
    ("sweeps", |runs| runs.shown.number("/sweeps")),
    ("inner_iterations", |runs| runs.shown.number("/inner_iterations")),
    ("factorizations", |runs| runs.shown.number("/factorizations")),
    ("dense_factorizations", |runs| runs.shown.number("/dense_factorizations")),
    ("residual", |runs| runs.shown.number("/residual")),
    ("peak_pressure", |runs| Some(runs.pairs()?.map(|pair| of(pair, "peak_pressure")).fold(0.0, f64::max))),
    ("linear_seconds", |runs| runs.linear_seconds()),
    ("linear_solves", |_| None),
    ("error", |_| None),
    ("error_h1", |runs| runs.shown.largest("error_h1")),
    ("error_energy", |runs| runs.shown.largest("error_energy")),
];

/// Columns after the numbers.
const LAST: [&str; 2] = ["error_of", "inputs"];

/// The status of a case that was not run.
pub(super) const SKIPPED: &str = "skipped";

/// The row of a case.
#[derive(Debug, Clone)]
pub(super) struct BenchRow {
    /// Values of the columns of the plan.
    pub key: Vec<String>,
    /// The texts of the other columns, as they are in the file; those that are empty may be missing.
    values: BTreeMap<&'static str, String>,
}

impl BenchRow {
    /// Return the names of its columns after the key.
    fn columns() -> impl Iterator<Item = &'static str> {
        TEXTS.into_iter().chain(NUMBERS.map(|(name, _)| name)).chain(LAST)
    }

    /// Return the row of some runs of a case.
    pub fn new(case: &BenchCase, runs: &[ProcessRun]) -> Self {
        let worst = runs.iter().find(|run| !is_good(&run.status));
        let Some(shown) = worst.or(runs.first()) else {
            return Self::unsolved(case, "failed", "nothing was run");
        };
        // such a run makes one update, and ends as it should
        let linear = case.is_linear() && shown.status == "iteration-limit";
        let (status, message) = if linear {
            (LINEAR, "one factorisation and one solve")
        } else {
            (shown.status.as_str(), shown.message.as_str())
        };
        let mut row = Self::unsolved(case, status, message);
        row.set("runs", runs.len());
        if let (false, Some(method)) = (case.is_linear(), shown.report["method"].as_str()) {
            row.set("method", method);
        }
        let runs = Runs { all: runs, shown, is_linear: case.is_linear() };
        for (name, number) in NUMBERS {
            number(&runs).filter(|value| value.is_finite()).iter().for_each(|value| row.set(name, value));
        }
        row
    }

    /// Return the row of a case without results.
    pub fn unsolved(case: &BenchCase, status: &str, message: &str) -> Self {
        let texts = [("runs", "0"), ("status", status), ("message", message), ("method", case.method.as_str())];
        let values = texts.map(|(name, text)| (name, text.to_owned())).into();
        Self { key: case.key.clone(), values }
    }

    /// Return whether the run ended as it should.
    pub fn is_good(&self) -> bool {
        is_good(self.text("status"))
    }

    /// Return whether it is one linear factor-and-solve.
    fn is_linear(&self) -> bool {
        self.text("status") == LINEAR
    }

    /// Return the text of a column.
    pub fn text(&self, name: &str) -> &str {
        self.values.get(name).map_or("", String::as_str)
    }

    fn number(&self, name: &str) -> Option<f64> {
        self.text(name).parse().ok()
    }

    /// Set the text or number of a column.
    pub fn set(&mut self, name: &'static str, value: impl ToString) {
        self.values.insert(name, value.to_string());
    }

    /// Set the error, and the text that says what it is measured in and against.
    pub fn set_error(&mut self, error: f64, what: &str) {
        self.set("error", error);
        self.set("error_of", what);
    }

    /// Return the row as a line for the terminal.
    pub fn line(&self, label: &str, is_new: bool) -> String {
        let mut line = format!("{label}: {}", self.text("status"));
        if !self.is_good() && !self.text("message").is_empty() {
            line += &format!(" ({})", self.text("message"));
        }
        if let Some(time) = self.number("seconds") {
            line += &format!(", {} s", seconds(time));
        }
        if let (Some(dofs), Some(iterations)) = (self.number("dofs"), self.number("iterations")) {
            line += &format!(", {dofs} dofs, {iterations} iterations");
        }
        if let Some(error) = self.number("error") {
            line += &format!(", error {}", sci(error, 2));
        }
        if is_new { line } else { line + " (kept)" }
    }

    /// Return the row as fields of the file.
    fn fields(&self) -> Vec<String> {
        self.key.iter().cloned().chain(Self::columns().map(|name| self.text(name).to_owned())).collect()
    }

    /// Return the row of a record of the file.
    fn parse(record: &csv::StringRecord) -> Self {
        let mut key: Vec<String> = record.iter().map(str::to_owned).collect();
        let values = key.split_off(record.len() - Self::columns().count());
        Self { key, values: Self::columns().zip(values).collect() }
    }
}

fn is_good(status: &str) -> bool {
    matches!(status, "converged" | "roundoff-limited" | LINEAR)
}

struct Runs<'a> {
    all: &'a [ProcessRun],
    /// The first that failed, else the first.
    shown: &'a ProcessRun,
    is_linear: bool,
}

impl Runs<'_> {
    /// Return the median of a number over the runs that have it.
    fn median(&self, number: impl Fn(&ProcessRun) -> Option<f64>) -> Option<f64> {
        median(self.all.iter().filter_map(number).filter(|value| value.is_finite()).collect())
    }

    /// Return the difference of the longest and the shortest run over the median; none for a single run.
    fn spread(&self) -> Option<f64> {
        let times: Vec<f64> = self.all.iter().map(|run| run.seconds).collect();
        let (low, high) = times.iter().fold((f64::MAX, 0.0f64), |(low, high), &t| (low.min(t), high.max(t)));
        median(times).filter(|_| self.all.len() > 1).map(|middle| (high - low) / middle)
    }

    fn solve_seconds(&self) -> Option<f64> {
        self.median(|run| run.number("/inner_times/solve"))
    }

    /// Return the pairs of the report; none without any.
    fn pairs(&self) -> Option<impl Iterator<Item = &Value>> {
        let pairs = items(&self.shown.report["pairs"]);
        (!pairs.is_empty()).then(|| pairs.iter())
    }

    /// Return the seconds of one linear factor-and-solve of all bodies, from a run with one update.
    ///
    /// The start of the run solves with very stiff springs, which takes an iterative solver longer. The sweep therefore has the share of the
    /// solve time that it has of the inner iterations, or without these of the body solves: one sweep solves each body once.
    fn linear_seconds(&self) -> Option<f64> {
        let run = self.is_linear.then_some(self.shown)?;
        let all = run.number("/inner_iterations").unwrap_or(0.0);
        let share = match run.last_sweep {
            Some(sweep) if all > 0.0 => sweep / all,
            _ => items(&run.report["bodies"]).len() as f64 / run.number("/body_solves")?,
        };
        Some(run.number("/inner_times/first")? + share * self.solve_seconds()?)
    }
}

/// Return a number of a pair, NaN if it has none.
fn of(pair: &Value, key: &str) -> f64 {
    pair[key].as_f64().unwrap_or(f64::NAN)
}

/// Return the coupling theta of a pair, the geometric mean of those of its sides.
fn coupling(pair: &Value) -> f64 {
    items(&pair["theta"]).iter().filter_map(Value::as_f64).product::<f64>().sqrt()
}

/// Return the median of some numbers, which is the mean of the two middle ones if their count is even.
fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    match values.len() {
        0 => None,
        count if count.is_multiple_of(2) => Some(0.5 * (values[middle - 1] + values[middle])),
        _ => Some(values[middle]),
    }
}

/// A function that returns a number as a text.
type NumberFormat = fn(f64) -> String;

/// Columns with a number: heading, name in the rows, format.
const SHOWN: [(&str, &str, NumberFormat); 9] = [
    ("dofs", "dofs", |value| format!("{value:.0}")),
    ("iterations", "iterations", |value| format!("{value:.0}")),
    ("sweeps", "sweeps", |value| format!("{value:.0}")),
    ("inner iterations", "inner_iterations", |value| format!("{value:.0}")),
    ("s", "seconds", seconds),
    ("CPU s", "cpu_seconds", seconds),
    ("MB", "memory_mb", |value| format!("{value:.0}")),
    ("linear solves", "linear_solves", |value| format!("{value:.1}")),
    ("error", "error", |value| sci(value, 2)),
];

/// Return the table with one line for each row: the values that distinguish it, the method that ran, and the numbers that some row has.
pub(super) fn summary(rows: &[BenchRow], plan: &BenchPlan) -> comfy_table::Table {
    let columns = &plan.columns;
    let mut named = plan.varied(rows.iter().map(|row| &row.key));
    named.retain(|&column| columns[column] != ASKED);
    let known = |name: &str| rows.iter().any(|row| row.number(name).is_some());
    let numbers: Vec<_> = SHOWN.iter().filter(|(_, name, _)| known(name)).collect();
    let mut table = comfy_table::Table::new();
    table.load_style(presets::NOTHING);
    let heads = named.iter().map(|&column| columns[column].as_str());
    table.set_header(heads.chain(["method", "status"]).chain(numbers.iter().map(|number| number.0)));
    let line = |row: &BenchRow| -> Vec<String> {
        let words = named.iter().map(|&column| row.key[column].clone());
        let words = words.chain(["method", "status"].map(|name| row.text(name).to_owned()));
        words.chain(numbers.iter().map(|(_, name, format)| row.number(name).map_or(String::new(), format))).collect()
    };
    table.add_rows(rows.iter().map(line));
    for column in table.column_iter_mut().skip(named.len() + 2) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}

/// Return all plots for which the rows have numbers, with the names of their files. With several scenes a name has the scene in it.
pub(super) fn plots(rows: &[BenchRow], plan: &BenchPlan) -> Vec<(String, Plot)> {
    let mut plots = Vec::new();
    for (name, scene) in plan.names.iter().zip(&plan.scenes) {
        let rows: Vec<&BenchRow> =
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

struct Chart<'a> {
    rows: &'a [&'a BenchRow],
    plan: &'a BenchPlan,
    title: &'a str,
}

impl Chart<'_> {
    /// Return a plot with logarithmic axes; none without points.
    fn plot(&self, x: &str, y: &str, series: Vec<Series>) -> Option<Plot> {
        let has_points = series.iter().any(|series| !series.points.is_empty());
        has_points.then(|| Plot { title: self.title.to_owned(), x: PlotAxis::log(x), y: PlotAxis::log(y), series })
    }

    /// Return the plot of time against error. The dashed line joins the runs that no other run beats in both.
    fn time_error(&self) -> Option<Plot> {
        let mut series =
            self.series(is_of_mesh, |row| Some((row.number("error")?, row.number("seconds")?)), |_| String::new());
        let all: Vec<(f64, f64)> = series.iter().flat_map(|series| series.points.iter().copied()).collect();
        let front = Series::new("Pareto front", pareto(all), Style::Dashed).color(Color::Grey);
        series.push(front);
        let mut of = self.rows.iter().map(|row| row.text("error_of")).filter(|of| !of.is_empty());
        let first = of.next()?;
        // keys other than those of the mesh may give several references
        let of = if of.all(|other| other == first) { first } else { "pressure, finest mesh" };
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
        let is_over = |column: &str| !is_of_mesh(column) && self.plan.keys().iter().any(|key| key == column);
        let point = |row: &BenchRow| Some((1.0 / (1.0 - row.number("theta")?), row.number("sweeps")?));
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
        point: impl Fn(&BenchRow) -> Option<(f64, f64)>,
        suffix: impl Fn(&[(f64, f64)]) -> String,
    ) -> Vec<Series> {
        let (columns, solver, asked) = (&self.plan.columns, self.plan.column("solver"), self.plan.column(ASKED));
        // the method of a curve is the one that ran
        let key = |row: &&BenchRow| {
            let mut key = row.key.clone();
            key[asked] = row.text("method").to_owned();
            key
        };
        let keys: Vec<Vec<String>> = self.rows.iter().map(key).collect();
        let mut named = self.plan.varied(keys.iter());
        named.retain(|&column| columns[column] != "scene" && !along(&columns[column]));
        let mut all: Vec<Series> = Vec::new();
        for (row, key) in self.rows.iter().zip(&keys) {
            let Some(point) = point(row) else { continue };
            let parts: Vec<String> = named.iter().map(|&k| part(&columns[k], &key[k], columns)).collect();
            let label = if parts.is_empty() { key[solver].clone() } else { parts.join(", ") };
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

/// Relative difference of errors below which two runs are those of different solvers on one mesh. Solvers of one mesh have errors with the same two
/// digits (docs/benchmarks.md); halving the size of linear elements halves the error.
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
    fn the_median_is_the_middle() {
        assert_eq!(median(vec![5.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(vec![4.0, 1.0, 2.0, 100.0]), Some(3.0));
        assert_eq!(median(Vec::new()), None);
    }

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
