//! The work of the first rank alone: a problem without its matrices, and what each rank receives of it.
//!
//! The factory requests facts about each body, chooses solvers, and decides which bodies share a matrix.

use super::assembly::Factory;
use super::body_mesh::BodyMesh;
use super::facts::BodyInfo;
use super::kept::{EarlierPair, Kept, MatrixInputs};
use super::meshes::{KeptMeshes, Meshes};
use super::pairs::{self, Contact, ContactFacts, Contacts};
use super::partition::{BodyRanks, Partition};
use super::scene_body::{SceneBody, parts};
use super::verify::Verified;
use super::{approach, chords, mechanism, obstacle};
use crate::contact::pieces::Cut;
use crate::contact::{self, ContactPair};
use crate::error::Result;
use crate::exchange::Plain;
use crate::fem::Frame;
use crate::mesh::{BodyCheck, Mesh};
use crate::model::{BodyFacts, BodySlot, Mechanism, Segment, interface_dofs, slenderness};
use crate::problem::Order;
use crate::scene::Scene;
use serde::{Deserialize, Serialize};
use std::rc::Rc;

/// What a discrete problem is made from.
pub struct Request<'a, const D: usize> {
    /// The scene, with the bodies of `verified` under the loads of a step.
    pub scene: &'a Scene,
    /// The mesh.
    pub verified: &'a Verified<D>,
    /// Function that finds the common pieces of surfaces in this dimension.
    pub cut: Cut<D>,
    /// What wraps the meshes, if they are kept for an estimate of the error.
    pub keep: Option<fn(Rc<KeptMeshes<D>>) -> Meshes>,
}

/// What all ranks have of a prepared problem.
#[derive(Serialize, Deserialize)]
#[serde(bound = "[f64; D]: Plain, P: Plain")]
pub struct ReplicatedProblem<const D: usize, P> {
    /// Bodies in the order of the scene: arrays of the model, and facts for reports.
    pub bodies: Vec<(BodySlot, BodyInfo)>,
    /// Arrays on which the method works.
    pub pairs: Vec<ContactPair>,
    /// Rigid parts, which follow the bodies.
    pub rigid: Vec<BodySlot>,
    /// Facts of each pair besides its arrays.
    pub contacts: Vec<ContactFacts>,
    /// Motions that nothing resists.
    pub mechanisms: Vec<Mechanism>,
    /// Integration points of each pair, if meshes are kept.
    pub fine: Vec<Rc<contact::Fine<D>>>,
    /// Choice of solvers.
    pub plan: P,
    /// Whether the matrix of each body, with its solver, is that of the problem before.
    pub is_kept: Vec<bool>,
    /// Number of pairs whose surfaces were searched for common pieces.
    pub searched: usize,
}

/// All bodies before their matrices are assembled, with the ranks that own their nodes.
pub struct WholeProblem<'a, const D: usize> {
    bodies: Vec<SceneBody<'a, D>>,
    /// Ranks of each body.
    owners: Vec<BodyRanks>,
    partitions: Vec<Rc<Partition>>,
    /// Whether every rank keeps all meshes, for an estimate of the error.
    keep: bool,
}

impl<const D: usize> WholeProblem<'_, D> {
    /// Return everything, for the only rank.
    pub fn into_locals(self) -> Vec<Option<BodyMesh<D>>> {
        self.bodies.into_iter().map(|body| Some(body.mesh)).collect()
    }

    /// Return what a rank receives of each body.
    pub fn on(&self, rank: usize) -> Vec<Option<BodyMesh<D>>> {
        let of_body = |(index, body): (usize, &SceneBody<D>)| {
            let is_owned = self.owners[index].leader == rank;
            match place_of(&self.partitions, index) {
                Some((partition, number)) => Some(partition.restrict(&body.mesh, number, rank, self.keep)),
                None => (is_owned || self.keep).then(|| BodyMesh { is_owned, ..body.mesh.clone() }),
            }
        };
        self.bodies.iter().enumerate().map(of_body).collect()
    }
}

/// Return the partition that contains a body, and the index of the body there. The result is `None` if the body stays
/// whole.
fn place_of(partitions: &[Rc<Partition>], body: usize) -> Option<(&Partition, usize)> {
    partitions.iter().find_map(|partition| Some((&**partition, partition.bodies.binary_search(&body).ok()?)))
}

/// Prepare a scene on its mesh for this number of `ranks`: bodies, pairs, free motions, solvers, and the partition; see
/// [`discretize`](super::discretize). `kept` and the `pairs` are those of the problem before; `kept` becomes that of
/// this one.
///
/// # Errors
/// The scene contradicts its mesh, or `factory` fails.
pub fn prepare<'a, const D: usize, F: Factory>(
    request: &Request<'a, D>,
    ranks: usize,
    factory: &mut F,
    kept: &mut Kept<D>,
    pairs: Vec<EarlierPair>,
) -> Result<(ReplicatedProblem<D, F::SolverPlan>, WholeProblem<'a, D>)> {
    let Request { scene, verified, cut, keep } = *request;
    let keep = keep.is_some();
    let mesh = &verified.mesh;
    let mut before = std::mem::take(kept);
    let mut bodies = parts(scene, verified, &before.spaces())?;
    kept.bodies = bodies.iter().map(MatrixInputs::of).collect();
    let earlier_pairs = before.serving_pairs(&kept.bodies, pairs);
    let Contacts { all, searched } = pairs::all(scene, mesh, cut, &bodies, keep, earlier_pairs)?;
    let (mut pairs, mut contacts, mut fine) = (Vec::new(), Vec::new(), Vec::new());
    for Contact { pair, facts, inputs } in all {
        pairs.push(pair);
        contacts.push(facts);
        fine.extend(inputs.fine.clone());
        kept.pairs.push(inputs);
    }
    let lack = chords::lack(&bodies, mesh)?;
    complete(&mut bodies, &pairs, mesh)?;
    let mechanisms = mechanism::fix(&mut bodies, &mut pairs, lack);
    let is_through: Vec<bool> = kept.pairs.iter().map(|inputs| inputs.is_through).collect();
    let rigid = obstacle::all(scene, &mut pairs, &is_through, bodies.len())?;
    kept.bodies.iter_mut().zip(&bodies).for_each(|(inputs, body)| inputs.complete(body));
    let has_matrix =
        |(i, body): (usize, &MatrixInputs<D>)| before.bodies.get(i).is_some_and(|it| body.has_matrix_of(it));
    let mut is_kept: Vec<bool> = kept.bodies.iter().enumerate().map(has_matrix).collect();
    let plan = plan_in_contact_axes(&mut bodies, &mut pairs, &verified.checked, factory, &mut is_kept)?;
    kept.partitions = partitions(&bodies, &pairs, factory, ranks, (before.partitions, &is_kept));
    kept.owners = owners(&bodies, &kept.partitions, ranks);
    is_kept.iter_mut().enumerate().for_each(|(i, is_kept)| *is_kept &= before.owners.get(i) == Some(&kept.owners[i]));
    kept.rules = scene.rules().cloned().collect();
    let share = |i: usize| bodies[i].shared(&pairs, &verified.checked[i], scene.plane, &kept.owners[i]);
    let shared = (0..bodies.len()).map(share).collect();
    let shared =
        ReplicatedProblem { bodies: shared, pairs, rigid, contacts, mechanisms, fine, plan, is_kept, searched };
    let (owners, partitions) = (kept.owners.clone(), kept.partitions.clone());
    Ok((shared, WholeProblem { bodies, owners, partitions, keep }))
}

/// Complete all bodies by their contact rows, their loads and the motions that supports leave.
///
/// # Errors
/// See [`SceneBody::load`].
fn complete<const D: usize>(bodies: &mut [SceneBody<D>], pairs: &[ContactPair], mesh: &Mesh<D>) -> Result<()> {
    let count = bodies.len();
    for (pair, sides) in pairs.iter().enumerate() {
        for (side, &body) in sides.bodies.iter().enumerate().filter(|(_, body)| **body < count) {
            bodies[body].segments.push(Segment { pair, side });
        }
    }
    for body in bodies {
        body.mesh.approach = approach::rows(body, &body.segments, pairs, mesh)?;
        body.mesh.load = body.load(mesh)?;
        body.mesh.find_motions();
        body.dof_load = body.mesh.load_on_dofs();
        body.collect_rows(pairs);
    }
    Ok(())
}

/// Turn nodes to their contact normals, and make the factory's plan, for which that counts. Turn the nodes of bodies
/// back that are not eliminated: multigrid needs the same axes at all nodes. See [`plan`].
fn plan_in_contact_axes<const D: usize, F: Factory>(
    bodies: &mut [SceneBody<D>],
    pairs: &mut [ContactPair],
    checked: &[BodyCheck],
    factory: &mut F,
    is_kept: &mut [bool],
) -> Result<F::SolverPlan> {
    let frames: Vec<Frame<D>> = bodies.iter().map(|body| body.mesh.held.frame.clone()).collect();
    bodies.iter_mut().for_each(|body| body.set_frame(body.mesh.contact_frame(), pairs));
    let plan = plan(bodies, checked, factory, is_kept)?;
    for (_, (body, frame)) in bodies.iter_mut().zip(frames).enumerate().filter(|(i, _)| !factory.eliminates(*i)) {
        body.set_frame(frame, pairs);
    }
    Ok(plan)
}

/// Return the factory's plan of the solvers of all bodies. `is_kept` says whether each has the matrix of the problem
/// before, and then also whether its solver serves.
///
/// # Errors
/// See [`Factory::plan`].
fn plan<const D: usize, F: Factory>(
    bodies: &[SceneBody<D>],
    checked: &[BodyCheck],
    factory: &mut F,
    is_kept: &mut [bool],
) -> Result<F::SolverPlan> {
    let of_body = |(SceneBody { spec, mesh, .. }, checked): (&SceneBody<D>, &BodyCheck)| {
        let rigid_modes = mesh.rigid_modes();
        let at = |k: usize, dof: usize| mesh.dof_of(&rigid_modes[k], dof);
        let interface = interface_dofs(&mesh.rows, &mesh.prescribed(), rigid_modes.len(), at);
        let facts = BodyFacts {
            name: spec.name.value.clone(),
            dimension: D,
            dofs: mesh.space.dofs(),
            interface: interface.len(),
            is_quadratic: mesh.space.order > Order::P1,
            slenderness: slenderness(mesh.extent.size(), checked.surface, mesh.space.measure()),
            ..BodyFacts::default()
        };
        (facts, interface)
    };
    factory.plan(bodies.iter().zip(checked).map(of_body).collect(), is_kept)
}

/// Distribute the nodes of the bodies that share a matrix over the ranks, by the factory's plan. `kept` are the
/// partitions of the problem before, with the bodies that have the same matrices.
fn partitions<const D: usize>(
    bodies: &[SceneBody<D>],
    pairs: &[ContactPair],
    factory: &impl Factory,
    ranks: usize,
    kept: (Vec<Rc<Partition>>, &[bool]),
) -> Vec<Rc<Partition>> {
    let wants_coarse = |body: usize| factory.wants_interpolation(&bodies[body].spec.name.value);
    let partition = |set: Vec<usize>| {
        let serves = |partition: &&Rc<Partition>| partition.bodies == set && set.iter().all(|&body| kept.1[body]);
        match kept.0.iter().find(serves) {
            Some(partition) => partition.clone(),
            None => Rc::new(Partition::new(set, bodies, pairs, ranks, &wants_coarse)),
        }
    };
    factory.distributed().into_iter().map(partition).collect()
}

/// Return for each body the rank that owns it or most of it, and all ranks that own nodes of it. A body that is not
/// distributed stays whole; such bodies are assigned so that all ranks get about equally many of their dofs.
fn owners<const D: usize>(bodies: &[SceneBody<D>], partitions: &[Rc<Partition>], ranks: usize) -> Vec<BodyRanks> {
    let dofs = |body: usize| if place_of(partitions, body).is_some() { 0 } else { bodies[body].mesh.space.dofs() };
    let owners = crate::parallel::owners(&(0..bodies.len()).map(dofs).collect::<Vec<_>>(), ranks);
    let of_body = |(body, owner): (usize, usize)| match place_of(partitions, body) {
        Some((partition, number)) => BodyRanks { leader: partition.leader(number), all: partition.ranks(number) },
        None => BodyRanks { leader: owner, all: vec![owner] },
    };
    owners.into_iter().enumerate().map(of_body).collect()
}
