//! `mesh`: a mesh file, a script of Gmsh, or a shape.

use crate::error::{Error, Place, Result};
use crate::mesh::is_shape;
use crate::problem::{Guard, MeshSource};
use crate::setting::{Context, Entry, Keys, Node, Setting, TableShape, Value, ValueKind, file};
use serde_json::{Map, Value as Json, json};
use std::sync::Arc;

/// Return the shape of `mesh` as a table.
fn shape() -> TableShape {
    use ValueKind::{Map, Number, Text};
    TableShape::new("the mesh")
        .optional("geo", Text, "a Gmsh script, or a shape (.step, .iges, .brep, .stl), relative to the scene's folder")
        .optional("msh", Text, "a mesh: Gmsh's .msh, or a format that Gmsh converts")
        .optional("set", Map(Box::new(Number)), "numbers for the script: set = { n = 32 }")
        .and(Guard::shape())
        .at_most_one(&["geo", "msh"])
}

impl Setting for MeshSource {
    fn kind() -> ValueKind {
        ValueKind::Either(vec![ValueKind::Text, shape().into()])
    }

    fn read(node: &Node, context: &Context) -> Result<Self> {
        if let Value::String(name) = &node.value {
            let file = file(context.folder, node)?;
            return Ok(match name.ends_with(".geo") || is_shape(&file.value) {
                true => {
                    let guard = Guard::default();
                    Self::Geo { file, set: Vec::new(), places: Vec::new(), sizes: None, guard }
                }
                false => Self::Msh { file },
            });
        }
        let keys = Keys::open(node, &shape())?;
        if let Some(msh) = keys.get("msh") {
            return mesh_file(&keys, msh, context);
        }
        let file = file(context.folder, keys.require("geo")?)?;
        if let (Some(entry), false) = (keys.entry("size"), is_shape(&file.value)) {
            return Err(Error::scene(&entry.key_place, "`size` for a script, which has sizes of its own")
                .help("it is for shapes (.step, .iges, .brep, .stl): give scripts numbers by set = { n = 32 }"));
        }
        let set = keys.read("set", numbers)?.unwrap_or_default();
        let (places, set) = set.into_iter().map(|NamedNumber { place, name, value }| (place, (name, value))).unzip();
        Ok(Self::Geo { file, set, places, sizes: None, guard: Guard::decode(&keys, context)? })
    }

    fn echo(&self, dimension: usize) -> Json {
        match self {
            Self::Arrays(arrays) => json!({ "points": arrays.points.len(), "groups": arrays.groups.len() }),
            Self::Msh { file } => json!({ "msh": file.value.display().to_string() }),
            Self::Geo { file, set, places: _, sizes: _, guard } => {
                let mut entries = guard.entries(dimension);
                entries.insert("geo".to_owned(), json!(file.value.display().to_string()));
                let set: Map<_, _> = set.iter().map(|(name, value)| (name.clone(), json!(value))).collect();
                entries.insert("set".to_owned(), set.into());
                entries.into()
            }
        }
    }
}

/// Return the mesh file that `msh` names. A shape, and keys that are for Gmsh alone, are refused.
fn mesh_file(keys: &Keys, msh: &Node, context: &Context) -> Result<MeshSource> {
    let file = file(context.folder, msh)?;
    if is_shape(&file.value) {
        return Err(msh
            .refuse("this is the shape of bodies, and no mesh")
            .help("mesh = { geo = \"...\", size = 0.1 }"));
    }
    let of_gmsh = Guard::shape();
    match ["set"].into_iter().chain(of_gmsh.keys.iter().map(|key| key.name)).find_map(|key| keys.entry(key)) {
        None => Ok(MeshSource::Msh { file }),
        Some(Entry { key, key_place, .. }) => Err(Error::scene(key_place, format!("`{key}` for a finished mesh"))
            .help("it is for Gmsh, which makes meshes from scripts: mesh = { geo = \"...\" }")),
    }
}

/// Return whether the user trusts the mesh's script as a program. Only the command line can say so: a key whose place lies in the
/// scene file is refused.
pub fn is_trusted(tree: &Node, keys: &Keys) -> Result<bool> {
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
