//! Checks of the mesh against the scene before anything is assembled. Surfaces that a scene names by sets of nodes, as
//! meshes of other programs have them, become groups of facets first.

use super::groups::earlier;
use super::patterns;
use crate::error::{Error, Located, Result, few};
use crate::exchange::{Exchange, broadcast};
use crate::fem::PointExtent;
use crate::mesh::{Asked, BodyCheck, Duty, EDGES, Groups, LENGTHS, Mesh};
use crate::problem::body::plain;
use crate::problem::pattern::{BODY, Pattern, is_pattern};
use crate::problem::{BodySpec, LoadKind};
use crate::problem::{Order, Plane};
use crate::scene::Scene;
use serde::{Deserialize, Serialize};
use std::collections::{HashMap, HashSet};
use std::path::PathBuf;
use std::rc::Rc;

/// A checked mesh, and the bodies of a scene on it.
pub struct Verified<const D: usize> {
    /// The mesh. On ranks other than the first, its groups have no elements and there are no points.
    pub mesh: Mesh<D>,
    /// Number of points of the mesh.
    pub points: usize,
    /// The bodies of the scene, each with a name of its own.
    pub bodies: Vec<BodySpec>,
    /// The groups that lie on each body, see [`patterns::lying`].
    lying: Vec<Vec<u32>>,
    /// The scene for which the mesh was checked.
    scene: Scene,
    /// Result of the check for each body, in the same order, on the first rank. Bodies that the mesh does not have are
    /// missing.
    pub checked: Rc<[BodyCheck]>,
    /// What is to be said of the file, and of surfaces that are sets of nodes, on the first rank.
    pub notes: Vec<String>,
}

/// What all ranks have of a mesh.
#[derive(Serialize, Deserialize)]
struct MeshHeader {
    path: PathBuf,
    order: Order,
    default_order: Order,
    /// Groups without elements.
    groups: Groups,
    split: usize,
    straightened: usize,
    points: usize,
    /// The groups that lie on each body, see [`patterns::lying`].
    lying: Vec<Vec<u32>>,
}

/// Find the bodies of a scene and check its mesh once, see `patterns::bodies` and [`Mesh::check`]. The first rank reads
/// and checks the mesh. Collective.
///
/// # Errors
/// `read` fails, a pattern does not fit the mesh, or the mesh cannot be that of a body. The last error names the body,
/// the place and the elements.
pub fn verify<const D: usize>(
    scene: &Scene,
    exchange: &dyn Exchange,
    read: impl FnOnce() -> Result<Mesh<D>>,
) -> Result<Verified<D>> {
    let mut verified = None;
    let head = broadcast(exchange, || {
        let found = check(scene, read()?)?;
        let head = MeshHeader::of(&found);
        verified = Some(found);
        Ok(head)
    })?;
    match verified {
        Some(verified) => Ok(verified),
        None => head.into_verified(scene),
    }
}

/// Check the mesh of a scene.
fn check<const D: usize>(scene: &Scene, mut mesh: Mesh<D>) -> Result<Verified<D>> {
    size(&mesh)?;
    mesh.sort_cells();
    // The radius of a body of revolution is measured from its axis.
    mesh.measure_nearby(std::array::from_fn(|c| c > 0 || scene.plane != Plane::Axisymmetric));
    let solid = if scene.plane == Plane::Axisymmetric { mesh.close_axis() } else { None };
    patterns::split(scene, &mut mesh)?;
    let notes = to_surfaces(scene, &mut mesh)?.into_iter().chain(solid).collect();
    let lying = patterns::lying(scene, &mesh)?;
    let bodies = patterns::bodies(scene, &mesh, &lying)?;
    let asked: Vec<Asked> = bodies.iter().map(asked).collect();
    let contacts = scene.pairs().flat_map(|contact| &contact.between).map(|name| name.value.as_str());
    let checked = mesh.check(&asked, &contacts.collect::<Vec<_>>(), scene.rules().next().is_some())?;
    let (points, scene) = (mesh.points.len(), scene.clone());
    Ok(Verified { points, mesh, bodies, lying, scene, checked: checked.into(), notes })
}

impl<const D: usize> Verified<D> {
    /// Take the bodies of another scene, if they are the same on the same mesh, and its lines need the same of the same
    /// groups. Return whether they are.
    ///
    /// # Errors
    /// A line of the scene acts on no body, or on several.
    pub fn follow(&mut self, scene: &Scene) -> Result<bool> {
        let body = |body: &BodySpec| {
            (body.name.clone(), body.split, body.order, of_body(body).into_iter().map(owned).collect::<Vec<_>>())
        };
        let used = |scene: &Scene| {
            let bodies: Vec<_> = scene.bodies.iter().map(body).collect();
            let contacts: Vec<_> = of_contacts(scene).map(owned).collect();
            (scene.mesh.clone(), scene.dimension.value, scene.plane, bodies, contacts, scene.rules().next().is_some())
        };
        let serves = used(&self.scene) == used(scene);
        if serves {
            self.bodies = patterns::bodies(scene, &self.mesh, &self.lying)?;
        }
        Ok(serves)
    }

    /// Return a line for each group that is split into bodies: its name, and the number and names of the bodies.
    pub fn splits(&self) -> Vec<String> {
        let mut splits: Vec<(&str, Vec<&str>)> = Vec::new();
        for body in &self.bodies {
            let name = body.name.value.as_str();
            let Some(whole) = self.mesh.groups.whole(name) else { continue };
            match splits.iter_mut().find(|(known, _)| *known == whole) {
                Some((_, parts)) => parts.push(name),
                None => splits.push((whole, vec![name])),
            }
        }
        let line = |(whole, parts): &(&str, Vec<&str>)| {
            format!(
                "`{whole}` is split into {} connected parts: {}",
                parts.len(),
                few(parts.iter().copied()).join(", ")
            )
        };
        splits.iter().map(line).collect()
    }
}

impl MeshHeader {
    fn of<const D: usize>(verified: &Verified<D>) -> Self {
        let Mesh { path, order, default_order, groups, split, straightened, .. } = &verified.mesh;
        Self {
            path: path.clone(),
            order: *order,
            default_order: *default_order,
            groups: groups.without_simplices(),
            split: *split,
            straightened: *straightened,
            points: verified.points,
            lying: verified.lying.clone(),
        }
    }

    /// Return the facts of the mesh on a rank that has not read it.
    fn into_verified<const D: usize>(self, scene: &Scene) -> Result<Verified<D>> {
        let Self { path, order, default_order, groups, split, straightened, points, lying } = self;
        let mesh = Mesh { default_order, split, straightened, ..Mesh::new(path, Vec::new(), order, groups) };
        let bodies = patterns::bodies(scene, &mesh, &lying)?;
        let scene = scene.clone();
        Ok(Verified { mesh, points, bodies, lying, scene, checked: Rc::new([]), notes: Vec::new() })
    }
}

/// Check that the size of the mesh is within the range of lengths of the program.
///
/// # Errors
/// The mesh is too small or too large.
fn size<const D: usize>(mesh: &Mesh<D>) -> Result<()> {
    let mut extent = PointExtent::default();
    mesh.points.iter().for_each(|x| extent.add(*x));
    let [least, most] = LENGTHS;
    let largest = extent.size();
    if mesh.points.is_empty() || (least..=most).contains(&largest) {
        return Ok(());
    }
    let message = format!("the mesh is {largest:.1e} long, and lengths from {least:e} to {most:e} are computed with");
    Err(Error::mesh(&mesh.path, None, message).help("choose another unit of length"))
}

/// Return a body with the groups on which its loads, springs and supports act.
fn asked(body: &BodySpec) -> Asked<'_> {
    let loads = body.load.iter().map(|load| (load.on.value.as_str(), Duty::Acts));
    let springs = body.spring.iter().map(|spring| (spring.on.value.as_str(), Duty::Acts));
    let supports = body.fix.iter().map(|fix| (fix.on.value.as_str(), Duty::Holds));
    Asked {
        name: &body.name.value,
        order: body.order.unwrap_or_default(),
        groups: loads.chain(springs).chain(supports).collect(),
    }
}

/// What a line of a scene needs of the group that it names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Need {
    Facets,
    /// Facets or points: a total force.
    Either,
    /// The nodes: a support.
    Nodes,
    /// Points: springs.
    Points,
    /// Cells: a region.
    Cells,
}

/// Replace each group of points that the scene names as a surface by facets: those of the boundary of a body all of
/// whose nodes belong to the group. Return what is to be said of nodes that belong to no such facet.
///
/// # Errors
/// The scene names the group for points, too, and some of these would be lost.
pub fn to_surfaces<const D: usize>(scene: &Scene, mesh: &mut Mesh<D>) -> Result<Vec<String>> {
    let mut notes = Vec::new();
    let uses: Vec<(&Located<String>, Need)> = scene.bodies.iter().flat_map(of_body).chain(of_contacts(scene)).collect();
    for place in 0..mesh.groups.len() {
        let group = &mesh.groups[place];
        let own: Vec<(&Located<String>, Need)> =
            uses.iter().copied().filter(|(on, _)| group.dimension == 0 && names(on, mesh, place)).collect();
        if !own.iter().any(|(_, need)| matches!(need, Need::Facets | Need::Either)) {
            continue;
        }
        let points: HashSet<u32> = group.connectivity.iter().copied().collect();
        let (stride, connectivity) = facets(scene, mesh, &points)?;
        let covered = connectivity.iter().collect::<HashSet<_>>().len();
        let lost = points.len() - covered;
        let has = |wanted: Need| own.iter().any(|(_, need)| *need == wanted);
        let is_surface = has(Need::Facets) || lost == 0 && !has(Need::Points);
        if connectivity.is_empty() || !is_surface {
            continue;
        }
        refuse_points(&own, lost)?;
        let name = mesh.groups[place].name.clone();
        if lost > 0 {
            notes.push(format!(
                "the surface of the node set `{name}` has the facets whose nodes all belong to it, and {lost} of its {} nodes \
                 belong to no such facet",
                points.len()
            ));
        }
        let group = &mut mesh.groups[place];
        (group.dimension, group.stride, group.connectivity, group.tags) = (D - 1, stride, connectivity, Vec::new());
    }
    Ok(notes)
}

/// Refuse a group that is named as a surface, and also where points would be lost.
fn refuse_points(own: &[(&Located<String>, Need)], lost: usize) -> Result<()> {
    let is_point = |need: Need| need == Need::Points || need == Need::Nodes && lost > 0;
    let as_points = own.iter().find(|(_, need)| is_point(*need));
    let as_surface = own.iter().find(|(_, need)| *need == Need::Facets);
    match (as_points, as_surface.or(own.first())) {
        (Some((on, _)), Some((other, _))) => {
            let message = format!("`{}` is a set of nodes here, and a surface elsewhere in the scene", on.value);
            Err(Error::scene(&on.place, message).because(earlier(other)).help("give the mesh two sets, one for each"))
        }
        _ => Ok(()),
    }
}

/// Return whether a line names the group with this index, itself or by a pattern, which may match the plain form of its
/// name.
fn names<const D: usize>(on: &Located<String>, mesh: &Mesh<D>, place: usize) -> bool {
    let (any, group) = (on.value.replace(BODY, "*"), &mesh.groups[place].name);
    if is_pattern(&any) {
        Pattern::new(&any).is_ok_and(|pattern| pattern.matches(group) || pattern.matches(&plain(group)))
    } else {
        mesh.groups.place(&any) == Some(place)
    }
}

fn owned((on, need): (&Located<String>, Need)) -> (Located<String>, Need) {
    (on.clone(), need)
}

fn of_body(body: &BodySpec) -> Vec<(&Located<String>, Need)> {
    let load = body.load.iter().map(|load| match load.kind {
        LoadKind::Force { rigid: false, .. } => (&load.on, Need::Either),
        _ => (&load.on, Need::Facets),
    });
    let fix =
        body.fix.iter().map(|fix| (&fix.on, if fix.along_normal().is_some() { Need::Facets } else { Need::Nodes }));
    let spring_need = |normal: bool| if normal { Need::Facets } else { Need::Points };
    let spring = body.spring.iter().map(|spring| (&spring.on, spring_need(spring.normal.is_some())));
    let region = body.regions.iter().map(|region| (&region.on, Need::Cells));
    load.chain(fix).chain(spring).chain(region).collect()
}

fn of_contacts(scene: &Scene) -> impl Iterator<Item = (&Located<String>, Need)> {
    scene.pairs().flat_map(|contact| &contact.between).map(|on| (on, Need::Facets))
}

/// Return the facets of the boundaries of all bodies with all their nodes among `points`: nodes per facet, and nodes.
fn facets<const D: usize>(scene: &Scene, mesh: &Mesh<D>, points: &HashSet<u32>) -> Result<(usize, Vec<u32>)> {
    let (mut stride, mut all) = (D, Vec::new());
    for name in patterns::members(scene, mesh)?.concat() {
        let Some(cells) = mesh.group(name).filter(|group| group.dimension == D) else { continue };
        // Facets with the number of cells that have them; those of the boundary have one.
        let mut found: HashMap<Vec<u32>, (usize, Vec<u32>)> = HashMap::new();
        for cell in cells.simplices() {
            for opposite in 0..=D {
                let facet = facet::<D>(cell, opposite);
                if facet.iter().all(|node| points.contains(node)) {
                    let mut corners = facet[..D].to_vec();
                    corners.sort_unstable();
                    found.entry(corners).or_insert((0, facet)).0 += 1;
                }
            }
        }
        let mut outer: Vec<Vec<u32>> =
            found.into_values().filter(|(cells, _)| *cells == 1).map(|(_, facet)| facet).collect();
        outer.sort_unstable();
        stride = outer.first().map_or(stride, Vec::len);
        all.extend(outer.into_iter().flatten());
    }
    Ok((stride, all))
}

/// Return the nodes of the facet of a cell without its vertex `opposite`, in the local numbering of a mesh.
fn facet<const D: usize>(cell: &[u32], opposite: usize) -> Vec<u32> {
    let corners: Vec<usize> = (0..=D).filter(|&corner| corner != opposite).collect();
    // The order of the middle nodes of a facet is that of its own edges.
    let own = if cell.len() > D + 1 { &EDGES[..D * (D - 1) / 2] } else { &[] };
    let middle = |edge: &[usize; 2]| EDGES.iter().position(|other| *other == edge.map(|at| corners[at]));
    let middles = own.iter().filter_map(middle).map(|edge| D + 1 + edge);
    corners.iter().copied().chain(middles).map(|at| cell[at]).collect()
}
