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

/// Where the mesh comes from; paths are relative to the scene file's folder and already joined with it.
#[derive(Debug, Clone)]
pub enum MeshSource {
    /// A Gmsh geometry script and the numbers set in it (`gmsh -setnumber NAME VALUE`), sorted by name.
    Geo {
        /// The script.
        file: Located<PathBuf>,
        /// Names and numbers, sorted by name.
        set: Vec<(String, f64)>,
        /// Where each name stands.
        places: Vec<Place>,
        /// Sizes of elements instead of the script's own; no scene file has them.
        sizes: Option<Sizing>,
    },
    /// A mesh file, format 4.1, text or binary.
    Msh {
        /// The mesh file.
        file: Located<PathBuf>,
    },
}
