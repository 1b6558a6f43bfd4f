//! `winkler mesh`: make the mesh of a scene, or find it in the cache, and print what is in it.

use crate::discretize::{Verified, verify};
use crate::error::{Error, Kind, Result};
use crate::exchange::Serial;
use crate::fem::Space;
use crate::interrupt::Interrupt;
use crate::linalg::bounds;
use crate::mesh::{Group, Loaded, Mesh, MeshOrigin};
use crate::output::report::readable;
use crate::output::terminal::ProgressLine;
use crate::output::{say, write_whole};
use crate::problem::Order;
use crate::run::{in_parts, made_straight};
use crate::scene::Scene;
use serde::Serialize;
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
    /// File to write, .msh, which a scene can name as its mesh
    #[arg(short, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Print it as JSON
    #[arg(long)]
    json: bool,
}

/// What is printed about a mesh.
#[derive(Serialize)]
struct MeshFacts {
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
    bodies: Vec<BodyFacts>,
    groups: Vec<GroupFacts>,
}

#[derive(Serialize)]
struct BodyFacts {
    name: String,
    cells: usize,
    nodes: usize,
    dofs: usize,
    inner_facets: usize,
    boundary_facets: usize,
    parts: usize,
}

#[derive(Serialize)]
struct GroupFacts {
    name: String,
    dimension: usize,
    simplices: usize,
    /// Least and largest coordinates.
    low: Vec<f64>,
    high: Vec<f64>,
}

/// Make the mesh of a scene or find it in the cache, and return the exit code.
///
/// Bodies and groups are printed. With `-o` the mesh is written to a file.
///
/// # Errors
/// Refusals of scene and mesh, a body without cells, a file that cannot be written.
pub fn mesh(interrupt: &Interrupt, request: &MeshArgs) -> Result<i32> {
    let scene = crate::scene::load(&request.scene, &request.overrides)?;
    let facts = match scene.dimension.value {
        2 => load::<2>(&scene, interrupt, request)?,
        _ => load::<3>(&scene, interrupt, request)?,
    };
    match request.json {
        true => say(format_args!("{:#}", serde_json::json!(facts)))?,
        false => say(in_lines(&facts))?,
    }
    Ok(0)
}

/// Load the mesh, write it if a file was asked for, and return what is to be printed.
fn load<const D: usize>(scene: &Scene, interrupt: &Interrupt, request: &MeshArgs) -> Result<MeshFacts> {
    let began = Instant::now();
    let order = scene.bodies.iter().map(|body| body.order).max().unwrap_or(Order::P1);
    let line = (!request.json).then(|| ProgressLine::new("mesh", None));
    let Loaded { mesh, origin, file, notes, .. } = crate::mesh::load::<D>(&scene.mesh, order, interrupt)?;
    drop(line);
    let seconds = began.elapsed().as_secs_f64();
    request.output.as_ref().map_or(Ok(()), |path| write(path, &file, D))?;
    let verified = verify(scene, &Serial, || Ok(mesh))?;
    let mesh = &verified.mesh;
    let of_mesh = [in_parts(mesh.split), made_straight(mesh.straightened)];
    Ok(MeshFacts {
        title: scene.title.clone(),
        file,
        origin: match origin {
            MeshOrigin::File => "the scene's own file",
            MeshOrigin::Cache => "from the cache",
            MeshOrigin::Gmsh => "made by Gmsh",
        },
        warnings: [notes, verified.notes.clone()].concat().into_iter().chain(of_mesh.into_iter().flatten()).collect(),
        seconds,
        dimension: D,
        order: mesh.order.degree(),
        nodes: mesh.points.len(),
        splits: verified.splits(),
        bodies: bodies(&verified)?,
        groups: mesh.groups.iter().map(|group| group_facts(mesh, group)).collect(),
    })
}

fn bodies<const D: usize>(verified: &Verified<D>) -> Result<Vec<BodyFacts>> {
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
        let [inner_facets, boundary_facets, parts] =
            checked.next().map(|found| [found.inner, found.outer, found.parts.count]).unwrap_or_default();
        bodies.push(BodyFacts {
            name: name.clone(),
            cells: group.len(),
            nodes: space.nodes.len(),
            dofs: space.dofs(),
            inner_facets,
            boundary_facets,
            parts,
        });
    }
    Ok(bodies)
}

fn group_facts<const D: usize>(mesh: &Mesh<D>, group: &Group) -> GroupFacts {
    let points = group.connectivity.iter().map(|&point| mesh.in_scene(mesh.points[point as usize]));
    let [low, high] = bounds(points).map(|corner| corner[..D].to_vec());
    GroupFacts { name: group.name.to_string(), dimension: group.dimension, simplices: group.len(), low, high }
}

/// Return the facts as lines for people.
fn in_lines(facts: &MeshFacts) -> String {
    let MeshFacts { title, file, origin, seconds, nodes, order, .. } = facts;
    let mut lines =
        vec![title.clone(), format!("  {} ({origin}, {seconds:.2} s): {nodes} nodes, order {order}", file.display())];
    lines.extend(facts.splits.iter().map(|line| format!("  {line}")));
    for BodyFacts { name, cells, nodes, dofs, .. } in &facts.bodies {
        lines.push(format!("  body {name}: {cells} cells, {nodes} nodes, {dofs} dofs"));
    }
    lines.extend(facts.warnings.iter().map(|warning| format!("  warning: {warning}")));
    let corner = |x: &[f64]| x.iter().map(|&x| readable(x, 4)).collect::<Vec<_>>().join(", ");
    for group in facts.groups.iter().filter(|group| group.dimension < facts.dimension) {
        let kind = ["points", "lines", "triangles"][group.dimension];
        let (low, high) = (corner(&group.low), corner(&group.high));
        lines.push(format!("  group {}: {} {kind}, ({low}) to ({high})", group.name, group.simplices));
    }
    lines.join("\n")
}

/// Write the mesh to another file.
fn write(path: &Path, mesh: &Path, dimension: usize) -> Result<()> {
    if path.extension().is_none_or(|ending| ending != "msh") {
        return Err(Error::new(Kind::Usage, format!("`{}` is no name for a mesh file", path.display()))
            .help("end it with .msh; `winkler solve --vtu` writes bodies for ParaView"));
    }
    let bytes = crate::mesh::as_msh(mesh, dimension)?;
    write_whole(path, |out| out.write_all(&bytes))
}
