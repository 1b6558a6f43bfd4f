//! Bulk data of Nastran (`.bdf`, `.nas`) in a form that Gmsh can read.

mod solids;
mod systems;

use crate::error::Result;
use std::path::Path;

/// Return the bulk data with all grid points in the basic system, and with cards of solids that Gmsh understands.
///
/// # Errors
/// A card is malformed, or a point lies in a system that is not there or not known. The error names the line.
pub fn readable(path: &Path, text: &str) -> Result<String> {
    // The first step may add lines. The second one is made on the text of the file as well, so that its errors name lines of it.
    solids::readable(path, text)?;
    solids::readable(path, &systems::in_basic_system(path, text)?)
}
