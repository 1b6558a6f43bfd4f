//! All files of a run: what is small comes first, so that a full disk takes fields and not results.

use super::clock::Clock;
use super::results::{self, Recovered};
use super::stages::Done;
use super::{adapt::Plan, report};
use crate::error::{Error, Kind, Result};
use crate::estimate::Estimate;
use crate::output::{Folder, Plot, Report, vtu};
use crate::petsc::Session;
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
}

impl Writing<'_> {
    /// Writes tables, report, plots and fields in this order, and the report again with all of their names; what cannot be written
    /// keeps nothing else from it. The report, and the first failure. Collective.
    pub fn all(&self, clock: &mut Clock, change: impl Fn(&mut Report)) -> (Report, Result<()>) {
        let Self { session, path, plan, done, estimate, .. } = *self;
        let recovered = results::recover(done);
        let make = |clock: &Clock| {
            let mut report = report::report(session, done, &recovered, clock);
            report.discretization_error = estimate.map(report::discretization_error);
            report.rounds.clone_from(&plan.rounds);
            change(&mut report);
            report
        };
        let fields = self.fields && done.built.scene.output.vtu;
        let first = session.rank() == 0;
        // names of a snapshot are no reason for others
        let folder = match Folder::create(path) {
            Ok(folder) => folder,
            Err(error) => return (make(clock), Err(error)),
        };
        let mut report = make(clock);
        let mut written = Ok(());
        if first {
            let early = self.small(&folder).and(self.report(&folder, &mut report, false));
            written = early.and(plots(done, &folder));
        }
        if fields {
            written = written.and(self.fields(&recovered, &folder));
        }
        clock.phase("output");
        clock.total();
        report.times.clone_from(&clock.times);
        if first {
            written = written.and(self.report(&folder, &mut report, fields));
        }
        let failed = recovered.into_iter().flatten().filter_map(Result::err).next();
        (report, failed.map_or(written, Err))
    }

    /// Contact tables.
    fn small(&self, folder: &Folder) -> Result<()> {
        let pairs = 0..self.done.model().pairs.len();
        let save = |i| report::contact_table(self.done, self.estimate, i).save(folder).map(|_| ());
        pairs.map(save).fold(Ok(()), Result::and)
    }

    fn report(&self, folder: &Folder, report: &mut Report, fields: bool) -> Result<()> {
        report.files = self.names(folder, fields);
        let json = to_json(report)?;
        folder.write("report.json", |out| out.write_all(json.as_bytes())).map(|_| ())
    }

    /// Fields: each rank its bodies; the first one the contact surfaces.
    fn fields(&self, recovered: &results::All, folder: &Folder) -> Result<()> {
        let done = self.done;
        for Recovered { field, .. } in recovered.iter().flatten().flatten() {
            folder.write(&field.file_name(), |out| field.clone().write(out))?;
        }
        if self.session.rank() != 0 {
            return Ok(());
        }
        let mut names: Vec<String> = done.built.discrete.bodies.iter().map(|body| body.name.clone()).collect();
        for i in 0..done.model().pairs.len() {
            let file = folder.unused(&report::contact_table(done, None, i).stem(), "vtu");
            let name = file.trim_end_matches(".vtu").to_owned();
            folder.write(&file, |out| report::contact_surface(&name, done, i).write(out))?;
            names.push(name);
        }
        folder.write(&vtu::pvd_name("bodies"), |out| vtu::write_pvd(&names, out)).map(|_| ())
    }

    /// Names of the files of a run, those of other ranks included.
    fn names(&self, folder: &Folder, fields: bool) -> Vec<String> {
        let own = folder.files();
        let mut names: Vec<String> =
            own.iter().filter_map(|path| path.file_name()).map(|name| name.to_string_lossy().into_owned()).collect();
        if fields {
            names.extend(self.done.built.discrete.bodies.iter().map(|body| format!("{}.vtu", body.name)));
        }
        names.extend(["history.csv", "report.json"].map(str::to_owned));
        names.sort();
        names.dedup();
        names
    }
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

fn plots(done: &Done, folder: &Folder) -> Result<()> {
    let (scene, model) = (&done.built.scene, done.model());
    if !scene.output.plots {
        return Ok(());
    }
    let convergence = Plot::convergence(&scene.title, &[report::convergence("", &done.outcome)]);
    folder.write("convergence.svg", |out| convergence.write(out))?;
    // only along curves: points of a surface over one coordinate would be a cloud
    for i in (0..model.pairs.len()).filter(|&i| model.pairs[i].along_curve) {
        let mut curves = vec![report::pressure("pressure", done, i)];
        curves.extend(report::reference(&done.built.discrete, i));
        let (_, axis) = report::main_axis(&model.pairs[i]);
        let plot = Plot::pressure(&scene.title, axis, &curves);
        folder.write(&folder.unused("pressure", "svg"), |out| plot.write(out))?;
    }
    Ok(())
}
