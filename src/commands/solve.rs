//! `winkler solve`: one scene, one run, all its results.

use super::adapt::Plan;
use super::checkpoint::{self, Checkpoint};
use super::typed::{Manner, SceneArgs, flags};
use super::write::{Writing, to_json};
use super::{folder_of, load, said, series};
use crate::ddm::{Observer, Row, Status};
use crate::error::{Error, Result};
use crate::estimate::Estimate;
use crate::exchange::share;
use crate::interrupt::Interrupt;
use crate::output::progress::Line;
use crate::output::{Checksums, Folder, HistoryWriter, IterationTable, Report, StepTable, Verbosity, say};
use crate::parallel::{Ranks, agree};
use crate::petsc::Session;
use crate::run::asking::{is_snapshot, signal};
use crate::run::{self, All, Asking, Built, Clock, Done, Keep, Ready, measure, report};
use std::path::{Path, PathBuf};

/// What the user typed.
#[derive(clap::Args)]
pub struct Request {
    #[command(flatten)]
    scene: SceneArgs,
    /// Folder for the results [default: output.dir of the scene, else results/CASE]
    #[arg(short, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Write displacements and stresses of the bodies for ParaView (short for --set output.vtu=true)
    #[arg(long)]
    vtu: bool,
    /// Write displacements, stresses and contact pressures as views for Gmsh (short for --set output.msh=true)
    #[arg(long)]
    msh: bool,
    /// Write a page with pictures and tables of the run, report.html (short for --set output.report=true)
    #[arg(long)]
    report: bool,
    /// Minutes between checkpoints (short for --set output.checkpoint=T)
    #[arg(long, value_name = "T", allow_hyphen_values = true)]
    checkpoint: Option<String>,
    /// Go on from the checkpoint in a folder of results
    #[arg(long, value_name = "DIR")]
    restart: Option<PathBuf>,
    #[command(flatten)]
    manner: Manner,
}

impl Request {
    fn overrides(&self) -> Vec<String> {
        let flags = flags([(self.vtu, "--vtu"), (self.msh, "--msh"), (self.report, "--report")]);
        let checkpoint = self.checkpoint.iter().map(|minutes| format!("--checkpoint {minutes}"));
        self.scene.overrides().into_iter().chain(flags).chain(checkpoint).collect()
    }
}

/// Solves a scene, writes its results and returns the exit code.
///
/// # Errors
/// Everything that keeps the run from starting, and failures of the file system. Not converging is an exit code, and all
/// that was computed is written.
pub fn solve(session: &Session, interrupt: &Interrupt, request: &Request) -> Result<i32> {
    let first = session.rank() == 0;
    let (json, verbosity) = (request.scene.json, request.manner.verbosity());
    let is_loud = first && !json && verbosity != Verbosity::Quiet;
    let mut clock = said::watched(is_loud);
    let scene = load(session, &request.scene.scene, &request.overrides())?;
    let read = |folder: &PathBuf| Checkpoint::read(&Ranks::new(session), folder, &scene);
    let kept = agree(session, request.restart.as_ref().map(read).transpose())?;
    let folder = agree(session, claim(session, folder_of(&scene, request.output.as_ref())))?;
    let mut plan = Plan::new(session, scene, kept, interrupt, &mut clock)?;
    // one rank has the clock
    let asking = Asking::new(interrupt, plan.scene.output.checkpoint.filter(|_| first));
    let saved =
        request.restart.as_ref().is_some_and(|from| from.canonicalize().ok() == folder.path().canonicalize().ok());
    let solving = Solving { session, interrupt, asking: &asking, folder: &folder, first, json, verbosity, is_loud };
    let mut solving = Rounds { of: solving, clock, saved, has_begun: false, unwritten: Vec::new() };
    let last = loop {
        let round = solving.solve(&mut plan)?;
        if !plan.goes_on(session, &round.done, round.estimate.as_ref(), &mut solving.clock)? {
            break round;
        }
        if plan.adapts() {
            solving.keep(&plan, round);
        }
    };
    solving.finish(&plan, last)
}

/// What does not change from mesh to mesh.
#[derive(Clone, Copy)]
struct Solving<'s> {
    session: &'s Session,
    interrupt: &'s Interrupt,
    asking: &'s Asking,
    folder: &'s Folder,
    /// Whether this rank is the first one, which writes.
    first: bool,
    json: bool,
    verbosity: Verbosity,
    is_loud: bool,
}

/// The rounds of a run, one a mesh.
struct Rounds<'s> {
    of: Solving<'s>,
    clock: Clock,
    /// Whether the folder has a checkpoint of this run.
    saved: bool,
    /// Whether the folder has the tables of this run.
    has_begun: bool,
    /// What could not be written of earlier meshes, in words.
    unwritten: Vec<String>,
}

/// A round that has ended.
struct Round {
    done: Done,
    estimate: Option<Estimate>,
    /// Whether its tables were written.
    tables: Result<()>,
}

impl Rounds<'_> {
    /// Solves on the next mesh of the plan, and estimates the error.
    fn solve(&mut self, plan: &mut Plan) -> Result<Round> {
        let Solving { session, interrupt, asking, folder, first, verbosity, is_loud, .. } = self.of;
        let built = plan.build(session, interrupt, &mut self.clock)?;
        let begin = agree(session, plan.begin(&built))?;
        let ready = run::set_up(session, built, begin, &mut self.clock)?;
        let all = session.options().all()?;
        let monitored = all.iter().any(|(name, _)| name.contains("monitor") || name.contains("view"));
        if verbosity == Verbosity::Verbose {
            let decided = said::decisions(session, &ready)?;
            decided.iter().filter(|_| first).for_each(|line| eprintln!("{line}"));
        }
        let (history, steps) = self.open_tables(&ready)?;
        let stop = &plan.scene.method.stop;
        let mut watchers = Watchers {
            table: IterationTable::new(is_loud && !monitored, &run::targets(&plan.scene), stop.residual),
            history,
            steps,
            folder,
            asking,
            session,
            path: folder.path(),
            plan,
            clock: self.clock.clone(),
            saved: self.saved,
            failed: Vec::new(),
        };
        let stage = session.stage("iterate");
        let mut done = run::iterate(ready, interrupt, &mut watchers, &mut self.clock)?;
        drop(stage);
        done.warnings.append(&mut watchers.failed);
        done.warnings.extend(self.unwritten.drain(..).map(|what| format!("of an earlier mesh: {what}")));
        self.saved = watchers.saved;
        let stage = session.stage("estimate");
        let mut estimate = run::estimate(&mut done, &mut self.clock)?;
        drop(stage);
        watchers.table.finish();
        let tables = watchers.history.map_or(Ok(()), |history| history.finish());
        let tables = tables.and(watchers.steps.map_or(Ok(()), |steps| steps.finish()));
        estimate.iter_mut().for_each(|estimate| plan.hold(&done, estimate));
        Ok(Round { done, estimate, tables })
    }

    /// The tables of a round. Those of a later mesh are worth less than its results, so that the run goes on without them.
    fn open_tables(&mut self, ready: &Ready) -> Result<(Option<HistoryWriter>, Option<StepTable>)> {
        let Solving { folder, first, .. } = self.of;
        // all refusals are behind: from here on the folder has this run alone
        if first && !self.has_begun {
            begin_in(folder, self.saved)?;
        }
        let has_begun = std::mem::replace(&mut self.has_begun, true);
        match tables(folder, ready, first) {
            Err(error) if has_begun => {
                self.unwritten.push(error.message().to_owned());
                Ok((None, None))
            }
            opened => opened,
        }
    }

    /// Writes the results of a mesh that is not the last: whatever comes of the next one, they are there.
    fn keep(&mut self, plan: &Plan, Round { done, estimate, tables }: Round) {
        let (session, path) = (self.of.session, self.of.folder.path());
        let estimate = estimate.as_ref();
        let writing = Writing { session, path, plan, done: &done, estimate, fields: false, is_last: false };
        let ended = match plan.is_stepping() {
            true => "ended while load steps were at work on the last mesh",
            false => "ended while the next mesh was at work: the error asked for is not reached",
        };
        let (_, written) = writing.all(&mut self.clock, |report| {
            (report.status, report.message) = ("interrupted".to_owned(), ended.to_owned());
        });
        // what cannot be written now may find room at the end, and what was computed goes on
        if let Err(error) = tables.and(written) {
            self.unwritten.push(error.message().to_owned());
        }
    }

    /// Writes all results of the last mesh, and returns the exit code.
    fn finish(mut self, plan: &Plan, Round { done, estimate, tables }: Round) -> Result<i32> {
        let Solving { session, folder, first, is_loud, .. } = self.of;
        let path = folder.path();
        let line = is_loud.then(|| Line::new("stresses and files", None));
        let estimate = estimate.as_ref();
        let writing = Writing { session, path, plan, done: &done, estimate, fields: true, is_last: true };
        let (report, written) = writing.all(&mut self.clock, |report| {
            if let Some(limit) = &plan.limit {
                report.status = "mesh-limit".to_owned();
                report.message = format!("the error asked for is not reached: {limit}");
            }
        });
        let written = match plan.scene.output.report {
            true => written.and(page(&done, path, first)),
            false => written,
        };
        drop(line);
        let code = if plan.limit.is_some() { 1 } else { report::exit_code(&done) };
        if first {
            if self.saved && code == 0 {
                // nothing is left to go on from; one that is gone already is as well
                let _ = std::fs::remove_file(path.join(checkpoint::FILE));
            }
            self.say(&report, &done, code)?;
        }
        tables.and(written)?;
        agree(session, if first { plan.keep_mesh(&done) } else { Ok(()) })?;
        Ok(code)
    }

    /// Says how the run ended.
    fn say(&self, report: &Report, done: &Done, code: i32) -> Result<()> {
        let Solving { json, verbosity, folder, .. } = self.of;
        if json {
            return say(to_json(report)?.trim_end());
        }
        let again = if self.saved && code > 1 { "; --restart with this folder goes on" } else { "" };
        let results = format!("  results in {}{again}", folder.path().display());
        if verbosity == Verbosity::Quiet {
            return say(said::briefly(report, code, &results));
        }
        let solvers: Vec<String> = report.bodies.iter().map(|body| body.solver.clone()).collect();
        let (solvers, choice) = (report::solvers_in_words(&solvers), &done.built.choice);
        say(format!("{}\n  inner solver: {solvers} ({choice})\n{results}", report.summary()))
    }
}

/// Takes the folder of results for this run, on the first rank, which writes its tables.
pub(super) fn claim(session: &Session, path: PathBuf) -> Result<Folder> {
    if session.rank() == 0 { Folder::claim(path) } else { Folder::create(path) }
}

/// Lets a folder have no results but those of the run that begins. A run that `goes_on` from the checkpoint there is the one whose files it
/// has; another checkpoint is set aside, since hours of work may be in it.
fn begin_in(folder: &Folder, goes_on: bool) -> Result<()> {
    Checksums::withdraw(folder.path());
    if goes_on {
        return Ok(());
    }
    folder.clear()?;
    let file = folder.path().join(checkpoint::FILE);
    match file.symlink_metadata() {
        Ok(_) => std::fs::rename(&file, folder.path().join(checkpoint::ASIDE))
            .map_err(|cause| Error::file(&file, "set aside", &cause)),
        Err(_) => Ok(()),
    }
}

/// Writes the page of the results when all ranks have written their fields. Collective.
fn page(done: &Done, path: &Path, first: bool) -> Result<()> {
    share(&*done.model().exchange, ());
    if first { crate::report::save(path, None).map(|_| ()) } else { Ok(()) }
}

/// The tables that grow, on the rank that writes them.
fn tables(folder: &Folder, ready: &Ready, writes: bool) -> Result<(Option<HistoryWriter>, Option<StepTable>)> {
    if !writes {
        return Ok((None, None));
    }
    Ok((Some(history(folder, &ready.built)?), steps(folder, ready)?))
}

fn history(folder: &Folder, built: &Built) -> Result<HistoryWriter> {
    let names: Vec<&str> = built.discrete.bodies.iter().map(|body| body.name.as_str()).collect();
    HistoryWriter::create(folder, &names, !built.scene.method.steps.is_empty())
}

/// The table of load steps, if there are any, with those of another process.
fn steps(folder: &Folder, ready: &Ready) -> Result<Option<StepTable>> {
    let (built, history) = (&ready.built, &ready.built.scene.method.steps);
    if history.is_empty() {
        return Ok(None);
    }
    let (pairs, reactions) = (measure::pair_names(built), measure::reaction_names(built));
    let (dimension, measure) = (built.scene.dimension.value, measure::of_points(built));
    let mut table = StepTable::create(folder, &history.names, &pairs, &reactions, dimension, measure)?;
    ready.steps.iter().for_each(|step| table.row(&history.names, step));
    Ok(Some(table))
}

/// Table and file of the iterations of a round, what is asked meanwhile, and its checkpoints and snapshots.
struct Watchers<'a> {
    table: IterationTable,
    history: Option<HistoryWriter>,
    steps: Option<StepTable>,
    folder: &'a Folder,
    asking: &'a Asking,
    session: &'a Session,
    path: &'a Path,
    plan: &'a Plan,
    clock: Clock,
    /// Whether the folder has a checkpoint of this run.
    saved: bool,
    /// What could not be written, in words.
    failed: Vec<String>,
}

impl Observer for Watchers<'_> {
    fn row(&mut self, row: &Row) {
        self.table.row(row);
        if let Some(history) = &mut self.history {
            history.row(row);
            history.complaint().iter().for_each(|text| self.table.warn(text));
        }
    }

    fn asked(&self) -> u8 {
        self.asking.bits()
    }
}

impl Watchers<'_> {
    /// Notes a failure once: a disk that is full now may have room later.
    fn note_failure(&mut self, what: &str, written: Result<()>) {
        if let Err(error) = written {
            let text = format!("{what} was not written: {}", error.message());
            if !self.failed.contains(&text) {
                self.failed.push(text);
            }
        }
    }
}

impl Keep for Watchers<'_> {
    fn state(&mut self, done: &Done) {
        let Status::Paused { asked } = done.outcome.status else { return };
        let is_due = signal(asked).is_some() || !is_snapshot(asked);
        let Some(head) = is_due.then(|| self.plan.head()).flatten() else { return };
        let written = Checkpoint::write(self.path, head, done, self.session.rank() == 0);
        self.saved |= written.is_ok();
        self.note_failure("a checkpoint", written);
    }

    fn step(&mut self, done: &Done, recovered: &All) {
        let scene = &done.built.scene;
        let history = &scene.method.steps;
        if let (Some(table), Some(step)) = (&mut self.steps, done.steps.last()) {
            table.row(&history.names, step);
            table.complaint().iter().for_each(|text| self.table.warn(text));
        }
        let ends = done.steps.len() == history.steps.len() || matches!(done.outcome.status, Status::Paused { .. });
        if scene.output.vtu && !ends {
            let written = series::write(done, recovered, self.folder);
            self.note_failure("a field of a load step", written);
        }
    }

    fn results(&mut self, done: &mut Done) {
        let Self { session, path, plan, .. } = *self;
        let writing = Writing { session, path, plan, done, estimate: None, fields: true, is_last: false };
        let (_, written) = writing.all(&mut self.clock.clone(), |_| {});
        self.note_failure("a snapshot", written);
    }
}
