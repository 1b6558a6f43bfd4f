//! Fields of a history: files of each load step, and the collection that gives them their times.

use super::shown;
use crate::error::Result;
use crate::output::collection::{Entry, write_pvd};
use crate::output::gmsh::Tags;
use crate::output::{Folder, safe_name};
use crate::run::report;
use crate::run::results::{All, Recovered};
use crate::run::stages::Done;
use std::io::Write;

/// Folder of the files of steps but the last.
const FOLDER: &str = "steps";

/// Name of a file in a step before the last, numbered from 1 on.
fn file_of(name: &str, step: usize, steps: usize) -> String {
    let digits = steps.to_string().len();
    format!("{FOLDER}/{}-{step:0digits$}.vtu", safe_name(name))
}

/// Bodies, then contact surfaces.
fn names(done: &Done) -> Vec<String> {
    let bodies = done.built.discrete.bodies.iter().map(|body| body.name.clone());
    bodies.chain(shown::stems(done)).collect()
}

/// Writes the fields of the step that has ended: each rank its bodies, one rank the contact surfaces and the collection of all steps so far.
///
/// # Errors
/// Files that cannot be written; the failure of a solver that should have found the interior of a body.
pub fn write(done: &Done, recovered: &All, folder: &Folder, first: bool) -> Result<()> {
    folder.subfolder(FOLDER)?;
    let (step, steps) = (done.steps.len(), done.built.scene.method.steps.steps.len());
    fields(done, recovered, folder, first, &|name| file_of(name, step, steps))?;
    if first { collection(done, folder, false) } else { Ok(()) }
}

/// Writes the fields of the end of a run, likewise.
///
/// # Errors
/// Those of [`write`].
pub fn write_last(done: &Done, recovered: &All, folder: &Folder, first: bool) -> Result<()> {
    if done.built.scene.output.msh {
        views(done, recovered, folder, first)?;
    }
    if !done.built.scene.output.vtu {
        return Ok(());
    }
    fields(done, recovered, folder, first, &|name| format!("{}.vtu", safe_name(name)))?;
    if first { collection(done, folder, true) } else { Ok(()) }
}

/// Writes bodies and contact surfaces for Gmsh, each file with tags of its own.
fn views(done: &Done, recovered: &All, folder: &Folder, first: bool) -> Result<()> {
    let discrete = &done.built.discrete;
    let mut tags = Tags::default();
    for (info, recovered) in discrete.bodies.iter().zip(recovered) {
        if let Some(Ok(recovered)) = recovered {
            let recovered: &Recovered = recovered;
            let write = |out: &mut dyn Write| recovered.field(info).clone().into_grid()?.write_msh(tags, out);
            folder.write(&format!("{}.msh", safe_name(&info.name)), write)?;
        }
        tags = Tags { entity: tags.entity + 1, points: tags.points + info.nodes, cells: tags.cells + info.cells };
    }
    for (i, name) in shown::stems(done).into_iter().enumerate().filter(|_| first) {
        let grid = report::contact_surface(&name, done, i);
        folder.write(&format!("{name}.msh"), |out| grid.write_msh(tags, out))?;
        let (points, cells) = (grid.points.len(), grid.connectivity.len() / grid.cell.stride());
        tags = Tags { entity: tags.entity + 1, points: tags.points + points, cells: tags.cells + cells };
    }
    Ok(())
}

fn fields(done: &Done, recovered: &All, folder: &Folder, first: bool, file: &dyn Fn(&str) -> String) -> Result<()> {
    let encoding = done.built.scene.output.encoding;
    for (info, recovered) in done.built.discrete.bodies.iter().zip(recovered) {
        if let Some(Ok(recovered)) = recovered {
            let recovered: &Recovered = recovered;
            folder.write(&file(&info.name), |out| recovered.field(info).clone().write(encoding, out))?;
        }
    }
    for (i, name) in shown::stems(done).into_iter().enumerate().filter(|_| first) {
        folder.write(&file(&name), |out| report::contact_surface(&name, done, i).write(encoding, out))?;
    }
    Ok(())
}

/// The collection of all steps so far; `ended` tells that the last of them has files at the top.
fn collection(done: &Done, folder: &Folder, ended: bool) -> Result<()> {
    let history = &done.built.scene.method.steps.steps;
    let names = names(done);
    let mut entries = Vec::new();
    for step in 0..done.steps.len().max(1) {
        let is_last = step + 1 >= done.steps.len();
        for (part, name) in names.iter().enumerate() {
            let file = match is_last && ended {
                true => format!("{}.vtu", safe_name(name)),
                false => file_of(name, step + 1, history.len()),
            };
            // steps of another process may have their files elsewhere
            if is_last || folder.path().join(&file).is_file() {
                entries.push(Entry { time: history.get(step).map_or(0.0, |step| step.time), part, name, file });
            }
        }
    }
    folder.write("bodies.pvd", |out| write_pvd(&entries, out)).map(|_| ())
}
