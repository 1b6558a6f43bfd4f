//! Bulk data of Nastran (`.bdf`, `.nas`) in a form that Gmsh can read.

mod cards;
mod solids;
mod systems;

use crate::error::{Error, Result};
use cards::{Card, cards};
use std::path::Path;

/// Return the bulk data with all grid points in the basic system, and with cards of solids that Gmsh understands. All other lines are
/// those of the file, without empty ones.
///
/// # Errors
/// A card is malformed, or a point lies in a system that is not there or not known. Another file is to be included. The error names the
/// line.
pub fn readable(path: &Path, text: &str) -> Result<String> {
    let lines: Vec<&str> = text.lines().collect();
    let includes = |line: &&str| line.trim_start().get(..8).is_some_and(|word| word.eq_ignore_ascii_case("INCLUDE "));
    if let Some(at) = lines.iter().position(includes) {
        return Err(Error::mesh(path, Some(at + 1), "files that include others are not read")
            .help("put the files together into one"));
    }
    let all = cards(&lines, |name| systems::is_ours(name) || solids::is_ours(name));
    let of = |is_ours: fn(&str) -> bool| all.iter().filter(|card| is_ours(&card.name)).collect::<Vec<&Card>>();
    let mut made: Vec<String> = lines.iter().map(|line| (*line).to_owned()).collect();
    systems::to_basic(path, &of(systems::is_ours), &mut made)?;
    solids::to_small_fields(path, &of(solids::is_ours), &mut made)?;
    made.retain(|line| !line.is_empty());
    Ok(made.join("\n") + "\n")
}
