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

/// Columns of words and of the number of runs, after the key.
const WORDS: [&str; 4] = ["runs", "status", "message", "method"];

/// Where a number of a row comes from.
enum Of {
    /// The reports of all runs, of which it is the median.
    Runs(&'static str),
    /// The report of the first run.
    First(&'static str),
    /// Anything else.
    Other,
}

/// Columns with a number, after the words.
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

/// One combination and what was measured.
#[derive(Debug, Clone)]
pub(super) struct Row {
    /// Columns of the plan.
    pub key: Vec<String>,
    runs: usize,
    /// How it ended.
    pub status: String,
    message: String,
    /// The method that ran; the one that was asked for where nothing ran.
    pub method: String,
    numbers: BTreeMap<&'static str, f64>,
    /// What the error is measured in and against; empty without an error.
    pub error_of: String,
    /// Digest of what the run computed with; empty if that is not known.
    pub inputs: String,
    /// Relative error of the displacements that the run itself told, where the scene has their closed form.
    pub displacement_error: Option<f64>,
}

/// All rows and their file.
pub(super) struct Table<'a> {
    folder: &'a Folder,
    columns: Vec<String>,
    /// Rows so far.
    pub rows: Vec<Row>,
    /// Rows of an earlier benchmark that are kept.
    old: Vec<Row>,
    file: RowFile,
}

/// The file of the rows.
const FILE: &str = "bench.csv";
/// Status of a case that was not run.
const SKIPPED: &str = "skipped";
/// What the rows of the folder were made with.
const SETTINGS: &str = "bench.txt";

impl Row {
    /// The row of some runs of a case: times are medians, counts those of the first run, which all share.
    pub fn new(case: &Case, runs: &[Run]) -> Self {
        let worst = runs.iter().find(|run| !is_good(&run.status));
        let Some(first) = worst.or(runs.first()) else {
            return Self::empty(case, "failed", "nothing was run");
        };
        // such a run stops at its one update, as it should
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
        let mut put = |name: &'static str, of: &dyn Fn(&Run) -> Option<f64>| {
            let values: Vec<f64> = runs.iter().filter_map(of).filter(|value| value.is_finite()).collect();
            if let Some(middle) = median(values) {
                row.numbers.insert(name, middle);
            }
        };
        put("seconds", &|run| Some(run.seconds));
        put("cpu_seconds", &|run| Some(run.cpu));
        put("memory_mb", &|run| Some(run.memory as f64 / 1e6));
        let at = |run: &Run, path: &str| run.report.pointer(path).and_then(Value::as_f64);
        for (name, of) in NUMBERS {
            match of {
                Of::Runs(path) => put(name, &|run| at(run, path)),
                Of::First(path) => put(name, &|_| at(first, path)),
                Of::Other => {}
            }
        }
        let pairs = first.report["pairs"].as_array().map_or(&[][..], Vec::as_slice);
        if !pairs.is_empty() {
            let of = |pair: &Value, key: &str| pair[key].as_f64().unwrap_or(f64::NAN);
            let theta = |pair: &Value| {
                let both = pair["theta"].as_array().map_or(&[][..], Vec::as_slice);
                both.iter().filter_map(Value::as_f64).product::<f64>().sqrt()
            };
            row.numbers.insert("points", pairs.iter().map(|pair| of(pair, "points")).sum());
            row.numbers.insert("theta", pairs.iter().map(theta).fold(0.0, f64::max));
            row.numbers.insert("peak_pressure", pairs.iter().map(|pair| of(pair, "peak_pressure")).fold(0.0, f64::max));
        }
        let times: Vec<f64> = runs.iter().map(|run| run.seconds).collect();
        if let (true, Some(middle)) = (runs.len() > 1, median(times.clone())) {
            let (low, high) = times.iter().fold((f64::MAX, 0.0f64), |(low, high), &t| (low.min(t), high.max(t)));
            row.numbers.insert("spread", (high - low) / middle);
        }
        if case.is_linear() {
            let body_solves = at(first, "/body_solves").unwrap_or(0.0);
            let bodies = first.report["bodies"].as_array().map_or(0, Vec::len) as f64;
            let each = |time: &str, count: f64| row.number(time).map_or(f64::NAN, |time| time / count * bodies);
            let all = row.number("inner_iterations").unwrap_or(0.0);
            // the start solves with very stiff springs, which takes an iterative solver longer; one sweep solves each body once
            let solve = match (first.last_sweep, row.number("solve_seconds")) {
                (Some(sweep), Some(seconds)) if all > 0.0 => seconds * sweep / all,
                _ => each("solve_seconds", body_solves),
            };
            let linear = at(first, "/inner_times/first").unwrap_or(f64::NAN) + solve;
            row.numbers.extend(linear.is_finite().then_some(("linear_seconds", linear)));
        }
        // of the bodies that have a closed form, the worst
        let bodies = first.report["bodies"].as_array().map_or(&[][..], Vec::as_slice);
        let worst = |key: &str| bodies.iter().filter_map(|body| body[key].as_f64()).reduce(f64::max);
        row.displacement_error = worst("error_l2");
        for name in ["error_h1", "error_energy"] {
            row.numbers.extend(worst(name).map(|error| (name, error)));
        }
        row
    }

    /// The row of a case whose scene is refused.
    pub fn refused(case: &Case, error: &Error) -> Self {
        let message = match error.advice() {
            Some(help) => format!("error: {}; help: {help}", error.message()),
            None => format!("error: {}", error.message()),
        };
        Self::empty(case, "refused", &message)
    }

    /// The row of a case that is not run.
    pub fn skipped(case: &Case, why: &str) -> Self {
        Self::empty(case, SKIPPED, why)
    }

    /// Whether the run did not end in time.
    pub fn is_late(&self) -> bool {
        self.status == "timeout"
    }

    fn empty(case: &Case, status: &str, message: &str) -> Self {
        Self {
            key: case.key.clone(),
            runs: 0,
            status: status.to_owned(),
            message: message.to_owned(),
            method: case.asked().to_owned(),
            numbers: BTreeMap::new(),
            error_of: String::new(),
            inputs: String::new(),
            displacement_error: None,
        }
    }

    /// Whether the run came to its end as it should.
    pub fn is_good(&self) -> bool {
        is_good(&self.status)
    }

    /// Whether it is one linear factor-and-solve.
    pub fn is_linear(&self) -> bool {
        self.status == LINEAR
    }

    /// A measured number.
    pub fn number(&self, name: &str) -> Option<f64> {
        self.numbers.get(name).copied()
    }

    /// Sets the error and what it is measured in and against.
    pub fn set_error(&mut self, error: f64, what: &str) {
        self.numbers.insert("error", error);
        self.error_of = what.to_owned();
    }

    /// The row as a line for the terminal.
    pub fn line(&self, label: &str, is_new: bool) -> String {
        let number = |name: &str| self.number(name);
        let mut line = format!("{label}: {}", self.status);
        if !self.is_good() && !self.message.is_empty() {
            line += &format!(" ({})", self.message);
        }
        if let Some(time) = number("seconds") {
            line += &format!(", {} s", seconds(time));
        }
        if let (Some(dofs), Some(sweeps)) = (number("dofs"), number("sweeps")) {
            line += &format!(", {dofs} dofs, {sweeps} sweeps");
        }
        if let Some(error) = number("error") {
            line += &format!(", error {}", sci(error, 2));
        }
        if is_new { line } else { line + " (kept)" }
    }

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

/// The middle of some numbers, the mean of the two middle ones if their count is even.
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
    /// Opens the file of a plan. With `--resume` the rows that it has already are read first, if they were made with the
    /// same settings.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn open(folder: &'a Folder, plan: &Plan, request: &Request, reference: &References) -> Result<Self> {
        let mut columns = plan.columns();
        columns.extend(WORDS.map(str::to_owned));
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
        // rows that are kept are there all the time: a benchmark that is killed loses none
        let file = RowFile::create(folder, FILE, &columns, &old.iter().map(Row::fields).collect::<Vec<_>>())?;
        Ok(Self { folder, columns, rows: Vec::new(), old, file })
    }

    /// The row of a case that an earlier benchmark made from the same inputs: scenes, data and meshes may have been edited meanwhile.
    pub fn kept(&self, case: &Case, inputs: Option<&str>) -> Option<Row> {
        let is_same = |row: &&Row| row.key == case.key && Some(row.inputs.as_str()) == inputs;
        self.old.iter().find(is_same).cloned()
    }

    /// Whether a case differs by its mesh alone from a row that did not end in time: lists of meshes go from coarse to fine.
    pub fn is_beyond(&self, plan: &Plan, case: &Case) -> bool {
        let is_mesh =
            |column: usize| column > 0 && plan.keys.get(column - 1).is_some_and(|key| key.starts_with("mesh."));
        let like = |row: &Row| (0..row.key.len()).all(|column| is_mesh(column) || row.key[column] == case.key[column]);
        self.rows.iter().any(|row| row.is_late() && like(row))
    }

    /// Adds a row, and writes it at once if it is new: what was measured is kept whatever comes next. Why the file lacks rows, once.
    pub fn add(&mut self, row: Row, is_new: bool) -> Option<String> {
        if is_new {
            self.file.push(&row.fields());
        }
        self.rows.push(row);
        self.file.complaint()
    }

    /// Writes all rows anew, with what only the whole table could tell.
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

    /// Folder of the results of all runs.
    pub fn runs(&self) -> PathBuf {
        self.folder.path().join(RUNS)
    }

    /// Place of a column of the key.
    fn column(&self, name: &str) -> Option<usize> {
        self.columns.iter().position(|column| column == name)
    }

    /// Says of every row how many linear factor-and-solves of the same bodies its set-up and iteration would pay for: by the
    /// fastest solver with a row of the method `linear`.
    pub fn compare_with_linear(&mut self) {
        let Some(solver) = self.column("solver") else { return };
        let same = |a: &Row, b: &Row| (0..a.key.len()).all(|k| k == solver || k == solver + 1 || a.key[k] == b.key[k]);
        let linear: Vec<Row> = self.rows.iter().filter(|row| row.is_linear()).cloned().collect();
        for row in self.rows.iter_mut().filter(|row| row.is_good() && !row.is_linear()) {
            let yard =
                linear.iter().filter(|other| same(row, other)).filter_map(|other| other.number("linear_seconds"));
            let (yard, own) = (yard.fold(f64::INFINITY, f64::min), ["set_up_seconds", "iterate_seconds"]);
            let own: f64 = own.iter().filter_map(|name| row.number(name)).sum();
            if yard.is_finite() && yard > 0.0 {
                row.numbers.insert("linear_solves", own / yard);
            }
        }
    }
}

/// The rows of the file in a folder that has these columns; none if it has others.
fn read(folder: &Folder, columns: &[String]) -> Vec<Row> {
    let Ok(bytes) = crate::file::read(&folder.path().join(FILE)) else { return Vec::new() };
    let mut file = csv::Reader::from_reader(bytes.as_slice());
    if !file.headers().is_ok_and(|header| header.iter().eq(columns)) {
        return Vec::new();
    }
    let keys = columns.len() - NUMBERS.len() - WORDS.len() - LAST.len();
    let row = |record: csv::StringRecord| {
        let numbers = NUMBERS.iter().enumerate();
        let numbers = numbers.filter_map(|(k, &(name, _))| Some((name, record[keys + WORDS.len() + k].parse().ok()?)));
        Row {
            key: record.iter().take(keys).map(str::to_owned).collect(),
            runs: record[keys].parse().unwrap_or(0),
            status: record[keys + 1].to_owned(),
            message: record[keys + 2].to_owned(),
            method: record[keys + 3].to_owned(),
            numbers: numbers.collect(),
            error_of: record[columns.len() - 2].to_owned(),
            inputs: record[columns.len() - 1].to_owned(),
            displacement_error: None,
        }
    };
    // the last row of a benchmark that was killed may not be whole
    file.records().map_while(|record| record.ok()).map(row).collect()
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
