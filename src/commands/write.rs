//! The files of the results of a run: tables, plots, fields, those of each load step included, the page, and the
//! report, which lists all files.

use super::adapt::AdaptiveRun;
use super::checkpoint;
use super::plots::{self, Plots};
use crate::discretize::{BodyInfo, corners};
use crate::error::{Error, Kind, Result};
use crate::estimate::Estimate;
use crate::exchange::{all_gather, gather};
use crate::output::folder::{MARK_OF_MESH, REPORT, STEPS};
use crate::output::views::Tags;
use crate::output::vtu::{self, CollectionEntry, write_pvd};
use crate::output::{Folder, LISTED, PairReport, Report, busiest, safe_name, tables};
use crate::page::{self, Page, Surface};
use crate::petsc::Session;
use crate::run::results::{self, pair_names};
use crate::run::{All, Built, Clock, Done, Recovered, report};
use crate::scene::{Precision, Scene};
use serde::Serialize;
use std::collections::HashMap;
use std::fs::File;
use std::io::Write;
use std::path::Path;

/// The results of a run, and where they are to be written.
pub struct ResultFiles<'a> {
    pub session: &'a Session,
    pub folder: &'a Folder,
    /// Plan with the meshes before.
    pub plan: &'a AdaptiveRun,
    pub done: &'a Done,
    pub estimate: Option<&'a Estimate>,
    /// Whether fields and the page may be written, if the scene asks for them.
    pub fields: bool,
}

impl ResultFiles<'_> {
    /// Write tables, plots, fields and the page, and last the report with the names of all files.
    ///
    /// A file that cannot be written does not keep the others from being written. Return the report, changed by
    /// `change`, and the first failure. Collective.
    pub fn write(&self, clock: &mut Clock, change: impl Fn(&mut Report)) -> (Report, Result<()>) {
        let _stage = self.session.stage("output");
        let Self { session, folder, done, .. } = *self;
        let output = &done.built.scene.output;
        let is_first = session.rank() == 0;
        let recovered = results::recover(done);
        let mut report = report::report(session, done, &recovered, self.estimate, clock);
        report.rounds = self.plan.reports();
        change(&mut report);
        let shown = busiest(report.results(), output.pairs.unwrap_or(LISTED));
        report.left_out = left_out(&report.pairs, &shown);
        let mut plots = Plots::default();
        plots.add("pressure", done, &shown);
        self.name_files(&mut report, &shown, &plots);
        let mut written = if is_first { self.tables_and_plots(&report, &shown, &plots) } else { Ok(()) };
        if let Some(mesh) = done.built.file.as_ref().filter(|_| self.fields && self.plan.adapts()) {
            written = written.and(copy_mesh(folder, &mesh.path));
        }
        if self.fields {
            written = written.and(write_fields(done, &recovered, folder, true));
        }
        clock.phase("output");
        clock.total();
        report.times.clone_from(&clock.times);
        report.memory.clone_from(&clock.memory);
        if self.fields && output.report {
            written = written.and(self.page(&report, &recovered, &shown, &plots));
        }
        // the report lists the files of all ranks
        all_gather(&*done.model().exchange, ());
        if is_first {
            report.files = self.names();
            let json = to_json(&report);
            written = written.and(json.and_then(|json| folder.write(REPORT, |out| out.write_all(json.as_bytes()))));
        }
        let failed = recovered.iter().flatten().find_map(|body| body.as_ref().err());
        let failed = failed.map(|error| Error::new(error.kind(), error.message()));
        (report, failed.map_or(written, Err))
    }

    /// Name the table and the plot of each pair that is shown.
    fn name_files(&self, report: &mut Report, shown: &[usize], plots: &Plots) {
        let stems = stems(&self.done.built);
        shown.iter().for_each(|&i| report.pairs[i].table = Some(format!("{}.csv", stems[i])));
        let drawn = plots.files().filter(|_| self.done.built.scene.output.plots);
        drawn.for_each(|(i, file)| report.pairs[i].plot = Some(file));
    }

    /// Write the table of all pairs, a table for each of the pairs that are shown, and the plots if the scene wants
    /// them.
    fn tables_and_plots(&self, report: &Report, shown: &[usize], plots: &Plots) -> Result<()> {
        let (folder, done) = (self.folder, self.done);
        tables::save(folder, &report.pairs)?;
        for (i, file) in report.pairs.iter().enumerate().filter_map(|(i, pair)| Some((i, pair.table.as_ref()?))) {
            let table = report::contact_table(done, self.estimate, i);
            folder.write(file, |out| table.write(out))?;
        }
        let has_plots = done.built.scene.output.plots;
        if !has_plots {
            return Ok(());
        }
        plots.write(folder)?;
        let mut of_steps = plots::of_steps(done, shown).into_iter();
        of_steps.try_for_each(|(file, plot)| folder.write(file, |out| plot.write(out)))
    }

    /// Write the page with the surfaces of the bodies of all ranks. Collective.
    fn page(&self, report: &Report, recovered: &All, shown: &[usize], plots: &Plots) -> Result<()> {
        let (done, discrete) = (self.done, &self.done.built.discrete);
        let own = discrete.bodies.iter().zip(recovered).enumerate().filter_map(|(body, (info, recovered))| {
            Some((body, Surface::of_body(recovered.as_ref()?.as_ref().ok()?.field(info), &info.points)))
        });
        let parts: Vec<(usize, Surface)> =
            gather(&*done.model().exchange, own.collect::<Vec<_>>())?.into_iter().flatten().collect();
        let displacement = report::surface_displacements(done, recovered)?;
        if self.session.rank() != 0 {
            return Ok(());
        }
        let mut of_bodies: Vec<Vec<Surface>> = discrete.bodies.iter().map(|_| Vec::new()).collect();
        parts.into_iter().for_each(|(body, part)| of_bodies[body].push(part));
        let scene = &done.built.scene;
        // in the plane contact surfaces are lines, which have plots
        let in_space = shown.iter().filter(|_| scene.dimension.value == 3);
        let names = stems(&done.built);
        let mut bodies: Vec<Surface> = of_bodies.into_iter().map(Surface::join).collect();
        mark(&mut bodies, done);
        let page = Page {
            report,
            units: plots::units(scene),
            bodies,
            marks: &done.built.marks,
            contacts: in_space
                .map(|&i| {
                    let surface = report::contact_surface(&names[i], done, i, &displacement[i]);
                    Surface::of_contact(surface, done.model().pairs[i].bodies[0])
                })
                .collect(),
            pressures: plots.pressures().collect(),
            of_steps: plots::of_steps(done, shown),
            convergence: (!done.outcome.rows.is_empty()).then(|| plots.convergence()),
        };
        let html = page.html();
        self.folder.write(page::FILE, |out| out.write_all(html.as_bytes()))
    }

    /// Return the names of the files of a run, those of other ranks included.
    fn names(&self) -> Vec<String> {
        let (done, steps) = (self.done, self.done.built.scene.method.steps.steps.len());
        let mut of_ranks = field_files(&done.built, &|name| safe_name(name));
        for step in 1..=done.steps.len() {
            of_ranks.extend(field_files(&done.built, &|name| stem_of(name, step, steps)));
            of_ranks.extend(stems(&done.built).iter().map(|stem| format!("{}.csv", stem_of(stem, step, steps))));
        }
        of_ranks.retain(|name| self.folder.path().join(name).is_file());
        let mut names = [self.folder.files(), of_ranks, vec![REPORT.to_owned()]].concat();
        names.sort();
        names.dedup();
        names
    }
}

/// Mark supports, loads, springs and contact surfaces of the bodies.
fn mark(bodies: &mut [Surface], done: &Done) {
    let (model, layer) = (done.model(), &done.outcome.layer);
    // how many contact points of each facet there are, and how many of them carry pressure
    let mut points: HashMap<[u32; 3], [usize; 2]> = HashMap::new();
    for (i, contact) in done.built.discrete.contacts.iter().enumerate() {
        let pressure = &layer.pressure[model.range(i)];
        for facing in &contact.facing {
            let closed = facing.points.iter().filter(|&&q| pressure[q] != 0.0).count();
            for facet in facing.facets {
                let [all, under_pressure] = points.entry(facet).or_default();
                (*all, *under_pressure) = (*all + facing.points.len(), *under_pressure + closed);
            }
        }
    }
    let is_closed = |facet: &[u32]| {
        points.get(&corners(facet.iter().copied())).is_some_and(|[all, closed]| *closed > 0 && 2 * closed >= *all)
    };
    for (index, body) in bodies.iter_mut().enumerate() {
        body.body = index;
        body.mark(done.built.marks.iter().filter(|mark| mark.body == index), &is_closed);
    }
}

/// Copy the mesh with which an adaptation has ended into a file that a scene can name as its mesh.
fn copy_mesh(folder: &Folder, mesh: &Path) -> Result<()> {
    folder.write(ADAPTED, |out| {
        std::io::copy(&mut File::open(mesh)?, out)?;
        out.write_all(MARK_OF_MESH.as_bytes())
    })
}

/// The file of the last mesh of an adaptation.
const ADAPTED: &str = "adapted.msh";

/// Return the names of the files that a run may write for a scene and its bodies, whatever is on its mesh.
pub fn planned(scene: &Scene) -> Vec<String> {
    let (output, steps) = (&scene.output, scene.method.steps.steps.len());
    let is_plane = scene.dimension.value == 2 && !scene.contacts.is_empty();
    let fixed = [
        (true, REPORT),
        (true, "history.csv"),
        (true, "contacts.csv"),
        (true, checkpoint::FILE),
        (true, checkpoint::ASIDE),
        (steps > 0, "steps.csv"),
        (output.plots, "convergence.svg"),
        (output.plots && is_plane, "pressure.svg"),
        (output.plots && steps > 1, plots::OF_STEPS[0]),
        (output.plots && steps > 1, plots::OF_STEPS[1]),
        (output.report, page::FILE),
        (output.vtu, COLLECTION),
        (scene.adapt.is_some(), ADAPTED),
    ];
    let mut files: Vec<String> =
        fixed.into_iter().filter(|(is_written, _)| *is_written).map(|(_, file)| file.to_owned()).collect();
    for (_, ending) in [(output.vtu, "vtu"), (output.msh, "msh")].into_iter().filter(|(is_written, _)| *is_written) {
        files.extend(scene.bodies.iter().map(|body| format!("{}.{ending}", safe_name(&body.name.value))));
    }
    files
}

/// Return the names of the files that a run may write on its mesh, those of other ranks included.
pub fn planned_on_mesh(built: &Built) -> Vec<String> {
    let (scene, stems) = (&built.scene, stems(built));
    let (output, steps) = (&scene.output, scene.method.steps.steps.len());
    let mut fields = field_files(built, &|name| safe_name(name));
    fields.extend(stems.iter().flat_map(|stem| ["vtu", "msh"].map(|ending| format!("{stem}.{ending}"))));
    fields.retain(|file| if file.ends_with("msh") { output.msh } else { output.vtu });
    for step in 1..steps {
        fields.extend(stems.iter().map(|stem| format!("{}.csv", stem_of(stem, step, steps))));
        fields.extend(field_files(built, &|name| stem_of(name, step, steps)).into_iter().filter(|_| output.vtu));
    }
    [planned(scene), stems.iter().map(|stem| format!("{stem}.csv")).collect(), fields].concat()
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

/// Return `contact-<a>-<b>` for each pair, safe as a file name, with a number from the second pair of the same bodies
/// on.
pub fn stems(built: &Built) -> Vec<String> {
    pair_names(built).into_iter().map(|name| format!("contact-{}", safe_name(&name))).collect()
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

/// Return the names that the files of fields of all ranks have or would have. `stem` returns the name of a file without
/// its ending.
fn field_files(built: &Built, stem: &dyn Fn(&str) -> String) -> Vec<String> {
    let mut files = Vec::new();
    for info in &built.discrete.bodies {
        let stem = stem(&info.name);
        for ending in ["vtu", "msh"] {
            files.extend(info.ranks.iter().map(|&rank| part(&stem, info, rank, ending)));
        }
    }
    files
}

/// Return the names of the bodies, then those of the contact surfaces.
fn names(done: &Done) -> Vec<String> {
    let bodies = done.built.discrete.bodies.iter().map(|body| body.name.clone());
    bodies.chain(stems(&done.built)).collect()
}

/// Write the fields at the end of a run or, before that, of the load step that has ended. Each rank writes its parts of
/// bodies; the first rank also writes the contact surfaces and the files that join parts.
pub fn write_fields(done: &Done, recovered: &All, folder: &Folder, ended: bool) -> Result<()> {
    let (output, step, steps) = (&done.built.scene.output, done.steps.len(), done.built.scene.method.steps.steps.len());
    let has_views = ended && output.msh;
    if !output.vtu && !has_views {
        return Ok(());
    }
    let displacement = report::surface_displacements(done, recovered)?;
    if has_views {
        views(done, recovered, folder, &displacement)?;
    }
    if !output.vtu {
        return Ok(());
    }
    if !ended {
        folder.make_steps()?;
    }
    let stem = |name: &str| if ended { safe_name(name) } else { stem_of(name, step, steps) };
    fields(done, recovered, folder, &stem, &displacement)?;
    collection(done, folder, ended)
}

/// Write the tables of contact points at the end of a load step before the last, on the first rank: those of the pairs
/// with the largest forces of the step.
pub fn write_step_tables(done: &Done, folder: &Folder) -> Result<()> {
    let (scene, step) = (&done.built.scene, done.steps.len());
    let Some(last) = done.steps.last().filter(|_| done.model().exchange.rank() == 0) else { return Ok(()) };
    let shown = busiest(last.pairs.iter(), scene.output.pairs.unwrap_or(LISTED));
    if shown.is_empty() {
        return Ok(());
    }
    folder.make_steps()?;
    let (stems, steps) = (stems(&done.built), scene.method.steps.steps.len());
    shown.into_iter().try_for_each(|i| {
        let file = format!("{}.csv", stem_of(&stems[i], step, steps));
        folder.write(&file, |out| report::contact_table(done, None, i).write(out))
    })
}

/// Write bodies and contact surfaces for Gmsh, each file with tags of its own.
fn views(done: &Done, recovered: &All, folder: &Folder, displacement: &[Vec<[f64; 3]>]) -> Result<()> {
    let discrete = &done.built.discrete;
    let rank = done.model().exchange.rank();
    let mut tags = Tags::default();
    for (info, recovered) in discrete.bodies.iter().zip(recovered) {
        for &owner in &info.ranks {
            if let (true, Some(Ok(recovered))) = (owner == rank, recovered) {
                let recovered: &Recovered = recovered;
                let write = |out: &mut dyn Write| recovered.field(info).grid().write_msh(tags, out);
                folder.write(&part(&safe_name(&info.name), info, rank, "msh"), write)?;
            }
            // tags for the whole body, since other ranks do not know how many a part needs
            tags = Tags { entity: tags.entity + 1, points: tags.points + info.nodes, cells: tags.cells + info.cells };
        }
    }
    for (i, name) in stems(&done.built).into_iter().enumerate().filter(|_| rank == 0) {
        let grid = report::contact_surface(&name, done, i, &displacement[i]);
        folder.write(&format!("{name}.msh"), |out| grid.write_msh(tags, out))?;
        let (points, cells) = (grid.points.len(), grid.connectivity.len() / grid.cell.stride());
        tags = Tags { entity: tags.entity + 1, points: tags.points + points, cells: tags.cells + cells };
    }
    Ok(())
}

/// Write bodies and contact surfaces for ParaView. `stem` returns the name of a file without its ending.
fn fields(
    done: &Done,
    recovered: &All,
    folder: &Folder,
    stem: &dyn Fn(&str) -> String,
    displacement: &[Vec<[f64; 3]>],
) -> Result<()> {
    let single = done.built.scene.output.precision == Precision::Single;
    let rank = done.model().exchange.rank();
    for (info, recovered) in done.built.discrete.bodies.iter().zip(recovered) {
        if let (true, Some(Ok(recovered))) = (info.ranks.contains(&rank), recovered) {
            let recovered: &Recovered = recovered;
            let file = part(&stem(&info.name), info, rank, "vtu");
            folder.write(&file, |out| recovered.field(info).grid().write(single, out))?;
        }
        if rank == 0 && info.ranks.len() > 1 {
            let stem = stem(&info.name);
            // parts lie in the same folder
            let name = stem.rsplit('/').next().unwrap_or(&stem);
            let parts: Vec<String> = info.ranks.iter().map(|&rank| part(name, info, rank, "vtu")).collect();
            folder.write(&format!("{stem}.pvtu"), |out| vtu::join(&parts, single, out))?;
        }
    }
    for (i, name) in stems(&done.built).into_iter().enumerate().filter(|_| rank == 0) {
        let file = format!("{}.vtu", stem(&name));
        let grid = report::contact_surface(&name, done, i, &displacement[i]);
        folder.write(&file, |out| grid.write(single, out))?;
    }
    Ok(())
}

/// Write the collection of all steps so far, on the first rank. If `ended`, the files of the last step are in the
/// folder of results itself.
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
            let stem = if is_last && ended { safe_name(name) } else { stem_of(name, step + 1, history.len()) };
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
