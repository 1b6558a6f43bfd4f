//! From the tree of values to a checked [`Scene`]: the whole scene, and its tables `solver`, `adapt` and `output`. Each of the other
//! tables has a file of its own, with the shape of the table and the functions that decode it.

mod body;
mod contact;
mod data;
mod decoder;
mod elasticity;
mod history;
mod layer;
mod mesh;
mod method;

use super::read::{Keys, Node, Value};
use super::shape::{TableShape, ValueKind, word};
use crate::data::Library;
use crate::error::{Error, Located, Result};
use crate::output::vtu::Encoding;
use crate::problem::{Own, Plane, Preset, SolverSpec, Units};
use crate::scene::{AdaptSpec, OutputSpec, Scene};
use crate::solver::options;
use decoder::{Decoder, body_name, choose, file, pattern};
use std::path::Path;

/// Return the shape of a whole scene.
pub(super) fn shape() -> TableShape {
    use ValueKind::{Either, Flag, Map, OneOf, Text};
    TableShape::new("the scene")
        .optional("title", Text, "title of plots and reports; the name of the file without one")
        .required("dimension", OneOf(&[2, 3]), "2 in the plane, 3 in space")
        .optional("plane", word(&Plane::ALL), "what a plane problem stands for; \"strain\" without it")
        .optional("units", Text, "words for labels, such as \"mm, MPa\"; nothing is converted")
        .required(
            "mesh",
            Either(vec![Text, mesh::shape().into()]),
            "a file name, or a table: mesh = { geo = \"a.geo\", set = { n = 32 } }",
        )
        .optional(
            "data",
            Map(Box::new(data::shape("data").into())),
            "functions from files; each begins with a line [data.NAME]",
        )
        .required("body", body::shape().list(), "a body starts with the line [[body]]")
        .optional("contact", contact::shape().list(), "a contact starts with the line [[contact]]")
        .optional("method", method::shape(), "the iteration; Newton's method without it")
        .optional(
            "solver",
            Either(vec![word(&Preset::ALL), solver_shape().into()]),
            "the inner solver; chosen by the program without it",
        )
        .optional("estimate", Flag, "whether to estimate the error that the mesh leaves; false")
        .optional("adapt", adapt_shape(), "adapts the mesh to an error: adapt = { error = 1e-2 }")
        .optional("output", output_shape(), "what is written, and where")
        // only `--trust-geo` sets it
        .optional("trust_geo", Flag, "")
}

fn solver_shape() -> TableShape {
    use ValueKind::Text;
    TableShape::new("the solver").optional("preset", word(&Preset::ALL), "the inner solver of all bodies").optional(
        "options",
        Text,
        "PETSc options that choose solvers and set their parameters: \"-ksp_rtol 1e-10\"",
    )
}

fn adapt_shape() -> TableShape {
    use ValueKind::{Number, PositiveInteger};
    TableShape::new("`adapt`")
        .required("error", Number, "largest relative error of pressures and displacements: 0.01 is one per cent")
        .optional("cells", PositiveInteger, "most cells of a mesh; 1000000")
        .optional("rounds", PositiveInteger, "most meshes; 10")
}

/// Precisions of VTU files by name, and whether their numbers are single.
const PRECISIONS: [(&str, bool); 2] = [("double", false), ("single", true)];

fn output_shape() -> TableShape {
    use ValueKind::{Either, Flag, NonNegativeInteger, Number, Text};
    TableShape::new("[output]")
        .optional("dir", Text, "folder of the results; results/CASE without it")
        .optional("vtu", Flag, "whether to write fields for ParaView; false")
        .optional("msh", Flag, "whether to write fields as views for Gmsh; false")
        .optional("report", Flag, "whether to write the page report.html; false")
        .optional("precision", word(&PRECISIONS), "of the numbers in VTU files; \"double\"")
        .optional("compress", Flag, "whether VTU files are compressed; true")
        .optional("plots", Flag, "whether to draw the SVG plots; true")
        .optional(
            "pairs",
            Either(vec![NonNegativeInteger, word(&[("all", ())])]),
            "most pairs with files of their own; 24",
        )
        .optional("checkpoint", Number, "minutes between checkpoints; none without it")
}

/// Decode the tree of a scene that was read from `path`. Its numbers are checked later ([`Scene::verify`]). Files of meshes and data
/// must exist; they are not read, unless a value of the scene needs data.
///
/// # Errors
/// Tables that do not fit their shape, values that have no meaning, and files that are not there.
pub(super) fn scene(tree: &Node, path: &Path) -> Result<Scene> {
    let keys = Keys::open(tree, &shape())?;
    let dimension = dimension(&keys)?;
    let plane = plane(&keys, dimension.value)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut decoder = Decoder { dimension: dimension.value, folder, data: Library::new() };
    decoder.data = decoder.library(keys.get("data"))?;
    let title = match keys.get("title") {
        Some(node) => node.string()?.to_owned(),
        None => path.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
    };
    let units = keys.read("units", units)?;
    let (contacts, auto) = decoder.contacts(&keys)?;
    let mut method = decoder.method(keys.get("method"))?;
    // meshes that are adapted need no more digits than they are worth, unless the scene says how many
    let has_stop = keys.get("method").is_some_and(|method| method.has_key("stop"));
    method.stop.balanced |= keys.get("adapt").is_some() && !has_stop;
    let mesh = decoder.mesh(keys.require("mesh")?, mesh::is_trusted(tree, &keys)?)?;
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
        solver: keys.read("solver", solver)?.unwrap_or_default(),
        estimate: keys.flag("estimate", false)?,
        adapt: keys.read("adapt", adapt)?,
        output: keys.read("output", output)?.unwrap_or_default(),
        dimension,
    })
}

fn units(node: &Node) -> Result<Units> {
    Units::parse(node.string()?).map_err(|(message, advice)| node.refuse(message).help(advice))
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

fn preset(node: &Node) -> Result<Preset> {
    choose(node, "solver", &Preset::ALL)
}

fn solver(node: &Node) -> Result<SolverSpec> {
    if let Value::String(_) = node.value {
        return Ok(SolverSpec { preset: Some(preset(node)?), options: Vec::new() });
    }
    let keys = Keys::open(node, &solver_shape())?;
    let options = keys.read("options", petsc_options)?.unwrap_or_default();
    Ok(SolverSpec { preset: keys.read("preset", preset)?, options })
}

/// Return the words of PETSc options that choose solvers and set their parameters. Options that do anything else are refused.
fn petsc_options(node: &Node) -> Result<Vec<String>> {
    let words: Vec<String> = node.string()?.split_whitespace().map(str::to_owned).collect();
    for (name, value) in options::pairs(&words).map_err(|error| error.at(&node.place))? {
        options::check_of_scene(name, value).map_err(|error| error.at(&node.place_of_word(name)))?;
    }
    Ok(words)
}

fn adapt(node: &Node) -> Result<AdaptSpec> {
    let keys = Keys::open(node, &adapt_shape())?;
    let error = keys.require("error")?;
    Ok(AdaptSpec {
        error: error.number()?,
        cells: keys.read("cells", Node::count)?.unwrap_or(1_000_000),
        rounds: keys.read("rounds", Node::count)?.unwrap_or(10),
        place: error.place.clone(),
    })
}

fn output(node: &Node) -> Result<OutputSpec> {
    let default = OutputSpec::default();
    let keys = Keys::open(node, &output_shape())?;
    let precision = |node: &Node| choose(node, "precision", &PRECISIONS);
    Ok(OutputSpec {
        dir: keys.read("dir", Node::name)?.map(|name| name.value.into()),
        report: keys.flag("report", default.report)?,
        vtu: keys.flag("vtu", default.vtu)?,
        msh: keys.flag("msh", default.msh)?,
        encoding: Encoding {
            single: keys.read("precision", precision)?.unwrap_or(default.encoding.single),
            compress: keys.flag("compress", default.encoding.compress)?,
        },
        plots: keys.flag("plots", default.plots)?,
        pairs: keys.read("pairs", pairs)?,
        checkpoint: keys.read("checkpoint", Node::number)?,
    })
}

/// Return the most pairs with files of their own: a number, or all.
fn pairs(node: &Node) -> Result<usize> {
    match node.string() {
        Ok(_) => choose(node, "number of pairs", &[("all", usize::MAX)]),
        Err(_) => node.count(),
    }
}
