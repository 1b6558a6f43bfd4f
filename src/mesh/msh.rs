//! A reader of Gmsh's `.msh` 4.1, text and binary, that makes a [`Mesh`]. Formats 1 and 2 are rewritten as 4.1 first.

use super::cursor::{Cursor, ReadSeek};
use super::elements::{self, Nodes};
use super::physical::Physical;
use super::simplex::THINGS;
use super::{Mesh, groups, old};
use crate::error::{Error, Result};
use crate::problem::order::Order;
use std::io::{Read, SeekFrom};
use std::path::Path;

/// Number of bytes at the start of a file that show its format.
const START: u64 = 100;

/// The maker of the bytes of a mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MeshProducer {
    /// The user. Line numbers are meaningful in messages, and groups have names.
    User,
    /// Gmsh, from a script.
    Script,
    /// Gmsh, from a file of another program, whose groups may have no names.
    Other,
}

/// Read the bytes of a `.msh` file, for tests. Cells are in the order of the file, with the local numbering of [`Mesh`].
///
/// # Errors
/// The input is not a mesh. The error names the file and the line.
pub fn parse<const D: usize>(path: &Path, bytes: &[u8], maker: MeshProducer) -> Result<Mesh<D>> {
    read(path, Box::new(std::io::Cursor::new(bytes)), maker)
}

/// Read a `.msh` file from its start, one window at a time. `path` stands in messages and is what `maker` made the file from.
///
/// # Errors
/// The file cannot be read, or it is not a mesh of named simplices in `D` dimensions. The latter is a
/// [`Kind::Mesh`](crate::error::Kind) error with the line or byte and a way out.
pub fn read<const D: usize>(path: &Path, mut source: Box<dyn ReadSeek + '_>, maker: MeshProducer) -> Result<Mesh<D>> {
    const { assert!(D == 2 || D == 3) };
    let mut start = Vec::new();
    // The cursor reports a source that cannot be read.
    let _ = source.seek(SeekFrom::Start(0)).and_then(|_| source.by_ref().take(START).read_to_end(&mut start));
    if old::is_old(&start) {
        let bytes = old::convert(path, source, maker != MeshProducer::User)?;
        return read(path, Box::new(std::io::Cursor::new(bytes)), MeshProducer::Other);
    }
    let cursor = &mut Cursor::new(path, source, maker != MeshProducer::User);
    read_format(cursor)?;
    let mut physical = Physical::new(maker == MeshProducer::Other);
    let mut nodes: Option<Nodes> = None;
    let (mut order, mut split) = (None, 0);
    let needed = ["PhysicalNames", "Entities", "PartitionedEntities", "Nodes", "Elements"];
    while let Some((start, section)) = cursor.next_section(&needed)? {
        match (section.as_str(), &mut nodes) {
            ("PhysicalNames", _) => physical.read_names(cursor, D)?,
            ("Entities", _) => physical.read_entities(cursor)?,
            ("Nodes", _) => nodes = Some(Nodes::read(cursor)?),
            ("PartitionedEntities", _) => {
                let error = cursor.error_at(start, "the mesh is partitioned");
                return Err(error.help("save it in one piece: the program divides it among the ranks itself"));
            }
            (_, Some(nodes)) if cursor.has("Entities") => {
                (order, split) = elements::read::<D>(cursor, nodes, &mut physical)?;
            }
            _ => {
                let error = cursor.error_at(start, "$Elements needs $Entities and $Nodes before it");
                return Err(error.help("save the mesh again with Gmsh"));
            }
        }
        cursor.leave()?;
    }
    match nodes {
        Some(nodes) if cursor.has("Elements") => finish(path, physical, nodes, order, split),
        _ => {
            let error = Error::mesh(path, None, "there are no elements");
            Err(error.help("the file was cut short, or nothing was meshed"))
        }
    }
}

/// Read `$MeshFormat`, which is the first section except for comments.
fn read_format(cursor: &mut Cursor) -> Result<()> {
    let save_again = |error: Error, path: &Path| {
        error.help(format!("save it as 4.1: gmsh {} -save -format msh41 -o new.msh", path.display()))
    };
    loop {
        let start = cursor.position();
        let line = if cursor.at_end() { String::new() } else { cursor.line().unwrap_or_default() };
        match line.as_str() {
            "$MeshFormat" => break,
            "$Comments" => {
                cursor.enter("Comments");
                cursor.skip_section()?;
            }
            _ => {
                let message = "this is not a mesh file of Gmsh: it does not begin with $MeshFormat";
                return Err(cursor.error_at(start, message).help(
                    "winkler reads scripts (.geo), meshes (.msh, .unv, .bdf, .inp, .mesh) and shapes (.step, .iges, .brep, .stl) by the \
                     ends of their names: docs/meshes.md has them all",
                ));
            }
        }
    }
    cursor.enter("MeshFormat");
    let start = cursor.position();
    let line = cursor.line()?;
    let words: Vec<&str> = line.split_whitespace().collect();
    let [version, form, size] = words[..] else {
        return Err(cursor.error_at(start, "a format such as `4.1 0 8` should stand here"));
    };
    if version != "4.1" {
        let shown: String = version.chars().take(20).collect();
        let message = format!("this is version {shown} of the mesh format, not 4.1");
        return Err(save_again(cursor.error_at(start, message), cursor.path));
    }
    match (form, size) {
        ("0", _) => {}
        ("1", "8") => cursor.begin_binary()?,
        _ => {
            let message = format!("`{form} {size}` is neither text (`0 8`) nor binary (`1 8`)");
            return Err(save_again(cursor.error_at(start, message), cursor.path));
        }
    }
    cursor.leave()
}

/// Make the mesh after all sections are read.
fn finish<const D: usize>(
    path: &Path,
    physical: Physical,
    nodes: Nodes,
    order: Option<Order>,
    split: usize,
) -> Result<Mesh<D>> {
    let fail = |message: String| Error::mesh(path, None, message);
    let (thing, cells) = (THINGS[D], THINGS[D].to_lowercase());
    let example = format!("name the bodies and their boundaries: Physical {thing}(\"lower\") = {{1}};");
    let empty = physical.empty().map(|group| (group.dimension, group.name.clone()));
    let mut groups = physical.finished(D);
    if groups.is_empty() {
        return Err(fail("the mesh has no physical groups".into()).help(example));
    }
    if let Some((dimension, name)) = empty {
        let thing = THINGS[dimension];
        let message = format!("the physical {} `{name}` has no elements", thing.to_lowercase());
        return Err(fail(message).help(format!("check what its `Physical {thing}` names, or remove it")));
    }
    if let Some(name) = groups::twice(&groups) {
        let help = "names of bodies have small letters, digits and _, and other characters become these: rename one of the groups";
        return Err(fail(format!("two groups of the mesh have the name `{name}` here")).help(help));
    }
    let (Some(order), true) = (order, groups.iter().any(|group| group.dimension == D)) else {
        return Err(fail(format!("no physical group holds {cells}s, and dimension = {D}")).help(example));
    };
    let point = |x: [f64; 3]| std::array::from_fn(|k| x[k]);
    let points = groups::renumber(&mut groups).into_iter().map(|old| point(nodes.points[old as usize])).collect();
    Ok(Mesh { split, ..Mesh::new(path.to_owned(), points, order, groups.into()) })
}
