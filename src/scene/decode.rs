//! From the tree of values to a checked [`Scene`].

mod body;
mod contact;
mod data;
mod elasticity;
mod history;
mod layer;
mod method;

use super::read::{Keys, Node, Value};
use crate::data::Library;
use crate::error::{Error, Located, Place, Result, nearest, shown};
use crate::expression::{Differentiable, Field, Scope};
use crate::mesh::is_shape;
use crate::output::vtu::Encoding;
use crate::problem::elasticity::Plane;
use crate::problem::mesh::{Guard, MeshSource};
use crate::problem::own::Own;
use crate::problem::pattern::Pattern;
use crate::problem::solver::{Preset, SolverSpec};
use crate::problem::units::Units;
use crate::scene::{AdaptSpec, OutputSpec, Scene};
use std::path::{Path, PathBuf};

/// Checks a whole scene, read from `path`. Looks whether the mesh file is there.
pub(super) fn scene(tree: &Node, path: &Path) -> Result<Scene> {
    const KEYS: &[&str] = &[
        "title",
        "dimension",
        "plane",
        "units",
        "mesh",
        "data",
        "body",
        "contact",
        "method",
        "solver",
        "estimate",
        "adapt",
        "output",
        "trust_geo",
    ];
    let keys = Keys::open(tree, "the scene", KEYS)?;
    let dimension = dimension(&keys)?;
    let plane = plane(&keys, dimension.value)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut decoder = Decoder { dimension: dimension.value, plane, folder, data: Library::new() };
    decoder.data = decoder.library(keys.get("data"))?;
    let title = match keys.get("title") {
        Some(node) => node.string()?.to_owned(),
        None => path.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
    };
    let units = keys.get("units").map(units).transpose()?;
    let (contacts, auto) = decoder.contacts(&keys)?;
    let mut method = decoder.method(keys.get("method"))?;
    if let (Some(adapt), false) = (keys.get("adapt"), method.steps.is_empty()) {
        return Err(adapt
            .refuse("an adapted mesh and load steps in one scene")
            .help("leave `adapt` or `method.steps` away"));
    }
    let mesh = decoder.mesh(keys.require("mesh")?, trust(tree, &keys)?)?;
    let bodies = decoder.bodies(&keys)?;
    decoder.join(&mut method.steps, &bodies)?;
    Ok(Scene {
        path: path.to_owned(),
        title,
        units,
        plane,
        mesh,
        bodies,
        contacts,
        auto,
        method,
        laws: Own::default(),
        rules: Own::default(),
        data: decoder.data,
        solver: solver(keys.get("solver"))?,
        estimate: keys.get("estimate").map_or(Ok(false), Node::boolean)?,
        adapt: keys.get("adapt").map(adapt).transpose()?,
        output: output(keys.get("output"))?,
        dimension,
    })
}

fn units(node: &Node) -> Result<Units> {
    Units::parse(node.string()?).map_err(|(message, advice)| node.refuse(message).help(advice))
}

/// What the meaning of values depends on.
struct Decoder<'a> {
    /// Space dimension: 2 or 3.
    dimension: usize,
    /// What the plane stands for.
    plane: Plane,
    /// Folder of the scene file.
    folder: &'a Path,
    /// Functions from files.
    data: Library,
}

impl Decoder<'_> {
    /// A number > 0, or an expression.
    fn positive_field(&self, node: &Node, what: &str) -> Result<Field> {
        match self.field(node)? {
            Field::Constant(value) if value <= 0.0 => {
                Err(node.refuse(format!("{what} is {}", shown(value))).label("must be greater than 0"))
            }
            field => Ok(field),
        }
    }

    /// A number, or an expression in the coordinates.
    fn field(&self, node: &Node) -> Result<Field> {
        match &node.value {
            Value::Integer(_) | Value::Float(_) => Ok(Field::Constant(node.number()?)),
            Value::String(text) => Field::parse(text, &node.place, self.dimension, false, &self.data),
            _ => Err(node.expected("a number or an expression")),
        }
    }

    /// A vector with as many components as space has; the missing third one is zero.
    fn vector(&self, node: &Node) -> Result<[Field; 3]> {
        let mut vector = [const { Field::Constant(0.0) }; 3];
        for (component, item) in vector.iter_mut().zip(self.components(node)?) {
            *component = self.field(item)?;
        }
        Ok(vector)
    }

    /// A vector that can be differentiated.
    fn smooth_vector(&self, node: &Node) -> Result<Vec<Differentiable>> {
        let scope = Scope { variables: &["x", "y", "z"][..self.dimension], data: &self.data };
        let component = |item: &Node| match &item.value {
            Value::Integer(_) | Value::Float(_) => {
                Differentiable::parse(&item.number()?.to_string(), &item.place, scope)
            }
            Value::String(text) => Differentiable::parse(text, &item.place, scope),
            _ => Err(item.expected("a number or an expression")),
        };
        self.components(node)?.iter().map(component).collect()
    }

    /// The components of a vector: as many as space has.
    fn components<'n>(&self, node: &'n Node) -> Result<&'n [Node]> {
        let items = node.list()?;
        if items.len() != self.dimension {
            let place = items.get(self.dimension).map_or(&node.place, |extra| &extra.place);
            let count = format!("a vector has {} components here, not {}", self.dimension, items.len());
            return Err(Error::scene(place, count).help(format!("the dimension of the scene is {}", self.dimension)));
        }
        Ok(items)
    }

    fn mesh(&self, node: &Node, trusted: bool) -> Result<MeshSource> {
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
        if !matches!(node.value, Value::Table(_)) {
            return Err(node.expected("a file name or a table"));
        }
        let keys = Keys::open(node, "the mesh", &["geo", "msh", "set", "size", "threads", "timeout", "memory"])?;
        keys.exclude("geo", "msh")?;
        if let Some(msh) = keys.get("msh") {
            let path = file(self.folder, msh)?;
            if is_shape(&path.value) {
                return Err(msh
                    .refuse("this is the shape of bodies, and no mesh")
                    .help("mesh = { geo = \"...\", size = 0.1 }"));
            }
            return match ["set", "size", "threads", "timeout", "memory"].iter().find_map(|key| keys.entry(key)) {
                None => Ok(MeshSource::Msh { file: path }),
                Some(entry) => Err(Error::scene(&entry.key_place, format!("`{}` for a finished mesh", entry.key))
                    .help("it is for Gmsh, which makes meshes from scripts: mesh = { geo = \"...\" }")),
            };
        }
        let file = file(self.folder, keys.require("geo")?)?;
        if let (Some(entry), false) = (keys.entry("size"), is_shape(&file.value)) {
            return Err(Error::scene(&entry.key_place, "`size` for a script, which has sizes of its own")
                .help("it is for shapes (.step, .iges, .brep, .stl): give scripts numbers by set = { n = 32 }"));
        }
        let set = keys.get("set").map_or(Ok(Vec::new()), numbers)?;
        let (places, set) = set.into_iter().map(|(place, name, value)| (place, (name, value))).unzip();
        let usual = Guard::default();
        let guard = Guard {
            seconds: keys.get("timeout").map_or(Ok(usual.seconds), |node| node.positive("the timeout"))?,
            gigabytes: keys.get("memory").map(|node| node.positive("the memory")).transpose()?,
            size: keys.get("size").map(|node| node.positive("the size")).transpose()?,
            threads: keys.get("threads").map(threads).transpose()?,
            trusted,
        };
        Ok(MeshSource::Geo { file, set, places, sizes: None, guard })
    }
}

/// The path of a file that must exist, joined with the folder of the scene.
fn file(folder: &Path, node: &Node) -> Result<Located<PathBuf>> {
    let name = node.name()?.value;
    let path = folder.join(&name);
    match std::fs::metadata(&path) {
        Ok(found) if found.is_file() => Ok(Located::new(path, node.place.clone())),
        Ok(_) => Err(node.refuse(format!("{} is not a file", path.display()))),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
            let files = std::fs::read_dir(folder).into_iter().flatten().flatten();
            let names: Vec<_> = files.map(|file| file.file_name().to_string_lossy().into_owned()).collect();
            let wanted = path.file_name().unwrap_or_default().to_string_lossy();
            Err(node.refuse(format!("there is no file {}", path.display())).label("not there").help(
                match nearest(&wanted, names.iter().map(String::as_str)) {
                    Some(near) => format!("did you mean `{near}`?"),
                    None => "paths are relative to the folder of the scene file".to_owned(),
                },
            ))
        }
        Err(error) => Err(node.refuse(format!("cannot look at {}", path.display())).because(error.to_string())),
    }
}

/// Whether the user trusts the mesh's script as a program: the command line says so, never the scene.
fn trust(tree: &Node, keys: &Keys) -> Result<bool> {
    let Some(entry) = keys.entry("trust_geo") else { return Ok(false) };
    if std::sync::Arc::ptr_eq(&entry.key_place.source, &tree.place.source) {
        return Err(Error::scene(&entry.key_place, "a scene cannot say that it is trusted")
            .help("remove this, and give --trust-geo on the command line"));
    }
    entry.node.boolean()
}

fn dimension(keys: &Keys) -> Result<Located<usize>> {
    let node = keys.require("dimension")?;
    match node.whole()? {
        2 => Ok(Located::new(2, node.place.clone())),
        3 => Ok(Located::new(3, node.place.clone())),
        other => Err(node.refuse(format!("the dimension is {other}")).label("must be 2 or 3")),
    }
}

fn plane(keys: &Keys, dimension: usize) -> Result<Plane> {
    let Some(entry) = keys.entry("plane") else {
        return Ok(Plane::Strain);
    };
    if dimension == 3 {
        return Err(Error::scene(&entry.key_place, "`plane` in a problem in space")
            .label("only plane problems have it")
            .help("remove it, or set dimension = 2"));
    }
    choose(&entry.node, "plane", &Plane::ALL)
}

fn threads(node: &Node) -> Result<usize> {
    match usize::try_from(node.whole()?) {
        Ok(count @ 1..) => Ok(count),
        _ => Err(node.refuse("`threads` must be 1 or more".to_owned())),
    }
}

/// Named numbers for Gmsh, sorted by name.
fn numbers(node: &Node) -> Result<Vec<(Place, String, f64)>> {
    let Value::Table(entries) = &node.value else {
        return Err(node.expected("a table").help("write set = { n = 32 }"));
    };
    let mut numbers = Vec::new();
    for entry in entries {
        let word = |c: char| c.is_ascii_alphanumeric() || c == '_';
        if !entry.key.chars().all(word) || !entry.key.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') {
            return Err(Error::scene(&entry.key_place, format!("`{}` is no name of a Gmsh number", entry.key)));
        }
        numbers.push((entry.key_place.clone(), entry.key.clone(), entry.node.number()?));
    }
    numbers.sort_by(|a, b| a.1.cmp(&b.1));
    Ok(numbers)
}

/// One of a few words; `what` names the key in the message.
fn choose<T: Clone>(node: &Node, what: &str, choices: &[(&str, T)]) -> Result<T> {
    let word = node.string()?;
    if let Some((_, choice)) = choices.iter().find(|(name, _)| *name == word) {
        return Ok(choice.clone());
    }
    let names: Vec<_> = choices.iter().map(|(name, _)| *name).collect();
    Err(node.refuse(format!("unknown {what} `{word}`")).help(match nearest(word, names.iter().copied()) {
        Some(near) => format!("did you mean `{near}`?"),
        None => format!("it is one of {}", names.join(", ")),
    }))
}

/// The name of a group, or a pattern of such names.
fn pattern(node: &Node) -> Result<Located<String>> {
    let name = node.name()?;
    match Pattern::new(&name.value) {
        Ok(_) => Ok(name),
        Err(flaw) => Err(node
            .refuse(format!("`{}` is no pattern: {flaw}", name.value))
            .help("`*` is any text, `?` one character, `[0-9]` one of some")),
    }
}

fn preset(node: &Node) -> Result<Preset> {
    choose(node, "solver", &Preset::ALL)
}

fn solver(node: Option<&Node>) -> Result<SolverSpec> {
    let Some(node) = node else {
        return Ok(SolverSpec::default());
    };
    if let Value::String(_) = node.value {
        return Ok(SolverSpec { preset: Some(preset(node)?), options: Vec::new() });
    }
    let keys = Keys::open(node, "the solver", &["preset", "options"])?;
    let mut options = Vec::new();
    if let Some(node) = keys.get("options") {
        options.extend(node.string()?.split_whitespace().map(str::to_owned));
        if let Some(first) = options.first().filter(|word| !word.starts_with('-')) {
            return Err(node
                .refuse(format!("`{first}` is no PETSc option"))
                .help("options start with a dash: -ksp_rtol 1e-10"));
        }
    }
    Ok(SolverSpec { preset: keys.get("preset").map(preset).transpose()?, options })
}

fn adapt(node: &Node) -> Result<AdaptSpec> {
    let keys = Keys::open(node, "`adapt`", &["error", "cells", "rounds"])?;
    let error = keys.require("error")?;
    let count = |key: &str, usual: usize| match keys.get(key) {
        None => Ok(usual),
        Some(node) => match usize::try_from(node.whole()?) {
            Ok(count) if count > 0 => Ok(count),
            _ => Err(node.refuse(format!("`{key}` must be 1 or more"))),
        },
    };
    Ok(AdaptSpec {
        error: error.positive("the error")?,
        cells: count("cells", 1_000_000)?,
        rounds: count("rounds", 10)?,
        place: error.place.clone(),
    })
}

fn output(node: Option<&Node>) -> Result<OutputSpec> {
    let default = OutputSpec::default();
    let Some(node) = node else { return Ok(default) };
    let usual = default.encoding;
    let keys = Keys::open(
        node,
        "[output]",
        &["dir", "vtu", "report", "precision", "compress", "plots", "pairs", "checkpoint"],
    )?;
    Ok(OutputSpec {
        dir: keys.get("dir").map(|dir| dir.name().map(|name| name.value.into())).transpose()?,
        report: keys.get("report").map_or(Ok(default.report), Node::boolean)?,
        vtu: keys.get("vtu").map_or(Ok(default.vtu), Node::boolean)?,
        encoding: Encoding {
            single: keys
                .get("precision")
                .map_or(Ok(usual.single), |node| choose(node, "precision", &[("double", false), ("single", true)]))?,
            compress: keys.get("compress").map_or(Ok(usual.compress), Node::boolean)?,
        },
        plots: keys.get("plots").map_or(Ok(default.plots), Node::boolean)?,
        pairs: keys.get("pairs").map(pairs).transpose()?,
        checkpoint: keys.get("checkpoint").map(|minutes| minutes.positive("the time in minutes")).transpose()?,
    })
}

/// Most pairs with files of their own: a number, or all.
fn pairs(node: &Node) -> Result<usize> {
    match node.string() {
        Ok("all") => Ok(usize::MAX),
        Ok(_) => Err(node.expected("a whole number or \"all\"")),
        Err(_) => usize::try_from(node.whole()?).map_err(|_| node.refuse("the number of pairs is below 0")),
    }
}
