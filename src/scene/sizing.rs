//! Sizes of elements that the program asks of Gmsh in place of the script's own.

use std::sync::Arc;

/// Sizes of elements other than those that a Gmsh script asks for.
#[derive(Debug, Clone, PartialEq)]
pub enum Sizing {
    /// A field of sizes for Gmsh to follow: a view of its own (`.pos`).
    View(Arc<str>),
    /// This many times those of the script. Structured meshes stay as they are.
    Times(f64),
}
