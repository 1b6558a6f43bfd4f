//! The files of the results of a run. Small files come first, so that on a full disk fields are missing and not results.

use super::adapt::Plan;
use super::plots::{self, Plots};
use super::series;
use crate::error::{Error, Kind, Result};
use crate::estimate::Estimate;
use crate::exchange::all_gather;
use crate::output::{Checksums, Folder, LISTED, PairReport, PairRow, Report, busiest, contacts};
use crate::petsc::Session;
use crate::run::{All, Clock, Done, report, results};
use serde::Serialize;
use std::path::Path;

/// The results of a run, and where they are to be written.
pub struct ResultFiles<'a> {
    /// Session of this rank.
    pub session: &'a Session,
    /// Folder of results.
    pub path: &'a Path,
    /// Plan with the meshes before.
    pub plan: &'a Plan,
    /// Solution.
    pub done: &'a Done,
    /// Estimate of its error.
    pub estimate: Option<&'a Estimate>,
    /// Whether fields may be written, if the scene asks for them.
    pub fields: bool,
    /// Whether these results are final, which means that the tables of iterations and steps have ended.
    pub is_last: bool,
}

impl ResultFiles<'_> {
    /// Write tables, report, plots and fields in this order, and then the report again with the names of all files.
    ///
    /// A file that cannot be written does not keep the others from being written. Return the report, changed by `change`, and the first
    /// failure. Collective.
    pub fn write(&self, clock: &mut Clock, change: impl Fn(&mut Report)) -> (Report, Result<()>) {
        let _stage = self.session.stage("output");
        let Self { session, path, done, .. } = *self;
        let recovered = results::recover(done);
        let fields = self.fields && (done.built.scene.output.vtu || done.built.scene.output.msh);
        let first = session.rank() == 0;
        // a list of files of its own, without those of a snapshot
        let folder = match Folder::create(path) {
            Ok(folder) => folder,
            Err(error) => {
                // the other ranks wait for this one below
                all_gather(&*done.model().exchange, ());
                return (self.new_report(&recovered, clock, &change), Err(error));
            }
        };
        let mut report = self.new_report(&recovered, clock, &change);
        let mut written = Ok(());
        if first {
            Checksums::withdraw(path);
            let output = &done.built.scene.output;
            let shown = busiest(&report.pairs, output.pairs.map_or(LISTED, |most| most.0));
            report.left_out = left_out(&report.pairs, &shown);
            let mut plots = Plots::default();
            if output.plots {
                plots.add("pressure", done, &shown);
            }
            written = self.tables(&folder, &report, &shown, &plots);
            if output.plots || fields {
                // once before the large files
                written = written.and(self.report(&folder, &mut report, fields));
            }
            if output.plots {
                written = written.and(plots.write(&folder)).and(plots::write_approach(done, &shown, &folder));
            }
        }
        if fields {
            written = written.and(series::write_last(done, &recovered, &folder));
        }
        clock.phase("output");
        clock.total();
        report.times.clone_from(&clock.times);
        report.memory.clone_from(&clock.memory);
        // the checksums need the files of all ranks
        all_gather(&*done.model().exchange, ());
        if first {
            written = written.and(self.report(&folder, &mut report, fields));
            written = written.and(Checksums::save(&folder, report.files.iter().filter(|name| self.is_final(name))));
        }
        let failed = recovered.iter().flatten().find_map(|body| body.as_ref().err());
        let failed = failed.map(|error| Error::new(error.kind(), error.message()));
        (report, failed.map_or(written, Err))
    }

    /// Return the report of the solution, changed by `change`. Collective.
    fn new_report(&self, recovered: &All, clock: &Clock, change: &impl Fn(&mut Report)) -> Report {
        let mut report = report::report(self.session, self.done, recovered, clock);
        report.discretization_error = self.estimate.map(report::discretization_error);
        report.rounds.clone_from(&self.plan.rounds);
        change(&mut report);
        report
    }

    /// Write the table of all pairs, and a table for each of the pairs that are shown.
    fn tables(&self, folder: &Folder, report: &Report, shown: &[usize], plots: &Plots) -> Result<()> {
        let mut rows: Vec<PairRow> = (0..report.pairs.len()).map(|i| report::pair_row(self.done, i)).collect();
        let stems = series::stems(self.done);
        shown.iter().for_each(|&i| rows[i].table = format!("{}.csv", stems[i]));
        plots.files().for_each(|(i, file)| rows[i].plot = file);
        let save = |&i: &usize| {
            let table = report::contact_table(self.done, self.estimate, i);
            folder.write(&rows[i].table, |out| table.write(out))
        };
        shown.iter().map(save).fold(contacts::save(folder, &report.pairs, &rows), Result::and)
    }

    /// Write the report, with the names of the files so far and of the fields.
    fn report(&self, folder: &Folder, report: &mut Report, fields: bool) -> Result<()> {
        report.files = self.names(folder, fields);
        let json = to_json(report)?;
        folder.write("report.json", |out| out.write_all(json.as_bytes()))
    }

    /// Return whether a file is not written any more by this run, nor by `winkler report`.
    fn is_final(&self, name: &str) -> bool {
        name != crate::report::FILE && (self.is_last || !["history.csv", "steps.csv"].contains(&name))
    }

    /// Return the names of the files of a run, those of other ranks included.
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

/// Return a report, or several, as JSON text that ends with a newline.
///
/// # Errors
/// None in practice: a report holds nothing that JSON cannot hold.
pub fn to_json(report: &impl Serialize) -> Result<String> {
    serde_json::to_string_pretty(report)
        .map(|text| text + "\n")
        .map_err(|cause| Error::new(Kind::File, "the report cannot be written as JSON").because(cause.to_string()))
}

/// Return the message that pairs other than those `shown` have no table and plot; none if all are shown.
fn left_out(pairs: &[PairReport], shown: &[usize]) -> Option<String> {
    let (all, left) = (pairs.len(), pairs.len() - shown.len());
    (left > 0).then(|| {
        format!(
            "{left} of {all} pairs, those with the smallest forces, have no table and plot of their own; contacts.csv has a row of \
             each, and --set output.pairs=all writes all"
        )
    })
}
