//! Files of other programs: shapes that Gmsh meshes, and meshes that it converts.

use super::simplex::THINGS;
use crate::error::{Error, Located, Result};
use crate::file::write;
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
/// Every volume, surface and point becomes a group with a name of its kind and number. In the plane these are surfaces,
/// curves and points. Elements have the given `size`, if there is one.
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

/// Copy a mesh of another program into the folder `work`, and return the path of the copy. Gmsh chooses its reader by
/// the name, and reads files beside a mesh as scripts, so that the copy has a name of our own. A file of no other kind
/// begins like a mesh of Gmsh.
///
/// # Errors
/// A deck or universal file uses local systems of coordinates, which Gmsh ignores without a word. The folder cannot be
/// written.
pub fn copied(file: &Located<PathBuf>, bytes: &[u8], work: &Path) -> Result<PathBuf> {
    let kind = if is_kind(&file.value, &MESHES) { ending(&file.value) } else { "msh".to_owned() };
    match kind.as_str() {
        "bdf" | "nas" => refuse_local_systems(file, bytes)?,
        "unv" => refuse_turned_systems(file, bytes)?,
        _ => {}
    }
    let made = work.join(format!("mesh.{kind}"));
    write(&made, bytes).map(|()| made)
}

/// Refuse a deck of Nastran with a grid point in a local system of coordinates.
///
/// A point is in the system of its field CP, or where that is blank in that of `GRDSET`; 0 is the global system.
/// Systems that no point names change nothing, and neither does the field CD: it turns displacements, supports and
/// loads, which are not read.
fn refuse_local_systems(file: &Located<PathBuf>, bytes: &[u8]) -> Result<()> {
    let text = String::from_utf8_lossy(bytes);
    let usual = text.lines().find_map(|line| system(line, "GRDSET")).unwrap_or_default();
    for (line, number) in text.lines().zip(1..) {
        let named = system(line, "GRID").map(|own| if own.is_empty() { usual } else { own });
        if let Some(local) = named.filter(|name| !name.bytes().all(|digit| digit == b'0')) {
            let what = format!(
                "this grid point is in the local system of coordinates {local}, and Gmsh reads all points as global ones"
            );
            return Err(Error::mesh(&file.value, Some(number), what)
                .at(&file.place)
                .help("write the deck with all grid points in the basic system (CP = 0)"));
        }
    }
    Ok(())
}

/// Return the field CP of a line of a deck with this card, in free, small or large fields; none if the line has another
/// card.
fn system<'a>(line: &'a str, card: &str) -> Option<&'a str> {
    let line = line.split('$').next().unwrap_or_default();
    let (name, field) = if line.contains(',') {
        let mut fields = line.split(',');
        (fields.next().unwrap_or_default(), fields.nth(1))
    } else {
        let name = line.get(..8).unwrap_or(line);
        let [from, to] = if name.contains('*') { [24, 40] } else { [16, 24] };
        (name, line.get(from..to.min(line.len())))
    };
    let name = name.trim().trim_end_matches('*').trim_end();
    name.eq_ignore_ascii_case(card).then(|| field.unwrap_or_default().trim())
}

/// Refuse a universal file with a node in a local system of coordinates: one of dataset 2420 that is not rectangular,
/// or turned or moved.
fn refuse_turned_systems(file: &Located<PathBuf>, bytes: &[u8]) -> Result<()> {
    let text = String::from_utf8_lossy(bytes);
    let lines: Vec<&str> = text.lines().collect();
    let numbers = |line: usize| -> Vec<f64> {
        let words = lines.get(line).copied().unwrap_or_default().split_whitespace();
        words.map_while(|word| word.replace(['D', 'd'], "e").parse().ok()).collect()
    };
    // the lines of each dataset behind its number
    let is_mark = |line: usize| lines[line].trim() == "-1";
    let marks: Vec<usize> = (0..lines.len()).filter(|&line| is_mark(line)).collect();
    let datasets = |number: f64| {
        let found = marks.chunks_exact(2).filter(move |ends| numbers(ends[0] + 1) == [number]);
        found.map(|ends| (ends[0] + 2, ends[1]))
    };
    // a system: its number and kind, its name, and four lines with its axes and its origin
    let is_global = |line: usize| {
        let place = (2..6).flat_map(|row| numbers(line + row));
        numbers(line).get(1) == Some(&0.0) && place.eq([1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
    };
    let systems = datasets(2420.0).flat_map(|(from, to)| (from + 2..to).step_by(6));
    let local: Vec<f64> =
        systems.filter(|&line| !is_global(line)).filter_map(|line| numbers(line).first().copied()).collect();
    let mut nodes = datasets(2411.0).flat_map(|(from, to)| (from..to).step_by(2));
    match nodes.find(|&line| !local.is_empty() && numbers(line).get(1).is_some_and(|own| local.contains(own))) {
        Some(line) => Err(Error::mesh(
            &file.value,
            Some(line + 1),
            "this node is in a local system of coordinates, and Gmsh reads all as global ones",
        )
        .at(&file.place)
        .help("export the mesh in global coordinates")),
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
