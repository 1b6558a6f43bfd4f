//! The rows of `sweep` and `bench`: what a run was and what it took.

use crate::output::tables::{Cell, number};
use crate::output::{BodyReport, Report, sci, seconds};

/// What is known of the run of a case, or of several runs of it. Numbers that a run does not have are empty fields.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct CaseRow {
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

impl From<&Report> for CaseRow {
    fn from(report: &Report) -> Self {
        let largest = |of: fn(&BodyReport) -> Option<f64>| report.bodies.iter().filter_map(of).reduce(f64::max);
        let time = |phase: &str| report.times.get(phase).copied();
        let error = largest(|body| body.error_l2);
        Self {
            status: report.status.to_string(),
            message: report.message.clone(),
            method: report.method.clone(),
            dofs: Some(report.dofs),
            points: report.pairs.iter().map(|pair| pair.points).reduce(|sum, points| sum + points),
            iterations: Some(report.iterations),
            sweeps: Some(report.sweeps),
            inner_iterations: Some(report.inner_iterations),
            factorizations: Some(report.factorizations),
            dense_factorizations: Some(report.dense_factorizations),
            residual: report.residual,
            increment: report.increment,
            f1: report.f1,
            peak_pressure: report.results().map(|pair| pair.peak_pressure).reduce(f64::max),
            seconds: time("total"),
            mesh_seconds: time("mesh"),
            discretize_seconds: time("discretize"),
            set_up_seconds: time("set-up"),
            iterate_seconds: time("iterate"),
            factor_seconds: Some(report.inner_times.factor),
            solve_seconds: Some(report.inner_times.solve),
            memory_mb: report.memory.get("iterate").copied(),
            error_h1: largest(|body| body.error_h1),
            error_energy: largest(|body| body.error_energy),
            error_of: error.map_or(String::new(), |_| "displacement, exact".to_owned()),
            error,
            runs: 1,
            cpu_seconds: None,
            spread: None,
        }
    }
}

impl CaseRow {
    /// Return the row of a case without results.
    pub fn unsolved(status: &str, message: &str) -> Self {
        Self { status: status.to_owned(), message: message.to_owned(), ..Self::default() }
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
        let text = |column: &str, text: &str| (column.to_owned(), text.to_owned());
        let count = |(column, value): (&str, Option<usize>)| {
            (column.to_owned(), value.map_or(String::new(), |value| value.to_string()))
        };
        let counts = [
            ("dofs", self.dofs),
            ("points", self.points),
            ("iterations", self.iterations),
            ("sweeps", self.sweeps),
            ("inner_iterations", self.inner_iterations),
            ("factorizations", self.factorizations),
            ("dense_factorizations", self.dense_factorizations),
        ];
        let numbers = [
            ("residual", self.residual),
            ("increment", self.increment),
            ("F1", self.f1),
            ("peak_pressure", self.peak_pressure),
            ("seconds", self.seconds),
            ("mesh_seconds", self.mesh_seconds),
            ("discretize_seconds", self.discretize_seconds),
            ("set_up_seconds", self.set_up_seconds),
            ("iterate_seconds", self.iterate_seconds),
            ("factor_seconds", self.factor_seconds),
            ("solve_seconds", self.solve_seconds),
            ("memory_mb", self.memory_mb),
            ("error_h1", self.error_h1),
            ("error_energy", self.error_energy),
            ("error", self.error),
        ];
        let mut fields =
            vec![text("status", &self.status), text("message", &self.message), text("method", &self.method)];
        fields.extend(counts.map(count));
        fields.extend(numbers.map(|(column, value)| number(column, value)));
        fields.extend([text("error_of", &self.error_of), count(("runs", Some(self.runs)))]);
        fields.extend([number("cpu_seconds", self.cpu_seconds), number("spread", self.spread)]);
        fields
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
    use crate::output::{PairReport, PairResult};

    #[test]
    fn a_row_stands_under_its_columns() {
        let pair = |points: usize, peak_pressure: f64| PairReport {
            points,
            result: PairResult { peak_pressure, ..PairResult::default() },
            ..PairReport::default()
        };
        let written = Report {
            status: crate::output::RunStatus::Converged,
            message: "a, b".to_owned(),
            residual: Some(1e-9),
            dofs: 12,
            pairs: vec![pair(3, f64::NAN), pair(4, 2.5)],
            ..Report::default()
        };
        // numbers that are not finite are null in JSON
        let read = serde_json::to_vec(&written).and_then(|json| serde_json::from_slice(&json));
        let row = CaseRow::from(&read.expect("a report"));
        let value = |name: &str| row.fields().into_iter().find(|(column, _)| column == name).expect("a column").1;
        let names = ["status", "message", "dofs", "points", "residual", "F1", "peak_pressure"];
        assert_eq!(names.map(value), ["converged", "a, b", "12", "7", "1e-9", "", "2.5"]);
    }

    #[test]
    fn columns_are_aligned() {
        let rows = [["a", "bb"], ["ccc", "d"]].map(|row| row.map(str::to_owned).to_vec());
        assert_eq!(aligned(&rows, 1), "a    bb\nccc   d");
    }
}
