//! All files of a run: what is small comes first, so that a full disk takes fields and not results.

use super::adapt::Plan;
use super::{curves, series};
use crate::error::{Error, Kind, Result};
use crate::estimate::Estimate;
use crate::exchange::share;
use crate::output::{Checksums, Folder, LISTED, PairReport, PairRow, Plot, Report, StepReport, busiest, contacts};
use crate::petsc::Session;
use crate::problem::{Plane, force_labels};
use crate::run::words::numbered;
use crate::run::{Clock, Done, measure, report, results};
use serde::Serialize;
use std::path::Path;

/// What is to be written, and where.
pub struct Writing<'a> {
    /// Ranks.
    pub session: &'a Session,
    /// Folder of results.
    pub path: &'a Path,
    /// Meshes before.
    pub plan: &'a Plan,
    /// What was found.
    pub done: &'a Done,
    /// And how good it is.
    pub estimate: Option<&'a Estimate>,
    /// Whether fields may be written, if the scene wants them.
    pub fields: bool,
    /// Whether these are the results that stay: tables of iterations and steps have ended.
    pub is_last: bool,
}

impl Writing<'_> {
    /// Writes tables, report, plots and fields in this order, and the report again with all of their names; what cannot be written
    /// keeps nothing else from it. The report, and the first failure. Collective.
    pub fn all(&self, clock: &mut Clock, change: impl Fn(&mut Report)) -> (Report, Result<()>) {
        let _stage = self.session.stage("output");
        let Self { session, path, plan, done, estimate, .. } = *self;
        let recovered = results::recover(done);
        let make = |clock: &Clock| {
            let mut report = report::report(session, done, &recovered, clock);
            report.discretization_error = estimate.map(report::discretization_error);
            report.rounds.clone_from(&plan.rounds);
            change(&mut report);
            report
        };
        let fields = self.fields && (done.built.scene.output.vtu || done.built.scene.output.msh);
        let first = session.rank() == 0;
        // names of a snapshot are no reason for others
        let folder = match Folder::create(path) {
            Ok(folder) => folder,
            Err(error) => {
                // the others wait for this rank before they end
                share(&*done.model().exchange, ());
                return (make(clock), Err(error));
            }
        };
        let mut report = make(clock);
        let mut written = Ok(());
        if first {
            Checksums::withdraw(path);
            let output = &done.built.scene.output;
            let shown = busiest(&report.pairs, output.pairs.unwrap_or(LISTED));
            report.left_out = left_out(&report.pairs, &shown);
            let plots = Plots::of(done, &shown);
            written = self.small(&folder, &report, &shown, &plots);
            if output.plots || fields {
                // before what is large
                written = written.and(self.report(&folder, &mut report, fields));
            }
            written = written.and(plots.write(done, &folder));
        }
        if fields {
            written = written.and(series::write_last(done, &recovered, &folder));
        }
        clock.phase("output");
        clock.total();
        report.times.clone_from(&clock.times);
        report.memory.clone_from(&clock.memory);
        // the sums are of the files of all ranks
        share(&*done.model().exchange, ());
        if first {
            written = written.and(self.report(&folder, &mut report, fields));
            written = written.and(Checksums::save(&folder, report.files.iter().filter(|name| self.is_final(name))));
        }
        let failed = recovered.iter().flatten().find_map(|body| body.as_ref().err());
        let failed = failed.map(|error| Error::new(error.kind(), error.message()));
        (report, failed.map_or(written, Err))
    }

    /// Tables: one of all pairs, and those of the pairs shown.
    fn small(&self, folder: &Folder, report: &Report, shown: &[usize], plots: &Plots) -> Result<()> {
        let mut rows: Vec<PairRow> = (0..report.pairs.len()).map(|i| report::pair_row(self.done, i)).collect();
        let stems = series::stems(self.done);
        shown.iter().for_each(|&i| rows[i].table = format!("{}.csv", stems[i]));
        plots.plotted.iter().for_each(|(i, file)| rows[*i].plot.clone_from(file));
        let save = |&i: &usize| {
            let table = report::contact_table(self.done, self.estimate, i);
            folder.write(&rows[i].table, |out| table.write(out))
        };
        shown.iter().map(save).fold(contacts::save(folder, &report.pairs, &rows), Result::and)
    }

    fn report(&self, folder: &Folder, report: &mut Report, fields: bool) -> Result<()> {
        report.files = self.names(folder, fields);
        let json = to_json(report)?;
        folder.write("report.json", |out| out.write_all(json.as_bytes()))
    }

    /// Whether a file is not written any more by this run, nor by `winkler report`.
    fn is_final(&self, name: &str) -> bool {
        name != crate::report::FILE && (self.is_last || !["history.csv", "steps.csv"].contains(&name))
    }

    /// Names of the files of a run, those of other ranks included.
    fn names(&self, folder: &Folder, fields: bool) -> Vec<String> {
        let own = folder.files();
        let mut names: Vec<String> = own
            .iter()
            .filter_map(|path| path.strip_prefix(folder.path()).ok())
            .map(|name| name.to_string_lossy().into_owned())
            .collect();
        if fields && self.done.built.scene.output.report {
            names.push(crate::report::FILE.to_owned());
        }
        if fields {
            names.extend(series::of_fields(self.done));
        }
        names.extend(["history.csv", "report.json"].map(str::to_owned));
        names.extend(Some("steps.csv".to_owned()).filter(|_| !self.done.steps.is_empty()));
        names.sort();
        names.dedup();
        names
    }
}

/// A report, or several, as JSON text, ended by a newline.
///
/// # Errors
/// None in practice: a report holds nothing that JSON cannot hold.
pub fn to_json(report: &impl Serialize) -> Result<String> {
    serde_json::to_string_pretty(report)
        .map(|text| text + "\n")
        .map_err(|cause| Error::new(Kind::File, "the report cannot be written as JSON").because(cause.to_string()))
}

/// What the pairs lack that are not `shown` and how to get it, in words; none if all are.
fn left_out(pairs: &[PairReport], shown: &[usize]) -> Option<String> {
    let (all, left) = (pairs.len(), pairs.len() - shown.len());
    (left > 0).then(|| {
        format!(
            "{left} of {all} pairs, those with the smallest forces, have no table and plot of their own; contacts.csv has a row of \
             each, and --set output.pairs=all writes all"
        )
    })
}

/// Approach and force of pair `i` in each step.
fn approach(steps: &[StepReport], i: usize) -> Vec<(f64, f64)> {
    let of_step = |step: &StepReport| {
        let pair = &step.pairs[i];
        (pair.approach.unwrap_or(f64::NAN), pair.force.iter().map(|f| f * f).sum::<f64>().sqrt())
    };
    steps.iter().map(of_step).collect()
}

/// The plots of a run.
struct Plots {
    /// Pairs that are shown.
    shown: Vec<usize>,
    /// Those that have a plot of their pressure, with its file.
    plotted: Vec<(usize, String)>,
}

impl Plots {
    /// Only along curves: points of a surface over one coordinate would be a cloud.
    fn of(done: &Done, shown: &[usize]) -> Self {
        let has_plot = |i: &usize| done.built.scene.output.plots && done.model().pairs[*i].along_curve;
        let plotted: Vec<usize> = shown.iter().copied().filter(has_plot).collect();
        let files = numbered(plotted.iter().map(|_| "pressure".to_owned()));
        let plotted = plotted.into_iter().zip(files.into_iter().map(|name| format!("{name}.svg"))).collect();
        Self { shown: shown.to_vec(), plotted }
    }

    fn write(&self, done: &Done, folder: &Folder) -> Result<()> {
        let (scene, model) = (&done.built.scene, done.model());
        if !scene.output.plots {
            return Ok(());
        }
        let convergence = Plot::convergence(&scene.title, &[curves::convergence("", &done.outcome)]);
        folder.write("convergence.svg", |out| convergence.write(out))?;
        if done.steps.len() > 1 {
            let names = measure::pair_names(&done.built);
            let curves = self.shown.iter().map(|&i| (names[i].as_str(), approach(&done.steps, i)));
            let is_whole = scene.dimension.value == 3 || scene.plane == Plane::Axisymmetric;
            let units = scene.units.clone().map(|units| if is_whole { units } else { units.per_thickness() });
            let plot = Plot::approach(&scene.title, force_labels(units.as_ref()), curves);
            folder.write("force-approach.svg", |out| plot.write(out))?;
        }
        for &(i, ref file) in &self.plotted {
            let mut curves = vec![curves::pressure("pressure", done, i)];
            curves.extend(curves::reference(&done.built.discrete, i));
            // with more plots than pairs that a person knows by heart, each says whose it is
            let title = match model.pairs.len() {
                ..=LISTED => scene.title.clone(),
                _ => format!("{}: {} - {}", scene.title, model.pairs[i].surfaces[0], model.pairs[i].surfaces[1]),
            };
            let plot = curves::pressure_plot(&title, scene, &model.pairs[i], curves);
            folder.write(file, |out| plot.write(out))?;
        }
        Ok(())
    }
}
