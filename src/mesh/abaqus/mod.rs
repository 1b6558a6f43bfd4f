//! Input files of Abaqus and CalculiX (`.inp`) in Gmsh's format 4.1: nodes, elements, and named sets.
//!
//! Element sets become groups of cells. Sets of shells, membranes and trusses become the groups of facets or edges of cells
//! that these lie on. Surfaces are groups of facets, and node sets groups of points. Instances of parts are placed. Names are
//! written in lower case. Characters that no name can have become `_`. Other keywords are skipped.

mod faces;
mod groups;
mod kinds;
mod lines;
mod model;
mod read;
mod words;
mod write;

use crate::error::{Error, Result};
use groups::{Groups, LeftOut};
use read::Reader;
use std::path::Path;

/// A converted file.
pub struct Converted {
    /// The bytes of the mesh in Gmsh's format 4.1.
    pub mesh: Vec<u8>,
    /// What the user should know of it, in sentences without a full stop.
    pub notes: Vec<String>,
}

/// Convert a file for a scene of this dimension.
///
/// # Errors
/// A line is not one of Abaqus or CalculiX. The file has no cells, or solids of other kinds. A set has members that do not
/// exist. Errors name the line.
pub fn convert(path: &Path, bytes: &[u8], dimension: usize) -> Result<Converted> {
    let reader = Reader::read(path, bytes)?;
    let help = "an input file of Abaqus or CalculiX has them under *NODE and *ELEMENT";
    if reader.model.nodes.is_empty() || reader.model.elements.is_empty() {
        return Err(Error::mesh(path, None, "this file has no nodes or no elements").help(help));
    }
    let groups = Groups::new(&reader.model, &reader.lines, dimension)?;
    groups.check_nodes()?;
    if !groups.list.iter().any(|group| group.dimension >= dimension) {
        let types: Vec<&str> = groups.left_out.elements.keys().map(String::as_str).collect();
        let message = format!("this file has no cells of bodies in dimension {dimension}, only {}", types.join(", "));
        let help = if dimension == 3 { "for plane elements set `dimension = 2`" } else { help };
        return Err(Error::mesh(path, None, message).help(help));
    }
    Ok(Converted { mesh: write::mesh(&reader.model, &groups.list), notes: notes(path, &reader, &groups.left_out) })
}

/// Return what was left out, or is not as the user may think.
fn notes(path: &Path, reader: &Reader, left_out: &LeftOut) -> Vec<String> {
    let mut notes = Vec::new();
    let file = path.display();
    let types: Vec<String> = left_out.elements.iter().map(|(name, count)| format!("{count} {name}")).collect();
    if !types.is_empty() {
        notes.push(format!("{file}: elements that are no solids are left out: {}", types.join(", ")));
    }
    if left_out.faces > 0 {
        notes.push(format!("{file}: surfaces lose {} faces of elements that are left out", left_out.faces));
    }
    if left_out.nodes > 0 {
        notes.push(format!("{file}: node sets lose {} nodes that belong to no solid", left_out.nodes));
    }
    if let [first, ..] = &reader.twice[..] {
        let [old, new] = first.lines.map(|at| reader.lines.show(at));
        notes.push(format!(
            "{file}: {} nodes stand twice with different coordinates, and the later ones count, as in CalculiX: node {} in {old} \
             and {new}",
            reader.twice.len(),
            first.tag
        ));
    }
    if reader.longer > 0 {
        notes.push(format!(
            "{file}: {} elements have more nodes than their type, and the first ones count, as in CalculiX",
            reader.longer
        ));
    }
    if !left_out.renamed.is_empty() {
        notes.push(format!("{file}: names of element sets are taken: {}", left_out.renamed.join(", ")));
    }
    if reader.transforms > 0 {
        notes.push(format!(
            "{file}: {} *TRANSFORM are skipped: supports and loads of the scene are along x, y and z",
            reader.transforms
        ));
    }
    notes
}
