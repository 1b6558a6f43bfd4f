//! The mesh against what the scene makes of it: what must hold before anything is assembled.

use super::find::point;
use super::part::Part;
use super::roster::{self, Lying};
use crate::contact::pad;
use crate::error::{Error, Result};
use crate::fem::Space;
use crate::fem::rigid::{self, RigidMotion};
use crate::mesh::{Asked, Checked, Duty, Mesh, Parts, Told};
use crate::problem::body::BodySpec;
use crate::scene::Scene;
use serde::{Deserialize, Serialize};
use std::collections::HashSet;
use std::rc::Rc;

/// A mesh that holds what bodies must be.
#[derive(Debug)]
pub struct Verified<const D: usize> {
    /// The mesh; on all ranks but the first without the cells of bodies.
    pub mesh: Mesh<D>,
    /// The bodies of the scene, each with a name of its own.
    pub bodies: Vec<BodySpec>,
    /// What was found of each body, in the same order; bodies that the mesh does not have are missing.
    pub checked: Rc<[Checked]>,
    lying: Lying,
}

/// What the first rank has found of a mesh, for the others.
#[derive(Serialize, Deserialize)]
pub struct Findings {
    mesh: Told,
    checked: Vec<Checked>,
    lying: Lying,
}

/// Finds the bodies of a scene and checks its mesh once: see `roster::bodies` and [`Mesh::check`].
///
/// # Errors
/// Patterns that do not fit the mesh; what is no mesh of a body, with body, place and elements.
pub fn verify<const D: usize>(scene: &Scene, mesh: Mesh<D>) -> Result<Verified<D>> {
    let lying = roster::lying(scene, &mesh)?;
    let bodies = roster::bodies(scene, &mesh, &lying)?;
    let asked: Vec<Asked> = bodies.iter().map(asked).collect();
    let contacts = scene.contacts.iter().flat_map(|contact| &contact.between).map(|name| name.value.as_str());
    let checked = mesh.check(&asked, &contacts.collect::<Vec<_>>(), !scene.auto.is_empty())?;
    Ok(Verified { mesh, bodies, checked: checked.into(), lying })
}

impl<const D: usize> Verified<D> {
    /// What other ranks have to know.
    pub fn findings(&self) -> Findings {
        // supports may hold all nodes of a group of cells
        let held = self.bodies.iter().flat_map(|body| &body.fix).map(|fix| fix.on.value.as_str());
        let held: HashSet<&str> = held.collect();
        let mesh = self.mesh.told(|name| held.contains(name));
        let counted = |checked: &Checked| Checked {
            parts: Parts { count: checked.parts.count, of_cell: Vec::new() },
            ..*checked
        };
        Findings { mesh, checked: self.checked.iter().map(counted).collect(), lying: self.lying.clone() }
    }

    /// What the first rank has found, on another one.
    ///
    /// # Errors
    /// None that [`verify`] has not found before.
    pub fn told(scene: &Scene, findings: Findings) -> Result<Self> {
        let Findings { mesh, checked, lying } = findings;
        let mesh = Mesh::of(mesh);
        let bodies = roster::bodies(scene, &mesh, &lying)?;
        Ok(Self { mesh, bodies, checked: checked.into(), lying })
    }
}

/// A body with the groups that serve it.
fn asked(body: &BodySpec) -> Asked<'_> {
    let loads = body.load.iter().map(|load| (load.on.value.as_str(), Duty::Acts));
    let springs = body.spring.iter().map(|spring| (spring.on.value.as_str(), Duty::Acts));
    let supports = body.fix.iter().map(|fix| (fix.on.value.as_str(), Duty::Holds));
    Asked { name: &body.name.value, order: body.order, groups: loads.chain(springs).chain(supports).collect() }
}

/// Refuses a body in parts of which supports and springs leave more free than of a body in one: contact and loads see its rigid
/// motions as those of one body.
///
/// # Errors
/// Such a body, with the place of a part that is free.
pub fn held<const D: usize>(part: &Part<D>, parts: &Parts, mesh: &Mesh<D>) -> Result<()> {
    if parts.count == 1 {
        return Ok(());
    }
    let space = &part.space;
    let mut nodes = vec![Vec::new(); parts.count];
    for (cell, &of) in space.cells.chunks_exact(space.stride).zip(&parts.of_cell) {
        nodes[of as usize].extend_from_slice(cell);
    }
    nodes.iter_mut().for_each(|nodes| {
        nodes.sort_unstable();
        nodes.dedup();
    });
    let motions: Vec<Vec<RigidMotion>> = nodes.iter().map(|nodes| of_nodes(space, nodes)).collect();
    let whole = part.left(&part.in_dofs(rigid::of(space))).len();
    if part.left(&part.in_dofs(motions.concat())).len() <= whole {
        return Ok(());
    }
    // contact may hold a part that supports leave free in part: the one most free is the one that is meant
    let free = |part_of: usize| part.left(&part.in_dofs(motions[part_of].clone())).len();
    let most = (0..parts.count).min_by_key(|&part_of| std::cmp::Reverse(free(part_of))).unwrap_or(0);
    let at = pad(space.nodes[nodes[most][0] as usize]);
    let (name, count) = (&part.spec.name.value, parts.count);
    let message =
        format!("body `{name}` is in {count} parts that share no facet, and the one at {} is not held", point(at));
    Err(Error::mesh(&mesh.path, None, message)
        .help("make a body of each part, support each of them, or let them share facets (in the script: `Coherence;`)"))
}

/// The rigid motions of some nodes of a body; the others stay at rest.
fn of_nodes<const D: usize>(space: &Space<D>, nodes: &[u32]) -> Vec<RigidMotion> {
    let places: Vec<[f64; D]> = nodes.iter().map(|&node| space.nodes[node as usize]).collect();
    let mut motions = rigid::modes(&places);
    if space.axisymmetric {
        motions = vec![motions.swap_remove(1)];
    }
    for motion in &mut motions {
        let mut all = vec![0.0; space.dofs()];
        for (k, &node) in nodes.iter().enumerate() {
            (0..D).for_each(|c| all[D * node as usize + c] = motion.displacement[D * k + c]);
        }
        motion.displacement = all;
    }
    motions
}
