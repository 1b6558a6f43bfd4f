//! `winkler bench`: run a scene with every mesh, order, inner solver, method and number of ranks that was asked for, each in a process of its
//! own. Times, memory, counters and errors are written as a table and plots.

mod compare;
mod plan;
mod process;
mod table;

pub use plan::BenchArgs;

use super::folder_of;
use crate::error::Result;
use crate::file::digest;
use crate::interrupt::Interrupt;
use crate::output::{Folder, say, terminal};
use crate::petsc::Session;
use crate::scene::Scene;
use compare::References;
use plan::{BenchCase, BenchPlan, usage};
use process::{ProcessRun, Runner};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::time::Instant;
use table::{BenchRow, BenchTable, SKIPPED};

/// Run all combinations, and write `bench.csv` row by row and the plots at the end.
///
/// Return the exit code: 1 if a run did not converge, was refused or did not end in time.
///
/// # Errors
/// Command lines that make no sense, scenes that cannot be read, a folder that cannot be written, a signal. A failure of a run is no error,
/// but a row.
pub fn bench(interrupt: &Interrupt, request: &BenchArgs) -> Result<i32> {
    interrupt.hold();
    if Session::is_one_of_several() {
        return Err(usage("`bench` starts the ranks of its runs itself").help("`--ranks 1,2` instead of mpiexec"));
    }
    let plan = BenchPlan::new(request)?;
    let folder = Folder::claim(folder(request, &plan))?;
    let reference = References::read(request.against.as_deref(), &plan)?;
    let mut table = BenchTable::open(&folder, &plan, request, &reference)?;
    let runner = Runner::new(interrupt, request, folder.path())?;
    let bar = terminal::runs(plan.cases.len(), !request.quiet);
    let mut meshed = BTreeSet::new();
    let began = Instant::now();
    for case in &plan.cases {
        bar.set_message(case.label.clone());
        let scene = crate::scene::load(&case.scene, &case.overrides);
        let inputs = scene.as_ref().ok().and_then(inputs);
        let old = table.old_row(case, inputs.as_deref());
        let is_new = old.is_none();
        let mut row = match old {
            Some(row) => row,
            None if table.is_beyond(case) => BenchRow::unsolved(case, SKIPPED, "an earlier mesh took too long"),
            None if began.elapsed().as_secs_f64() >= request.budget => {
                BenchRow::unsolved(case, SKIPPED, "the budget is spent")
            }
            None => measure(case, scene, &runner, &reference, &mut meshed)?,
        };
        row.set("inputs", inputs.unwrap_or_default());
        if !(request.quiet && row.is_good()) {
            bar.suspend(|| say(row.line(&case.label, is_new)))?;
        }
        table.add(row, is_new).iter().for_each(|text| bar.suspend(|| eprintln!("warning: {text}")));
        bar.inc(1);
    }
    bar.finish_and_clear();
    let mut written = table.complete();
    for (name, plot) in table::plots(&table.rows, &plan) {
        written = written.and(folder.write(&name, |out| plot.write(out)));
    }
    if !request.quiet {
        say(table::summary(&table.rows, &plan))?;
    }
    say(format_args!("results in {}", folder.path().display()))?;
    written?;
    Ok(i32::from(!table.rows.iter().all(BenchRow::is_good)))
}

/// Return the folder of the results: that of `-o`, else `bench` in that of the only scene, else `results/bench`.
fn folder(request: &BenchArgs, plan: &BenchPlan) -> PathBuf {
    match (&request.folder, &plan.scenes[..]) {
        (Some(folder), _) => folder.clone(),
        (None, [scene]) => folder_of(scene, None).join("bench"),
        (None, _) => PathBuf::from("results/bench"),
    }
}

/// Return a digest of all inputs of a run: the scene, its data, and what its mesh is made from; none if that is not known before the run.
fn inputs(scene: &Scene) -> Option<String> {
    let order = scene.bodies.iter().map(|body| body.order).max()?;
    let mesh = crate::mesh::made_from(&scene.mesh, scene.dimension.value, order)?;
    Some(digest(&(scene.problem().to_string(), mesh)))
}

/// Run a case as often as asked for, and return its row. `meshed` has the overrides of meshes that are in the cache.
fn measure(
    case: &BenchCase,
    scene: Result<Scene>,
    runner: &Runner,
    reference: &References,
    meshed: &mut BTreeSet<Vec<String>>,
) -> Result<BenchRow> {
    let scene = match scene {
        Ok(scene) => scene,
        Err(error) => {
            let help = error.advice().map_or(String::new(), |help| format!("; help: {help}"));
            return Ok(BenchRow::unsolved(case, "refused", &format!("error: {}{help}", error.message())));
        }
    };
    // the mesh is made before times are measured
    if meshed.insert(case.mesh_overrides.clone()) {
        runner.mesh(case)?;
    }
    let runs = runner.repeat(case)?;
    let mut row = BenchRow::new(case, &runs);
    if row.is_good()
        && !case.is_linear()
        && let Some((error, what)) = known_error(&scene, &runs, reference, &runner.folder(case))
    {
        row.set_error(error, what);
    }
    Ok(row)
}

/// Return the error of a run against a known solution, and what it is measured in and against. The solution is that of `--against`, or a closed
/// form of the scene.
fn known_error(
    scene: &Scene,
    runs: &[ProcessRun],
    reference: &References,
    folder: &Path,
) -> Option<(f64, &'static str)> {
    let tables = compare::tables(folder).ok()?;
    if let Some(error) = reference.error(scene, &tables) {
        return Some((error, "pressure, --against"));
    }
    if let Some(error) = runs.first().and_then(|run| run.largest("error_l2")) {
        return Some((error, "displacement, exact"));
    }
    Some((compare::closed_form(scene, &tables)?, "pressure, reference"))
}
