//! The mesh against what the scene makes of it: what must hold before anything is assembled.

use super::find::point;
use super::part::Part;
use super::roster;
use crate::error::{Error, Result};
use crate::exchange::{Exchange, first, share};
use crate::fem::{Extent, RigidMotion, rigid};
use crate::mesh::{Asked, Checked, Duty, LENGTHS, Mesh, Parts, Portion};
use crate::problem::Plane;
use crate::problem::body::BodySpec;
use crate::scene::Scene;
use std::rc::Rc;

/// A mesh that holds what bodies must be.
pub struct Verified<const D: usize> {
    /// What this rank has of the mesh.
    pub portion: Portion<D>,
    /// The bodies of the scene, each with a name of its own.
    pub bodies: Vec<BodySpec>,
    /// What was found of each body, in the same order; bodies that the mesh does not have are missing.
    pub checked: Rc<[Checked]>,
    /// By which ranks tell each other of cells; a run does not count these messages.
    pub exchange: Rc<dyn Exchange>,
}

/// Finds the bodies of a scene and checks its mesh once: see `roster::bodies` and [`Portion::check`]. Collective.
///
/// # Errors
/// Patterns that do not fit the mesh; what is no mesh of a body, with body, place and elements.
pub fn verify<const D: usize>(scene: &Scene, portion: Portion<D>, exchange: Rc<dyn Exchange>) -> Result<Verified<D>> {
    first(&*exchange, size(&portion.mesh).map_err(|error| (0, error)))?;
    // the radius of a body of revolution is measured from its axis
    let portion = portion.near(std::array::from_fn(|c| c > 0 || scene.plane != Plane::Axisymmetric));
    let lying = roster::lying(scene, &portion, &*exchange)?;
    let bodies = roster::bodies(scene, &portion.mesh, &lying)?;
    let asked: Vec<Asked> = bodies.iter().map(asked).collect();
    let contacts = scene.contacts.iter().flat_map(|contact| &contact.between).map(|name| name.value.as_str());
    let checked = portion.check(&asked, &contacts.collect::<Vec<_>>(), !scene.auto.is_empty(), &*exchange)?;
    Ok(Verified { portion, bodies, checked: checked.into(), exchange })
}

/// Refuses a mesh whose size no run computes with.
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

/// A body with the groups that serve it.
fn asked(body: &BodySpec) -> Asked<'_> {
    let loads = body.load.iter().map(|load| (load.on.value.as_str(), Duty::Acts));
    let springs = body.spring.iter().map(|spring| (spring.on.value.as_str(), Duty::Acts));
    let supports = body.fix.iter().map(|fix| (fix.on.value.as_str(), Duty::Holds));
    Asked { name: &body.name.value, order: body.order, groups: loads.chain(springs).chain(supports).collect() }
}

/// Refuses a body in parts of which supports and springs leave more free than of a body in one: contact and loads see its rigid
/// motions as those of one body. Collective.
///
/// # Errors
/// Such a body, with the place of a part that is free.
pub fn held<const D: usize>(part: &Part<D>, parts: &Parts, mesh: &Mesh<D>, exchange: &dyn Exchange) -> Result<()> {
    if parts.count == 1 {
        return Ok(());
    }
    let space = &part.space;
    let part_of = &parts.of_node;
    // of each part: where its nodes are, and the first of them
    let mut mine = vec![(Extent::default(), None); parts.count];
    for &node in &part.known.own {
        let (extent, first) = &mut mine[part_of[node as usize] as usize];
        let x = space.nodes[node as usize];
        extent.add(x);
        first.get_or_insert((node, space.in_scene(x)));
    }
    let of_ranks = share(exchange, mine);
    let extent = |number: usize| of_ranks.iter().fold(Extent::default(), |all, of_rank| all.join(&of_rank[number].0));
    let motions: Vec<Vec<RigidMotion<D>>> =
        (0..parts.count).map(|number| rigid::of(&extent(number), space.axisymmetric)).collect();
    // a part moves, the others stay at rest
    let each: Vec<(usize, &RigidMotion<D>)> =
        motions.iter().enumerate().flat_map(|(number, own)| own.iter().map(move |motion| (number, motion))).collect();
    let left = |moving: &[(usize, &RigidMotion<D>)]| {
        let at = |k: usize, node: u32| match moving[k].0 == part_of[node as usize] as usize {
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
    // contact may hold a part that supports leave free in part: the one most free is the one that is meant
    let alone = |number: usize| left(&each.iter().filter(|moving| moving.0 == number).copied().collect::<Vec<_>>());
    let most = (0..parts.count).min_by_key(|&number| std::cmp::Reverse(alone(number))).unwrap_or(0);
    let first = of_ranks.iter().filter_map(|of_rank| of_rank[most].1).min_by_key(|(node, _)| *node);
    let at = first.map_or([0.0; 3], |(_, x)| x);
    let (name, count) = (&part.spec.name.value, parts.count);
    let message =
        format!("body `{name}` is in {count} parts that share no facet, and the one at {} is not held", point(at));
    Err(Error::mesh(&mesh.path, None, message)
        .help("make a body of each part, support each of them, or let them share facets (in the script: `Coherence;`)"))
}
