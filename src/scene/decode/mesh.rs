//! `mesh`: a mesh file, a script of Gmsh, or a shape.

use super::{Decoder, Keys, Node, TableShape, Value, ValueKind, file};
use crate::error::{Error, Place, Result};
use crate::mesh::is_shape;
use crate::problem::{Guard, MeshSource};
use crate::scene::read::Entry;
use std::sync::Arc;

/// Return the shape of `mesh` as a table.
pub(super) fn shape() -> TableShape {
    use ValueKind::{Map, Number, PositiveInteger, Text};
    TableShape::new("the mesh")
        .optional("geo", Text, "a Gmsh script, or a shape (.step, .iges, .brep, .stl), relative to the scene's folder")
        .optional("msh", Text, "a mesh: Gmsh's .msh, or a format that Gmsh converts")
        .optional("set", Map(Box::new(Number)), "numbers for the script: set = { n = 32 }")
        .optional("size", Number, "largest size of elements in a shape")
        .optional("threads", PositiveInteger, "threads of Gmsh for free meshes in space")
        .optional("timeout", Number, "seconds after which Gmsh is ended; 1000")
        .optional("memory", Number, "gigabytes that Gmsh may take; what is free when it starts")
        .at_most_one(&["geo", "msh"])
}

/// Keys that say how Gmsh makes a mesh; a mesh file has none of them.
const OF_GMSH: [&str; 5] = ["set", "size", "threads", "timeout", "memory"];

impl Decoder<'_> {
    /// Return where the mesh comes from. `trusted` says whether its script may do what a program may.
    pub(super) fn mesh(&self, node: &Node, trusted: bool) -> Result<MeshSource> {
        if let Value::String(name) = &node.value {
            let file = file(self.folder, node)?;
            return Ok(match name.ends_with(".geo") || is_shape(&file.value) {
                true => {
                    let guard = Guard { trusted, ..Guard::default() };
                    MeshSource::Geo { file, set: Vec::new(), places: Vec::new(), sizes: None, guard }
                }
                false => MeshSource::Msh { file },
            });
        }
        let keys = Keys::open(node, &shape())?;
        if let Some(msh) = keys.get("msh") {
            return self.mesh_file(&keys, msh);
        }
        let file = file(self.folder, keys.require("geo")?)?;
        if let (Some(entry), false) = (keys.entry("size"), is_shape(&file.value)) {
            return Err(Error::scene(&entry.key_place, "`size` for a script, which has sizes of its own")
                .help("it is for shapes (.step, .iges, .brep, .stl): give scripts numbers by set = { n = 32 }"));
        }
        let set = keys.read("set", numbers)?.unwrap_or_default();
        let (places, set) = set.into_iter().map(|NamedNumber { place, name, value }| (place, (name, value))).unzip();
        let guard = Guard {
            seconds: keys.read("timeout", Node::number)?.unwrap_or(Guard::default().seconds),
            gigabytes: keys.read("memory", Node::number)?,
            size: keys.read("size", Node::number)?,
            threads: keys.read("threads", Node::count)?,
            trusted,
        };
        Ok(MeshSource::Geo { file, set, places, sizes: None, guard })
    }

    /// Return the mesh file that `msh` names. A shape, and keys that are for Gmsh alone, are refused.
    fn mesh_file(&self, keys: &Keys, msh: &Node) -> Result<MeshSource> {
        let file = file(self.folder, msh)?;
        if is_shape(&file.value) {
            return Err(msh
                .refuse("this is the shape of bodies, and no mesh")
                .help("mesh = { geo = \"...\", size = 0.1 }"));
        }
        match OF_GMSH.iter().find_map(|key| keys.entry(key)) {
            None => Ok(MeshSource::Msh { file }),
            Some(Entry { key, key_place, .. }) => Err(Error::scene(key_place, format!("`{key}` for a finished mesh"))
                .help("it is for Gmsh, which makes meshes from scripts: mesh = { geo = \"...\" }")),
        }
    }
}

/// Return whether the user trusts the mesh's script as a program. Only the command line can say so: a key whose place lies in the
/// scene file is refused.
pub(super) fn is_trusted(tree: &Node, keys: &Keys) -> Result<bool> {
    let Some(entry) = keys.entry("trust_geo") else { return Ok(false) };
    if Arc::ptr_eq(&entry.key_place.source, &tree.place.source) {
        return Err(Error::scene(&entry.key_place, "a scene cannot say that it is trusted")
            .help("remove this, and give --trust-geo on the command line"));
    }
    entry.node.boolean()
}

/// A number for a script of Gmsh.
struct NamedNumber {
    /// Place of the name.
    place: Place,
    name: String,
    value: f64,
}

/// Return the numbers for Gmsh, sorted by name.
fn numbers(node: &Node) -> Result<Vec<NamedNumber>> {
    let Value::Table(entries) = &node.value else {
        return Err(node.expected("a table", ""));
    };
    let mut numbers = Vec::new();
    for Entry { key, key_place, node } in entries {
        let is_word = |c: char| c.is_ascii_alphanumeric() || c == '_';
        if !key.chars().all(is_word) || !key.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') {
            return Err(Error::scene(key_place, format!("`{key}` is no name of a Gmsh number")));
        }
        numbers.push(NamedNumber { place: key_place.clone(), name: key.clone(), value: node.number()? });
    }
    numbers.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(numbers)
}
