//! The work of the first rank alone: a problem without its matrices, and what each rank receives of it.
//!
//! The factory requests facts about each body, chooses solvers, and decides which bodies share a matrix.

use super::assembly::Factory;
use super::bodies::parts;
use super::body::BodyMesh;
use super::facts::BodyInfo;
use super::pairs::{self, ContactFacts};
use super::partition::Partition;
use super::verify::Verified;
use super::whole::WholeBody;
use super::{chords, mechanism, rigid};
use crate::contact::pieces::Cut;
use crate::contact::{self, ContactPair};
use crate::error::Result;
use crate::exchange::Plain;
use crate::fem::rigid::AtDofs;
use crate::mesh::BodyCheck;
use crate::model::{BodyFacts, BodySlot, InterfaceDofs, Mechanism, compactness};
use crate::problem::Order;
use crate::scene::Scene;
use serde::{Deserialize, Serialize};

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
    pub fine: Vec<contact::Fine<D>>,
    /// Choice of solvers.
    pub plan: P,
}

/// All bodies before their matrices are assembled, with the ranks that own their nodes.
pub struct WholeProblem<'a, const D: usize> {
    bodies: Vec<WholeBody<'a, D>>,
    partitions: Vec<Partition>,
    /// Whether every rank keeps all meshes, for an estimate of the error.
    keep: bool,
}

impl<const D: usize> WholeProblem<'_, D> {
    /// Return everything, for the only rank.
    pub fn into_locals(self) -> Vec<Option<BodyMesh<D>>> {
        self.bodies.into_iter().map(|body| Some(body.part.mesh)).collect()
    }

    /// Return what a rank receives of each body.
    pub fn on(&self, rank: usize) -> Vec<Option<BodyMesh<D>>> {
        let of_body = |(index, body): (usize, &WholeBody<D>)| {
            let is_owned = body.owner == rank;
            match place_of(&self.partitions, index) {
                Some((partition, number)) => Some(partition.restrict(&body.part.mesh, number, rank, self.keep)),
                None => (is_owned || self.keep).then(|| BodyMesh { is_owned, ..body.part.mesh.clone() }),
            }
        };
        self.bodies.iter().enumerate().map(of_body).collect()
    }
}

/// Return the partition that contains a body, and the index of the body there. The result is `None` if the body stays whole.
fn place_of(partitions: &[Partition], body: usize) -> Option<(&Partition, usize)> {
    partitions.iter().find_map(|partition| Some((partition, partition.bodies.binary_search(&body).ok()?)))
}

/// Prepare a scene on its mesh for this number of `ranks`: bodies, pairs, free motions, solvers, and the partition; see
/// [`discretize`](super::discretize).
///
/// # Errors
/// The scene contradicts its mesh, or `factory` fails.
pub fn prepare<'a, const D: usize, F: Factory>(
    scene: &'a Scene,
    verified: &Verified<D>,
    cut: Cut<D>,
    keep: bool,
    ranks: usize,
    factory: &mut F,
) -> Result<(ReplicatedProblem<D, F::SolverPlan>, WholeProblem<'a, D>)> {
    let mesh = &verified.mesh;
    let parts = parts(scene, verified)?;
    let (mut pairs, mut contacts, mut fine) = (Vec::new(), Vec::new(), Vec::new());
    let mut is_through = Vec::new();
    for found in pairs::all(scene, mesh, cut, &parts, keep)? {
        pairs.push(found.pair);
        is_through.push(found.is_through);
        contacts.push(found.facts);
        fine.extend(found.fine);
    }
    let lack = chords::lack(&parts, mesh)?;
    let mut bodies = WholeBody::all(parts, &pairs, mesh)?;
    let mechanisms = mechanism::fix(&mut bodies, &mut pairs, lack);
    let rigid = rigid::all(scene, &mut pairs, &is_through, bodies.len())?;
    for body in &mut bodies {
        body.part.mesh.prescribed = body.part.mesh.prescribed_sorted();
    }
    let plan = plan(&bodies, &verified.checked, factory)?;
    let partitions = partitions(&bodies, &pairs, factory, ranks);
    for (index, (owner, ranks)) in owners(&bodies, &partitions, ranks).into_iter().enumerate() {
        let body = &mut bodies[index];
        (body.owner, body.ranks) = (owner, ranks);
    }
    let checked = bodies.iter().zip(&*verified.checked);
    let shared = checked.map(|(body, checked)| body.shared(&pairs, checked, scene.plane)).collect();
    let shared = ReplicatedProblem { bodies: shared, pairs, rigid, contacts, mechanisms, fine, plan };
    Ok((shared, WholeProblem { bodies, partitions, keep }))
}

/// Return the factory's plan of the solvers of all bodies.
///
/// # Errors
/// See [`Factory::plan`].
fn plan<const D: usize, F: Factory>(
    bodies: &[WholeBody<D>],
    checked: &[BodyCheck],
    factory: &mut F,
) -> Result<F::SolverPlan> {
    let of_body = |(WholeBody { part, rigid_modes, .. }, checked): (&WholeBody<D>, &BodyCheck)| {
        let (spec, mesh) = (part.spec, &part.mesh);
        let at = |k: usize, dof: usize| mesh.dof_of(&rigid_modes[k], dof);
        let motions = AtDofs { count: rigid_modes.len(), at: &at };
        let interface = InterfaceDofs::new(D, &mesh.rows, &mesh.prescribed, motions);
        let facts = BodyFacts {
            name: spec.name.value.clone(),
            dimension: D,
            dofs: mesh.space.dofs(),
            interface: interface.dofs.len(),
            is_quadratic: mesh.space.order > Order::P1,
            compactness: compactness(mesh.space.cell_count(), checked.outer),
            ..BodyFacts::default()
        };
        (facts, interface)
    };
    factory.plan(bodies.iter().zip(checked).map(of_body).collect())
}

/// Distribute the nodes of the bodies that share a matrix over the ranks, by the factory's plan.
fn partitions<const D: usize>(
    bodies: &[WholeBody<D>],
    pairs: &[ContactPair],
    factory: &impl Factory,
    ranks: usize,
) -> Vec<Partition> {
    let wants_coarse = |body: usize| factory.wants_interpolation(&bodies[body].part.spec.name.value);
    let partition = |set: Vec<usize>| Partition::new(set, bodies, pairs, ranks, &wants_coarse);
    factory.distributed().into_iter().map(partition).collect()
}

/// Return for each body the rank that owns it or most of it, and all ranks that own nodes of it. A body that is not distributed
/// stays whole; such bodies are assigned so that all ranks get about equally many of their dofs.
fn owners<const D: usize>(bodies: &[WholeBody<D>], partitions: &[Partition], ranks: usize) -> Vec<(usize, Vec<usize>)> {
    let dofs = |body: usize| if place_of(partitions, body).is_some() { 0 } else { bodies[body].part.mesh.space.dofs() };
    let owners = crate::parallel::owners(&(0..bodies.len()).map(dofs).collect::<Vec<_>>(), ranks);
    let of_body = |(body, owner): (usize, usize)| match place_of(partitions, body) {
        Some((partition, number)) => (partition.leader(number), partition.ranks(number)),
        None => (owner, vec![owner]),
    };
    owners.into_iter().enumerate().map(of_body).collect()
}
