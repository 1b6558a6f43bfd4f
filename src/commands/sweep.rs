//! `winkler sweep`: a scene over values of its keys, one row a run.

use super::solve::claim;
use super::typed::{Manner, SceneArgs};
use super::write::to_json;
use super::{curves, folder_of, reuse, said};
use crate::ddm::{Observer, Row, Status};
use crate::error::{Error, Kind, Result};
use crate::interrupt::Interrupt;
use crate::output::steps::{contact_column, vector_columns, vector_fields};
use crate::output::{
    ConvergenceSeries, Folder, LISTED, Plot, Report, RowFile, Series, Verbosity, busiest, progress, say, sci,
};
use crate::parallel::agree;
use crate::petsc::Session;
use crate::run::words::numbered;
use crate::run::{self, Asking, Begin, Built, Clock, Keep, measure, report, results};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::rc::Rc;

/// What the user typed.
#[derive(clap::Args)]
pub struct Request {
    #[command(flatten)]
    scene: SceneArgs,
    /// Folder for the results [default: output.dir of the scene, else results/CASE]
    #[arg(short, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Key and its values, for example method.gamma=0.3,0.6; may be repeated
    #[arg(long, value_name = "KEY=V1,V2,...", required = true)]
    over: Vec<String>,
    #[command(flatten)]
    manner: Manner,
}

/// Runs a scene for every combination of values and writes `sweep.csv`, `convergence.svg` and `pressure.svg`; returns the
/// exit code: that of a run that did not converge, if there is one. The run that a signal ends is the last.
///
/// # Errors
/// Refusals of any scene of the sweep, before the first run; failures of the file system.
pub fn sweep(session: &Session, interrupt: &Interrupt, request: &Request) -> Result<i32> {
    let axes = agree(session, request.over.iter().map(|text| axis(text)).collect::<Result<Vec<_>>>())?;
    let runs = combinations(&axes);
    let load = |values: &[String]| {
        let mut overrides = request.scene.overrides();
        overrides.extend(values.iter().zip(&axes).map(|(value, (key, _))| format!("--over {key}={value}")));
        crate::scene::load(&request.scene.scene, &overrides).map(Rc::new)
    };
    let scenes = agree(session, runs.iter().map(|values| load(values)).collect::<Result<Vec<_>>>())?;
    run::refuse_other_scenes(session, &scenes)?;
    let folder = agree(session, claim(session, folder_of(&scenes[0], request.output.as_ref())))?;
    let first = session.rank() == 0;
    let (mut table, mut columns) = (None::<RowFile>, None);
    let mut exit = 0;
    let (mut reports, mut histories, mut pressures, mut reference) = (Vec::new(), Vec::new(), Pressures::new(), None);
    // the same pairs of all runs
    let mut shown = None;
    let mut before = None;
    let mut watched = Watched(Asking::new(interrupt, None));
    let (json, verbosity) = (request.scene.json, request.manner.verbosity());
    let is_loud = first && !json && verbosity != Verbosity::Quiet;
    let bar = progress::runs(runs.len(), is_loud);
    for (scene, values) in scenes.iter().zip(&runs) {
        let mut clock = Clock::default();
        bar.set_message(label(&axes, values));
        let built = reuse::build(session, scene.clone(), before.take(), interrupt, &mut clock)?;
        let header = header(&axes, &built);
        agree(session, same(columns.get_or_insert_with(|| header.clone()), &header, &label(&axes, values)))?;
        let ready = run::set_up(session, built, Begin::default(), &mut clock)?;
        if first && table.is_none() {
            // before anything is computed that could be lost
            folder.clear()?;
            table = Some(RowFile::create(&folder, "sweep.csv", &header, &[])?);
        }
        if verbosity == Verbosity::Verbose {
            let decided = said::decisions(session, &ready)?;
            bar.suspend(|| decided.iter().filter(|_| first).for_each(|line| eprintln!("{line}")));
        }
        let done = run::iterate(ready, interrupt, &mut watched, &mut clock)?;
        clock.total();
        let report = report::report(session, &done, &results::recover(&done), &clock);
        exit = exit.max(report::exit_code(&done));
        let interrupted = matches!(done.outcome.status, Status::Paused { .. });
        if !first {
            if interrupted {
                break;
            }
            before = Some(done);
            continue;
        }
        let label = label(&axes, values);
        if let Some(table) = &mut table {
            table.push(&line(values, &report, scene.dimension.value));
            table.complaint().iter().for_each(|text| bar.suspend(|| eprintln!("warning: {text}")));
        }
        bar.inc(1);
        // with `-q` runs that are solved say nothing
        if is_loud || (!json && report::exit_code(&done) != 0) {
            let (status, iterations) = (&report.status, report.iterations);
            let residual = sci(report.residual.unwrap_or(f64::NAN), 2);
            bar.suspend(|| say(format_args!("{label}: {status}, {iterations} iterations, residual {residual}")))?;
        }
        histories.push(curves::convergence(&label, &done.outcome));
        let pairs = &done.model().pairs;
        let shown = shown.get_or_insert_with(|| busiest(&report.pairs, scenes[0].output.pairs.unwrap_or(LISTED)));
        for &i in shown.iter().filter(|&&i| pairs.get(i).is_some_and(|pair| pair.along_curve)) {
            let empty = || curves::pressure_plot(&scene.title, scene, &pairs[i], Vec::new());
            pressures.entry(i).or_insert_with(empty).series.push(curves::pressure(&label, &done, i));
            if let Some(curve) = curves::reference(&done.built.discrete, i) {
                reference.get_or_insert((i, curve));
            }
        }
        reports.push(report);
        if interrupted {
            break;
        }
        before = Some(done);
    }
    bar.finish_and_clear();
    if first {
        let mut written = table.map_or(Ok(()), RowFile::finish);
        if scenes[0].output.plots {
            written = written.and(plots(&folder, &scenes[0].title, &histories, pressures, reference));
        }
        if json {
            say(to_json(&reports)?.trim_end())?;
        } else {
            say(format_args!("results in {}", folder.path().display()))?;
        }
        written?;
    }
    Ok(exit)
}

/// Nobody looks at the rows of a sweep, but signals are heard.
struct Watched(Asking);

impl Observer for Watched {
    fn row(&mut self, _row: &Row) {}

    fn asked(&self) -> u8 {
        self.0.bits()
    }
}

impl Keep for Watched {}

/// One `--over`: key and values. Commas inside brackets, braces, parentheses or quotes do not separate.
pub(super) fn axis(text: &str) -> Result<(String, Vec<String>)> {
    let refuse = || {
        Error::new(Kind::Usage, format!("`--over {text}` is not KEY=V1,V2,..."))
            .help("for example --over method.gamma=0.3,0.6,0.9")
    };
    let (key, list) = text.split_once('=').ok_or_else(refuse)?;
    let mut values = vec![String::new()];
    let (mut depth, mut quote) = (0, None);
    for c in list.chars() {
        match (quote, c) {
            (None, '"' | '\'') => quote = Some(c),
            (Some(open), c) if c == open => quote = None,
            (None, '[' | '{' | '(') => depth += 1,
            (None, ']' | '}' | ')') => depth -= 1,
            (None, ',') if depth == 0 => {
                values.push(String::new());
                continue;
            }
            _ => {}
        }
        if let Some(value) = values.last_mut() {
            value.push(c);
        }
    }
    if key.trim().is_empty() || values.iter().any(|value| value.trim().is_empty()) {
        return Err(refuse());
    }
    Ok((key.trim().to_owned(), values.into_iter().map(|value| value.trim().to_owned()).collect()))
}

pub(super) fn combinations(axes: &[(String, Vec<String>)]) -> Vec<Vec<String>> {
    axes.iter().fold(vec![Vec::new()], |runs, (_, values)| {
        runs.iter()
            .flat_map(|run| values.iter().map(move |value| [run.clone(), vec![value.clone()]].concat()))
            .collect()
    })
}

fn label(axes: &[(String, Vec<String>)], values: &[String]) -> String {
    let parts = axes.iter().zip(values).map(|((key, _), value)| {
        let last = |key: &str| key.rsplit('.').next().unwrap_or(key).to_owned();
        let ambiguous = axes.iter().filter(|(other, _)| last(other) == last(key)).count() > 1;
        let short = if ambiguous { key.clone() } else { last(key) };
        format!("{short} = {value}")
    });
    parts.collect::<Vec<_>>().join(", ")
}

fn header(axes: &[(String, Vec<String>)], built: &Built) -> Vec<String> {
    let (pairs, reactions) = (measure::pair_names(built), measure::reaction_names(built));
    let (dimension, measure) = (built.scene.dimension.value, measure::of_points(built));
    let mut header: Vec<String> = axes.iter().map(|(key, _)| key.clone()).collect();
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
    let reactions = measure::reported(&report.bodies);
    line.extend(reactions.iter().flat_map(|reaction| vector_fields(&reaction.force, dimension)));
    line
}

/// Refuses a run, called by its values, whose row would have other columns than those before.
fn same(columns: &[String], header: &[String], run: &str) -> Result<()> {
    if columns == header {
        return Ok(());
    }
    Err(Error::new(Kind::Usage, format!("with {run} the scene has other contacts or supports than in the runs before"))
        .because("all rows of sweep.csv have the same columns")
        .help("sweep over values that leave them as they are; the rows so far are kept"))
}

/// The pressures of all runs along each pair.
type Pressures = BTreeMap<usize, Plot>;

fn plots(
    folder: &Folder,
    title: &str,
    histories: &[ConvergenceSeries],
    pressures: Pressures,
    reference: Option<(usize, Series)>,
) -> Result<()> {
    let convergence = Plot::convergence(title, histories);
    folder.write("convergence.svg", |out| convergence.write(out))?;
    let names = numbered(pressures.iter().map(|_| "pressure".to_owned()));
    for ((pair, of_pair), name) in pressures.into_iter().zip(names) {
        let mut curves = of_pair.series;
        curves.extend(reference.iter().filter(|(index, _)| *index == pair).map(|(_, curve)| curve.clone()));
        let plot = Plot::pressure(title, &of_pair.x.label, &of_pair.y.label, curves);
        folder.write(&format!("{name}.svg"), |out| plot.write(out))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_split_at_commas_outside_brackets_and_all_combinations_made() {
        let a = axis("method.gamma=0.3, 0.6").expect("two numbers");
        assert_eq!(a, ("method.gamma".to_owned(), vec!["0.3".to_owned(), "0.6".to_owned()]));
        let b = axis("contact.0.gap=\"max(x, 1)\",0").expect("an expression and a number");
        assert_eq!(b.1, ["\"max(x, 1)\"", "0"]);
        assert!(axis("method.gamma").is_err() && axis("method.gamma=1,,2").is_err());
        let runs = combinations(&[a, b]);
        assert_eq!(runs.len(), 4);
        assert_eq!(runs[1], ["0.3", "0"]);
    }
}
