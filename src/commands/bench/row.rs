//! The row of a case: what was measured in its runs.

use super::plan::{Case, LINEAR};
use super::process::Run;
use crate::error::Error;
use crate::output::{sci, seconds};
use serde_json::Value;
use std::collections::BTreeMap;

/// Columns of texts and of the number of runs, after the key.
const TEXTS: [&str; 4] = ["runs", "status", "message", "method"];

/// A function that returns a number of the runs of a case, if they have it.
type Number = fn(&Runs) -> Option<f64>;

/// Columns with a number, after the texts. Times are medians over the runs; counters are those of one run, and all runs have the same. The
/// numbers that need the whole table, or tables of contact, are set later.
const NUMBERS: [(&str, Number); 25] = [
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
    ("error_h1", |runs| runs.largest("error_h1")),
    ("error_energy", |runs| runs.largest("error_energy")),
];

/// Columns after the numbers.
const LAST: [&str; 2] = ["error_of", "inputs"];

/// The status of a case that was not run.
pub(super) const SKIPPED: &str = "skipped";

/// The row of a case.
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

impl Row {
    /// Return the names of its columns after the key.
    pub fn columns() -> impl Iterator<Item = &'static str> {
        TEXTS.into_iter().chain(NUMBERS.map(|(name, _)| name)).chain(LAST)
    }

    /// Return the row of some runs of a case.
    pub fn new(case: &Case, runs: &[Run]) -> Self {
        let worst = runs.iter().find(|run| !is_good(&run.status));
        let Some(shown) = worst.or(runs.first()) else {
            return Self::empty(case, "failed", "nothing was run");
        };
        // such a run makes one update, and ends as it should
        let linear = case.is_linear() && shown.status == "iteration-limit";
        let (status, message) = if linear {
            (LINEAR, "one factorisation and one solve")
        } else {
            (shown.status.as_str(), shown.message.as_str())
        };
        let mut row = Self::empty(case, status, message);
        row.runs = runs.len();
        if let (false, Some(method)) = (case.is_linear(), shown.report["method"].as_str()) {
            row.method = method.to_owned();
        }
        let runs = Runs { all: runs, shown, is_linear: case.is_linear() };
        let numbers = NUMBERS.iter().map(|(name, number)| (*name, number(&runs).unwrap_or(f64::NAN)));
        row.numbers = numbers.filter(|(_, value)| value.is_finite()).collect();
        row.displacement_error = runs.largest("error_l2");
        row
    }

    /// Return the row of a case whose scene is refused.
    pub fn refused(case: &Case, error: &Error) -> Self {
        let help = error.advice().map_or(String::new(), |help| format!("; help: {help}"));
        Self::empty(case, "refused", &format!("error: {}{help}", error.message()))
    }

    /// Return the row of a case that is not run.
    pub fn skipped(case: &Case, why: &str) -> Self {
        Self::empty(case, SKIPPED, why)
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

    /// Return whether the run did not end in time.
    pub fn is_late(&self) -> bool {
        self.status == "timeout"
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

    /// Set the number of linear factor-and-solves that take as long as set-up and iteration, from the seconds of one of them.
    pub fn set_linear_solves(&mut self, linear_seconds: f64) {
        let own: f64 = ["set_up_seconds", "iterate_seconds"].iter().filter_map(|name| self.number(name)).sum();
        self.numbers.insert("linear_solves", own / linear_seconds);
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
    pub fn fields(&self) -> Vec<String> {
        let texts = [self.runs.to_string(), self.status.clone(), self.message.clone(), self.method.clone()];
        let numbers =
            NUMBERS.iter().map(|(name, _)| self.number(name).map_or(String::new(), |value| value.to_string()));
        let last = [self.error_of.clone(), self.inputs.clone()];
        self.key.iter().cloned().chain(texts).chain(numbers).chain(last).collect()
    }

    /// Return the row of a record of the file.
    pub fn parse(record: &csv::StringRecord) -> Self {
        let keys = record.len() - Self::columns().count();
        let numbers = NUMBERS.iter().zip(keys + TEXTS.len()..);
        Self {
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
}

fn is_good(status: &str) -> bool {
    matches!(status, "converged" | "roundoff-limited" | LINEAR)
}

/// The runs of a case.
struct Runs<'a> {
    all: &'a [Run],
    /// The first that failed, else the first.
    shown: &'a Run,
    is_linear: bool,
}

impl Runs<'_> {
    /// Return the median of a number over the runs that have it.
    fn median(&self, number: impl Fn(&Run) -> Option<f64>) -> Option<f64> {
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

    /// Return the largest number of this name of the bodies that have it.
    fn largest(&self, key: &str) -> Option<f64> {
        items(&self.shown.report["bodies"]).iter().filter_map(|body| body[key].as_f64()).reduce(f64::max)
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

/// Return the items of a list of a report; none if it is no list.
fn items(list: &Value) -> &[Value] {
    list.as_array().map_or(&[], Vec::as_slice)
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
