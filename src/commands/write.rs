//! The files of the results of a run: tables, report, plots, and fields, those of each load step included. Small files come first, so that on a full
//! disk fields are missing and not results.

use super::adapt::AdaptiveRun;
use crate::contact::ContactPair;
use crate::discretize::BodyInfo;
use crate::error::{Error, Kind, Result};
use crate::estimate::Estimate;
use crate::exchange::all_gather;
use crate::fem::length;
use crate::linalg::bounds;
use crate::output::fields::{CollectionEntry, Tags, write_pvd};
use crate::output::folder::STEPS;
use crate::output::{
    BodyField, Checksums, Color, ConvergenceSeries, Folder, LISTED, PairReport, PairRow, Plot, Report, Series,
    StepReport, Style, busiest, safe_name, tables,
};
use crate::petsc::Session;
use crate::problem::units::label;
use crate::problem::{Plane, force_labels};
use crate::run::results::{self, pair_names};
use crate::run::{All, Clock, Done, Recovered, numbered, report};
use serde::Serialize;
use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;

/// The results of a run, and where they are to be written.
pub struct ResultFiles<'a> {
    pub session: &'a Session,
    pub path: &'a Path,
    /// Plan with the meshes before.
    pub plan: &'a AdaptiveRun,
    pub done: &'a Done,
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
                written = written.and(plots.write(&folder)).and(write_approach(done, &shown, &folder));
            }
        }
        if fields {
            written = written.and(write_fields(done, &recovered, &folder, true));
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
        let (model, layer) = (self.done.model(), &self.done.outcome.layer);
        let compression = |i: usize| &layer.compression[model.range(i)];
        let row = |(i, pair): (usize, &ContactPair)| PairRow::new(&pair.weight, &pair.gap, compression(i));
        let mut rows: Vec<PairRow> = model.pairs.iter().enumerate().map(row).collect();
        let stems = stems(self.done);
        shown.iter().for_each(|&i| rows[i].table = format!("{}.csv", stems[i]));
        plots.files().for_each(|(i, file)| rows[i].plot = file);
        let save = |&i: &usize| {
            let table = report::contact_table(self.done, self.estimate, i);
            folder.write(&rows[i].table, |out| table.write(out))
        };
        shown.iter().map(save).fold(tables::save(folder, &report.pairs, &rows), Result::and)
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
            names.extend(of_fields(self.done));
        }
        names.extend(["history.csv", "report.json"].map(str::to_owned));
        names.extend(Some("steps.csv".to_owned()).filter(|_| !self.done.steps.is_empty()));
        names.sort();
        names.dedup();
        names
    }
}

/// Return a report, or several, as JSON text that ends with a newline.
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

/// The file of the collection of all fields.
const COLLECTION: &str = "bodies.pvd";

/// Return the name of a file of a step before the last, without its ending. Steps are numbered from 1 on.
fn stem_of(name: &str, step: usize, steps: usize) -> String {
    let digits = steps.to_string().len();
    format!("{STEPS}/{}-{step:0digits$}", safe_name(name))
}

/// Return `contact-<a>-<b>` for each pair, safe as a file name, with a number from the second pair of the same bodies on.
pub fn stems(done: &Done) -> Vec<String> {
    pair_names(&done.built).into_iter().map(|name| format!("contact-{}", safe_name(&name))).collect()
}

/// Return the name of the file with a rank's part of a body.
fn part(stem: &str, info: &BodyInfo, rank: usize, ending: &str) -> String {
    match info.ranks.len() {
        1 => format!("{stem}.{ending}"),
        _ => format!("{stem}-r{rank}.{ending}"),
    }
}

/// Return the ending of the file that has all of a body.
fn ending(info: &BodyInfo) -> &'static str {
    if info.ranks.len() == 1 { "vtu" } else { "pvtu" }
}

/// Return the names of the files of fields at the end of a run, those of other ranks included.
fn of_fields(done: &Done) -> Vec<String> {
    let output = &done.built.scene.output;
    let endings = [(output.vtu, "vtu"), (output.msh, "msh")];
    let endings: Vec<&str> = endings.iter().filter(|(is_written, _)| *is_written).map(|(_, ending)| *ending).collect();
    let mut files = Vec::new();
    for info in &done.built.discrete.bodies {
        let stem = safe_name(&info.name);
        for ending in &endings {
            files.extend(info.ranks.iter().map(|&rank| part(&stem, info, rank, ending)));
        }
        files.extend(output.vtu.then(|| format!("{stem}.{}", ending(info))));
    }
    files.extend(stems(done).iter().flat_map(|stem| endings.iter().map(move |ending| format!("{stem}.{ending}"))));
    files.extend(output.vtu.then(|| COLLECTION.to_owned()));
    files
}

/// Return the names of the bodies, then those of the contact surfaces.
fn names(done: &Done) -> Vec<String> {
    let bodies = done.built.discrete.bodies.iter().map(|body| body.name.clone());
    bodies.chain(stems(done)).collect()
}

/// Write the fields at the end of a run or, before that, of the load step that has ended. Each rank writes its parts of bodies; the first rank also
/// writes the contact surfaces and the files that join parts.
pub fn write_fields(done: &Done, recovered: &All, folder: &Folder, ended: bool) -> Result<()> {
    let (output, step, steps) = (&done.built.scene.output, done.steps.len(), done.built.scene.method.steps.steps.len());
    if ended && output.msh {
        views(done, recovered, folder)?;
    }
    if !output.vtu {
        return Ok(());
    }
    if !ended {
        folder.subfolder(STEPS)?;
    }
    let stem = |name: &str| if ended { safe_name(name) } else { stem_of(name, step, steps) };
    fields(done, recovered, folder, &stem)?;
    collection(done, folder, ended)
}

/// Write bodies and contact surfaces for Gmsh, each file with tags of its own.
fn views(done: &Done, recovered: &All, folder: &Folder) -> Result<()> {
    let discrete = &done.built.discrete;
    let rank = done.model().exchange.rank();
    let mut tags = Tags::default();
    for (info, recovered) in discrete.bodies.iter().zip(recovered) {
        for &owner in &info.ranks {
            if let (true, Some(Ok(recovered))) = (owner == rank, recovered) {
                let recovered: &Recovered = recovered;
                let write = |out: &mut dyn Write| recovered.field(info).clone().into_grid().write_msh(tags, out);
                folder.write(&part(&safe_name(&info.name), info, rank, "msh"), write)?;
            }
            // tags for the whole body, since other ranks do not know how many a part needs
            tags = Tags { entity: tags.entity + 1, points: tags.points + info.nodes, cells: tags.cells + info.cells };
        }
    }
    for (i, name) in stems(done).into_iter().enumerate().filter(|_| rank == 0) {
        let grid = report::contact_surface(&name, done, i);
        folder.write(&format!("{name}.msh"), |out| grid.write_msh(tags, out))?;
        let (points, cells) = (grid.points.len(), grid.connectivity.len() / grid.cell.stride());
        tags = Tags { entity: tags.entity + 1, points: tags.points + points, cells: tags.cells + cells };
    }
    Ok(())
}

/// Write bodies and contact surfaces for ParaView. `stem` returns the name of a file without its ending.
fn fields(done: &Done, recovered: &All, folder: &Folder, stem: &dyn Fn(&str) -> String) -> Result<()> {
    let encoding = done.built.scene.output.encoding();
    let rank = done.model().exchange.rank();
    for (info, recovered) in done.built.discrete.bodies.iter().zip(recovered) {
        if let (true, Some(Ok(recovered))) = (info.ranks.contains(&rank), recovered) {
            let recovered: &Recovered = recovered;
            let file = part(&stem(&info.name), info, rank, "vtu");
            folder.write(&file, |out| recovered.field(info).clone().write(encoding, out))?;
        }
        if rank == 0 && info.ranks.len() > 1 {
            let stem = stem(&info.name);
            // parts lie in the same folder
            let name = stem.rsplit('/').next().unwrap_or(&stem);
            let parts: Vec<String> = info.ranks.iter().map(|&rank| part(name, info, rank, "vtu")).collect();
            folder.write(&format!("{stem}.pvtu"), |out| BodyField::join(&parts, encoding, out))?;
        }
    }
    for (i, name) in stems(done).into_iter().enumerate().filter(|_| rank == 0) {
        let file = format!("{}.vtu", stem(&name));
        folder.write(&file, |out| report::contact_surface(&name, done, i).write(encoding, out))?;
    }
    Ok(())
}

/// Write the collection of all steps so far, on the first rank. If `ended`, the files of the last step are in the folder of results itself.
fn collection(done: &Done, folder: &Folder, ended: bool) -> Result<()> {
    if done.model().exchange.rank() != 0 {
        return Ok(());
    }
    let bodies = &done.built.discrete.bodies;
    let history = &done.built.scene.method.steps.steps;
    let names = names(done);
    let mut entries = Vec::new();
    for step in 0..done.steps.len().max(1) {
        let is_last = step + 1 >= done.steps.len();
        for (part, name) in names.iter().enumerate() {
            let stem = match is_last && ended {
                true => safe_name(name),
                false => stem_of(name, step + 1, history.len()),
            };
            let usual = bodies.get(part).map_or("vtu", ending);
            // steps of another process may have been on more ranks or fewer, and their files may be in another folder
            let exists = |ending: &&str| is_last || folder.path().join(format!("{stem}.{ending}")).is_file();
            if let Some(ending) = [usual, "vtu", "pvtu"].into_iter().find(exists) {
                let file = format!("{stem}.{ending}");
                entries.push(CollectionEntry {
                    time: history.get(step).map_or(0.0, |step| step.time),
                    part,
                    name,
                    file,
                });
            }
        }
    }
    folder.write(COLLECTION, |out| write_pvd(&entries, out))
}

/// The plots of runs on the same pairs of surfaces.
#[derive(Default)]
pub struct Plots {
    /// Title of the first run.
    title: String,
    /// Residual and increment of each run.
    histories: Vec<ConvergenceSeries>,
    /// The pressures of all runs along each pair.
    pressures: BTreeMap<usize, Plot>,
}

impl Plots {
    /// Add a run. Pressures of the `shown` pairs are plotted only along curves: points of a surface over one coordinate would be a cloud.
    pub fn add(&mut self, label: &str, done: &Done, shown: &[usize]) {
        let pairs = &done.model().pairs;
        if self.histories.is_empty() {
            self.title.clone_from(&done.built.scene.title);
        }
        let rows = done.outcome.rows.iter().map(|row| (row.iteration, row.residual, row.increment)).collect();
        self.histories.push(ConvergenceSeries { label: label.to_owned(), rows });
        for &i in shown.iter().filter(|&&i| pairs.get(i).is_some_and(|pair| pair.along_curve)) {
            let plot = self.pressures.entry(i).or_insert_with(|| pressure_plot(done, i));
            plot.series.push(pressure_curve(label, done, i));
            if plot.series.iter().all(|curve| curve.style != Style::Dashed) {
                plot.series.extend(reference_curve(done, i));
            }
        }
    }

    /// Return the names of the plots of pressures, each with the number of its pair.
    pub fn files(&self) -> impl Iterator<Item = (usize, String)> {
        let names = numbered(self.pressures.iter().map(|_| "pressure".to_owned()));
        self.pressures.keys().copied().zip(names.into_iter().map(|name| format!("{name}.svg")))
    }

    /// Write all plots.
    pub fn write(self, folder: &Folder) -> Result<()> {
        let convergence = Plot::convergence(&self.title, &self.histories);
        folder.write("convergence.svg", |out| convergence.write(out))?;
        for (file, Plot { title, x, y, series }) in
            self.files().map(|(_, file)| file).zip(self.pressures.values().cloned())
        {
            let plot = Plot::pressure(&title, &x.label, &y.label, series);
            folder.write(&file, |out| plot.write(out))?;
        }
        Ok(())
    }
}

/// Write the plot of the contact force of the `shown` pairs over their approach, if the run has several load steps.
fn write_approach(done: &Done, shown: &[usize], folder: &Folder) -> Result<()> {
    if done.steps.len() < 2 {
        return Ok(());
    }
    let scene = &done.built.scene;
    let names = results::pair_names(&done.built);
    let curves = shown.iter().map(|&i| (names[i].as_str(), approach(&done.steps, i)));
    let is_whole = scene.dimension.value == 3 || scene.plane == Plane::Axisymmetric;
    let units = scene.units.clone().map(|units| if is_whole { units } else { units.per_thickness() });
    let plot = Plot::approach(&scene.title, force_labels(units.as_ref()), curves);
    folder.write("force-approach.svg", |out| plot.write(out))
}

/// Return the approach and the force of pair `i` in each step.
fn approach(steps: &[StepReport], i: usize) -> Vec<(f64, f64)> {
    let of_step = |step: &StepReport| {
        let pair = &step.pairs[i];
        (pair.approach.unwrap_or(f64::NAN), length(pair.force))
    };
    steps.iter().map(of_step).collect()
}

/// Return the plot of pressures along pair `i` without its curves, in the units of the scene. Among many pairs each has the names of its surfaces.
fn pressure_plot(done: &Done, i: usize) -> Plot {
    let (scene, pairs) = (&done.built.scene, &done.model().pairs);
    let title = match pairs.len() {
        ..=LISTED => scene.title.clone(),
        _ => format!("{}: {}", scene.title, pairs[i].surfaces.join(" - ")),
    };
    let units = scene.units.as_ref();
    let along = label(["x", "y", "z"][main_axis(&pairs[i])], units.map(|units| units.length));
    Plot::pressure(&title, &along, &label("contact pressure", units.map(|units| units.stress)), Vec::new())
}

/// Return the pressure of pair `i` along its surface, against the coordinate that varies most.
fn pressure_curve(label: &str, done: &Done, i: usize) -> Series {
    let (model, pair) = (done.model(), &done.model().pairs[i]);
    let axis = main_axis(pair);
    let pressure = &done.outcome.layer.pressure[model.range(i)];
    Series::new(label, pair.position.iter().zip(pressure).map(|(x, &p)| (x[axis], p)).collect(), Style::Line)
}

/// Return the scene's reference pressure of pair `i`, if it has one.
fn reference_curve(done: &Done, i: usize) -> Option<Series> {
    let field = done.built.discrete.contacts[i].spec.reference.as_ref()?;
    let pair = &done.model().pairs[i];
    let axis = main_axis(pair);
    let points = pair.position.iter().map(|&x| (x[axis], field.eval(x))).collect();
    Some(Series::new("reference", points, Style::Dashed).color(Color::Grey))
}

/// Return the coordinate along which a pair's points spread most.
fn main_axis(pair: &ContactPair) -> usize {
    let [low, high] = bounds(pair.position.iter().copied());
    let spread = |k: usize| high[k] - low[k];
    (0..3).max_by(|&i, &j| spread(i).total_cmp(&spread(j)).then(j.cmp(&i))).unwrap_or(0)
}
