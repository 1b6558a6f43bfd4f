//! The files of fields of bodies and pairs: their names, those of each load step, and the collection that gives each file its time.

use crate::discretize::BodyInfo;
use crate::error::Result;
use crate::output::collection::{Entry, write_pvd};
use crate::output::gmsh::Tags;
use crate::output::leftovers::STEPS;
use crate::output::{BodyField, Folder, safe_name};
use crate::run::measure::pair_names;
use crate::run::{All, Done, Recovered, report};
use std::io::Write;

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
pub fn of_fields(done: &Done) -> Vec<String> {
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

/// Write the fields of the step that has ended. Each rank writes its parts of bodies; the first rank also writes the contact surfaces and the
/// files that join parts.
///
/// # Errors
/// Files that cannot be written; the failure of a solver that should have found the interior of a body.
pub fn write(done: &Done, recovered: &All, folder: &Folder) -> Result<()> {
    folder.subfolder(STEPS)?;
    let (step, steps) = (done.steps.len(), done.built.scene.method.steps.steps.len());
    fields(done, recovered, folder, &|name| stem_of(name, step, steps))?;
    collection(done, folder, false)
}

/// Write the fields at the end of a run in the same way.
///
/// # Errors
/// Those of [`write`].
pub fn write_last(done: &Done, recovered: &All, folder: &Folder) -> Result<()> {
    if done.built.scene.output.msh {
        views(done, recovered, folder)?;
    }
    if !done.built.scene.output.vtu {
        return Ok(());
    }
    fields(done, recovered, folder, &safe_name)?;
    collection(done, folder, true)
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
                entries.push(Entry { time: history.get(step).map_or(0.0, |step| step.time), part, name, file });
            }
        }
    }
    folder.write(COLLECTION, |out| write_pvd(&entries, out))
}
