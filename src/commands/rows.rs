//! The rows of `sweep` and `bench`: what a run was and what it took.

use crate::output::tables::Cell;
use crate::output::{sci, seconds};
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// What is known of the run of a case, or of several runs of it. Numbers that a run does not have are empty fields.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Row {
    /// Status of the report, or why there is none, and the status in words; the method that ran.
    pub status: String,
    pub message: String,
    pub method: String,
    /// Degrees of freedom of all bodies, and contact points of all pairs.
    pub dofs: Option<usize>,
    pub points: Option<usize>,
    /// Counters and numbers of the report.
    pub iterations: Option<usize>,
    pub sweeps: Option<usize>,
    pub inner_iterations: Option<usize>,
    pub factorizations: Option<usize>,
    pub dense_factorizations: Option<usize>,
    pub residual: Option<f64>,
    pub increment: Option<f64>,
    #[serde(rename = "F1")]
    pub f1: Option<f64>,
    /// Largest pressure of all pairs.
    pub peak_pressure: Option<f64>,
    /// Wall seconds: of the process in `bench`, of the run in `sweep`; then those of its phases, and the parts of
    /// set-up and iteration in factorisations and solves, summed over the bodies.
    pub seconds: Option<f64>,
    pub mesh_seconds: Option<f64>,
    pub discretize_seconds: Option<f64>,
    pub set_up_seconds: Option<f64>,
    pub iterate_seconds: Option<f64>,
    pub factor_seconds: Option<f64>,
    pub solve_seconds: Option<f64>,
    /// Peak resident memory, 10^6 bytes: of the largest process in `bench`, so far in `sweep`.
    pub memory_mb: Option<f64>,
    /// Errors of the displacements against `exact`, the largest of the bodies; relative error in L2, and what it is
    /// measured in and against.
    pub error_h1: Option<f64>,
    pub error_energy: Option<f64>,
    pub error: Option<f64>,
    pub error_of: String,
    /// Runs of the case in `bench`, CPU seconds of all ranks, and the largest less the shortest wall time over the
    /// median.
    pub runs: usize,
    pub cpu_seconds: Option<f64>,
    pub spread: Option<f64>,
}

impl Row {
    /// Return the row of a case without results.
    pub fn unsolved(status: &str, message: &str) -> Self {
        Self { status: status.to_owned(), message: message.to_owned(), ..Self::default() }
    }

    /// Return what a report says.
    pub fn of_report(report: &Value) -> Self {
        let number = |path: &str| report.pointer(path).and_then(Value::as_f64);
        let pairs = report["pairs"].as_array().filter(|pairs| !pairs.is_empty());
        let own = match Self::deserialize(report) {
            Ok(own) => own,
            Err(cause) => return Self::unsolved("failed", &format!("its report cannot be read: {cause}")),
        };
        Self {
            points: pairs.map(|pairs| pairs.iter().filter_map(|pair| pair["points"].as_u64()).sum::<u64>() as usize),
            peak_pressure: largest(&report["pairs"], "peak_pressure"),
            seconds: number("/times/total"),
            mesh_seconds: number("/times/mesh"),
            discretize_seconds: number("/times/discretize"),
            set_up_seconds: number("/times/set-up"),
            iterate_seconds: number("/times/iterate"),
            factor_seconds: number("/inner_times/factor"),
            solve_seconds: number("/inner_times/solve"),
            memory_mb: number("/memory/iterate"),
            error: largest(&report["bodies"], "error_l2"),
            error_h1: largest(&report["bodies"], "error_h1"),
            error_energy: largest(&report["bodies"], "error_energy"),
            error_of: largest(&report["bodies"], "error_l2")
                .map_or(String::new(), |_| "displacement, exact".to_owned()),
            runs: 1,
            ..own
        }
    }

    /// Set the error, and what it is measured in and against.
    pub fn set_error(&mut self, error: f64, of: impl Into<String>) {
        (self.error, self.error_of) = (Some(error), of.into());
    }

    /// Return whether the run ended as it should.
    pub fn is_good(&self) -> bool {
        matches!(self.status.as_str(), "converged" | "roundoff-limited")
    }

    /// Return the fields of the row.
    pub fn fields(&self) -> Vec<Cell> {
        let mut csv = csv::Writer::from_writer(Vec::new());
        // writing to memory does not fail
        let _ = csv.serialize(self);
        let bytes = csv.into_inner().unwrap_or_default();
        let mut lines = csv::ReaderBuilder::new().has_headers(false).from_reader(&bytes[..]).into_records().flatten();
        let (names, texts) = (lines.next().unwrap_or_default(), lines.next().unwrap_or_default());
        names.iter().zip(&texts).map(|(name, text)| (name.to_owned(), text.to_owned())).collect()
    }

    /// Return the row as a line for the terminal.
    pub fn line(&self, label: &str) -> String {
        let mut line = format!("{label}: {}", self.status);
        if !self.is_good() && !self.message.is_empty() {
            line += &format!(" ({})", self.message);
        }
        if let Some(time) = self.seconds {
            line += &format!(", {} s", seconds(time));
        }
        if let (Some(dofs), Some(iterations)) = (self.dofs, self.iterations) {
            let residual = sci(self.residual.unwrap_or(f64::NAN), 2);
            line += &format!(", {dofs} dofs, {iterations} iterations, residual {residual}");
        }
        if let Some(error) = self.error {
            line += &format!(", error {} ({})", sci(error, 2), self.error_of);
        }
        line
    }
}

/// Return the largest number of this name in a list of bodies or pairs.
fn largest(list: &Value, key: &str) -> Option<f64> {
    list.as_array()?.iter().filter_map(|item| item[key].as_f64()).reduce(f64::max)
}

/// Return rows of texts as a table with columns to the right, all but the first `left` ones.
pub fn aligned(rows: &[Vec<String>], left: usize) -> String {
    let count = rows.first().map_or(0, Vec::len);
    let width = |k: usize| rows.iter().map(|row| row[k].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..count).map(width).collect();
    let cell = |(k, text): (usize, &String)| {
        if k < left { format!("{text:<0$}", widths[k]) } else { format!("{text:>0$}", widths[k]) }
    };
    let line = |row: &Vec<String>| row.iter().enumerate().map(cell).collect::<Vec<_>>().join("  ");
    rows.iter().map(|row| line(row).trim_end().to_owned()).collect::<Vec<_>>().join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_stands_under_its_columns() {
        let report = serde_json::json!({
            "status": "converged", "message": "a, b", "residual": 1e-9, "dofs": 12,
            "pairs": [{ "points": 3, "peak_pressure": null }, { "points": 4 }],
        });
        let row = Row::of_report(&report);
        let value = |name: &str| row.fields().into_iter().find(|(column, _)| column == name).expect("a column").1;
        let names = ["status", "message", "dofs", "points", "residual", "F1", "peak_pressure"];
        assert_eq!(names.map(value), ["converged", "a, b", "12", "7", "1e-9", "", ""]);
    }

    #[test]
    fn columns_are_aligned() {
        let rows = [["a", "bb"], ["ccc", "d"]].map(|row| row.map(str::to_owned).to_vec());
        assert_eq!(aligned(&rows, 1), "a    bb\nccc   d");
    }
}
