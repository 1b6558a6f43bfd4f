//! Checks of the mesh against the scene before anything is assembled.

use super::find::point;
use super::node_sets;
use super::part::Part;
use super::roster::{self, Lying};
use crate::error::{Error, Result, few};
use crate::exchange::{Exchange, broadcast};
use crate::fem::{Extent, RigidMotion, rigid};
use crate::mesh::{Asked, Checked, Duty, Groups, LENGTHS, Mesh, Parts};
use crate::problem::body::BodySpec;
use crate::problem::{Order, Plane};
use crate::scene::Scene;
use serde::{Deserialize, Serialize};
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
    /// Result of the check for each body, in the same order, on the first rank. Bodies that the mesh does not have are missing.
    pub checked: Rc<[Checked]>,
    /// What is to be said of surfaces that are sets of nodes, on the first rank.
    pub notes: Vec<String>,
}

/// What all ranks have of a mesh.
#[derive(Serialize, Deserialize)]
struct Head {
    path: PathBuf,
    order: Order,
    /// Groups without elements.
    groups: Groups,
    split: usize,
    straightened: usize,
    points: usize,
    lying: Lying,
}

/// Find the bodies of a scene and check its mesh once, see `roster::bodies` and [`Mesh::check`]. The first rank reads and
/// checks the mesh. Collective.
///
/// # Errors
/// `read` fails, a pattern does not fit the mesh, or the mesh cannot be that of a body. The last error names the body, the place
/// and the elements.
pub fn verify<const D: usize>(
    scene: &Scene,
    exchange: &dyn Exchange,
    read: impl FnOnce() -> Result<Mesh<D>>,
) -> Result<Verified<D>> {
    let mut verified = None;
    let head = broadcast(exchange, || {
        let (found, lying) = check(scene, read()?)?;
        let head = Head::of(&found, lying);
        verified = Some(found);
        Ok(head)
    })?;
    match verified {
        Some(verified) => Ok(verified),
        None => head.into_verified(scene),
    }
}

/// Check the mesh of a scene. Return also which groups lie on which bodies.
fn check<const D: usize>(scene: &Scene, mut mesh: Mesh<D>) -> Result<(Verified<D>, Lying)> {
    size(&mesh)?;
    mesh.sort_cells();
    // The radius of a body of revolution is measured from its axis.
    mesh.measure_nearby(std::array::from_fn(|c| c > 0 || scene.plane != Plane::Axisymmetric));
    roster::split(scene, &mut mesh)?;
    let notes = node_sets::to_surfaces(scene, &mut mesh)?;
    let lying = roster::lying(scene, &mesh)?;
    let bodies = roster::bodies(scene, &mesh, &lying)?;
    let asked: Vec<Asked> = bodies.iter().map(asked).collect();
    let contacts = scene.contacts.iter().flat_map(|contact| &contact.between).map(|name| name.value.as_str());
    let checked = mesh.check(&asked, &contacts.collect::<Vec<_>>(), !scene.auto.is_empty())?;
    Ok((Verified { points: mesh.points.len(), mesh, bodies, checked: checked.into(), notes }, lying))
}

impl<const D: usize> Verified<D> {
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

impl Head {
    fn of<const D: usize>(verified: &Verified<D>, lying: Lying) -> Self {
        let Mesh { path, order, groups, split, straightened, .. } = &verified.mesh;
        Self {
            path: path.clone(),
            order: *order,
            groups: groups.without_simplices(),
            split: *split,
            straightened: *straightened,
            points: verified.points,
            lying,
        }
    }

    /// Return the facts of the mesh on a rank that has not read it.
    fn into_verified<const D: usize>(self, scene: &Scene) -> Result<Verified<D>> {
        let Self { path, order, groups, split, straightened, points, lying } = self;
        let mesh = Mesh { split, straightened, ..Mesh::new(path, Vec::new(), order, groups) };
        let bodies = roster::bodies(scene, &mesh, &lying)?;
        Ok(Verified { mesh, points, bodies, checked: Rc::new([]), notes: Vec::new() })
    }
}

/// Check that the size of the mesh is within the range of lengths of the program.
///
/// # Errors
/// The mesh is too small or too large.
fn size<const D: usize>(mesh: &Mesh<D>) -> Result<()> {
    let mut extent = Extent::default();
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
    Asked { name: &body.name.value, order: body.order, groups: loads.chain(springs).chain(supports).collect() }
}

/// Check a body in several unconnected parts. Supports and springs must leave it no more rigid motions than a connected body
/// would have. The reason is that contact and loads treat its rigid motions as those of one body.
///
/// # Errors
/// Supports and springs leave more. The error names the place of a free part.
pub fn held<const D: usize>(part: &Part<D>, parts: &Parts, mesh: &Mesh<D>) -> Result<()> {
    if parts.count == 1 {
        return Ok(());
    }
    let space = &part.space;
    let part_of = |node: u32| parts.of_node[node as usize] as usize;
    let mut extents = vec![Extent::default(); parts.count];
    let mut first: Vec<Option<[f64; D]>> = vec![None; parts.count];
    for (node, x) in (0..).zip(&space.nodes) {
        extents[part_of(node)].add(*x);
        first[part_of(node)].get_or_insert(*x);
    }
    let motions: Vec<Vec<RigidMotion<D>>> =
        extents.iter().map(|extent| rigid::of(extent, space.axisymmetric)).collect();
    // In each of these motions one part moves and the others stay at rest.
    let each: Vec<(usize, &RigidMotion<D>)> =
        motions.iter().enumerate().flat_map(|(number, own)| own.iter().map(move |motion| (number, motion))).collect();
    let left = |moving: &[(usize, &RigidMotion<D>)]| {
        let at = |k: usize, node: u32| match moving[k].0 == part_of(node) {
            true => moving[k].1.at(&space.nodes[node as usize]),
            false => [0.0; D],
        };
        part.left(moving.len(), &at).len()
    };
    let free = part.free();
    let whole = part.left(free.len(), &|k, node| free[k].at(&space.nodes[node as usize])).len();
    if left(&each) <= whole {
        return Ok(());
    }
    // Contact may resist a part to which supports leave some motions. The part with the most free motions is reported.
    let alone = |number: usize| left(&each.iter().filter(|moving| moving.0 == number).copied().collect::<Vec<_>>());
    let most = (0..parts.count).min_by_key(|&number| std::cmp::Reverse(alone(number))).unwrap_or(0);
    let at = first[most].map_or([0.0; 3], |x| space.in_scene(x));
    let (name, count) = (&part.spec.name.value, parts.count);
    let message =
        format!("body `{name}` is in {count} parts that share no facet, and the one at {} is not held", point(at));
    Err(Error::mesh(&mesh.path, None, message)
        .help("make a body of each part (`split = true` in its table), support each of them, or let them share facets (in the script: `Coherence;`)"))
}
