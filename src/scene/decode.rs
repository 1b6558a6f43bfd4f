//! From the tree of values to a checked [`Scene`]. Most keys are declared where their structs are; mesh, data and the inner solver have a
//! file of their own here.

mod data;
mod mesh;
mod solver;

use crate::error::{Error, Located, Result};
use crate::problem::MeshSource;
use crate::problem::keys::contact;
use crate::scene::Scene;
use crate::setting::{Context, Keys, Node, TableShape, ValueKind};
use serde_json::{Value as Json, json};
use std::path::Path;

/// Return the shape of a whole scene.
pub(super) fn shape() -> TableShape {
    use ValueKind::{Flag, Map, OneOf, Text};
    TableShape::new("the scene")
        .optional("title", Text, "title of plots and reports; the name of the file without one")
        .required("dimension", OneOf(&[2, 3]), "2 in the plane, 3 in space")
        .and(Scene::shape())
        .optional(
            "data",
            Map(Box::new(data::shape("data").into())),
            "functions from files; each begins with a line [data.NAME]",
        )
        .optional("contact", contact::shape().list(), "a contact starts with the line [[contact]]")
        // only `--trust-geo` sets it
        .optional("trust_geo", Flag, "")
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
    let data = data::library(keys.get("data"), folder)?;
    let context = &Context { dimension: dimension.value, folder, data: data.clone() };
    let title = match keys.get("title") {
        Some(node) => node.string()?.to_owned(),
        None => path.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
    };
    let (contacts, auto) = contact::read(keys.items("contact")?, context)?;
    let mut scene = Scene { contacts, auto, data, ..Scene::decode(&keys, context, path.to_owned(), title, dimension)? };
    let trusted = mesh::is_trusted(tree, &keys)?;
    if let MeshSource::Geo { guard, .. } = &mut scene.mesh {
        guard.trusted = trusted;
    }
    // meshes that are adapted need no more digits than they are worth, unless the scene says how many
    let has_stop = keys.get("method").is_some_and(|method| method.has_key("stop"));
    scene.method.stop.balanced |= scene.adapt.is_some() && !has_stop;
    scene.method.steps.join(&scene.bodies)?;
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
            ("data", data::echo(&self.data)),
            ("contact", contact::echo(&self.contacts, &self.auto, dimension)),
        ];
        entries.extend(crate::setting::entries(own));
        entries.into()
    }
}
