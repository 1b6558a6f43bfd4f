//! From the tree of values to a checked [`Scene`].

mod body;
mod contact;
mod data;
mod decoder;
mod elasticity;
mod history;
mod layer;
mod method;

use super::read::{Keys, Node, Value};
use super::shape::{Form, Table, word};
use crate::data::Library;
use crate::error::{Error, Located, Place, Result};
use crate::mesh::is_shape;
use crate::output::vtu::Encoding;
use crate::problem::{Guard, MeshSource, Own, Plane, Preset, SolverSpec, Units};
use crate::scene::{AdaptSpec, OutputSpec, Scene};
use crate::solver::options;
use decoder::{Decoder, choose, file, pattern};
use std::path::Path;

/// The shape of a whole scene.
pub(super) fn table() -> Table {
    use Form::{Among, Either, Flag, Named, Text};
    Table::new("the scene")
        .key("title", Text, "title of plots and reports; the name of the file without one")
        .must("dimension", Among(&[2, 3]), "2 in the plane, 3 in space")
        .key("plane", word(&Plane::ALL), "what a plane problem stands for; \"strain\" without it")
        .key("units", Text, "words for labels, such as \"mm, MPa\"; nothing is converted")
        .must(
            "mesh",
            Either(vec![Text, mesh_table().form()]),
            "a file name, or a table: mesh = { geo = \"a.geo\", set = { n = 32 } }",
        )
        .key(
            "data",
            Named(Box::new(data::table("data").form())),
            "functions from files; each begins with a line [data.NAME]",
        )
        .must("body", body::table().form().list(), "a body starts with the line [[body]]")
        .key("contact", contact::table().form().list(), "a contact starts with the line [[contact]]")
        .key("method", method::table().form(), "the iteration; Newton's method without it")
        .key(
            "solver",
            Either(vec![word(&Preset::ALL), solver_table().form()]),
            "the inner solver; chosen by the program without it",
        )
        .key("estimate", Flag, "whether to estimate the error that the mesh leaves; false")
        .key("adapt", adapt_table().form(), "adapts the mesh to an error: adapt = { error = 1e-2 }")
        .key("output", output_table().form(), "what is written, and where")
        .key("trust_geo", Flag, "")
}

fn mesh_table() -> Table {
    use Form::{Count, Named, Number, Text};
    Table::new("the mesh")
        .key("geo", Text, "a Gmsh script, or a shape (.step, .iges, .brep, .stl), relative to the scene's folder")
        .key("msh", Text, "a mesh: Gmsh's .msh, or a format that Gmsh converts")
        .key("set", Named(Box::new(Number)), "numbers for the script: set = { n = 32 }")
        .key("size", Number, "largest size of elements in a shape")
        .key("threads", Count, "threads of Gmsh for free meshes in space")
        .key("timeout", Number, "seconds after which Gmsh is ended; 1000")
        .key("memory", Number, "gigabytes that Gmsh may take; what is free when it starts")
        .apart(&["geo", "msh"])
}

fn solver_table() -> Table {
    Table::new("the solver").key("preset", word(&Preset::ALL), "the inner solver of all bodies").key(
        "options",
        Form::Text,
        "PETSc options that choose solvers and set their parameters: \"-ksp_rtol 1e-10\"",
    )
}

fn adapt_table() -> Table {
    Table::new("`adapt`")
        .must("error", Form::Number, "largest relative error of pressures and displacements: 0.01 is one per cent")
        .key("cells", Form::Count, "most cells of a mesh; 1000000")
        .key("rounds", Form::Count, "most meshes; 10")
}

/// Precisions of VTU files: whether numbers are single.
const PRECISIONS: [(&str, bool); 2] = [("double", false), ("single", true)];

fn output_table() -> Table {
    use Form::{Either, Flag, Number, Text, Whole};
    Table::new("[output]")
        .key("dir", Text, "folder of the results; results/CASE without it")
        .key("vtu", Flag, "whether to write fields for ParaView; false")
        .key("msh", Flag, "whether to write fields as views for Gmsh; false")
        .key("report", Flag, "whether to write the page report.html; false")
        .key("precision", word(&PRECISIONS), "of the numbers in VTU files; \"double\"")
        .key("compress", Flag, "whether VTU files are compressed; true")
        .key("plots", Flag, "whether to draw the SVG plots; true")
        .key("pairs", Either(vec![Whole, word(&[("all", ())])]), "most pairs with files of their own; 24")
        .key("checkpoint", Number, "minutes between checkpoints; none without it")
}

/// Checks a whole scene, read from `path`. Looks whether the mesh file is there.
pub(super) fn scene(tree: &Node, path: &Path) -> Result<Scene> {
    let keys = Keys::open(tree, &table())?;
    let dimension = dimension(&keys)?;
    let plane = plane(&keys, dimension.value)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut decoder = Decoder { dimension: dimension.value, folder, data: Library::new() };
    decoder.data = decoder.library(keys.get("data"))?;
    let title = match keys.get("title") {
        Some(node) => node.string()?.to_owned(),
        None => path.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
    };
    let units = keys.get("units").map(units).transpose()?;
    let (contacts, auto) = decoder.contacts(&keys)?;
    let mut method = decoder.method(keys.get("method"))?;
    // meshes that are adapted need no more digits than they are worth, unless the scene says how many
    let says_stop = keys.get("method").is_some_and(|method| method.holds("stop"));
    method.stop.balanced |= keys.get("adapt").is_some() && !says_stop;
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
        estimate: keys.flag("estimate", false)?,
        adapt: keys.get("adapt").map(adapt).transpose()?,
        output: output(keys.get("output"))?,
        dimension,
    })
}

fn units(node: &Node) -> Result<Units> {
    Units::parse(node.string()?).map_err(|(message, advice)| node.refuse(message).help(advice))
}

impl Decoder<'_> {
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
        let keys = Keys::open(node, &mesh_table())?;
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
            seconds: keys.get("timeout").map_or(Ok(usual.seconds), Node::number)?,
            gigabytes: keys.get("memory").map(Node::number).transpose()?,
            size: keys.get("size").map(Node::number).transpose()?,
            threads: keys.get("threads").map(Node::count).transpose()?,
            trusted,
        };
        Ok(MeshSource::Geo { file, set, places, sizes: None, guard })
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
    Ok(Located::new(node.count()?, node.place.clone()))
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

/// Named numbers for Gmsh, sorted by name.
fn numbers(node: &Node) -> Result<Vec<(Place, String, f64)>> {
    let Value::Table(entries) = &node.value else {
        return Err(node.expected("a table", ""));
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
    let keys = Keys::open(node, &solver_table())?;
    let mut options = Vec::new();
    if let Some(node) = keys.get("options") {
        options.extend(node.string()?.split_whitespace().map(str::to_owned));
        only_solvers(node, &options)?;
    }
    Ok(SolverSpec { preset: keys.get("preset").map(preset).transpose()?, options })
}

/// Check that options choose solvers and set their parameters, and do nothing else. `node` is the text that they stand in.
fn only_solvers(node: &Node, words: &[String]) -> Result<()> {
    for (name, value) in options::pairs(words).map_err(|error| error.at(&node.place))? {
        options::check_of_scene(name, value).map_err(|error| error.at(&node.place_of_word(name)))?;
    }
    Ok(())
}

fn adapt(node: &Node) -> Result<AdaptSpec> {
    let keys = Keys::open(node, &adapt_table())?;
    let error = keys.require("error")?;
    Ok(AdaptSpec {
        error: error.number()?,
        cells: keys.get("cells").map_or(Ok(1_000_000), Node::count)?,
        rounds: keys.get("rounds").map_or(Ok(10), Node::count)?,
        place: error.place.clone(),
    })
}

fn output(node: Option<&Node>) -> Result<OutputSpec> {
    let default = OutputSpec::default();
    let Some(node) = node else { return Ok(default) };
    let usual = default.encoding;
    let keys = Keys::open(node, &output_table())?;
    Ok(OutputSpec {
        dir: keys.get("dir").map(|dir| dir.name().map(|name| name.value.into())).transpose()?,
        report: keys.flag("report", default.report)?,
        vtu: keys.flag("vtu", default.vtu)?,
        msh: keys.flag("msh", default.msh)?,
        encoding: Encoding {
            single: keys.get("precision").map_or(Ok(usual.single), |node| choose(node, "precision", &PRECISIONS))?,
            compress: keys.flag("compress", usual.compress)?,
        },
        plots: keys.flag("plots", default.plots)?,
        pairs: keys.get("pairs").map(pairs).transpose()?,
        checkpoint: keys.get("checkpoint").map(Node::number).transpose()?,
    })
}

/// Most pairs with files of their own: a number, or all.
fn pairs(node: &Node) -> Result<usize> {
    match node.string() {
        Ok(_) => choose(node, "number of pairs", &[("all", usize::MAX)]),
        Err(_) => node.count(),
    }
}
