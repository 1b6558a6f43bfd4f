//! The commands, each a table of contents of its run: [`solve`], [`check`], [`sweep`], [`bench`](mod@bench), [`mesh`]. What those
//! that solve share with the library is in [`run`](crate::run).

pub mod adapt;
mod adapted;
pub mod bench;
pub mod carry;
pub mod check;
pub mod checkpoint;
mod curves;
pub mod mesh;
pub mod new;
mod reuse;
mod said;
mod series;
pub mod solve;
pub mod surfaces;
pub mod sweep;
mod told;
mod typed;
pub mod write;

use crate::error::Result;
use crate::petsc::Session;
use crate::scene::Scene;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::rc::Rc;

/// Folder of results: `-o`, else what the scene says, else `results/<case>`.
pub fn folder_of(scene: &Scene, typed: Option<&PathBuf>) -> PathBuf {
    typed
        .cloned()
        .or_else(|| scene.output.dir.clone())
        .unwrap_or_else(|| PathBuf::from("results").join(case_of(&scene.path)))
}

/// Name of a scene's case: the folder of a file called `scene.toml`, else the file's name.
fn case_of(path: &Path) -> &OsStr {
    let stem = path.file_stem().unwrap_or_default();
    match path.parent().and_then(|parent| parent.file_name()) {
        Some(folder) if stem == "scene" => folder,
        _ => stem,
    }
}

/// Reads a scene on every rank; a refusal is printed once.
///
/// # Errors
/// Refusals of the scene, or of scenes that are not the same on all ranks.
pub fn load(session: &Session, path: &Path, overrides: &[String]) -> Result<Rc<Scene>> {
    let scene = crate::parallel::agree(session, crate::scene::load(path, overrides).map(Rc::new))?;
    crate::run::refuse_other_scenes(session, &[&*scene])?;
    Ok(scene)
}
