//! `winkler solve`: one scene, one run, all its results.

use super::adapt::Plan;
use super::clock::Clock;
use super::results::Recovered;
use super::run;
use super::stages::Done;
use super::{folder_of, load, report, results};
use crate::ddm::{Observer, Row};
use crate::error::{Error, Kind, Result};
use crate::estimate::Estimate;
use crate::output::{Folder, HistoryWriter, IterationTable, Plot, Report, Verbosity, say, vtu};
use crate::parallel::agree;
use crate::petsc::Session;
use crate::scene::Scene;
use std::path::PathBuf;

/// What the user typed.
pub struct Request {
    /// Scene file.
    pub scene: PathBuf,
    /// Folder of results, if typed.
    pub folder: Option<PathBuf>,
    /// Overrides of scene keys.
    pub overrides: Vec<String>,
    /// Whether to print the report as JSON instead of the table.
    pub json: bool,
}

/// Solves a scene, writes its results and returns the exit code.
///
/// # Errors
/// Everything that keeps the run from starting, and failures of the file system. Not converging is an exit code, and all
/// that was computed is written.
pub fn solve(session: &Session, request: Request) -> Result<i32> {
    let mut clock = Clock::default();
    let scene = load(session, &request.scene, &request.overrides)?;
    let folder = agree(session, Folder::create(folder_of(&scene, request.folder)))?;
    let first = session.rank() == 0;
    let mut plan = Plan::new(session, scene, &mut clock)?;
    let (done, estimate, failed) = loop {
        let built = run::build(session, plan.scene.clone(), &mut clock)?;
        let start = plan.start(&built);
        let ready = run::set_up(session, built, start, &mut clock)?;
        let all = session.options().all()?;
        let monitored = all.iter().any(|(name, _)| name.contains("monitor") || name.contains("view"));
        let verbosity = if request.json || monitored || !first { Verbosity::Quiet } else { Verbosity::Table };
        let mut watchers = Watchers {
            table: IterationTable::new(verbosity, &run::targets(&plan.scene)),
            history: if first { Some(history(&folder, &plan.scene)?) } else { None },
        };
        let mut done = run::iterate(ready, &mut watchers, &mut clock)?;
        let estimate = run::estimate(&mut done, &mut clock)?;
        watchers.table.finish();
        let failed = watchers.history.map_or(Ok(()), |history| history.finish().map(|_| ()));
        let more = plan.goes_on(session, &done, estimate.as_ref(), &mut clock)?;
        if !more {
            break (done, estimate, failed);
        }
    };
    let recovered = results::recover(&done);
    let written = failed.and(write(session, &done, &recovered, estimate.as_ref(), &folder));
    clock.phase("output");
    clock.total();
    let mut report = report::report(session, &done, &recovered, &clock);
    report.discretization_error = estimate.as_ref().map(report::discretization_error);
    report.rounds = plan.rounds;
    if let Some(limit) = &plan.limit {
        report.status = "mesh-limit".to_owned();
        report.message = format!("the error asked for is not reached: {limit}");
    }
    if first {
        report.files = names(&folder, &done);
        let json = to_json(&report)?;
        folder.write("report.json", |out| out.write_all(json.as_bytes()))?;
        if request.json {
            say(json.trim_end());
        } else {
            let solvers: Vec<String> = report.bodies.iter().map(|body| body.solver.clone()).collect();
            say(format_args!(
                "{}\n  inner solver: {} ({})\n  results in {}",
                report.summary(),
                report::solvers_in_words(&solvers),
                done.built.choice,
                folder.path().display()
            ));
        }
    }
    written?;
    recovered.into_iter().flatten().collect::<Result<Vec<_>>>()?;
    Ok(if plan.limit.is_some() { 1 } else { report::exit_code(&done) })
}

/// A report as JSON text, ended by a newline.
///
/// # Errors
/// None in practice: a report holds nothing that JSON cannot hold.
pub fn to_json(report: &Report) -> Result<String> {
    serde_json::to_string_pretty(report)
        .map(|text| text + "\n")
        .map_err(|cause| Error::new(Kind::File, "the report cannot be written as JSON").because(cause.to_string()))
}

fn history(folder: &Folder, scene: &Scene) -> Result<HistoryWriter> {
    let names: Vec<&str> = scene.bodies.iter().map(|body| body.name.value.as_str()).collect();
    HistoryWriter::create(folder, &names, !scene.method.steps.is_empty())
}

/// Table and file of the iterations.
struct Watchers {
    table: IterationTable,
    history: Option<HistoryWriter>,
}

impl Observer for Watchers {
    fn row(&mut self, row: &Row) {
        self.table.row(row);
        if let Some(history) = &mut self.history {
            history.row(row);
        }
    }

    fn note(&mut self, text: &str) {
        self.table.note(text);
    }
}

/// Writes fields (each rank its bodies), contact tables and plots (the first rank).
fn write(
    session: &Session,
    done: &Done,
    recovered: &results::All,
    estimate: Option<&Estimate>,
    folder: &Folder,
) -> Result<()> {
    let (scene, discrete, model) = (&done.built.scene, &done.built.discrete, done.model());
    let first = session.rank() == 0;
    if scene.output.vtu {
        for Recovered { field, .. } in recovered.iter().flatten().flatten() {
            folder.write(&field.file_name(), |out| field.clone().write(out))?;
        }
        if first {
            let mut names: Vec<String> = discrete.bodies.iter().map(|body| body.name.clone()).collect();
            for i in 0..model.pairs.len() {
                let file = folder.unused(&report::contact_table(done, None, i).stem(), "vtu");
                let name = file.trim_end_matches(".vtu").to_owned();
                folder.write(&file, |out| report::contact_surface(&name, done, i).write(out))?;
                names.push(name);
            }
            folder.write(&vtu::pvd_name("bodies"), |out| vtu::write_pvd(&names, out))?;
        }
    }
    if !first {
        return Ok(());
    }
    for i in 0..model.pairs.len() {
        report::contact_table(done, estimate, i).save(folder)?;
    }
    if scene.output.plots {
        let convergence = Plot::convergence(&scene.title, &[report::convergence("", &done.outcome)]);
        folder.write("convergence.svg", |out| convergence.write(out))?;
        // only along curves: points of a surface over one coordinate would be a cloud
        for i in (0..model.pairs.len()).filter(|&i| model.pairs[i].along_curve) {
            let mut curves = vec![report::pressure("pressure", done, i)];
            curves.extend(report::reference(discrete, i));
            let (_, axis) = report::main_axis(&model.pairs[i]);
            let plot = Plot::pressure(&scene.title, axis, &curves);
            folder.write(&folder.unused("pressure", "svg"), |out| plot.write(out))?;
        }
    }
    Ok(())
}

/// Names of the files of a run, those of other ranks included.
fn names(folder: &Folder, done: &Done) -> Vec<String> {
    let own = folder.files();
    let mut names: Vec<String> =
        own.iter().filter_map(|path| path.file_name()).map(|name| name.to_string_lossy().into_owned()).collect();
    if done.built.scene.output.vtu {
        names.extend(done.built.discrete.bodies.iter().map(|body| format!("{}.vtu", body.name)));
    }
    names.push("report.json".to_owned());
    names.sort();
    names.dedup();
    names
}
