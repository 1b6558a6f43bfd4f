//! Files of other programs: shapes that Gmsh meshes, and meshes that it converts.

use super::cache::write;
use super::simplex::THINGS;
use crate::error::{Error, Located, Result};
use crate::problem::mesh::is_shape;
use std::path::{Path, PathBuf};

/// Kinds of file with a mesh that Gmsh reads, whatever their contents.
const MESHES: [&str; 6] = ["unv", "bdf", "nas", "mesh", "med", "inp"];

/// Return whether a file has a shape or a mesh, by its name, so that Gmsh reads no script in it.
pub fn is_data(path: &Path) -> bool {
    is_shape(path) || is_kind(path, &MESHES)
}

/// Return whether a file holds a mesh of another program, or of Gmsh's format 4.0.
pub fn is_mesh(path: &Path, bytes: &[u8]) -> bool {
    let version = bytes.strip_prefix(b"$MeshFormat").map(|rest| rest.trim_ascii_start());
    is_kind(path, &MESHES)
        || version.is_some_and(|version| ["4 ", "4.0 "].iter().any(|old| version.starts_with(old.as_bytes())))
}

/// Write a script into the folder `work` that loads the shape in a file and names its groups, and return its path.
///
/// Every volume, surface and point becomes a group with a name of its kind and number. In the plane these are surfaces, curves
/// and points. Elements have the given `size`, if there is one.
///
/// # Errors
/// The folder cannot be written.
pub fn script(path: &Path, bytes: &[u8], dimension: usize, size: Option<f64>, work: &Path) -> Result<PathBuf> {
    let kind = ending(path);
    // The copy has a name of our own, since the user's may contain any characters.
    let copy = format!("shape.{kind}");
    write(&work.join(&copy), bytes)?;
    let mut text = format!("Merge \"{copy}\";\n");
    if kind == "stl" {
        // A surface ends at a bend of more than 40 degrees.
        text += "ClassifySurfaces{40*Pi/180, 1, 1, Pi};\nCreateGeometry;\n";
        if dimension == 3 {
            text += "all() = Surface{:};\nSurface Loop(1) = {all()};\nVolume(1) = {1};\n";
        }
    }
    if let Some(size) = size {
        text += &format!("Mesh.MeshSizeMax = {size};\nends() = Point{{:}};\nMeshSize{{ends()}} = {size};\n");
    }
    for of in [dimension, dimension - 1, 0] {
        let thing = THINGS[of];
        let (name, list) = (thing.to_lowercase(), format!("list{of}"));
        text += &format!(
            "{list}() = {thing}{{:}};\nFor i In {{0:#{list}()-1}}\n  \
             Physical {thing}(Sprintf(\"{name}_%g\", {list}(i)), {list}(i)) = {{{list}(i)}};\nEndFor\n"
        );
    }
    let made = work.join("shape.geo");
    write(&made, text).map(|()| made)
}

/// Return whether a file is one of Abaqus or CalculiX, which [`super::abaqus`] reads without Gmsh.
pub fn is_input_file(path: &Path) -> bool {
    is_kind(path, &["inp"])
}

/// Copy a mesh of another program into the folder `work`, and return the path of the copy. Gmsh chooses its reader by the name, and reads files
/// beside a mesh as scripts, so that the copy has a name of our own. A file of no other kind begins like a mesh of Gmsh.
///
/// # Errors
/// A deck has local systems of coordinates, which Gmsh ignores without a word. The folder cannot be written.
pub fn copied(file: &Located<PathBuf>, bytes: &[u8], work: &Path) -> Result<PathBuf> {
    let kind = match is_kind(&file.value, &MESHES) {
        true => ending(&file.value),
        false => "msh".to_owned(),
    };
    if ["bdf", "nas"].contains(&kind.as_str()) {
        refuse_local_systems(file, bytes)?;
    }
    let made = work.join(format!("mesh.{kind}"));
    write(&made, bytes).map(|()| made)
}

/// Refuse a deck of Nastran that defines local systems of coordinates (`CORD2R` and the like) or a default one (`GRDSET`).
fn refuse_local_systems(file: &Located<PathBuf>, bytes: &[u8]) -> Result<()> {
    let text = String::from_utf8_lossy(bytes).to_ascii_uppercase();
    let is_local = |line: &str| ["CORD", "GRDSET"].iter().any(|card| line.trim_start().starts_with(card));
    match text.lines().zip(1..).find(|(line, _)| is_local(line)) {
        Some((_, number)) => {
            let what = "the deck has a local system of coordinates, and Gmsh reads all points as global ones";
            Err(Error::mesh(&file.value, Some(number), what)
                .at(&file.place)
                .help("write the deck with all grid points in the basic system"))
        }
        None => Ok(()),
    }
}

fn ending(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase()
}

/// Return whether the name of a file ends in one of these, in lower or upper case. Gmsh does not recognize a mixture.
fn is_kind(path: &Path, kinds: &[&str]) -> bool {
    let end = path.extension().unwrap_or_default();
    kinds.iter().any(|kind| end == *kind || end == kind.to_ascii_uppercase().as_str())
}
