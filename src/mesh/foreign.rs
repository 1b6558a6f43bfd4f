//! Files of other programs: shapes that Gmsh meshes, and meshes that it converts.

use super::trust::is_kind;
use super::{abaqus, nastran, unv};
use crate::error::{Error, Located, Result};
use std::path::{Path, PathBuf};

/// Kinds of file with the shape of bodies.
const SHAPES: [&str; 6] = ["step", "stp", "iges", "igs", "brep", "stl"];

/// Kinds of file with a mesh that Gmsh reads, whatever their contents.
const MESHES: [&str; 6] = ["unv", "bdf", "nas", "mesh", "med", "inp"];

/// Return whether a file has the shape of bodies, by its name.
pub fn is_shape(path: &Path) -> bool {
    is_kind(path, &SHAPES)
}

/// Return whether a file holds a mesh that Gmsh converts first: one of another program, or of another version of Gmsh's own
/// format.
pub fn is_mesh(path: &Path, bytes: &[u8]) -> bool {
    let version = bytes.strip_prefix(b"$MeshFormat").map(|rest| rest.trim_ascii_start());
    is_kind(path, &MESHES)
        || bytes.starts_with(b"$NOD")
        || version.is_some_and(|version| ["2", "4 ", "4.0 "].iter().any(|old| version.starts_with(old.as_bytes())))
}

/// Write a script into the folder `work` that loads the shape in a file and names its groups, and return its path.
///
/// Every volume, surface and point becomes a group with a name of its kind and number. In the plane these are surfaces, curves
/// and points. Elements have the given `size`, if there is one.
///
/// # Errors
/// The folder cannot be written.
pub fn script(path: &Path, bytes: &[u8], dimension: usize, size: Option<f64>, work: &Path) -> Result<PathBuf> {
    let kind = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
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
    let things = ["Point", "Curve", "Surface", "Volume"];
    for (thing, of) in [(things[dimension], dimension), (things[dimension - 1], dimension - 1), (things[0], 0)] {
        let (name, list) = (thing.to_lowercase(), format!("list{of}"));
        text += &format!(
            "{list}() = {thing}{{:}};\nFor i In {{0:#{list}()-1}}\n  \
             Physical {thing}(Sprintf(\"{name}_%g\", {list}(i)), {list}(i)) = {{{list}(i)}};\nEndFor\n"
        );
    }
    let made = work.join("shape.geo");
    write(&made, text.as_bytes()).map(|()| made)
}

/// Write a mesh of another program into the folder `work` in a form that Gmsh reads, and return its path.
///
/// # Errors
/// The file is not such a mesh, or the folder cannot be written.
pub fn mesh(file: &Located<PathBuf>, bytes: &[u8], work: &Path) -> Result<PathBuf> {
    let path = &file.value;
    if is_kind(path, &["inp"]) {
        let text = abaqus::convert(path, &String::from_utf8_lossy(bytes)).map_err(|error| error.at(&file.place))?;
        let made = work.join("mesh.msh");
        return write(&made, text.as_bytes()).map(|()| made);
    }
    // A file that begins like a mesh of Gmsh must not be read as a script, whatever its name.
    let kind = match is_kind(path, &MESHES) {
        true => path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase(),
        false => "msh".to_owned(),
    };
    let made = work.join(format!("mesh.{kind}"));
    let written = match kind.as_str() {
        "unv" => write(&made, unv::readable(&String::from_utf8_lossy(bytes)).as_bytes()),
        "bdf" | "nas" => {
            let text = nastran::readable(path, &String::from_utf8_lossy(bytes));
            write(&made, text.map_err(|error| error.at(&file.place))?.as_bytes())
        }
        _ => write(&made, bytes),
    };
    written.map(|()| made)
}

fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    std::fs::write(path, bytes).map_err(|cause| Error::file(path, "write", &cause))
}
