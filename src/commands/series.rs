//! Fields of bodies and pairs: names of their files, those of each load step, and the collection that gives them their times.

use crate::discretize::BodyInfo;
use crate::error::Result;
use crate::output::collection::{Entry, write_pvd};
use crate::output::gmsh::Tags;
use crate::output::leftovers::STEPS;
use crate::output::{BodyField, Folder, safe_name};
use crate::run::measure::pair_names;
use crate::run::{All, Done, Recovered, report};
use std::io::Write;

/// The collection of all fields.
const COLLECTION: &str = "bodies.pvd";

/// Name of a file in a step before the last without its ending, numbered from 1 on.
fn stem_of(name: &str, step: usize, steps: usize) -> String {
    let digits = steps.to_string().len();
    format!("{STEPS}/{}-{step:0digits$}", safe_name(name))
}

/// `contact-<a>-<b>` of each pair, safe as a file name, with a number from the second pair of the same bodies on.
pub fn stems(done: &Done) -> Vec<String> {
    pair_names(&done.built).into_iter().map(|name| format!("contact-{}", safe_name(&name))).collect()
}

/// The file of a rank's part of a body.
fn part(stem: &str, info: &BodyInfo, rank: usize, ending: &str) -> String {
    match info.ranks.len() {
        1 => format!("{stem}.{ending}"),
        _ => format!("{stem}-r{rank}.{ending}"),
    }
}

/// Ending of the file that has all of a body.
fn ending(info: &BodyInfo) -> &'static str {
    if info.ranks.len() == 1 { "vtu" } else { "pvtu" }
}

/// The files of the fields at the end of a run, those of other ranks included.
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

/// Bodies, then contact surfaces.
fn names(done: &Done) -> Vec<String> {
    let bodies = done.built.discrete.bodies.iter().map(|body| body.name.clone());
    bodies.chain(stems(done)).collect()
}

/// Writes the fields of the step that has ended: each rank its parts of bodies, one rank the contact surfaces and what joins all.
///
/// # Errors
/// Files that cannot be written; the failure of a solver that should have found the interior of a body.
pub fn write(done: &Done, recovered: &All, folder: &Folder) -> Result<()> {
    folder.subfolder(STEPS)?;
    let (step, steps) = (done.steps.len(), done.built.scene.method.steps.steps.len());
    fields(done, recovered, folder, &|name| stem_of(name, step, steps))?;
    collection(done, folder, false)
}

/// Writes the fields of the end of a run, likewise.
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

/// The rank that writes, and whether it is the first.
fn writer(done: &Done) -> (usize, bool) {
    let rank = done.model().exchange.rank();
    (rank, rank == 0)
}

/// Writes bodies and contact surfaces for Gmsh, each file with tags of its own.
fn views(done: &Done, recovered: &All, folder: &Folder) -> Result<()> {
    let discrete = &done.built.discrete;
    let (rank, first) = writer(done);
    let mut tags = Tags::default();
    for (info, recovered) in discrete.bodies.iter().zip(recovered) {
        for &owner in &info.ranks {
            if let (true, Some(Ok(recovered))) = (owner == rank, recovered) {
                let recovered: &Recovered = recovered;
                let write = |out: &mut dyn Write| recovered.field(info).clone().into_grid().write_msh(tags, out);
                folder.write(&part(&safe_name(&info.name), info, rank, "msh"), write)?;
            }
            // room for the whole body: other ranks know no better of a part
            tags = Tags { entity: tags.entity + 1, points: tags.points + info.nodes, cells: tags.cells + info.cells };
        }
    }
    for (i, name) in stems(done).into_iter().enumerate().filter(|_| first) {
        let grid = report::contact_surface(&name, done, i);
        folder.write(&format!("{name}.msh"), |out| grid.write_msh(tags, out))?;
        let (points, cells) = (grid.points.len(), grid.connectivity.len() / grid.cell.stride());
        tags = Tags { entity: tags.entity + 1, points: tags.points + points, cells: tags.cells + cells };
    }
    Ok(())
}

fn fields(done: &Done, recovered: &All, folder: &Folder, stem: &dyn Fn(&str) -> String) -> Result<()> {
    let encoding = done.built.scene.output.encoding;
    let (rank, first) = writer(done);
    for (info, recovered) in done.built.discrete.bodies.iter().zip(recovered) {
        if let (true, Some(Ok(recovered))) = (info.ranks.contains(&rank), recovered) {
            let recovered: &Recovered = recovered;
            let file = part(&stem(&info.name), info, rank, "vtu");
            folder.write(&file, |out| recovered.field(info).clone().write(encoding, out))?;
        }
        if first && info.ranks.len() > 1 {
            let stem = stem(&info.name);
            let beside = stem.rsplit('/').next().unwrap_or(&stem);
            let parts: Vec<String> = info.ranks.iter().map(|&rank| part(beside, info, rank, "vtu")).collect();
            folder.write(&format!("{stem}.pvtu"), |out| BodyField::join(&parts, encoding, out))?;
        }
    }
    for (i, name) in stems(done).into_iter().enumerate().filter(|_| first) {
        let file = format!("{}.vtu", stem(&name));
        folder.write(&file, |out| report::contact_surface(&name, done, i).write(encoding, out))?;
    }
    Ok(())
}

/// Writes the collection of all steps so far, on the first rank; `ended` tells that the last of them has files at the top.
fn collection(done: &Done, folder: &Folder, ended: bool) -> Result<()> {
    if !writer(done).1 {
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
            let here = bodies.get(part).map_or("vtu", ending);
            // steps of another process may have been on more ranks or fewer, and may have their files elsewhere
            let is_there = |ending: &&str| is_last || folder.path().join(format!("{stem}.{ending}")).is_file();
            if let Some(ending) = [here, "vtu", "pvtu"].into_iter().find(is_there) {
                let file = format!("{stem}.{ending}");
                entries.push(Entry { time: history.get(step).map_or(0.0, |step| step.time), part, name, file });
            }
        }
    }
    folder.write(COLLECTION, |out| write_pvd(&entries, out))
}
