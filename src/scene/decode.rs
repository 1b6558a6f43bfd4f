//! From the tree of values to a checked [`Scene`], and the JSON schema of scene files. Most keys are declared where their structs are; those of
//! the whole scene, of mesh, data and the inner solver are here.

use super::Scene;
use crate::data::{Data, DataSpec, Detrend, Interpolation, Library, Outside};
use crate::error::{Error, Located, Place, Result};
use crate::expression::names;
use crate::mesh::is_shape;
use crate::problem::{Guard, MeshSource, Preset, SolverSpec, contact, name_of};
use crate::setting::{
    Context, Entries, Keys, Node, Setting, TableEntry, TableShape, Value, ValueKind, choose, entries, file, word,
};
use serde_json::{Map, Value as Json, json};
use std::borrow::Cow;
use std::path::Path;
use std::sync::Arc;

/// Return the shape of a whole scene.
pub(super) fn shape() -> TableShape {
    use ValueKind::{Map, OneOf, Text};
    TableShape::new("the scene")
        .optional("title", Text, "title of plots and reports; the name of the file without one")
        .required("dimension", OneOf(&[2, 3]), "2 in the plane, 3 in space")
        .and(Scene::shape())
        .optional(
            "data",
            Map(Box::new(data_shape("data").into())),
            "functions from files; each begins with a line [data.NAME]",
        )
        .optional("contact", contact::shape().list(), "a contact starts with the line [[contact]]")
}

/// Decode the tree of a scene that was read from `path`. Its numbers are checked later ([`Scene::verify`]). Files of meshes and data
/// must exist; they are not read, unless a value of the scene needs data.
///
/// # Errors
/// Tables that do not fit their shape, values that have no meaning, and files that are not there.
pub(super) fn scene(tree: &Node, path: &Path) -> Result<Scene> {
    let keys = Keys::open(tree, &shape())?;
    let dimension = dimension(&keys)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let data = library(keys.get("data"), folder)?;
    let context = &Context { dimension: dimension.value, folder, data: data.clone() };
    let title = match keys.get("title") {
        Some(node) => node.string()?.to_owned(),
        None => path.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
    };
    let (contacts, auto) = contact::read(keys.items("contact")?, context)?;
    let mut scene = Scene { contacts, auto, data, ..Scene::decode(&keys, context, path.to_owned(), title, dimension)? };
    // meshes that are adapted need no more digits than they are worth, unless the scene says how many
    let has_stop = keys.get("method").is_some_and(|method| method.has_key("stop"));
    if let (Some(adapt), false) = (&scene.adapt, has_stop) {
        scene.method.stop.residual = Some(0.1 * adapt.error.value);
    }
    scene.method.steps.join(&scene.bodies, &scene.contacts)?;
    Ok(scene)
}

/// Return the dimension. A `plane` in space is refused.
fn dimension(keys: &Keys) -> Result<Located<usize>> {
    let node = keys.require("dimension")?;
    match (node.count()?, keys.entry("plane")) {
        (3, Some(plane)) => Err(Error::scene(&plane.key_place, "`plane` in a problem in space")
            .label("only plane problems have it")
            .help("remove it, or set dimension = 2")),
        (dimension, _) => Ok(Located::new(dimension, node.place.clone())),
    }
}

impl Scene {
    /// Return the scene as JSON, keyed like the scene file, with every default written out. Keys that have no default and were not given
    /// are left out. Expressions are texts.
    ///
    /// A key that is missing here is also ignored where scenes are compared: by a restart, in a sweep, and between ranks.
    pub fn settings(&self) -> Json {
        let dimension = self.dimension.value;
        let mut entries = self.entries(dimension);
        if dimension == 3 {
            entries.remove("plane");
        }
        let own = [
            ("scene", json!(self.path.display().to_string())),
            ("title", json!(self.title)),
            ("dimension", json!(dimension)),
            ("data", echo_of_data(&self.data)),
            ("contact", contact::echo(&self.contacts, &self.auto, dimension)),
        ];
        entries.extend(crate::setting::entries(own));
        entries.into()
    }
}

/// Return the shape of `mesh` as a table.
fn mesh_shape() -> TableShape {
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
        ValueKind::Either(vec![ValueKind::Text, mesh_shape().into()])
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
        let keys = Keys::open(node, &mesh_shape())?;
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
        Some(TableEntry { key, key_place, .. }) => Err(Error::scene(key_place, format!("`{key}` for a finished mesh"))
            .help("it is for Gmsh, which makes meshes from scripts: mesh = { geo = \"...\" }")),
    }
}

struct NamedNumber {
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
    for TableEntry { key, key_place, node } in entries {
        let is_word = |c: char| c.is_ascii_alphanumeric() || c == '_';
        if !key.chars().all(is_word) || !key.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') {
            return Err(Error::scene(key_place, format!("`{key}` is no name of a Gmsh number")));
        }
        numbers.push(NamedNumber { place: key_place.clone(), name: key.clone(), value: node.number()? });
    }
    numbers.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(numbers)
}

/// Return the shape of `[data.NAME]`; `name` is its name in messages.
fn data_shape(name: impl Into<Cow<'static, str>>) -> TableShape {
    use ValueKind::{Either, Number, Text};
    let one_or_two = || Either(vec![Number, Number.list()]);
    TableShape::new(name)
        .required("file", Text, "heights in rows: .npy, or a table of numbers")
        .optional("origin", one_or_two(), "place of the first height; 0")
        .required("spacing", one_or_two(), "distance of the heights along a row and from row to row")
        .optional("unit", Number, "what a height of 1 in the file is; 1")
        .optional("detrend", word(&Detrend::ALL), "what is subtracted from the heights; \"none\"")
        .optional("interpolate", word(&Interpolation::ALL), "what is between the heights; \"linear\"")
        .optional("outside", word(&Outside::ALL), "what is beyond them; \"error\"")
}

/// Return the data of a scene by name. Their files must exist; they are not read.
fn library(node: Option<&Node>, folder: &Path) -> Result<Library> {
    const EXAMPLE: &str = "write [data.rough] and below it file = \"surface.csv\"";
    let Some(node) = node else { return Ok(Library::new()) };
    let Value::Table(entries) = &node.value else { return Err(node.expected("a table", EXAMPLE)) };
    let is_table = |entry: &&TableEntry| matches!(entry.node.value, Value::Table(_));
    if let Some(TableEntry { key, key_place, .. }) = entries.iter().find(|entry| !is_table(entry)) {
        return Err(Error::scene(key_place, format!("`{key}` in data without a name")).help(EXAMPLE));
    }
    entries.iter().map(|entry| Ok((entry.key.clone(), Arc::new(Data::new(spec(entry, folder)?))))).collect()
}

/// Refuse names that expressions cannot use, or use for something else.
fn check_name(name: &str, place: &Place) -> Result<()> {
    if !name.starts_with(|c: char| c.is_alphabetic()) || name.contains(|c: char| !c.is_alphanumeric() && c != '_') {
        return Err(Error::scene(place, format!("data cannot be called `{name}`"))
            .help("a name that expressions can use has letters, digits and _, a letter first"));
    }
    if names().any(|known| known == name) {
        return Err(
            Error::scene(place, format!("data cannot be called `{name}`")).label("expressions have this name already")
        );
    }
    Ok(())
}

fn spec(entry: &TableEntry, folder: &Path) -> Result<DataSpec> {
    let TableEntry { key: name, key_place, node } = entry;
    check_name(name, key_place)?;
    let keys = Keys::open(node, &data_shape(format!("[data.{name}]")))?;
    let path = file(folder, keys.require("file")?)?;
    Ok(DataSpec {
        name: name.clone(),
        file: path.value,
        place: path.place,
        origin: keys.read("origin", |node| pair(node, Node::number))?.unwrap_or_default(),
        spacing: pair(keys.require("spacing")?, |node| node.positive("the spacing"))?,
        unit: keys.read("unit", unit)?.unwrap_or(1.0),
        detrend: keys.read("detrend", |node| choose(node, "`detrend`", &Detrend::ALL))?.unwrap_or(Detrend::None),
        interpolation: keys
            .read("interpolate", |node| choose(node, "interpolation", &Interpolation::ALL))?
            .unwrap_or(Interpolation::Linear),
        outside: keys.read("outside", |node| choose(node, "`outside`", &Outside::ALL))?.unwrap_or(Outside::Error),
    })
}

/// Return the echo of data by name; null without data.
fn echo_of_data(data: &Library) -> Json {
    match data.is_empty() {
        true => Json::Null,
        false => data.values().map(|data| (data.spec.name.clone(), of_spec(&data.spec))).collect::<Entries>().into(),
    }
}

fn of_spec(spec: &DataSpec) -> Json {
    let DataSpec { name: _, file, place: _, origin, spacing, unit, detrend, interpolation, outside } = spec;
    entries([
        ("file", json!(file.display().to_string())),
        ("origin", json!(origin)),
        ("spacing", json!(spacing)),
        ("unit", json!(unit)),
        ("detrend", json!(name_of(&Detrend::ALL, detrend))),
        ("interpolate", json!(name_of(&Interpolation::ALL, interpolation))),
        ("outside", json!(name_of(&Outside::ALL, outside))),
    ])
    .into()
}

fn unit(node: &Node) -> Result<f64> {
    match node.number()? {
        0.0 => Err(node.refuse("the unit is 0").label("all heights would be 0")),
        unit => Ok(unit),
    }
}

/// Return two numbers, each read by `number`; a single number stands for both.
fn pair(node: &Node, number: impl Fn(&Node) -> Result<f64>) -> Result<[f64; 2]> {
    match &node.value {
        Value::List(items) => match &items[..] {
            [a, b] => Ok([number(a)?, number(b)?]),
            _ => Err(node.refuse(format!("{} numbers", items.len())).label("one number, or two in a list")),
        },
        _ => number(node).map(|both| [both; 2]),
    }
}

impl Setting for SolverSpec {
    fn kind() -> ValueKind {
        ValueKind::Either(vec![Preset::kind(), solver_shape().into()])
    }

    fn read(node: &Node, context: &Context) -> Result<Self> {
        if let Value::String(_) = node.value {
            return Ok(Self { preset: Some(Preset::read(node, context)?) });
        }
        let keys = Keys::open(node, &solver_shape())?;
        Ok(Self { preset: keys.read("preset", |node| Preset::read(node, context))? })
    }

    fn echo(&self, dimension: usize) -> Json {
        entries([("preset", self.preset.echo(dimension))]).into()
    }
}

fn solver_shape() -> TableShape {
    TableShape::new("the solver").optional("preset", Preset::kind(), "the inner solver of all bodies")
}

/// Return the schema (draft 2020-12), made of the shapes by which scenes are decoded.
pub fn schema() -> Json {
    let mut schema = table_schema(&shape());
    schema["$schema"] = json!("https://json-schema.org/draft/2020-12/schema");
    schema["title"] = json!("Scene of winkler");
    schema
}

fn table_schema(table: &TableShape) -> Json {
    let mut properties = Map::new();
    for key in table.documented() {
        let mut property = value_schema(&key.kind);
        property["description"] = json!(key.description);
        properties.insert(key.name.to_owned(), property);
    }
    let required: Vec<&str> = table.documented().filter(|key| key.required).map(|key| key.name).collect();
    let mut schema = json!({ "type": "object", "properties": properties, "additionalProperties": false });
    if !required.is_empty() {
        schema["required"] = json!(required);
    }
    if !table.exclusive.is_empty() {
        schema["allOf"] = table.exclusive.iter().map(|pair| json!({ "not": { "required": pair } })).collect();
    }
    schema
}

fn value_schema(kind: &ValueKind) -> Json {
    match kind {
        ValueKind::Text => json!({ "type": "string" }),
        ValueKind::Flag => json!({ "type": "boolean" }),
        ValueKind::Number => json!({ "type": "number" }),
        ValueKind::Integer(least) => json!({ "type": "integer", "minimum": least }),
        ValueKind::OneOf(numbers) => json!({ "enum": numbers }),
        ValueKind::Field => json!({ "type": ["number", "string"] }),
        ValueKind::Word(words) => json!({ "enum": words }),
        ValueKind::List(item) => json!({ "type": "array", "items": value_schema(item) }),
        ValueKind::Table(table) => table_schema(table),
        ValueKind::Map(value) => json!({ "type": "object", "additionalProperties": value_schema(value) }),
        ValueKind::Either(kinds) => json!({ "anyOf": kinds.iter().map(value_schema).collect::<Vec<_>>() }),
    }
}
