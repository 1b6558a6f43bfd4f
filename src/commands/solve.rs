//! `winkler solve`: solve one scene and write all its results.

use super::adapt::AdaptiveRun;
use super::checkpoint::{self, Checkpoint};
use super::plots::unit_words;
use super::shortfall::Shortfall;
use super::write::{ResultFiles, planned, planned_on_mesh, to_json, write_fields, write_step_tables};
use super::{SceneArgs, Terminal, VerbosityArgs, clock_with_phases, folder_of, inputs};
use crate::ddm::{Observer, Row, Status};
use crate::error::{Error, Result};
use crate::estimate::Estimate;
use crate::interrupt::Interrupt;
use crate::output::terminal::ProgressLine;
use crate::output::{
    Folder, HistoryWriter, IterationTable, Report, RoundReport, RowFile, RunStatus, StepTable, say, warning_lines,
};
use crate::parallel::{Ranks, collectively};
use crate::petsc::Session;
use crate::run::{self, All, Clock, Done, Prepared, Recorder, report, results, verdict};
use crate::scene::Scene;
use std::path::PathBuf;
use std::rc::Rc;

/// The command line of `winkler solve`.
#[derive(clap::Args)]
pub struct SolveArgs {
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
    /// Go on from the checkpoint in a folder of results
    #[arg(long, value_name = "DIR")]
    restart: Option<PathBuf>,
    #[command(flatten)]
    verbosity: VerbosityArgs,
}

/// Solve a scene, write its results and return the exit code.
///
/// # Errors
/// Everything that keeps the run from starting, and failures of the file system. A run that does not converge is no
/// error: it has an exit code of its own, and all that was computed is written.
pub fn solve(session: &Session, interrupt: &Interrupt, request: &SolveArgs) -> Result<i32> {
    let terminal = Terminal::new(session, &request.scene, &request.verbosity);
    let mut clock = clock_with_phases(terminal.is_loud());
    let mut scene = request.scene.load(session)?;
    scene.output.vtu |= request.vtu;
    scene.output.msh |= request.msh;
    scene.output.report |= request.report;
    let scene = Rc::new(scene);
    let read = |folder: &PathBuf| Checkpoint::read(&Ranks::new(session), folder);
    let checkpoint = collectively(session, request.restart.as_ref().map(read).transpose())?;
    let folder = collectively(
        session,
        claim(session, folder_of(&scene, request.output.as_ref()), std::slice::from_ref(&scene), planned(&scene)),
    )?;
    let plan = AdaptiveRun::new(session, scene, checkpoint, interrupt, &mut clock)?;
    let has_checkpoint =
        request.restart.as_ref().is_some_and(|from| from.canonicalize().ok() == folder.path().canonicalize().ok());
    let mut solver = Solver {
        session,
        interrupt,
        folder,
        terminal,
        clock,
        plan,
        table: IterationTable::new(false, "", None),
        tables: Tables::default(),
        has_checkpoint,
        has_tables: false,
        shown_meshes: 0,
        written: Ok(()),
    };
    let last = loop {
        let round = solver.solve()?;
        let goes_on = solver.plan.advance(&round.done, round.estimate.as_ref(), &mut solver.clock);
        solver.print_meshes(goes_on)?;
        if !goes_on {
            break round;
        }
        if solver.plan.adapts() {
            solver.write_round(round);
        }
    };
    solver.finish(last)
}

/// The state of the command over its rounds, one for each mesh. It is the observer of each round: it writes iterations
/// and load steps to the terminal and to tables, passes signals on, and writes checkpoints.
struct Solver<'s> {
    session: &'s Session,
    interrupt: &'s Interrupt,
    folder: Folder,
    terminal: Terminal,
    clock: Clock,
    plan: AdaptiveRun,
    /// The table of iterations on the terminal.
    table: IterationTable,
    tables: Tables,
    /// Whether the folder has a checkpoint of this run.
    has_checkpoint: bool,
    /// Whether the folder has the tables of this run.
    has_tables: bool,
    /// Number of adapted meshes that have their line on the terminal.
    shown_meshes: usize,
    /// The first failure to write a file, with which the run ends: until then it goes on with what it computes.
    written: Result<()>,
}

/// A round that has ended: the solution on one mesh.
struct Round {
    done: Done,
    estimate: Option<Estimate>,
}

impl Solver<'_> {
    /// Solve on the next mesh of the plan, and estimate the error.
    fn solve(&mut self) -> Result<Round> {
        let Self { session, interrupt, .. } = *self;
        let built = self.plan.build(session, interrupt, &mut self.clock)?;
        let begin = collectively(session, self.plan.begin(&built))?;
        let ready = run::set_up(session, built, begin, &mut self.clock)?;
        let typed = session.options().typed();
        let is_monitored = typed.iter().any(|(name, _)| name.contains("monitor") || name.contains("view"));
        self.terminal.decisions(session, &ready)?.iter().for_each(|line| eprintln!("{line}"));
        collectively(session, self.open_tables(&ready))?;
        let scene = &self.plan.scene;
        let is_shown = self.terminal.is_loud() && !is_monitored;
        self.table = IterationTable::new(is_shown, &run::targets(scene), scene.method.stop.residual);
        let stage = session.stage("iterate");
        let mut clock = self.clock.clone();
        let mut done = run::iterate(ready, interrupt, self, &mut clock)?;
        self.clock = clock;
        drop(stage);
        let stage = session.stage("estimate");
        let mut estimate = run::estimate(&mut done, &mut self.clock)?;
        drop(stage);
        self.table.finish();
        let tables = std::mem::take(&mut self.tables).finish();
        self.note(tables);
        estimate.iter_mut().for_each(|estimate| self.plan.correct(&done, estimate));
        Ok(Round { done, estimate })
    }

    /// Open the tables of a round, before the first one of which the folder loses the results of other runs: nothing
    /// can be refused any more.
    fn open_tables(&mut self, ready: &Prepared) -> Result<()> {
        if !self.terminal.is_first {
            return Ok(());
        }
        if !std::mem::replace(&mut self.has_tables, true) {
            self.folder.check(&planned_on_mesh(&ready.built), &inputs(&ready.built.scene))?;
            prepare_folder(&self.folder, self.has_checkpoint)?;
        }
        self.tables = Tables::open(&self.folder, ready)?;
        Ok(())
    }

    /// Print a line for each adapted mesh that has ended, and what the error asked for will take if another one
    /// follows.
    fn print_meshes(&mut self, goes_on: bool) -> Result<()> {
        let rounds = self.plan.reports();
        if !self.terminal.is_loud() || rounds.is_empty() {
            return Ok(());
        }
        if self.shown_meshes == 0 {
            say(RoundReport::HEADS)?;
        }
        for (number, round) in rounds.iter().enumerate().skip(self.shown_meshes) {
            say(round.line(number))?;
        }
        self.shown_meshes = rounds.len();
        let forecast = self.plan.forecast().filter(|_| goes_on && !self.plan.is_stepping());
        forecast.map_or(Ok(()), say)
    }

    /// Write the results of a mesh that is not the last, so that they exist whatever happens on the next mesh.
    fn write_round(&mut self, Round { done, estimate }: Round) {
        let ended = if self.plan.is_stepping() {
            "ended while load steps were at work on the last mesh"
        } else {
            "ended while the next mesh was at work: the error asked for is not reached"
        };
        let mut clock = self.clock.clone();
        let (_, written) = self.files(&done, estimate.as_ref(), false).write(&mut clock, |report| {
            (report.status, report.message) = (RunStatus::Interrupted, ended.to_owned());
        });
        self.clock = clock;
        self.note(written);
    }

    /// Return the results of a round that are to be written.
    fn files<'a>(&'a self, done: &'a Done, estimate: Option<&'a Estimate>, fields: bool) -> ResultFiles<'a> {
        ResultFiles { session: self.session, folder: &self.folder, plan: &self.plan, done, estimate, fields }
    }

    /// Write all results of the last mesh, and return the exit code.
    fn finish(self, Round { done, estimate }: Round) -> Result<i32> {
        let (plan, first, path) = (&self.plan, self.terminal.is_first, self.folder.path());
        let shortfall = plan.shortfall.as_ref().filter(|_| verdict::exit_code(&done) == 0);
        let line = self.terminal.is_loud().then(|| ProgressLine::new("stresses and files", None));
        let (report, written) = self.files(&done, estimate.as_ref(), true).write(&mut self.clock.clone(), |report| {
            report.unmet.clone_from(&plan.unmet);
            shortfall.iter().for_each(|shortfall| shortfall.put_into(report));
        });
        drop(line);
        let code = shortfall.map_or(verdict::exit_code(&done), Shortfall::exit_code);
        if first {
            if self.has_checkpoint && verdict::exit_code(&done) == 0 {
                // nothing is left to go on with; it is no failure if the file is gone already
                let _ = std::fs::remove_file(path.join(checkpoint::FILE));
            }
            self.print(&report, &done, code)?;
        }
        self.written.and(written)?;
        Ok(code)
    }

    /// Note whether a file was written.
    fn note(&mut self, written: Result<()>) {
        if self.written.is_ok() {
            self.written = written;
        }
    }

    fn print(&self, report: &Report, done: &Done, code: i32) -> Result<()> {
        if self.terminal.json {
            return say(to_json(report)?.trim_end());
        }
        let again = if self.has_checkpoint && code > 1 { "; --restart with this folder goes on" } else { "" };
        let results = format!("  results in {}{again}", self.folder.path().display());
        if self.terminal.is_quiet {
            return say(brief_summary(report, code, &results));
        }
        let solvers: Vec<String> = report.bodies.iter().map(|body| body.solver.clone()).collect();
        let (solvers, choice) = (report::solvers_in_words(&solvers), &done.built.choice);
        say(format!(
            "{}\n  inner solver: {solvers} ({choice})\n{results}",
            report.summary(&unit_words(&done.built.scene))
        ))
    }
}

/// Return the text of a run with `-q`: how it ended if it is not solved, its warnings, and where the results are.
fn brief_summary(report: &Report, code: i32, results: &str) -> String {
    let ended = (code != 0).then(|| format!("{}: {}", report.title, report.message));
    let warnings = warning_lines(&report.warnings, "report.json");
    ended.into_iter().chain(warnings).chain([results.to_owned()]).collect::<Vec<_>>().join("\n")
}

/// Take the folder of results for a run of these scenes, which writes files of these names. The first rank, which
/// writes its tables, locks it.
pub(super) fn claim(session: &Session, path: PathBuf, scenes: &[Rc<Scene>], names: Vec<String>) -> Result<Folder> {
    if session.rank() > 0 {
        return Folder::create(path);
    }
    let folder = Folder::claim(path)?;
    folder.check(&names, &scenes.iter().flat_map(|scene| inputs(scene)).collect::<Vec<_>>())?;
    Ok(folder)
}

/// Remove the results of other runs from the folder.
///
/// If this run `goes_on` from the checkpoint in the folder, the results are its own and stay. Another checkpoint is
/// renamed, since hours of work may be in it.
fn prepare_folder(folder: &Folder, goes_on: bool) -> Result<()> {
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

/// The tables that grow while a round iterates. They are open only on the rank that writes.
#[derive(Default)]
struct Tables {
    /// Rows of the iterations.
    history: Option<HistoryWriter>,
    /// Rows of the load steps, if there are any.
    steps: Option<StepTable>,
}

impl Tables {
    /// Open the tables of a round. The table of load steps begins with those of another process.
    fn open(folder: &Folder, ready: &Prepared) -> Result<Self> {
        let (built, history) = (&ready.built, &ready.built.scene.method.steps);
        let rows = RowFile::create(folder, "history.csv")?;
        let bodies = built.discrete.bodies.iter().map(|body| body.name.clone()).collect();
        let mut tables =
            Self { history: Some(HistoryWriter::new(rows, Vec::new(), bodies, !history.is_empty())), steps: None };
        if !history.is_empty() {
            let (rows, names) = (RowFile::create(folder, "steps.csv")?, results::names_of_results(built));
            let mut steps = StepTable { rows, count: 0, factors: history.names.clone(), names };
            ready.steps.iter().for_each(|step| steps.row(step));
            tables.steps = Some(steps);
        }
        Ok(tables)
    }

    fn finish(self) -> Result<()> {
        let files = [self.history.map(|history| history.rows), self.steps.map(|steps| steps.rows)];
        files.into_iter().flatten().map(RowFile::finish).fold(Ok(()), Result::and)
    }
}

impl Observer for Solver<'_> {
    fn row(&mut self, row: &Row) {
        self.table.row(row);
        if let Some(history) = &mut self.tables.history {
            history.row(row);
        }
    }

    fn asked(&self) -> u8 {
        Observer::asked(self.interrupt)
    }
}

impl Recorder for Solver<'_> {
    fn state(&mut self, done: &Done) {
        let (path, head) = (self.folder.path(), self.plan.head());
        let written = match self.session.rank() {
            0 => Checkpoint::write(path, head, &self.plan.requested, done),
            _ => Ok(()),
        };
        self.has_checkpoint |= written.is_ok();
        self.note(written);
    }

    fn step(&mut self, done: &Done, recovered: &All) {
        let scene = &done.built.scene;
        let history = &scene.method.steps;
        if let (Some(table), Some(step)) = (&mut self.tables.steps, done.steps.last()) {
            table.row(step);
        }
        let is_interrupted = matches!(done.outcome.status, Status::Interrupted { .. });
        let ends = done.steps.len() == history.steps.len() || is_interrupted;
        if !ends {
            self.note(write_step_tables(done, &self.folder).and(write_fields(done, recovered, &self.folder, false)));
        }
    }
}
