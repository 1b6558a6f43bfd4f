//! `winkler sweep`: solve a scene for every combination of values of its keys in one process, one row of a table for each run.
//! A run takes over what it can from the run before it.

use super::cases::{Axis, Case, Plan};
use super::plots::Plots;
use super::rows::Row;
use super::solve::claim;
use super::write::to_json;
use super::{SceneArgs, Terminal, VerbosityArgs, folder_of};
use crate::ddm::Status;
use crate::error::{Error, Kind, Result};
use crate::interrupt::Interrupt;
use crate::output::tables::{contact_column, vector_columns, vector_fields};
use crate::output::{Folder, LISTED, Report, RowFile, busiest, say, terminal};
use crate::parallel::collectively;
use crate::petsc::Session;
use crate::run::{self, Begin, Built, Clock, Done, Prepared, report, results, verdict};
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

/// Solve a scene for every combination of values, and write `sweep.csv`, `convergence.svg` and `pressure.svg`.
///
/// Return the exit code: that of a run that did not converge, if there is one. A signal ends the sweep with the run under way.
///
/// # Errors
/// Refusals of any scene of the sweep, before the first run; failures of the file system.
pub fn sweep(session: &Session, interrupt: &Interrupt, request: &SweepArgs) -> Result<i32> {
    let plan = collectively(session, plan(request))?;
    let text = super::text_of(session, &request.scene.scene)?;
    let load = |case: &Case| {
        let own = case.overrides.iter().map(|text| format!("--over {text}"));
        let overrides: Vec<String> = request.scene.overrides().into_iter().chain(own).collect();
        crate::scene::parse(&case.scene, text.clone(), &overrides).map(Rc::new)
    };
    let scenes = collectively(session, plan.cases.iter().map(load).collect::<Result<Vec<Rc<Scene>>>>())?;
    let folder = collectively(session, claim(session, folder_of(&scenes[0], request.output.as_ref())))?;
    let terminal = Terminal::new(session, &request.scene, &request.verbosity);
    let bar = terminal::runs(plan.cases.len(), terminal.is_loud());
    let mut sweep = Sweep {
        session,
        interrupt,
        terminal,
        folder,
        bar,
        columns: plan.columns.clone(),
        header: None,
        table: None,
        shown: None,
        plots: Plots::default(),
        reports: Vec::new(),
    };
    let mut requests = interrupt.clone();
    let (mut exit, mut before) = (0, None);
    for (case, scene) in plan.cases.iter().zip(&scenes) {
        let mut clock = Clock::default();
        sweep.bar.set_message(case.label.clone());
        let ready = sweep.prepare(case, scene, before.take(), &mut clock)?;
        let done = run::iterate(ready, interrupt, &mut requests, &mut clock)?;
        clock.total();
        let report = report::report(session, &done, &results::recover(&done), &clock);
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

/// Return the cases of a request.
fn plan(request: &SweepArgs) -> Result<Plan> {
    let axes = request.over.iter().map(|text| Axis::over(text)).collect::<Result<Vec<_>>>()?;
    let mut plan = Plan::new(axes.iter().map(|axis| axis.name.clone()).collect());
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
    /// Names of the axes.
    columns: Vec<String>,
    /// All columns of the table, from the first run on.
    header: Option<Vec<String>>,
    /// `sweep.csv`, on the first rank and from the first run on.
    table: Option<RowFile>,
    /// Pairs whose pressures are drawn, the same for all runs.
    shown: Option<Vec<usize>>,
    plots: Plots,
    reports: Vec<Report>,
}

impl Sweep<'_> {
    /// Build the problem of a run, with what the run before has left, and set up its method. Collective.
    fn prepare(&mut self, case: &Case, scene: &Rc<Scene>, before: Option<Done>, clock: &mut Clock) -> Result<Prepared> {
        let session = self.session;
        let built = run::build_after(session, scene.clone(), before, self.interrupt, clock)?;
        let own = [self.columns.clone(), Row::columns(), pair_columns(&built)].concat();
        let header = self.header.get_or_insert_with(|| own.clone());
        collectively(session, refuse_other_columns(header, &own, &case.label))?;
        let ready = run::set_up(session, built, Begin::default(), clock)?;
        if session.rank() == 0 && self.table.is_none() {
            // before anything is computed that could be lost
            self.folder.clear()?;
            self.table = Some(RowFile::create(&self.folder, "sweep.csv", &own)?);
        }
        let decisions = self.terminal.decisions(session, &ready)?;
        self.bar.suspend(|| decisions.iter().for_each(|line| eprintln!("{line}")));
        Ok(ready)
    }

    /// Write the row of a run to the table, print it, and keep its report and its curves.
    fn add(&mut self, case: &Case, done: &Done, report: Report) -> Result<()> {
        let row = Row::of_report(&serde_json::json!(report));
        let scene = &done.built.scene;
        let fields = [case.key.clone(), row.fields(), pair_fields(&report, scene.dimension.value)].concat();
        self.table.iter_mut().for_each(|table| table.push(&fields));
        self.bar.inc(1);
        // with `-q` only runs that are not solved are printed
        if self.terminal.is_loud() || (!self.terminal.json && verdict::exit_code(done) != 0) {
            self.bar.suspend(|| say(row.line(&case.label)))?;
        }
        let most = scene.output.pairs.map_or(LISTED, |most| most.0);
        let shown = self.shown.get_or_insert_with(|| busiest(&report.pairs, most));
        self.plots.add(&case.label, done, shown);
        self.reports.push(report);
        Ok(())
    }

    /// End the table, draw the plots if they are wanted, and print the reports or the folder.
    fn finish(self, has_plots: bool) -> Result<()> {
        let mut written = self.table.map_or(Ok(()), RowFile::finish);
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

/// Return the names of the columns of all pairs and reactions; [`pair_fields`] has their texts.
fn pair_columns(built: &Built) -> Vec<String> {
    let (dimension, measure) = (built.scene.dimension.value, results::of_points(built));
    let mut header = Vec::new();
    for pair in results::pair_names(built) {
        let what = ["peak_pressure", &contact_column(measure), "layer_energy"];
        header.extend(what.map(|what| format!("{what} {pair}")));
        header.extend(vector_columns("force", &pair, dimension));
        header.push(format!("approach {pair}"));
    }
    header.extend(results::reaction_names(built).iter().flat_map(|name| vector_columns("reaction", name, dimension)));
    header
}

fn pair_fields(report: &Report, dimension: usize) -> Vec<String> {
    let mut fields = Vec::new();
    for pair in &report.pairs {
        fields.extend([pair.peak_pressure, pair.extent.contact(), pair.layer_energy].map(|value| format!("{value:?}")));
        fields.extend(vector_fields(&pair.force[0], dimension));
        fields.push(pair.approach.map_or(String::new(), |approach| format!("{approach:?}")));
    }
    let reactions = results::reported(&report.bodies);
    fields.extend(reactions.iter().flat_map(|reaction| vector_fields(&reaction.force, dimension)));
    fields
}

/// Refuse a run, named by its label, whose row would have other columns than those before.
fn refuse_other_columns(columns: &[String], own: &[String], label: &str) -> Result<()> {
    if columns == own {
        return Ok(());
    }
    Err(Error::new(
        Kind::Usage,
        format!("with {label} the scene has other contacts or supports than in the runs before"),
    )
    .because("all rows of sweep.csv have the same columns")
    .help("sweep over values that leave them as they are; the rows so far are kept"))
}
