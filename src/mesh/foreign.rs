//! Files of other programs: shapes that Gmsh meshes, and meshes that it converts.

use super::cache::write;
use super::nastran;
use super::trust::is_kind;
use crate::error::{Located, Result};
use std::collections::HashSet;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Kinds of file with the shape of bodies.
const SHAPES: [&str; 6] = ["step", "stp", "iges", "igs", "brep", "stl"];

/// Kinds of file with a mesh that Gmsh reads, whatever their contents.
const MESHES: [&str; 6] = ["unv", "bdf", "nas", "mesh", "med", "inp"];

/// Return whether a file has the shape of bodies, by its name.
pub fn is_shape(path: &Path) -> bool {
    is_kind(path, &SHAPES)
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
    write(&made, text).map(|()| made)
}

/// Return whether a file is one of Abaqus or CalculiX, which [`super::abaqus`] reads without Gmsh.
pub fn is_input_file(path: &Path) -> bool {
    is_kind(path, &["inp"])
}

/// Write a mesh of another program into the folder `work` in a form that Gmsh reads, and return its path.
///
/// # Errors
/// The file is not such a mesh, or the folder cannot be written.
pub fn mesh(file: &Located<PathBuf>, bytes: &[u8], work: &Path) -> Result<PathBuf> {
    let path = &file.value;
    // A file that begins like a mesh of Gmsh must not be read as a script, whatever its name.
    let kind = match is_kind(path, &MESHES) {
        true => path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase(),
        false => "msh".to_owned(),
    };
    let made = work.join(format!("mesh.{kind}"));
    let written = match kind.as_str() {
        "unv" => write(&made, readable(&String::from_utf8_lossy(bytes))),
        "bdf" | "nas" => {
            let text = nastran::readable(path, &String::from_utf8_lossy(bytes));
            write(&made, text.map_err(|error| error.at(&file.place))?)
        }
        _ => write(&made, bytes),
    };
    written.map(|()| made)
}

/// Datasets of groups with four numbers per member. Gmsh reads groups from the second one, 2477.
const GROUPS: [&str; 5] = ["2467", "2477", "2452", "2435", "2432"];

/// Kinds of elements with an additional line: beams.
const BEAMS: [&str; 5] = ["11", "21", "22", "23", "24"];

/// Code of members that are elements.
const ELEMENT: &str = "8";

/// Number of the dataset of elements.
const ELEMENTS: &str = "2412";

/// Return the file with groups that contain only elements of the file, and with elements of no material if there are groups.
pub fn readable(text: &str) -> String {
    let lines: Vec<&str> = text.lines().collect();
    let number = |dataset: &[&str]| dataset.first().map_or("", |line| line.trim()).to_owned();
    let has_groups = datasets(&lines).any(|dataset| GROUPS.contains(&number(dataset).as_str()));
    let mut elements = HashSet::new();
    for dataset in datasets(&lines).filter(|dataset| number(dataset) == ELEMENTS) {
        elements
            .extend(records(&dataset[1..]).filter_map(|record| record[0].split_whitespace().next()).map(str::to_owned));
    }
    let mut made = String::with_capacity(text.len());
    for dataset in datasets(&lines) {
        made += "    -1\n";
        match dataset.split_first() {
            Some((number, groups)) if GROUPS.contains(&number.trim()) => {
                made += "  2477\n";
                write_groups(groups, &elements, &mut made);
            }
            Some((number, lines)) if has_groups && number.trim() == ELEMENTS => {
                let _ = writeln!(made, "  {ELEMENTS}");
                records(lines).for_each(|record| write_element(record, &mut made));
            }
            _ => dataset.iter().for_each(|line| {
                made += line;
                made.push('\n');
            }),
        }
        made += "    -1\n";
    }
    made
}

/// Return the lines between each two lines of `-1`.
fn datasets<'a>(lines: &'a [&'a str]) -> impl Iterator<Item = &'a [&'a str]> {
    lines.split(|line| line.trim() == "-1").filter(|dataset| dataset.iter().any(|line| !line.trim().is_empty()))
}

/// Return the lines of each element of a dataset.
fn records<'a>(mut lines: &'a [&'a str]) -> impl Iterator<Item = &'a [&'a str]> {
    std::iter::from_fn(move || {
        let words: Vec<&str> = lines.first()?.split_whitespace().collect();
        let nodes: usize = words.get(5).and_then(|word| word.parse().ok()).unwrap_or(0);
        let count = 1 + usize::from(BEAMS.contains(words.get(1)?)) + nodes.div_ceil(8);
        let (record, rest) = lines.split_at(count.min(lines.len()));
        lines = rest;
        Some(record)
    })
}

/// Write an element without its material, which is the fourth number.
fn write_element(record: &[&str], made: &mut String) {
    let words = record[0].split_whitespace().enumerate();
    let words = words.map(|(at, word)| format!("{:>10}", if at == 3 { "0" } else { word }));
    let _ = writeln!(made, "{}", words.collect::<String>());
    record[1..].iter().for_each(|line| {
        let _ = writeln!(made, "{line}");
    });
}

/// Write the groups without members that are not elements of the file. Groups that become empty are omitted.
fn write_groups(mut lines: &[&str], elements: &HashSet<String>, made: &mut String) {
    while let [head, name, rest @ ..] = lines {
        let head: Vec<&str> = head.split_whitespace().collect();
        let (Some(number), Some(count)) = (head.first(), head.last().and_then(|word| word.parse::<usize>().ok()))
        else {
            return;
        };
        // Most programs write two members a line.
        let (mut words, mut members) = (Vec::new(), rest.iter());
        while words.len() < count.saturating_mul(4) {
            let Some(line) = members.next() else { break };
            words.extend(line.split_whitespace());
        }
        lines = members.as_slice();
        let known: Vec<&str> = words
            .chunks(4)
            .filter(|member| member[0] == ELEMENT && member.get(1).is_some_and(|tag| elements.contains(*tag)))
            .map(|member| member[1])
            .collect();
        if known.is_empty() {
            continue;
        }
        let _ = writeln!(made, "{number:>10}{:>10}{:>10}{:>10}{:>10}{:>10}{:>10}{:>10}", 0, 0, 0, 0, 0, 0, known.len());
        let _ = writeln!(made, "{}", name.trim());
        for pair in known.chunks(2) {
            pair.iter().for_each(|tag| {
                let _ = write!(made, "{ELEMENT:>10}{tag:>10}{:>10}{:>10}", 0, 0);
            });
            made.push('\n');
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_keep_the_elements_that_are_there() {
        let text = "    -1\n  2412\n         1        11         0         1         7         2\n 0 1 1\n 1 2\n\
                    \x20        2        41         2         1         7         3\n 1 2 3\n    -1\n    -1\n  2467\n\
                    \x201 0 0 0 0 0 0 3\nLow\n 8 2 0 0 7 1 0 0\n 8 9 0 0\n 2 0 0 0 0 0 0 1\nNodes\n 7 1 0 0\n\
                    \x203 0 0 0 0 0 0 1\nBeam\n 8 1 0 0\n    -1\n";
        let made = readable(text);
        assert!(made.contains("         2        41         2         0         7         3\n 1 2 3\n"), "{made}");
        assert!(made.contains("  2477\n") && !made.contains("2467") && !made.contains("Nodes"), "{made}");
        let groups: Vec<&str> = made.lines().skip_while(|line| line.trim() != "2477").skip(1).collect();
        assert_eq!(groups.len(), 7, "{made}");
        assert_eq!([groups[1], groups[4]], ["Low", "Beam"]);
        assert_eq!(groups[2].split_whitespace().collect::<Vec<_>>(), ["8", "2", "0", "0"]);
        for members in [" 8 2 0 0\n 7 1 0 0\n 8 9 0 0\n", " 8 2 0 0 7 1 0 0 8 9 0 0\n", " 8 2\n0 0 7 1 0 0 8\n9 0 0\n"]
        {
            let other = readable(&text.replace(" 8 2 0 0 7 1 0 0\n 8 9 0 0\n", members));
            assert_eq!(other, made, "{members}");
        }
    }
}
