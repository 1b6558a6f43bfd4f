//! `winkler mesh`: make the mesh of a scene, or find it in the cache, and print what is in it.

use super::adapt;
use crate::discretize::{Verified, verify};
use crate::error::{Error, Kind, Result};
use crate::exchange::Serial;
use crate::fem::Space;
use crate::interrupt::Interrupt;
use crate::linalg::bounds;
use crate::mesh::{Group, Loaded, Mesh, MeshOrigin};
use crate::output::report::readable;
use crate::output::terminal::ProgressLine;
use crate::output::{CellKind, Encoding, UnstructuredGrid, say, write_whole};
use crate::problem::{MeshSource, Order};
use crate::run::{in_parts, made_straight};
use crate::scene::Scene;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// The command line of `winkler mesh`.
#[derive(clap::Args)]
pub struct MeshArgs {
    /// Scene file (TOML)
    #[arg(value_name = "SCENE")]
    scene: PathBuf,
    /// Replace a key of the scene, for example mesh.set.n=64; may be repeated
    #[arg(long = "set", value_name = "KEY=VALUE")]
    overrides: Vec<String>,
    /// The mesh that `winkler solve` has adapted to this error, with the same scene and overrides (short for --set adapt.error=E)
    #[arg(long, value_name = "E", allow_hyphen_values = true)]
    tolerance: Option<String>,
    /// The mesh that `winkler solve` has adapted to the error of the scene's `adapt`, or of --tolerance, which implies this
    #[arg(long)]
    adapted: bool,
    /// File to write: .msh, which a scene can name as its mesh, or .vtu
    #[arg(short, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Print it as JSON
    #[arg(long)]
    json: bool,
}

/// Make the mesh of a scene or find it in the cache, and return the exit code.
///
/// Bodies and groups are printed. With `-o` the mesh is written to a file.
///
/// # Errors
/// Refusals of scene and mesh, a body without cells, a file that cannot be written.
pub fn mesh(interrupt: &Interrupt, request: &MeshArgs) -> Result<i32> {
    let tolerance = request.tolerance.iter().map(|error| format!("--tolerance {error}"));
    let overrides: Vec<String> = request.overrides.iter().cloned().chain(tolerance).collect();
    let mut scene = crate::scene::load(&request.scene, &overrides)?;
    let is_adapted = request.adapted || request.tolerance.is_some();
    let is_reached = is_adapted.then(|| follow_adapted(&mut scene)).transpose()?;
    match scene.dimension.value {
        2 => show::<2>(&scene, is_reached, interrupt, request),
        _ => show::<3>(&scene, is_reached, interrupt, request),
    }
}

/// Let the mesh of a scene follow the sizes with which the last run that adapted it ended. Return whether that run reached its error.
fn follow_adapted(scene: &mut Scene) -> Result<bool> {
    let purpose = adapt::purpose(scene);
    let (MeshSource::Geo { file, sizes, .. }, Some(adapt)) = (&mut scene.mesh, &scene.adapt) else {
        let error = Error::new(Kind::Usage, format!("{} adapts no mesh", scene.path.display()));
        return Err(
            error.help("the scene needs a script for its mesh and `adapt = { error = E }`, or type --tolerance E")
        );
    };
    for is_reached in [true, false] {
        if let Some(view) = adapt::recall(&purpose, is_reached) {
            *sizes = Some(view.into());
            return Ok(is_reached);
        }
    }
    let message = format!("no mesh of {} was adapted to an error of {}", file.value.display(), adapt.error.value);
    Err(Error::scene(&adapt.error.place, message).help(
        "first run `winkler solve` with the same scene, --set and --tolerance; meshes are kept in the cache ($WINKLER_CACHE)",
    ))
}

/// Load the mesh, write it if a file was asked for, and print it.
fn show<const D: usize>(
    scene: &Scene,
    is_reached: Option<bool>,
    interrupt: &Interrupt,
    request: &MeshArgs,
) -> Result<i32> {
    let began = Instant::now();
    let order = scene.bodies.iter().map(|body| body.order).max().unwrap_or(Order::P1);
    let line = (!request.json).then(|| ProgressLine::new("mesh", None));
    let loaded = crate::mesh::load::<D>(&scene.mesh, order, interrupt)?;
    drop(line);
    let seconds = began.elapsed().as_secs_f64();
    if let Some(path) = &request.output {
        write(path, &loaded)?;
    }
    let mut facts = facts(scene, loaded, seconds)?;
    facts["reached"] = json!(is_reached);
    if request.json {
        say(format_args!("{facts:#}"))?;
    } else {
        print(&facts)?;
    }
    Ok(0)
}

/// Return all that is printed about a mesh, as JSON.
fn facts<const D: usize>(scene: &Scene, loaded: Loaded<D>, seconds: f64) -> Result<Value> {
    let Loaded { mesh, origin, file, notes, .. } = loaded;
    let verified = verify(scene, &Serial, || Ok(mesh))?;
    let mesh = &verified.mesh;
    let bodies = bodies(&verified)?;
    let groups: Vec<Value> = mesh.groups.iter().map(|group| group_facts(mesh, group)).collect();
    Ok(json!({
        "title": scene.title,
        "file": file,
        "origin": match origin {
            MeshOrigin::File => "the scene's own file",
            MeshOrigin::Cache => "from the cache",
            MeshOrigin::Gmsh => "made by Gmsh",
        },
        "notes": notes.iter().chain(&verified.notes).collect::<Vec<_>>(),
        "seconds": seconds,
        "dimension": D,
        "order": mesh.order.degree(),
        "nodes": mesh.points.len(),
        "split": mesh.split,
        "straightened": mesh.straightened,
        "splits": verified.splits(),
        "bodies": bodies,
        "groups": groups,
    }))
}

/// Return what is printed about each body.
fn bodies<const D: usize>(verified: &Verified<D>) -> Result<Vec<Value>> {
    let mesh = &verified.mesh;
    let mut checked = verified.checked.iter();
    let mut bodies = Vec::new();
    for body in &verified.bodies {
        let name = &body.name.value;
        let Some(group) = mesh.group(name).filter(|group| group.dimension == D) else {
            let known: Vec<&str> = mesh.group_names(D).collect();
            return Err(Error::scene(&body.name.place, format!("the mesh has no cells named `{name}`"))
                .help(format!("its groups of cells: {}", known.join(", "))));
        };
        let space = Space::new(mesh, group, body.order);
        let facets = checked.next().map(|found| [found.inner, found.outer, found.parts.count]).unwrap_or_default();
        bodies.push(json!({
            "name": name, "cells": group.len(), "nodes": space.nodes.len(), "dofs": space.dofs(),
            "inner_facets": facets[0], "boundary_facets": facets[1], "parts": facets[2],
        }));
    }
    Ok(bodies)
}

fn group_facts<const D: usize>(mesh: &Mesh<D>, group: &Group) -> Value {
    let points = group.connectivity.iter().map(|&point| mesh.in_scene(mesh.points[point as usize]));
    let [low, high] = bounds(points).map(|corner| corner[..D].to_vec());
    json!({ "name": group.name, "dimension": group.dimension, "simplices": group.len(), "low": low, "high": high })
}

fn print(facts: &Value) -> Result<()> {
    let text = |value: &Value| value.as_str().unwrap_or_default().to_owned();
    let number = |value: &Value| value.as_f64().unwrap_or(f64::NAN);
    let list = |key: &str| facts[key].as_array().cloned().unwrap_or_default();
    say(text(&facts["title"]))?;
    say(format_args!(
        "  {} ({}, {:.2} s): {} nodes, order {}",
        text(&facts["file"]),
        text(&facts["origin"]),
        number(&facts["seconds"]),
        facts["nodes"],
        facts["order"]
    ))?;
    for line in list("splits") {
        say(format_args!("  {}", text(&line)))?;
    }
    for body in list("bodies") {
        say(format_args!(
            "  body {}: {} cells, {} nodes, {} dofs",
            text(&body["name"]),
            body["cells"],
            body["nodes"],
            body["dofs"]
        ))?;
    }
    for note in list("notes").iter().filter_map(Value::as_str) {
        say(format_args!("  warning: {note}"))?;
    }
    if facts["reached"] == json!(false) {
        say("  warning: the run that adapted this mesh did not reach its error: it is the best one of that run")?;
    }
    let count = |key: &str| facts[key].as_u64().unwrap_or_default() as usize;
    for warning in [in_parts(count("split")), made_straight(count("straightened"))].into_iter().flatten() {
        say(format_args!("  warning: {warning}"))?;
    }
    let cells = facts["dimension"].clone();
    for group in list("groups").iter().filter(|group| group["dimension"] != cells) {
        let kind = ["points", "lines", "triangles"][number(&group["dimension"]) as usize];
        let corner = |key: &str| {
            let x = group[key].as_array().into_iter().flatten().filter_map(Value::as_f64);
            x.map(|x| readable(x, 4)).collect::<Vec<_>>().join(", ")
        };
        let name = text(&group["name"]);
        say(format_args!(
            "  group {name}: {} {kind}, ({}) to ({})",
            group["simplices"],
            corner("low"),
            corner("high")
        ))?;
    }
    Ok(())
}

/// Write the mesh: as `.msh` the file that was read, as `.vtu` cells with the index of their group.
fn write<const D: usize>(path: &Path, loaded: &Loaded<D>) -> Result<()> {
    match path.extension().and_then(|end| end.to_str()) {
        Some("msh") => {
            let bytes = crate::mesh::as_msh(&loaded.file, D)?;
            write_whole(path, |out| out.write_all(&bytes))
        }
        Some("vtu") => {
            let grid = grid(loaded);
            write_whole(path, |out| grid.write(Encoding::default(), out))
        }
        _ => Err(Error::new(Kind::Usage, format!("`{}` names no kind of mesh file", path.display()))
            .help("end it with .msh or .vtu")),
    }
}

/// Return the cells of the mesh, each with the index of its group.
fn grid<const D: usize>(loaded: &Loaded<D>) -> UnstructuredGrid {
    let mesh = &loaded.mesh;
    let mut grid = UnstructuredGrid {
        title: mesh.path.display().to_string(),
        points: mesh.points.iter().map(|&x| mesh.in_scene(x)).collect(),
        cell: CellKind::simplex(D, mesh.order.degree()),
        connectivity: Vec::new(),
        at_points: Vec::new(),
        at_cells: Vec::new(),
    };
    let mut groups = Vec::new();
    for (index, group) in mesh.groups.iter().filter(|group| group.dimension == D).enumerate() {
        grid.connectivity.extend(&group.connectivity);
        groups.extend(vec![index as f64; group.len()]);
    }
    grid.at_cells.push(("group".to_owned(), 1, groups));
    grid
}
