//! The rows of a benchmark, in memory and in `bench.csv`.

use super::compare::References;
use super::plan::{Case, LINEAR, Plan};
use super::process::{RUNS, Run};
use super::request::Request;
use crate::error::{Error, Result};
use crate::output::{Folder, RowFile, sci, seconds};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Columns of texts and of the number of runs, after the key.
const TEXTS: [&str; 4] = ["runs", "status", "message", "method"];

/// The source of a number of a row.
enum Of {
    /// The median over the reports of all runs, by the path of the number in a report.
    Runs(&'static str),
    /// The report of the first run, by the path of the number.
    First(&'static str),
    /// Anything else.
    Other,
}

/// Columns with a number, after the texts.
const NUMBERS: [(&str, Of); 25] = [
    ("dofs", Of::First("/dofs")),
    ("points", Of::Other),
    ("theta", Of::Other),
    ("seconds", Of::Other),
    ("spread", Of::Other),
    ("mesh_seconds", Of::Runs("/times/mesh")),
    ("discretize_seconds", Of::Runs("/times/discretize")),
    ("set_up_seconds", Of::Runs("/times/set-up")),
    ("iterate_seconds", Of::Runs("/times/iterate")),
    ("factor_seconds", Of::Runs("/inner_times/factor")),
    ("solve_seconds", Of::Runs("/inner_times/solve")),
    ("cpu_seconds", Of::Other),
    ("memory_mb", Of::Other),
    ("iterations", Of::First("/iterations")),
    ("sweeps", Of::First("/sweeps")),
    ("inner_iterations", Of::First("/inner_iterations")),
    ("factorizations", Of::First("/factorizations")),
    ("dense_factorizations", Of::First("/dense_factorizations")),
    ("residual", Of::First("/residual")),
    ("peak_pressure", Of::Other),
    ("linear_seconds", Of::Other),
    ("linear_solves", Of::Other),
    ("error", Of::Other),
    ("error_h1", Of::Other),
    ("error_energy", Of::Other),
];

/// Columns after the numbers.
const LAST: [&str; 2] = ["error_of", "inputs"];

/// The row of a case: what was measured.
#[derive(Debug, Clone)]
pub(super) struct Row {
    /// Values of the columns of the plan.
    pub key: Vec<String>,
    /// Number of runs.
    runs: usize,
    /// Status of the run.
    pub status: String,
    /// The status in words.
    message: String,
    /// The method that ran; the one that was asked for where nothing ran.
    pub method: String,
    /// Numbers by the names of their columns.
    numbers: BTreeMap<&'static str, f64>,
    /// The text that says what the error is measured in and against; empty without an error.
    pub error_of: String,
    /// Digest of the inputs of the run; empty if they are not known.
    pub inputs: String,
    /// Relative error of the displacements from the report, where the scene has their closed form.
    pub displacement_error: Option<f64>,
}

/// All rows and their file.
pub(super) struct Table<'a> {
    folder: &'a Folder,
    columns: Vec<String>,
    /// Rows so far.
    pub rows: Vec<Row>,
    /// Rows of an earlier benchmark that can be reused.
    old: Vec<Row>,
    file: RowFile,
}

/// The file of the rows.
const FILE: &str = "bench.csv";
/// The status of a case that was not run.
const SKIPPED: &str = "skipped";
/// The file with the settings of the rows in the folder.
const SETTINGS: &str = "bench.txt";

impl Row {
    /// Return the row of some runs of a case. Times are medians; counters are those of the first run, and all runs have the same.
    pub fn new(case: &Case, runs: &[Run]) -> Self {
        let worst = runs.iter().find(|run| !is_good(&run.status));
        let Some(first) = worst.or(runs.first()) else {
            return Self::empty(case, "failed", "nothing was run");
        };
        // such a run makes one update, and ends as it should
        let linear = case.is_linear() && first.status == "iteration-limit";
        let (status, message) = if linear {
            (LINEAR, "one factorisation and one solve")
        } else {
            (first.status.as_str(), first.message.as_str())
        };
        let mut row = Self::empty(case, status, message);
        row.runs = runs.len();
        if let (false, Some(method)) = (case.is_linear(), first.report["method"].as_str()) {
            row.method = method.to_owned();
        }
        row.add_measured(runs);
        row.add_reported(runs, first);
        row.add_pairs(&first.report);
        if case.is_linear() {
            row.add_linear(first);
        }
        row.add_exact_errors(&first.report);
        row
    }

    /// Add the median of finite numbers, if there are any.
    fn add_median(&mut self, name: &'static str, values: impl Iterator<Item = f64>) {
        self.numbers.extend(median(values.filter(|value| value.is_finite()).collect()).map(|middle| (name, middle)));
    }

    /// Add times and memory, and the spread of the times over the runs.
    fn add_measured(&mut self, runs: &[Run]) {
        self.add_median("seconds", runs.iter().map(|run| run.seconds));
        self.add_median("cpu_seconds", runs.iter().map(|run| run.cpu));
        self.add_median("memory_mb", runs.iter().map(|run| run.memory as f64 / 1e6));
        let times: Vec<f64> = runs.iter().map(|run| run.seconds).collect();
        let (low, high) = times.iter().fold((f64::MAX, 0.0f64), |(low, high), &t| (low.min(t), high.max(t)));
        if let (true, Some(middle)) = (runs.len() > 1, median(times)) {
            self.numbers.insert("spread", (high - low) / middle);
        }
    }

    /// Add the numbers that reports have at known paths.
    fn add_reported(&mut self, runs: &[Run], first: &Run) {
        for (name, source) in NUMBERS {
            match source {
                Of::Runs(path) => self.add_median(name, runs.iter().filter_map(|run| number_at(&run.report, path))),
                Of::First(path) => self.add_median(name, number_at(&first.report, path).into_iter()),
                Of::Other => {}
            }
        }
    }

    /// Add sums and maxima over the pairs of a report.
    fn add_pairs(&mut self, report: &Value) {
        let pairs = items(&report["pairs"]);
        if pairs.is_empty() {
            return;
        }
        let number = |pair: &Value, key: &str| pair[key].as_f64().unwrap_or(f64::NAN);
        // the coupling of a pair is the geometric mean of those of its sides
        let theta = |pair: &Value| items(&pair["theta"]).iter().filter_map(Value::as_f64).product::<f64>().sqrt();
        self.numbers.insert("points", pairs.iter().map(|pair| number(pair, "points")).sum());
        self.numbers.insert("theta", pairs.iter().map(theta).fold(0.0, f64::max));
        let peaks = pairs.iter().map(|pair| number(pair, "peak_pressure"));
        self.numbers.insert("peak_pressure", peaks.fold(0.0, f64::max));
    }

    /// Add the seconds of one linear factor-and-solve of all bodies.
    ///
    /// The start of the run solves with very stiff springs, which takes an iterative solver longer. The sweep therefore has the share of the
    /// solve time that it has of the inner iterations, or without these of the body solves: one sweep solves each body once.
    fn add_linear(&mut self, run: &Run) {
        let all = self.number("inner_iterations").unwrap_or(0.0);
        let solve = match (run.last_sweep, self.number("solve_seconds")) {
            (Some(sweep), Some(seconds)) if all > 0.0 => seconds * sweep / all,
            (_, Some(seconds)) => {
                let body_solves = number_at(&run.report, "/body_solves").unwrap_or(0.0);
                seconds / body_solves * items(&run.report["bodies"]).len() as f64
            }
            _ => f64::NAN,
        };
        let linear = number_at(&run.report, "/inner_times/first").unwrap_or(f64::NAN) + solve;
        self.numbers.extend(linear.is_finite().then_some(("linear_seconds", linear)));
    }

    /// Add the largest errors of the bodies that have a closed form.
    fn add_exact_errors(&mut self, report: &Value) {
        let largest =
            |key: &str| items(&report["bodies"]).iter().filter_map(|body| body[key].as_f64()).reduce(f64::max);
        self.displacement_error = largest("error_l2");
        for name in ["error_h1", "error_energy"] {
            self.numbers.extend(largest(name).map(|error| (name, error)));
        }
    }

    /// Return the row of a case whose scene is refused.
    pub fn refused(case: &Case, error: &Error) -> Self {
        let message = match error.advice() {
            Some(help) => format!("error: {}; help: {help}", error.message()),
            None => format!("error: {}", error.message()),
        };
        Self::empty(case, "refused", &message)
    }

    /// Return the row of a case that is not run.
    pub fn skipped(case: &Case, why: &str) -> Self {
        Self::empty(case, SKIPPED, why)
    }

    /// Return whether the run did not end in time.
    pub fn is_late(&self) -> bool {
        self.status == "timeout"
    }

    fn empty(case: &Case, status: &str, message: &str) -> Self {
        Self {
            key: case.key.clone(),
            runs: 0,
            status: status.to_owned(),
            message: message.to_owned(),
            method: case.requested_method().to_owned(),
            numbers: BTreeMap::new(),
            error_of: String::new(),
            inputs: String::new(),
            displacement_error: None,
        }
    }

    /// Return whether the run ended as it should.
    pub fn is_good(&self) -> bool {
        is_good(&self.status)
    }

    /// Return whether it is one linear factor-and-solve.
    pub fn is_linear(&self) -> bool {
        self.status == LINEAR
    }

    /// Return the number of a column.
    pub fn number(&self, name: &str) -> Option<f64> {
        self.numbers.get(name).copied()
    }

    /// Set the error, and the text that says what it is measured in and against.
    pub fn set_error(&mut self, error: f64, what: &str) {
        self.numbers.insert("error", error);
        self.error_of = what.to_owned();
    }

    /// Return the row as a line for the terminal.
    pub fn line(&self, label: &str, is_new: bool) -> String {
        let mut line = format!("{label}: {}", self.status);
        if !self.is_good() && !self.message.is_empty() {
            line += &format!(" ({})", self.message);
        }
        if let Some(time) = self.number("seconds") {
            line += &format!(", {} s", seconds(time));
        }
        if let (Some(dofs), Some(sweeps)) = (self.number("dofs"), self.number("sweeps")) {
            line += &format!(", {dofs} dofs, {sweeps} sweeps");
        }
        if let Some(error) = self.number("error") {
            line += &format!(", error {}", sci(error, 2));
        }
        if is_new { line } else { line + " (kept)" }
    }

    /// Return the row as fields of the file.
    fn fields(&self) -> Vec<String> {
        let mut fields = self.key.clone();
        fields.extend([self.runs.to_string(), self.status.clone(), self.message.clone(), self.method.clone()]);
        fields.extend(
            NUMBERS.iter().map(|(name, _)| self.number(name).map_or(String::new(), |value| format!("{value}"))),
        );
        fields.extend([self.error_of.clone(), self.inputs.clone()]);
        fields
    }
}

fn is_good(status: &str) -> bool {
    matches!(status, "converged" | "roundoff-limited" | LINEAR)
}

/// Return the number at a path of a report.
fn number_at(report: &Value, path: &str) -> Option<f64> {
    report.pointer(path).and_then(Value::as_f64)
}

/// Return the items of a list of a report; none if it is no list.
fn items(list: &Value) -> &[Value] {
    list.as_array().map_or(&[], Vec::as_slice)
}

/// Return the median of some numbers, which is the mean of the two middle ones if their count is even.
pub(super) fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    match values.len() {
        0 => None,
        count if count.is_multiple_of(2) => Some(0.5 * (values[middle - 1] + values[middle])),
        _ => Some(values[middle]),
    }
}

impl<'a> Table<'a> {
    /// Open the file of a plan. With `--resume` its rows are read first, if they were made with the same settings.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn open(folder: &'a Folder, plan: &Plan, request: &Request, reference: &References) -> Result<Self> {
        let mut columns = plan.columns();
        columns.extend(TEXTS.map(str::to_owned));
        columns.extend(NUMBERS.map(|(name, _)| name.to_owned()));
        columns.extend(LAST.map(str::to_owned));
        let settings = format!(
            "winkler {}\n--set {:?}\nPETSc {:?} {:?}\n--repeat {}\n--timeout {}\n--against {:?} {}\n",
            env!("CARGO_PKG_VERSION"),
            request.all_overrides(),
            request.petsc,
            std::env::var_os("PETSC_OPTIONS").unwrap_or_default(),
            request.repeat,
            request.timeout,
            request.against,
            reference.digest()
        );
        let path = folder.path().join(SETTINGS);
        let is_known = request.resume && crate::file::read(&path).is_ok_and(|old| old == settings.as_bytes());
        let mut old = if is_known { read(folder, &columns) } else { Vec::new() };
        old.retain(|row| !matches!(row.status.as_str(), "killed" | "failed" | SKIPPED));
        folder.write(SETTINGS, |out| out.write_all(settings.as_bytes()))?;
        // the file has the old rows from the start, so that a benchmark that is killed loses none
        let file = RowFile::create(folder, FILE, &columns, &old.iter().map(Row::fields).collect::<Vec<_>>())?;
        Ok(Self { folder, columns, rows: Vec::new(), old, file })
    }

    /// Return the row of a case that an earlier benchmark made from the same inputs. Scenes, data and meshes may have been edited meanwhile.
    pub fn old_row(&self, case: &Case, inputs: Option<&str>) -> Option<Row> {
        let is_same = |row: &&Row| row.key == case.key && Some(row.inputs.as_str()) == inputs;
        self.old.iter().find(is_same).cloned()
    }

    /// Return whether a case differs only by its mesh from a row that did not end in time. Lists of meshes go from coarse to fine.
    pub fn is_beyond(&self, plan: &Plan, case: &Case) -> bool {
        let is_mesh =
            |column: usize| column > 0 && plan.keys.get(column - 1).is_some_and(|key| key.starts_with("mesh."));
        let like = |row: &Row| (0..row.key.len()).all(|column| is_mesh(column) || row.key[column] == case.key[column]);
        self.rows.iter().any(|row| row.is_late() && like(row))
    }

    /// Add a row. A new row is written at once, so that it is kept whatever comes next. Return the message that the file lacks rows, once.
    pub fn add(&mut self, row: Row, is_new: bool) -> Option<String> {
        if is_new {
            self.file.push(&row.fields());
        }
        self.rows.push(row);
        self.file.complaint()
    }

    /// Write all rows again, with the numbers that need the whole table.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn rewrite(&self) -> Result<()> {
        let fill = |out: &mut dyn std::io::Write| {
            let mut file = csv::Writer::from_writer(out);
            file.write_record(&self.columns)?;
            for row in &self.rows {
                file.write_record(row.fields())?;
            }
            file.flush()
        };
        self.folder.write(FILE, fill)
    }

    /// Return the folder of the results of all runs.
    pub fn runs(&self) -> PathBuf {
        self.folder.path().join(RUNS)
    }

    /// Add to every row the number of linear factor-and-solves of the same bodies that take as long as its set-up and iteration.
    ///
    /// Their reference cost is that of the fastest solver with a row of the method `linear`.
    pub fn compare_with_linear(&mut self) {
        let Some(solver) = self.columns.iter().position(|column| column == "solver") else { return };
        let same = |a: &Row, b: &Row| (0..a.key.len()).all(|k| k == solver || k == solver + 1 || a.key[k] == b.key[k]);
        let linear: Vec<Row> = self.rows.iter().filter(|row| row.is_linear()).cloned().collect();
        for row in self.rows.iter_mut().filter(|row| row.is_good() && !row.is_linear()) {
            let costs =
                linear.iter().filter(|other| same(row, other)).filter_map(|other| other.number("linear_seconds"));
            let reference = costs.fold(f64::INFINITY, f64::min);
            let own: f64 = ["set_up_seconds", "iterate_seconds"].iter().filter_map(|name| row.number(name)).sum();
            if reference.is_finite() && reference > 0.0 {
                row.numbers.insert("linear_solves", own / reference);
            }
        }
    }
}

/// Return the rows of the file in a folder that has these columns; none if it has others.
fn read(folder: &Folder, columns: &[String]) -> Vec<Row> {
    let Ok(bytes) = crate::file::read(&folder.path().join(FILE)) else { return Vec::new() };
    let mut file = csv::Reader::from_reader(bytes.as_slice());
    if !file.headers().is_ok_and(|header| header.iter().eq(columns)) {
        return Vec::new();
    }
    // the last row of a benchmark that was killed may be incomplete
    file.records().map_while(|record| record.ok()).map(|record| row(&record)).collect()
}

/// Return the row of a record of the file.
fn row(record: &csv::StringRecord) -> Row {
    let keys = record.len() - NUMBERS.len() - TEXTS.len() - LAST.len();
    let numbers = NUMBERS.iter().zip(keys + TEXTS.len()..);
    Row {
        key: record.iter().take(keys).map(str::to_owned).collect(),
        runs: record[keys].parse().unwrap_or(0),
        status: record[keys + 1].to_owned(),
        message: record[keys + 2].to_owned(),
        method: record[keys + 3].to_owned(),
        numbers: numbers.filter_map(|(&(name, _), k)| Some((name, record[k].parse().ok()?))).collect(),
        error_of: record[record.len() - 2].to_owned(),
        inputs: record[record.len() - 1].to_owned(),
        displacement_error: None,
    }
}

#[cfg(test)]
mod tests {
    use super::median;

    #[test]
    fn the_median_is_the_middle() {
        assert_eq!(median(vec![5.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(vec![4.0, 1.0, 2.0, 100.0]), Some(3.0));
        assert_eq!(median(Vec::new()), None);
    }
}
