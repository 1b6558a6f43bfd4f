//! `winkler sweep`: solve a scene for every combination of values of its keys in one process, one row of a table for
//! each run. A run takes over what it can from the run before it.

use super::cases::{Case, CaseAxis, CasePlan};
use super::plots::Plots;
use super::rows::CaseRow;
use super::solve::claim;
use super::write::to_json;
use super::{SceneArgs, Terminal, VerbosityArgs, folder_of};
use crate::ddm::{InitialGuess, Observer, Outcome, Solution, Status};
use crate::discretize::Discrete;
use crate::error::{Error, Kind, Result};
use crate::interrupt::Interrupt;
use crate::output::tables::{self, Cell, HistoryWriter};
use crate::output::{Folder, LISTED, Report, ResultNames, RowFile, busiest, say, terminal};
use crate::parallel::collectively;
use crate::petsc::Session;
use crate::problem::{MethodName, MethodSpec, Start};
use crate::run::{self, Begin, Clock, Done, Prepared, report, results, verdict};
use crate::scene::Scene;
use indicatif::ProgressBar;
use std::path::PathBuf;
use std::rc::Rc;

/// The command line of `winkler sweep`.
#[derive(clap::Args)]
pub struct SweepArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// Folder for the results [default: output.dir of the scene, else results/CASE]
    #[arg(short, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Key and its values, for example method.gamma=0.3,0.6; may be repeated
    #[arg(long, value_name = "KEY=V1,V2,...", required = true)]
    over: Vec<String>,
    #[command(flatten)]
    verbosity: VerbosityArgs,
}

/// Solve a scene for every combination of values, and write `sweep.csv`, `history.csv`, `convergence.svg` and
/// `pressure.svg`.
///
/// Return the exit code: that of a run that did not converge, if there is one. A signal ends the sweep with the run
/// under way.
///
/// # Errors
/// Refusals of any scene of the sweep, before the first run; failures of the file system.
pub fn sweep(session: &Session, interrupt: &Interrupt, request: &SweepArgs) -> Result<i32> {
    let plan = collectively(session, plan(request))?;
    let text = super::text_of(session, &request.scene.scene)?;
    let load = |case: &Case| {
        let own = case.overrides.iter().map(|text| format!("--over {text}"));
        let overrides: Vec<String> = request.scene.overrides.iter().cloned().chain(own).collect();
        crate::scene::parse(&case.scene, text.clone(), &overrides, &request.scene.flags).map(Rc::new)
    };
    let scenes = plan.cases.iter().map(load).collect::<Result<Vec<Rc<Scene>>>>();
    let scenes = collectively(session, scenes.and_then(without_adaptation))?;
    let folder = collectively(
        session,
        claim(session, folder_of(&scenes[0], request.output.as_ref()), &scenes, planned(&scenes[0])),
    )?;
    let terminal = Terminal::new(session, &request.scene, &request.verbosity);
    let bar = terminal::runs(plan.cases.len(), terminal.is_loud());
    let has_steps = scenes.iter().any(|scene| !scene.method.steps.is_empty());
    let mut sweep = Sweep {
        session,
        interrupt,
        terminal,
        folder,
        bar,
        plan: &plan,
        names: None,
        has_steps,
        table: None,
        history: None,
        shown: None,
        plots: Plots::default(),
        reports: Vec::new(),
    };
    let mut requests = interrupt.clone();
    let (mut exit, mut before) = (0, None);
    for (case, scene) in plan.cases.iter().zip(&scenes) {
        let mut clock = Clock::default();
        sweep.bar.set_message(case.label.clone());
        let mut done = sweep.solve(case, scene, before.take(), &mut requests, &mut clock)?;
        let estimate = run::estimate(&mut done, &mut clock)?;
        clock.total();
        let report = report::report(session, &done, &results::recover(&done), estimate.as_ref(), &clock);
        exit = exit.max(verdict::exit_code(&done));
        if session.rank() == 0 {
            sweep.add(case, &done, report)?;
        }
        if matches!(done.outcome.status, Status::Interrupted { .. }) {
            break;
        }
        before = Some(done);
    }
    sweep.bar.finish_and_clear();
    if session.rank() == 0 {
        sweep.finish(scenes[0].output.plots)?;
    }
    Ok(exit)
}

/// Refuse scenes that are to be adapted: a sweep solves each on its own mesh, and a loose tolerance of the iteration
/// would be all that is left.
fn without_adaptation(scenes: Vec<Rc<Scene>>) -> Result<Vec<Rc<Scene>>> {
    if scenes.iter().all(|scene| scene.adapt.is_none()) {
        return Ok(scenes);
    }
    let error = Error::new(Kind::Usage, "`sweep` solves every value on one mesh, and adapts none");
    Err(error.help(
        "leave --tolerance and [adapt] away, and take --estimate for the errors; `solve` adapts the mesh of one scene",
    ))
}

/// Return the names of the files that a sweep writes, but for plots beyond the first.
fn planned(scene: &Scene) -> Vec<String> {
    let plots = ["convergence.svg", "pressure.svg"].into_iter().filter(|_| scene.output.plots);
    plots.chain(["sweep.csv"]).map(str::to_owned).collect()
}

/// Return the cases of a request.
fn plan(request: &SweepArgs) -> Result<CasePlan> {
    let axes = request.over.iter().map(|text| CaseAxis::over(text)).collect::<Result<Vec<_>>>()?;
    let mut plan = CasePlan::new(axes.iter().map(|axis| axis.name.clone()).collect());
    plan.add(request.scene.scene.clone(), &axes, &[], &[]);
    plan.label_cases(0);
    Ok(plan)
}

/// The sweep under way: what it prints and the table that it writes.
struct Sweep<'a> {
    session: &'a Session,
    interrupt: &'a Interrupt,
    terminal: Terminal,
    folder: Folder,
    bar: ProgressBar,
    plan: &'a CasePlan,
    /// Names of pairs and reactions, the same for all runs.
    names: Option<ResultNames>,
    /// Whether some run has load steps.
    has_steps: bool,
    /// `sweep.csv` and `history.csv`, on the first rank and from the first run on.
    table: Option<RowFile>,
    history: Option<HistoryWriter>,
    /// Pairs whose pressures are drawn, the same for all runs.
    shown: Option<Vec<usize>>,
    plots: Plots,
    reports: Vec<Report>,
}

impl Sweep<'_> {
    /// Solve the problem of a run, from the pressures of the run before where this may save steps, and from its own
    /// start if there is no solution from there. Collective.
    fn solve(
        &mut self,
        case: &Case,
        scene: &Rc<Scene>,
        before: Option<Done>,
        requests: &mut Interrupt,
        clock: &mut Clock,
    ) -> Result<Done> {
        let near = before.as_ref().and_then(|before| pressures(before, scene));
        let is_near = near.is_some();
        let ready = self.prepare(case, scene, before, near, clock)?;
        let done = run::iterate(ready, self.interrupt, requests, clock)?;
        let status = &done.outcome.status;
        if !is_near || status.is_solved() || matches!(status, Status::Interrupted { .. }) {
            return Ok(done);
        }
        let ready = self.prepare(case, scene, Some(done), None, clock)?;
        run::iterate(ready, self.interrupt, requests, clock)
    }

    /// Build the problem of a run, with what the run before has left, and set up its method, with these pressures of
    /// the run before if it has the same contact points. Collective.
    fn prepare(
        &mut self,
        case: &Case,
        scene: &Rc<Scene>,
        before: Option<Done>,
        pressures: Option<Vec<f64>>,
        clock: &mut Clock,
    ) -> Result<Prepared> {
        let session = self.session;
        let built = run::build_after(session, scene.clone(), before, self.interrupt, clock)?;
        let own = results::names_of_results(&built);
        let is_same = *self.names.get_or_insert_with(|| own.clone()) == own;
        collectively(session, if is_same { Ok(()) } else { Err(other_columns(&case.label)) })?;
        let Discrete { model, is_renewed, .. } = &built.discrete;
        let start = pressures.filter(|p| *is_renewed && p.len() == model.points()).map(|pressures| {
            let compression = model.compressions_of(&pressures);
            InitialGuess::Known(Box::new(Solution { compression, ..Solution::default() }))
        });
        let ready = run::set_up(session, built, Begin { start, ..Begin::default() }, clock)?;
        if session.rank() == 0 && self.table.is_none() {
            // before anything is computed that could be lost
            self.folder.clear()?;
            self.table = Some(RowFile::create(&self.folder, "sweep.csv")?);
            let rows = RowFile::create(&self.folder, "history.csv")?;
            let bodies = ready.built.discrete.bodies.iter().map(|body| body.name.clone()).collect();
            self.history = Some(HistoryWriter::new(rows, self.plan.fields(case).collect(), bodies, self.has_steps));
        }
        let decisions = self.terminal.decisions(session, &ready)?;
        self.bar.suspend(|| decisions.iter().for_each(|line| eprintln!("{line}")));
        Ok(ready)
    }

    /// Write the row of a run to the table, print it, and keep its report and its curves.
    fn add(&mut self, case: &Case, done: &Done, report: Report) -> Result<()> {
        let row = CaseRow::from(&report);
        let scene = &done.built.scene;
        if let (Some(table), Some(names)) = (&mut self.table, &self.names) {
            let fields = self.plan.fields(case).chain(row.fields()).chain(result_fields(&report, names));
            table.push(&fields.collect::<Vec<_>>());
        }
        if let Some(history) = &mut self.history {
            history.first = self.plan.fields(case).collect();
            done.earlier.iter().chain(&done.outcome.rows).for_each(|row| history.row(row));
        }
        self.bar.inc(1);
        // with `-q` only runs that are not solved are printed
        if self.terminal.is_loud() || (!self.terminal.json && verdict::exit_code(done) != 0) {
            self.bar.suspend(|| say(row.line(&case.label)))?;
        }
        let most = scene.output.pairs.unwrap_or(LISTED);
        let shown = self.shown.get_or_insert_with(|| busiest(report.results(), most));
        self.plots.add(&case.label, done, shown);
        self.reports.push(report);
        Ok(())
    }

    /// End the table, draw the plots if they are wanted, and print the reports or the folder.
    fn finish(self, has_plots: bool) -> Result<()> {
        let tables = [self.table, self.history.map(|history| history.rows)];
        let mut written = tables.into_iter().flatten().map(RowFile::finish).fold(Ok(()), Result::and);
        if has_plots {
            written = written.and(self.plots.write(&self.folder));
        }
        if self.terminal.json {
            say(to_json(&self.reports)?.trim_end())?;
        } else {
            say(format_args!("results in {}", self.folder.path().display()))?;
        }
        written
    }
}

/// Return the fields of all pairs and reactions.
fn result_fields(report: &Report, names: &ResultNames) -> Vec<Cell> {
    let pairs = || report.pairs.iter().zip(&names.pairs);
    let estimates = pairs().filter_map(|(pair, name)| Some((pair.estimate?.pressure_estimate, name)));
    let mut fields: Vec<Cell> =
        estimates.map(|(error, name)| tables::number(format!("pressure_estimate {name}"), error)).collect();
    fields.extend(pairs().flat_map(|(pair, name)| names.of_run(&pair.result, name)));
    fields.extend(names.reactions(&results::reported(&report.bodies)));
    fields
}

/// Return the pressures of the run before, if Newton's method may start from them: where the scene has no start of its
/// own, and the same method and solver, so that the iterations of methods and solvers can be compared.
fn pressures(before: &Done, scene: &Scene) -> Option<Vec<f64>> {
    let MethodSpec { name, start, steps, .. } = &scene.method;
    let is_newton = !matches!(name, MethodName::Robin | MethodName::Semismooth);
    let is_free = is_newton && matches!(start, Start::Auto) && steps.is_empty();
    let [earlier, settings] = [&before.built.scene, scene].map(Scene::settings);
    let is_same = ["method", "solver"].iter().all(|key| earlier[key] == settings[key]);
    let Outcome { status, layer, .. } = &before.outcome;
    (is_free && is_same && status.is_solved()).then(|| layer.pressure.clone())
}

/// Return the refusal of a run, named by its label, whose row would have other columns than those before.
fn other_columns(label: &str) -> Error {
    let message = format!("with {label} the scene has other contacts or supports than in the runs before");
    Error::new(Kind::Usage, message)
        .because("all rows of sweep.csv have the same columns")
        .help("sweep over values that leave them as they are; the rows so far are kept")
}
