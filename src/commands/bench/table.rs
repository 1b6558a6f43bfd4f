//! The rows of a benchmark, in memory and in `bench.csv`, and what only all of them together tell.

use super::compare::{self, References};
use super::plan::{Case, Plan, is_of_mesh};
use super::process::{RUNS, folder_of};
use super::request::Request;
use super::row::{Row, SKIPPED};
use crate::error::Result;
use crate::output::{Folder, RowFile};

/// All rows and their file.
pub(super) struct Table<'a> {
    folder: &'a Folder,
    plan: &'a Plan,
    columns: Vec<String>,
    /// Rows so far.
    pub rows: Vec<Row>,
    /// Rows of an earlier benchmark that can be reused.
    old: Vec<Row>,
    file: RowFile,
}

/// The file of the rows.
const FILE: &str = "bench.csv";
/// The file with the settings of the rows in the folder.
const SETTINGS: &str = "bench.txt";

impl<'a> Table<'a> {
    /// Open the file of a plan. With `--resume` its rows are read first, if they were made with the same settings.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn open(folder: &'a Folder, plan: &'a Plan, request: &Request, reference: &References) -> Result<Self> {
        let columns: Vec<String> = plan.columns().into_iter().chain(Row::columns().map(str::to_owned)).collect();
        let settings = settings(request, reference);
        let path = folder.path().join(SETTINGS);
        let is_known = request.resume && crate::file::read(&path).is_ok_and(|old| old == settings.as_bytes());
        let mut old = if is_known { read(folder, &columns) } else { Vec::new() };
        old.retain(|row| !matches!(row.status.as_str(), "killed" | "failed" | SKIPPED));
        folder.write(SETTINGS, |out| out.write_all(settings.as_bytes()))?;
        // the file has the old rows from the start, so that a benchmark that is killed loses none
        let file = RowFile::create(folder, FILE, &columns, &old.iter().map(Row::fields).collect::<Vec<_>>())?;
        Ok(Self { folder, plan, columns, rows: Vec::new(), old, file })
    }

    /// Return the row of a case that an earlier benchmark made from the same inputs. Scenes, data and meshes may have been edited meanwhile.
    pub fn old_row(&self, case: &Case, inputs: Option<&str>) -> Option<Row> {
        let is_same = |row: &&Row| row.key == case.key && Some(row.inputs.as_str()) == inputs;
        self.old.iter().find(is_same).cloned()
    }

    /// Return whether a case differs only by its mesh from a row that did not end in time. Lists of meshes go from coarse to fine.
    pub fn is_beyond(&self, case: &Case) -> bool {
        let columns = self.plan.columns();
        let is_like = |row: &Row| (0..row.key.len()).all(|k| is_of_mesh(&columns[k]) || row.key[k] == case.key[k]);
        self.rows.iter().any(|row| row.is_late() && is_like(row))
    }

    /// Add a row. A new row is written at once, so that it is kept whatever comes next. Return the message that the file lacks rows, once.
    pub fn add(&mut self, row: Row, is_new: bool) -> Option<String> {
        if is_new {
            self.file.push(&row.fields());
        }
        self.rows.push(row);
        self.file.complaint()
    }

    /// Add the numbers that need the whole table, and write all rows again.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn complete(&mut self) -> Result<()> {
        self.compare_with_finest();
        self.compare_with_linear();
        let rows: Vec<_> = self.rows.iter().map(Row::fields).collect();
        RowFile::create(self.folder, FILE, &self.columns, &rows)?.finish()
    }

    /// Set the error of every row that has none, against the row of the finest mesh with the same values of all keys that are not of the mesh.
    ///
    /// Rows of the finest mesh have no error. Of several rows with as many dofs and the same order, the one with the smallest residual is the
    /// reference.
    fn compare_with_finest(&mut self) {
        // the first columns of the table are the scene and the keys
        let first = &self.plan.columns()[..=self.plan.keys.len()];
        let is_alike = |a: &Row, b: &Row| (0..first.len()).all(|k| is_of_mesh(&first[k]) || a.key[k] == b.key[k]);
        let is_comparable = |row: &Row| row.is_good() && !row.is_linear();
        // dofs, and the order of the elements
        let fineness = |row: &Row| (row.number("dofs").unwrap_or(0.0), row.key[row.key.len() - 2].clone());
        let residual = |row: &Row| row.number("residual").unwrap_or(f64::INFINITY);
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
            found.extend(self.difference(row, finest).map(|error| (index, error)));
        }
        for (index, error) in found {
            self.rows[index].set_error(error, "pressure, finest mesh");
        }
    }

    /// Return the relative difference of the pressures of two rows; none where their tables cannot be compared.
    fn difference(&self, row: &Row, reference: &Row) -> Option<f64> {
        let runs = self.folder.path().join(RUNS);
        let dimension = self.plan.scene(&row.key[0])?.dimension.value;
        let [own, other] = [row, reference].map(|row| compare::tables(&folder_of(&runs, &row.key)).ok());
        compare::difference(dimension, &own?, &other?)
    }

    /// Add to every row the number of linear factor-and-solves of the same bodies that take as long as its set-up and iteration.
    ///
    /// Their reference cost is that of the fastest solver with a row of the method `linear`.
    fn compare_with_linear(&mut self) {
        let solver = 1 + self.plan.keys.len();
        let same = |a: &Row, b: &Row| (0..a.key.len()).all(|k| k == solver || k == solver + 1 || a.key[k] == b.key[k]);
        let linear: Vec<Row> = self.rows.iter().filter(|row| row.is_linear()).cloned().collect();
        for row in self.rows.iter_mut().filter(|row| row.is_good() && !row.is_linear()) {
            let alike = linear.iter().filter(|other| same(row, other));
            let cost = alike.filter_map(|other| other.number("linear_seconds")).fold(f64::INFINITY, f64::min);
            if cost.is_finite() && cost > 0.0 {
                row.set_linear_solves(cost);
            }
        }
    }
}

/// Return what rows depend on beside their key and their inputs.
fn settings(request: &Request, reference: &References) -> String {
    format!(
        "winkler {}\n--set {:?}\nPETSc {:?} {:?}\n--repeat {}\n--timeout {}\n--against {:?} {}\n",
        env!("CARGO_PKG_VERSION"),
        request.all_overrides(),
        request.petsc,
        std::env::var_os("PETSC_OPTIONS").unwrap_or_default(),
        request.repeat,
        request.timeout,
        request.against,
        reference.digest()
    )
}

/// Return the rows of the file in a folder that has these columns; none if it has others.
fn read(folder: &Folder, columns: &[String]) -> Vec<Row> {
    let Ok(bytes) = crate::file::read(&folder.path().join(FILE)) else { return Vec::new() };
    let mut file = csv::Reader::from_reader(bytes.as_slice());
    if !file.headers().is_ok_and(|header| header.iter().eq(columns)) {
        return Vec::new();
    }
    // the last row of a benchmark that was killed may be incomplete
    file.records().map_while(|record| record.ok()).map(|record| Row::parse(&record)).collect()
}
