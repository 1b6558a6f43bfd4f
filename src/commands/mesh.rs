//! `winkler mesh`: make the mesh of a scene, or find it in the cache, and print what is in it.

use super::shapes::{SurfaceFacts, place};
use super::{inputs, shapes};
use crate::discretize::{Verified, find_group, verify};
use crate::error::{Error, Kind, Result, few};
use crate::exchange::Serial;
use crate::fem::Space;
use crate::interrupt::Interrupt;
use crate::linalg::bounds;
use crate::mesh::{Group, Loaded, Mesh, MeshOrigin};
use crate::output::folder::MARK_OF_MESH;
use crate::output::terminal::ProgressLine;
use crate::output::{refuse_foreign, say, write_whole};
use crate::problem::{BodySpec, MeshSource};
use crate::run::{in_parts, made_straight};
use crate::scene::Scene;
use serde::Serialize;
use std::cmp::Reverse;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// The command line of `winkler mesh`.
#[derive(clap::Args)]
pub struct MeshArgs {
    /// Scene file (TOML), or a file with a shape or a mesh, whose groups a scene can name
    #[arg(value_name = "SCENE")]
    scene: PathBuf,
    /// Replace a key of the scene, for example mesh.set.n=64; may be repeated
    #[arg(long = "set", value_name = "KEY=VALUE")]
    overrides: Vec<String>,
    /// File to write, .msh, which a scene can name as its mesh
    #[arg(short, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Print it as JSON
    #[arg(long)]
    json: bool,
}

/// What is printed about a mesh.
#[derive(Serialize)]
struct MeshSummary {
    title: String,
    file: PathBuf,
    origin: &'static str,
    /// What is to be said about the file and the mesh.
    warnings: Vec<String>,
    seconds: f64,
    dimension: usize,
    order: usize,
    nodes: usize,
    /// A line for each group of cells that is split into bodies.
    splits: Vec<String>,
    bodies: Vec<BodySummary>,
    groups: Vec<GroupSummary>,
}

#[derive(Serialize)]
struct BodySummary {
    name: String,
    cells: usize,
    nodes: usize,
    dofs: usize,
    inner_facets: usize,
    boundary_facets: usize,
    parts: usize,
}

#[derive(Serialize)]
struct GroupSummary {
    name: String,
    dimension: usize,
    simplices: usize,
    /// Least and largest coordinates.
    low: Vec<f64>,
    high: Vec<f64>,
    /// Bodies, or groups of cells, that a surface bounds.
    bounds: Vec<String>,
    /// Shape of a surface in words; empty if it is not a known one.
    shape: String,
}

/// Make the mesh of a scene or find it in the cache, and return the exit code.
///
/// Bodies and groups are printed. With `-o` the mesh is written to a file.
///
/// # Errors
/// Refusals of scene and mesh, a body without cells, a file that cannot be written.
pub fn mesh(interrupt: &Interrupt, request: &MeshArgs) -> Result<i32> {
    let facts = if request.scene.extension().is_none_or(|ending| ending == "toml") {
        let scene = crate::scene::load(&request.scene, &request.overrides)?;
        let of_scene = if scene.dimension.value == 2 { facts::<2> } else { facts::<3> };
        of_scene(&scene.mesh, Some(&scene), interrupt, request)?
    } else {
        of_file(interrupt, request)?
    };
    if request.json {
        say(format_args!("{:#}", serde_json::json!(facts)))?
    } else {
        say(in_lines(&facts))?
    }
    Ok(0)
}

/// Return the facts of a mesh, or of a shape or script that Gmsh meshes: in space, or in the plane where it has no
/// cells in space.
fn of_file(interrupt: &Interrupt, request: &MeshArgs) -> Result<MeshSummary> {
    if let Some(set) = request.overrides.first() {
        return Err(Error::new(
            Kind::Usage,
            format!("`--set {set}` changes a scene, and `{}` is none", request.scene.display()),
        )
        .help("write a scene with this file as its mesh"));
    }
    let source = MeshSource::of_argument(&request.scene)?;
    facts::<3>(&source, None, interrupt, request)
        .or_else(|error| facts::<2>(&source, None, interrupt, request).map_err(|_| error))
}

/// Load a mesh, write it if a file was asked for, and check the bodies of a scene.
fn facts<const D: usize>(
    source: &MeshSource,
    scene: Option<&Scene>,
    interrupt: &Interrupt,
    request: &MeshArgs,
) -> Result<MeshSummary> {
    let read = scene.map_or_else(|| crate::mesh::files(source), inputs);
    request.output.as_ref().map_or(Ok(()), |path| check_output(path, &read))?;
    let orders: Vec<_> = scene.into_iter().flat_map(|scene| &scene.bodies).map(|body| body.order).collect();
    let began = Instant::now();
    let line = (!request.json).then(|| ProgressLine::new("mesh", None));
    let Loaded { mesh, origin, file, notes, .. } = crate::mesh::load::<D>(source, &orders, interrupt)?;
    drop(line);
    let seconds = began.elapsed().as_secs_f64();
    request.output.as_ref().map_or(Ok(()), |path| write::<D>(path, &file))?;
    let of_mesh = [in_parts(mesh.split), made_straight(mesh.straightened)];
    let mut facts = MeshSummary {
        title: request.scene.display().to_string(),
        file,
        origin: match origin {
            MeshOrigin::File => "the file itself",
            MeshOrigin::Cache => "from the cache",
            MeshOrigin::Gmsh => "made by Gmsh",
        },
        warnings: notes.into_iter().chain(of_mesh.into_iter().flatten()).collect(),
        seconds,
        dimension: D,
        order: mesh.order.degree(),
        nodes: mesh.points.len(),
        splits: Vec::new(),
        bodies: Vec::new(),
        groups: group_facts(&mesh),
    };
    if let Some(scene) = scene {
        let verified = verify(scene, &Serial, || Ok(mesh))?;
        facts.title.clone_from(&scene.title);
        facts.warnings.extend(verified.notes.iter().cloned());
        (facts.splits, facts.bodies) = (verified.splits(), bodies(&verified)?);
        facts.groups = group_facts(&verified.mesh);
    }
    Ok(facts)
}

fn bodies<const D: usize>(verified: &Verified<D>) -> Result<Vec<BodySummary>> {
    let mesh = &verified.mesh;
    // bodies without cells, which are refused here, were not checked
    let facts = |(index, body): (usize, &BodySpec)| {
        let group = find_group(mesh, &body.name, &[D], "body")?;
        let checked = &verified.checked[index];
        let space = Space::new(mesh, group, body.order.unwrap_or_default());
        Ok(BodySummary {
            name: body.name.value.clone(),
            cells: group.len(),
            nodes: space.nodes.len(),
            dofs: space.dofs(),
            inner_facets: checked.inner,
            boundary_facets: checked.outer,
            parts: checked.parts.count,
        })
    };
    verified.bodies.iter().enumerate().map(facts).collect()
}

fn group_facts<const D: usize>(mesh: &Mesh<D>) -> Vec<GroupSummary> {
    let of_group = |(group, surface): (&Group, SurfaceFacts)| {
        let points = group.connectivity.iter().map(|&point| mesh.in_scene(mesh.points[point as usize]));
        let [low, high] = bounds(points).map(|corner| corner[..D].to_vec());
        let SurfaceFacts { bodies: bounds, shape } = surface;
        let (name, dimension, simplices) = (group.name.to_string(), group.dimension, group.len());
        GroupSummary { name, dimension, simplices, low, high, bounds, shape }
    };
    mesh.groups.iter().zip(shapes::of_groups(mesh)).map(of_group).collect()
}

/// Return the facts as lines for people.
fn in_lines(facts: &MeshSummary) -> String {
    let MeshSummary { title, file, origin, seconds, nodes, order, .. } = facts;
    let mut lines =
        vec![title.clone(), format!("  {} ({origin}, {seconds:.2} s): {nodes} nodes, order {order}", file.display())];
    lines.extend(facts.splits.iter().map(|line| format!("  {line}")));
    for BodySummary { name, cells, nodes, dofs, .. } in &facts.bodies {
        lines.push(format!("  body {name}: {cells} cells, {nodes} nodes, {dofs} dofs"));
    }
    lines.extend(facts.warnings.iter().map(|warning| format!("  warning: {warning}")));
    let sizes = facts.groups.iter().flat_map(|group| group.low.iter().chain(&group.high));
    let roundoff = f64::EPSILON * sizes.fold(0.0, |most: f64, x| most.max(x.abs()));
    // bodies have lines of their own
    let is_listed = |group: &&GroupSummary| group.dimension < facts.dimension || facts.bodies.is_empty();
    let mut listed: Vec<&GroupSummary> = facts.groups.iter().filter(is_listed).collect();
    // shapes have many points, which few look for
    listed.sort_by_key(|group| Reverse(group.dimension));
    for group in listed {
        let kind = ["points", "lines", "triangles", "tetrahedra"][group.dimension];
        let [low, high] = [&group.low, &group.high].map(|corner| place(corner, roundoff));
        let beside =
            if group.bounds.is_empty() { String::new() } else { format!(" of {}", few(&group.bounds).join(", ")) };
        let shape = if group.shape.is_empty() { String::new() } else { format!(", {}", group.shape) };
        lines.push(format!("  group {}: {} {kind}{beside}{shape}, {low} to {high}", group.name, group.simplices));
    }
    lines.join("\n")
}

/// Refuse what is no name for a mesh file, and what is read or of another origin.
fn check_output(path: &Path, inputs: &[PathBuf]) -> Result<()> {
    if path.extension().is_none_or(|ending| ending != "msh") {
        return Err(Error::new(Kind::Usage, format!("`{}` is no name for a mesh file", path.display()))
            .help("end it with .msh; `winkler solve --vtu` writes bodies for ParaView"));
    }
    let is_own = |own: PathBuf| inputs.iter().any(|input| input.canonicalize().is_ok_and(|input| input == own));
    if path.canonicalize().is_ok_and(is_own) {
        return Err(Error::new(Kind::File, format!("{} is an input of this command", path.display()))
            .help("name another file with `-o`"));
    }
    refuse_foreign(path)
}

/// Write the mesh to another file.
fn write<const D: usize>(path: &Path, mesh: &Path) -> Result<()> {
    let bytes = crate::mesh::as_msh::<D>(mesh)?;
    write_whole(path, |out| {
        out.write_all(&bytes)?;
        out.write_all(MARK_OF_MESH.as_bytes())
    })
}
