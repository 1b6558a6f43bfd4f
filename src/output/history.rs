//! `history.csv`: the iteration history, written row by row during the run.

use super::folder::Folder;
use super::format::field;
use super::rows::RowFile;
use crate::ddm::{Observer, Row};
use crate::error::Result;

/// An observer that writes one line of `history.csv` for each row.
pub struct HistoryWriter {
    /// The file.
    pub rows: RowFile,
    bodies: usize,
    /// Whether rows have the column of load steps.
    steps: bool,
}

impl HistoryWriter {
    /// Open `history.csv` and write its header; `bodies` are the names in the order of [`Row::increments`]. With `steps`, each
    /// row begins with its load step.
    ///
    /// # Errors
    /// [`Kind::File`](crate::error::Kind::File) when the file cannot be written.
    pub fn create<S: AsRef<str>>(folder: &Folder, bodies: &[S], steps: bool) -> Result<Self> {
        let mut header: Vec<String> = if steps { vec!["step".into()] } else { Vec::new() };
        header.extend(["iteration", "residual", "error", "increment"].map(String::from));
        header.extend(bodies.iter().map(|body| format!("increment_{}", body.as_ref())));
        let last = "gamma energy closed points sweeps factorizations inner_iterations smoothed seconds";
        header.extend(last.split_whitespace().map(String::from));
        Ok(Self { rows: RowFile::create(folder, "history.csv", &header, &[])?, bodies: bodies.len(), steps })
    }
}

impl Observer for HistoryWriter {
    fn row(&mut self, row: &Row) {
        let mut fields = if self.steps { vec![row.step.to_string()] } else { Vec::new() };
        fields.push(row.iteration.to_string());
        fields.extend([row.residual, row.error, row.increment].map(field));
        // row 0 may have no increments
        fields.extend((0..self.bodies).map(|body| row.increments.get(body).map_or(String::new(), |&v| field(v))));
        fields.extend([field(row.gamma), field(row.energy)]);
        fields.extend(
            [row.closed, row.points, row.sweeps, row.factorizations, row.inner_iterations, row.smoothed]
                .map(|count| count.to_string()),
        );
        fields.push(field(row.seconds));
        self.rows.push(&fields);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_in_the_file_before_the_end() {
        let base = tempfile::tempdir().unwrap();
        let folder = Folder::create(base.path()).unwrap();
        let mut history = HistoryWriter::create(&folder, &["upper", "lower"], true).unwrap();
        history.row(&Row {
            residual: 1.0,
            error: f64::NAN,
            increment: f64::NAN,
            gamma: f64::NAN,
            energy: -0.1,
            points: 9,
            sweeps: 1,
            ..Row::default()
        });
        history.row(&Row {
            step: 2,
            iteration: 1,
            residual: 1e-9,
            error: 2e-9,
            is_bound: true,
            increment: 0.5,
            increments: vec![0.5, 1.0 / 3.0],
            gamma: 0.25,
            energy: -0.2,
            closed: 4,
            points: 9,
            sweeps: 2,
            factorizations: 3,
            inner_iterations: 7,
            smoothed: 1,
            seconds: 1.5,
        });
        let text = std::fs::read_to_string(base.path().join("history.csv")).unwrap();
        let lines: Vec<_> = text.lines().collect();
        assert_eq!(
            lines,
            [
                "step,iteration,residual,error,increment,increment_upper,increment_lower,gamma,energy,closed,points,\
                 sweeps,factorizations,inner_iterations,smoothed,seconds",
                "0,0,1.0,,,,,,-0.1,0,9,1,0,0,0,0.0",
                "2,1,1e-9,2e-9,0.5,0.5,0.3333333333333333,0.25,-0.2,4,9,2,3,7,1,1.5",
            ]
        );
        history.rows.finish().unwrap();
        assert_eq!(folder.files(), [base.path().join("history.csv")]);
    }
}
