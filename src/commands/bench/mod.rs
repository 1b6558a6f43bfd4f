//! `winkler bench`: run a scene with every mesh, order, inner solver, method and number of ranks that was asked for,
//! each in a process of its own. Times, memory, counters and errors are written as a table and plots.

mod compare;
mod plan;
mod plots;
mod process;

pub use plan::BenchArgs;

use super::cases::Case;
use super::inputs;
use super::rows::{CaseRow, aligned};
use crate::error::Result;
use crate::interrupt::Interrupt;
use crate::output::{Folder, RowFile, say, sci, seconds, terminal};
use crate::petsc::Session;
use compare::{PairPoints, difference};
use plan::{Benchmark, COLUMNS, Measured, is_of_mesh, usage};
use process::Runner;
use std::collections::BTreeSet;

/// The table of all runs.
const TABLE: &str = "bench.csv";

/// Run all combinations, and write `bench.csv` row by row and the plots at the end.
///
/// Return the exit code: 1 if a run did not converge, was refused or did not end in time.
///
/// # Errors
/// Command lines that make no sense, scenes that cannot be read, a folder that cannot be written, a signal. A failure
/// of a run is no error, but a row.
pub fn bench(interrupt: &Interrupt, request: &BenchArgs) -> Result<i32> {
    interrupt.hold();
    if Session::is_one_of_several() {
        return Err(usage("`bench` starts the ranks of its runs itself").help("`--ranks 1,2` instead of mpiexec"));
    }
    let bench = Benchmark::new(request)?;
    let reference = bench.reference(request)?;
    let folder = Folder::claim(bench.folder(request))?;
    let names: Vec<String> = plots::names(&bench).chain([TABLE.to_owned()]).collect();
    folder.check(&names, &bench.scenes.iter().flat_map(inputs).collect::<Vec<_>>())?;
    let runner = Runner::new(interrupt, request.timeout, request.repeat, folder.path())?;
    bench.plan.cases.iter().try_for_each(|case| runner.check(case, request.against.as_deref()))?;
    let mut file = RowFile::create(&folder, TABLE)?;
    let bar = terminal::runs(bench.plan.cases.len(), !request.quiet);
    let (mut rows, mut meshed) = (Vec::new(), BTreeSet::new());
    for case in &bench.plan.cases {
        bar.set_message(case.label.clone());
        let mut row = if bench.is_beyond(case, &rows) {
            CaseRow::unsolved("skipped", "an earlier mesh took too long")
        } else {
            bench.measure(case, &runner, reference.as_deref(), &mut meshed)?
        };
        if row.method.is_empty() {
            bench.plan.value(case, "asked").clone_into(&mut row.method);
        }
        if !(request.quiet && row.is_good()) {
            bar.suspend(|| say(row.line(&case.label)))?;
        }
        // written at once, so that it is kept whatever comes next
        file.push(&bench.plan.fields(case).chain(row.fields()).collect::<Vec<_>>());
        rows.push(Measured { case: case.clone(), row });
        bar.inc(1);
    }
    bar.finish_and_clear();
    file.finish()?;
    bench.compare_with_finest(&mut rows, &runner);
    let mut file = RowFile::create(&folder, TABLE)?;
    rows.iter()
        .for_each(|Measured { case, row }| file.push(&bench.plan.fields(case).chain(row.fields()).collect::<Vec<_>>()));
    file.finish()?;
    for (name, plot) in plots::plots(&rows, &bench) {
        folder.write(&name, |out| plot.write(out))?;
    }
    if !request.quiet {
        say(bench.summary(&rows))?;
    }
    say(format_args!("results in {}", folder.path().display()))?;
    Ok(i32::from(!rows.iter().all(|measured| measured.row.is_good())))
}

impl Benchmark {
    /// Return the contact tables of `--against`.
    fn reference(&self, request: &BenchArgs) -> Result<Option<Vec<PairPoints>>> {
        let Some(folder) = &request.against else { return Ok(None) };
        let [scene] = &self.scenes[..] else { return Err(usage("`--against` goes with one scene")) };
        let found = compare::tables(folder)?;
        let (tables, pairs) = (found.len(), scene.pairs().count());
        if found.is_empty() || (scene.rules().next().is_none() && tables != pairs) {
            let message = format!("{} has {tables} contact tables, the scene {pairs} pairs", folder.display());
            return Err(usage(message).help("give the folder of results of the same scene"));
        }
        Ok(Some(found))
    }

    /// Return whether a case differs only by its mesh from a row that did not end in time. Lists of meshes go from
    /// coarse to fine.
    fn is_beyond(&self, case: &Case, rows: &[Measured]) -> bool {
        let columns = &self.plan.columns;
        let is_like = |key: &[String]| (0..columns.len()).all(|k| is_of_mesh(&columns[k]) || key[k] == case.key[k]);
        rows.iter().any(|measured| measured.row.status == "timeout" && is_like(&measured.case.key))
    }

    /// Run a case as often as asked for, and return its row. `meshed` has the overrides of meshes that are in the
    /// cache.
    fn measure(
        &self,
        case: &Case,
        runner: &Runner,
        reference: Option<&[PairPoints]>,
        meshed: &mut BTreeSet<Vec<String>>,
    ) -> Result<CaseRow> {
        let scene = match crate::scene::load(&case.scene, &case.overrides) {
            Ok(scene) => scene,
            Err(error) => {
                let help = error.advice().map_or(String::new(), |help| format!("; help: {help}"));
                return Ok(CaseRow::unsolved("refused", &format!("error: {}{help}", error.message())));
            }
        };
        // the mesh is made before times are measured
        let solving = |text: &&String| ["method", "solver", "output"].iter().any(|key| text.starts_with(key));
        let mesh: Vec<String> = case.overrides.iter().filter(|text| !solving(text)).cloned().collect();
        if meshed.insert([vec![case.scene.display().to_string()], mesh.clone()].concat()) {
            runner.mesh(case, &mesh)?;
        }
        let ranks = self.plan.value(case, "ranks").parse().unwrap_or(1);
        let mut row = runner.repeat(case, ranks)?;
        let tables = compare::tables(&runner.folder(case)).unwrap_or_default();
        if row.is_good() {
            let against = reference.and_then(|reference| difference(&tables, reference));
            if let Some(error) = against {
                row.set_error(error, "pressure, --against");
            } else if row.error.is_none()
                && let Some(error) = compare::closed_form(&scene, &tables)
            {
                row.set_error(error, "pressure, reference");
            }
        }
        Ok(row)
    }

    /// Set the error of every row that has none, against the row of the finest mesh with the same values of all keys
    /// that are not of the mesh.
    ///
    /// Rows of the finest mesh have no error. Of several rows with as many dofs and the same order, the one with the
    /// smallest residual is the reference.
    fn compare_with_finest(&self, rows: &mut [Measured], runner: &Runner) {
        let keys = self.plan.columns.len() - COLUMNS.len();
        let is_alike =
            |a: &Case, b: &Case| (0..keys).all(|k| is_of_mesh(&self.plan.columns[k]) || a.key[k] == b.key[k]);
        let fineness = |measured: &Measured| (measured.row.dofs, self.plan.value(&measured.case, "order").to_owned());
        let residual = |measured: &Measured| measured.row.residual.unwrap_or(f64::INFINITY);
        let mut found = Vec::new();
        for (index, own) in rows.iter().enumerate().filter(|(_, own)| own.row.is_good() && own.row.error.is_none()) {
            let group = rows.iter().filter(|other| other.row.is_good() && is_alike(&own.case, &other.case));
            let finest = group.max_by(|a, b| fineness(a).cmp(&fineness(b)).then(residual(b).total_cmp(&residual(a))));
            let Some(finest) = finest.filter(|finest| fineness(finest) != fineness(own)) else { continue };
            let [run, reference] =
                [own, finest].map(|measured| compare::tables(&runner.folder(&measured.case)).unwrap_or_default());
            let error = difference(&run, &reference);
            let of = format!("pressure, mesh of {} dofs", finest.row.dofs.unwrap_or_default());
            found.extend(error.map(|error| (index, error, of)));
        }
        found.into_iter().for_each(|(index, error, of)| rows[index].row.set_error(error, of));
    }

    /// Return the table with one line for each row: the values that distinguish it, the method that ran, and the
    /// numbers that some row has.
    fn summary(&self, rows: &[Measured]) -> String {
        let mut named = self.plan.varied(rows.iter().map(|measured| &measured.case.key));
        named.retain(|&column| self.plan.columns[column] != "asked");
        let numbers: Vec<_> =
            SHOWN.iter().filter(|shown| rows.iter().any(|row| (shown.text)(&row.row).is_some())).collect();
        let heads = named.iter().map(|&column| self.plan.columns[column].as_str()).chain(["method", "status"]);
        let mut lines: Vec<Vec<String>> =
            vec![heads.chain(numbers.iter().map(|shown| shown.heading)).map(str::to_owned).collect()];
        for Measured { case, row } in rows {
            let words = named.iter().map(|&column| case.key[column].clone());
            let words = words.chain([row.method.clone(), row.status.clone()]);
            lines.push(words.chain(numbers.iter().map(|shown| (shown.text)(row).unwrap_or_default())).collect());
        }
        aligned(&lines, named.len() + 2)
    }
}

/// A column of the table on the terminal.
struct Shown {
    heading: &'static str,
    text: fn(&CaseRow) -> Option<String>,
}

const SHOWN: [Shown; 9] = [
    Shown { heading: "dofs", text: |row| row.dofs.map(|count| count.to_string()) },
    Shown { heading: "iterations", text: |row| row.iterations.map(|count| count.to_string()) },
    Shown { heading: "sweeps", text: |row| row.sweeps.map(|count| count.to_string()) },
    Shown { heading: "inner iterations", text: |row| row.inner_iterations.map(|count| count.to_string()) },
    Shown { heading: "s", text: |row| row.seconds.map(seconds) },
    Shown { heading: "CPU s", text: |row| row.cpu_seconds.map(seconds) },
    Shown { heading: "MB", text: |row| row.memory_mb.map(|memory| format!("{memory:.0}")) },
    Shown { heading: "error", text: |row| row.error.map(|error| sci(error, 2)) },
    Shown { heading: "of", text: |row| row.error.map(|_| row.error_of.clone()) },
];
