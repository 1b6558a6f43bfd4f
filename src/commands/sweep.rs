//! `winkler sweep`: solve a scene for every combination of values of its keys, one row of a table for each run.
//! A run takes over what it can from the run before it.

use super::axes::{AxisValue, SweepAxis, combinations, named};
use super::solve::claim;
use super::write::{Plots, to_json};
use super::{SceneArgs, Terminal, VerbosityArgs, folder_of};
use crate::ddm::Status;
use crate::error::{Error, Kind, Result};
use crate::interrupt::Interrupt;
use crate::output::tables::{contact_column, vector_columns, vector_fields};
use crate::output::{Folder, LISTED, Report, RowFile, busiest, say, sci, terminal};
use crate::parallel::collectively;
use crate::petsc::Session;
use crate::run::{self, Begin, Built, Clock, Done, Prepared, Requests, report, results, verdict};
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
    let axes = collectively(session, SweepAxis::all_over(&request.over))?;
    let load = |choices: Vec<&AxisValue>| SweepCase::load(request, &axes, &choices);
    let cases = collectively(session, combinations(&axes).into_iter().map(load).collect::<Result<Vec<_>>>())?;
    let scenes: Vec<&Scene> = cases.iter().map(|case| &*case.scene).collect();
    run::refuse_other_scenes(session, &scenes)?;
    let folder = collectively(session, claim(session, folder_of(scenes[0], request.output.as_ref())))?;
    let terminal = Terminal::new(session, &request.scene, &request.verbosity);
    let bar = terminal::runs(cases.len(), terminal.is_loud());
    let mut sweep = SweepOutput {
        session,
        interrupt,
        terminal,
        folder,
        bar,
        columns: None,
        table: None,
        shown: None,
        plots: Plots::default(),
        reports: Vec::new(),
    };
    let mut requests = Requests::new(interrupt, None);
    let (mut exit, mut before) = (0, None);
    for case in &cases {
        let mut clock = Clock::default();
        sweep.bar.set_message(case.label.clone());
        let ready = sweep.prepare(&axes, case, before.take(), &mut clock)?;
        let done = run::iterate(ready, interrupt, &mut requests, &mut clock)?;
        clock.total();
        let report = report::report(session, &done, &results::recover(&done), &clock);
        exit = exit.max(verdict::exit_code(&done));
        if session.rank() == 0 {
            sweep.write_row(case, &done, &report)?;
            sweep.collect(case, &done, report);
        }
        if matches!(done.outcome.status, Status::Paused { .. }) {
            break;
        }
        before = Some(done);
    }
    sweep.bar.finish_and_clear();
    if session.rank() == 0 {
        sweep.finish(cases[0].scene.output.plots)?;
    }
    Ok(exit)
}

struct SweepCase {
    /// Values of the keys, in the order of the axes.
    values: Vec<String>,
    /// The values with their keys, as they are printed.
    label: String,
    scene: Rc<Scene>,
}

impl SweepCase {
    /// Load the scene with the values of a run.
    fn load(request: &SweepArgs, axes: &[SweepAxis], choices: &[&AxisValue]) -> Result<Self> {
        let own = choices.iter().flat_map(|choice| &choice.overrides).map(|text| format!("--over {text}"));
        let overrides: Vec<String> = request.scene.overrides().into_iter().chain(own).collect();
        let scene = Rc::new(crate::scene::load(&request.scene.scene, &overrides)?);
        let values: Vec<String> = choices.iter().map(|choice| choice.text.clone()).collect();
        let keys: Vec<String> = axes.iter().map(|axis| axis.name.clone()).collect();
        let parts: Vec<String> = keys.iter().zip(&values).map(|(key, value)| named(key, value, &keys)).collect();
        Ok(SweepCase { values, label: parts.join(", "), scene })
    }
}

/// The sweep under way: what it prints and the table that it writes.
struct SweepOutput<'a> {
    session: &'a Session,
    interrupt: &'a Interrupt,
    terminal: Terminal,
    folder: Folder,
    bar: ProgressBar,
    /// Columns of the table, from the first run on.
    columns: Option<Vec<String>>,
    /// `sweep.csv`, on the first rank and from the first run on.
    table: Option<RowFile>,
    /// Pairs whose pressures are drawn, the same for all runs.
    shown: Option<Vec<usize>>,
    plots: Plots,
    reports: Vec<Report>,
}

impl SweepOutput<'_> {
    /// Build the problem of a run, with what the run before has left, and set up its method. Collective.
    fn prepare(
        &mut self,
        axes: &[SweepAxis],
        case: &SweepCase,
        before: Option<Done>,
        clock: &mut Clock,
    ) -> Result<Prepared> {
        let session = self.session;
        let built = run::build_after(session, case.scene.clone(), before, self.interrupt, clock)?;
        let header = header(axes, &built);
        let columns = self.columns.get_or_insert_with(|| header.clone());
        collectively(session, refuse_other_columns(columns, &header, &case.label))?;
        let ready = run::set_up(session, built, Begin::default(), clock)?;
        if session.rank() == 0 && self.table.is_none() {
            // before anything is computed that could be lost
            self.folder.clear()?;
            self.table = Some(RowFile::create(&self.folder, "sweep.csv", &header, &[])?);
        }
        let decisions = self.terminal.decisions(session, &ready)?;
        self.bar.suspend(|| decisions.iter().for_each(|line| eprintln!("{line}")));
        Ok(ready)
    }

    /// Write the row of a run to the table, and print how the run ended.
    fn write_row(&mut self, case: &SweepCase, done: &Done, report: &Report) -> Result<()> {
        if let Some(table) = &mut self.table {
            table.push(&line(&case.values, report, case.scene.dimension.value));
            table.complaint().iter().for_each(|text| self.bar.suspend(|| eprintln!("warning: {text}")));
        }
        self.bar.inc(1);
        // with `-q` only runs that are not solved are printed
        if self.terminal.is_loud() || (!self.terminal.json && verdict::exit_code(done) != 0) {
            let (label, status, iterations) = (&case.label, &report.status, report.iterations);
            let residual = sci(report.residual.unwrap_or(f64::NAN), 2);
            self.bar
                .suspend(|| say(format_args!("{label}: {status}, {iterations} iterations, residual {residual}")))?;
        }
        Ok(())
    }

    /// Add a run to the plots and the reports.
    fn collect(&mut self, case: &SweepCase, done: &Done, report: Report) {
        let most = case.scene.output.pairs.map_or(LISTED, |most| most.0);
        let shown = self.shown.get_or_insert_with(|| busiest(&report.pairs, most));
        self.plots.add(&case.label, done, shown);
        self.reports.push(report);
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

/// Return the names of the columns; [`line`] has their texts.
fn header(axes: &[SweepAxis], built: &Built) -> Vec<String> {
    let (pairs, reactions) = (results::pair_names(built), results::reaction_names(built));
    let (dimension, measure) = (built.scene.dimension.value, results::of_points(built));
    let mut header: Vec<String> = axes.iter().map(|axis| axis.name.clone()).collect();
    let columns = "status iterations sweeps factorizations dense_factorizations inner_iterations residual increment F1 dofs seconds";
    header.extend(columns.split_whitespace().map(str::to_owned));
    for pair in &pairs {
        header.extend(["peak_pressure", &contact_column(measure), "layer_energy"].map(|what| format!("{what} {pair}")));
        header.extend(vector_columns("force", pair, dimension));
        header.push(format!("approach {pair}"));
    }
    header.extend(reactions.iter().flat_map(|name| vector_columns("reaction", name, dimension)));
    header
}

fn line(values: &[String], report: &Report, dimension: usize) -> Vec<String> {
    let number = |value: Option<f64>| value.map_or(String::new(), |value| format!("{value:?}"));
    let mut line = values.to_vec();
    line.push(report.status.clone());
    let factored = [report.factorizations, report.dense_factorizations];
    let counts = [report.iterations, report.sweeps, factored[0], factored[1], report.inner_iterations];
    line.extend(counts.map(|count| count.to_string()));
    line.extend([report.residual, report.increment, report.f1].map(number));
    line.push(report.dofs.to_string());
    line.push(number(report.times.get("total").copied()));
    for pair in &report.pairs {
        line.extend([pair.peak_pressure, pair.extent.contact(), pair.layer_energy].map(|value| format!("{value:?}")));
        line.extend(vector_fields(&pair.force[0], dimension));
        line.push(number(pair.approach));
    }
    let reactions = results::reported(&report.bodies);
    line.extend(reactions.iter().flat_map(|reaction| vector_fields(&reaction.force, dimension)));
    line
}

/// Refuse a run, named by its label, whose row would have other columns than those before.
fn refuse_other_columns(columns: &[String], header: &[String], label: &str) -> Result<()> {
    if columns == header {
        return Ok(());
    }
    Err(Error::new(
        Kind::Usage,
        format!("with {label} the scene has other contacts or supports than in the runs before"),
    )
    .because("all rows of sweep.csv have the same columns")
    .help("sweep over values that leave them as they are; the rows so far are kept"))
}
