//! Where meshes come from.

use crate::error::{Located, Place};
use std::path::PathBuf;
use std::sync::Arc;

/// Sizes of elements other than those that a Gmsh script asks for.
#[derive(Debug, Clone, PartialEq)]
pub enum Sizing {
    /// A field of sizes for Gmsh to follow: a view of its own (`.pos`).
    View(Arc<str>),
    /// This many times those of the script. Structured meshes stay as they are.
    Times(f64),
}

/// What a Gmsh script may take and do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Guard {
    /// Seconds after which Gmsh is ended.
    pub seconds: f64,
    /// Gigabytes that it may take; what is free when it starts if `None`.
    pub gigabytes: Option<f64>,
    /// Largest size of elements in a shape of another program.
    pub size: Option<f64>,
    /// Threads of Gmsh's parallel algorithm for free meshes in space (HXT); the algorithm of the script if `None`.
    pub threads: Option<usize>,
    /// Whether the user trusts the script as a program.
    pub trusted: bool,
}

impl Default for Guard {
    /// A script that nobody trusts, and ten times what Gmsh takes for a million tetrahedra.
    fn default() -> Self {
        Self { seconds: 1000.0, gigabytes: None, size: None, threads: None, trusted: false }
    }
}

/// Where the mesh comes from; paths are relative to the scene file's folder and already joined with it.
#[derive(Debug, Clone)]
pub enum MeshSource {
    /// A Gmsh geometry script and the numbers set in it (`gmsh -setnumber NAME VALUE`), sorted by name; or a shape of another program.
    Geo {
        /// The script, or the file of the shape.
        file: Located<PathBuf>,
        /// Names and numbers, sorted by name.
        set: Vec<(String, f64)>,
        /// Where each name stands.
        places: Vec<Place>,
        /// Sizes of elements instead of the script's own; no scene file has them.
        sizes: Option<Sizing>,
        /// What it may take and do.
        guard: Guard,
    },
    /// A mesh file: Gmsh's format 4.1, text or binary, or one that Gmsh converts.
    Msh {
        /// The mesh file.
        file: Located<PathBuf>,
    },
}
