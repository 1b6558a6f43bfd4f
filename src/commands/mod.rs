//! The commands, each a table of contents of its run: [`solve`], [`check`], [`sweep`]. What they share is in [`run`].

mod balance;
pub mod check;
pub mod inner;
pub mod method;
pub mod preflight;
pub mod report;
pub mod run;
pub mod solve;
pub mod sweep;

use crate::error::Result;
use crate::petsc::Session;
use crate::scene::Scene;
use std::path::PathBuf;

/// Folder of results: `-o`, else what the scene says, else `results/<case>`.
pub fn folder_of(scene: &Scene, typed: Option<PathBuf>) -> PathBuf {
    let stem = scene.path.file_stem().unwrap_or_default();
    let case = match scene.path.parent().and_then(|parent| parent.file_name()) {
        Some(folder) if stem == "scene" => folder,
        _ => stem,
    };
    typed.or_else(|| scene.output.dir.clone()).unwrap_or_else(|| PathBuf::from("results").join(case))
}

/// Reads a scene on every rank; a refusal is printed once.
///
/// # Errors
/// Refusals of the scene.
pub fn load(session: &Session, path: &std::path::Path, overrides: &[String]) -> Result<Scene> {
    crate::parallel::agree(session, crate::scene::load(path, overrides))
}
