//! What the user asks `winkler bench` for.

use crate::error::{Error, Kind};
use std::path::PathBuf;

/// What the user typed.
pub struct Request {
    /// Scene files.
    pub scenes: Vec<PathBuf>,
    /// Folder of results, if typed.
    pub folder: Option<PathBuf>,
    /// Overrides of scene keys for every run.
    pub overrides: Vec<String>,
    /// `KEY=V1,V2,...`; several make all combinations.
    pub over: Vec<String>,
    /// Inner solvers: names of presets with commas between, or one string of PETSc options each.
    pub solvers: Vec<String>,
    /// Methods; none for the scene's own.
    pub methods: Vec<String>,
    /// Element orders; none for the scene's own.
    pub orders: Vec<usize>,
    /// Numbers of ranks.
    pub ranks: Vec<usize>,
    /// Runs of each combination.
    pub repeat: usize,
    /// Contact table, or folder of them, that errors are measured against.
    pub against: Option<PathBuf>,
    /// Seconds after which a run is ended.
    pub timeout: f64,
    /// Seconds after which no further run begins.
    pub budget: f64,
    /// Whether to measure one linear factor-and-solve of the bodies, too.
    pub linear: bool,
    /// Whether rows that the folder has already are kept.
    pub resume: bool,
    /// PETSc options for every run.
    pub petsc: Vec<String>,
}

/// A refusal of the command line.
pub(super) fn usage(message: impl Into<String>) -> Error {
    Error::new(Kind::Usage, message)
}
