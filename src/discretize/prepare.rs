//! The work of the first rank alone: a problem without its matrices, and what each rank receives of it.

use super::carried::{Supported, supported};
use super::couplings::Coupled;
use super::distribute::Partition;
use super::elastic;
use super::factory::Factory;
use super::info::{Balanced, ContactInfo};
use super::interface::{self, Interface};
use super::mechanism::{self, Fixed};
use super::pairs::{self, Contact, Origin};
use super::part::Part;
use super::parts::parts;
use super::plan::{partitions, plan};
use super::surface::ContactSurface;
use super::unassembled::{LocalBody, OnDofs, SharedBody, Unassembled};
use super::verify::Verified;
use crate::contact::pieces::Cut;
use crate::contact::{self, Chords, ContactPair, End};
use crate::error::Result;
use crate::exchange::Plain;
use crate::fem::NodeGraph;
use crate::mesh::Mesh;
use crate::model::Mechanism;
use crate::problem::{BodySpec, Plane};
use crate::scene::Scene;
use serde::{Deserialize, Serialize};

/// What all ranks have of a prepared problem.
#[derive(Serialize, Deserialize)]
#[serde(bound = "[f64; D]: Plain, P: Plain")]
pub struct Shared<const D: usize, P> {
    /// Bodies in the order of the scene.
    pub bodies: Vec<SharedBody<D>>,
    /// Arrays on which the method works.
    pub pairs: Vec<ContactPair>,
    /// Origin of each pair.
    pub contacts: Vec<SharedContact>,
    /// Free motions of several bodies together.
    pub mechanisms: Vec<Mechanism>,
    /// Loads that were balanced.
    pub balanced: Vec<Balanced>,
    /// Integration points of each pair, if meshes are kept.
    pub fine: Vec<contact::Fine<D>>,
    /// Choice of solvers.
    pub plan: P,
}

/// What all ranks have of the origin of a pair.
#[derive(Serialize, Deserialize)]
pub struct SharedContact {
    origin: Origin,
    swapped: bool,
    idle: usize,
    chords: Option<Chords>,
    ends: Vec<End>,
    surface: ContactSurface,
}

impl SharedContact {
    /// Return the facts of the pair, including its description in the scene.
    pub fn info(self, scene: &Scene) -> ContactInfo {
        let Self { origin, swapped, idle, chords, ends, surface } = self;
        ContactInfo { spec: origin.spec(scene), is_split: origin.is_split, swapped, idle, chords, ends, surface }
    }
}

/// All bodies before their matrices are assembled, with the ranks that own their nodes.
pub struct Whole<'a, const D: usize> {
    bodies: Vec<Unassembled<'a, D>>,
    partitions: Vec<Partition>,
    /// Whether every rank keeps all meshes, for an estimate of the error.
    keep: bool,
}

/// What a rank has of each body, and the coupling of its nodes by K, if it was computed.
pub type Locals<const D: usize> = Vec<(Option<LocalBody<D>>, Option<NodeGraph>)>;

impl<const D: usize> Whole<'_, D> {
    /// Return everything, for the only rank.
    pub fn into_locals(self) -> Locals<D> {
        let local = |mut body: Unassembled<D>| {
            let graph = body.graph.take();
            (Some(LocalBody::whole(body, true)), graph)
        };
        self.bodies.into_iter().map(local).collect()
    }

    /// Return what a rank receives of each body.
    pub fn on(&self, rank: usize) -> Vec<Option<LocalBody<D>>> {
        let of_body = |(index, body): (usize, &Unassembled<D>)| {
            let is_owned = body.owner == rank;
            match place_of(&self.partitions, index) {
                Some((partition, number)) => Some(LocalBody::restrict(body, partition, number, rank, self.keep)),
                None => (is_owned || self.keep).then(|| LocalBody::whole(body.clone(), is_owned)),
            }
        };
        self.bodies.iter().enumerate().map(of_body).collect()
    }
}

/// Return the partition that contains a body, and the index of the body there. The result is `None` if the body stays whole.
fn place_of(partitions: &[Partition], body: usize) -> Option<(&Partition, usize)> {
    partitions.iter().find_map(|partition| Some((partition, partition.bodies.binary_search(&body).ok()?)))
}

/// Prepare a scene on its mesh for this number of `ranks`; see [`discretize`](super::discretize).
///
/// # Errors
/// The scene contradicts its mesh, or `factory` fails.
pub fn prepare<'a, const D: usize, F: Factory>(
    scene: &Scene,
    verified: &Verified<D>,
    bodies: &'a [BodySpec],
    cut: Cut<D>,
    keep: bool,
    ranks: usize,
    factory: &mut F,
) -> Result<(Shared<D, F::Plan>, Whole<'a, D>)> {
    let mesh = &verified.mesh;
    let mut parts = parts(scene, verified, bodies)?;
    let Paired { pairs, contacts, fine } = pair_surfaces(scene, mesh, cut, &parts, keep)?;
    let mut interfaces = interfaces_of(&parts, &pairs, mesh)?;
    let Fixed { gauged, mechanisms, unconstrained, balanced } =
        mechanism::fix(&mut parts, &mut interfaces, &pairs, mesh);
    let supported: Vec<Supported<D>> =
        parts.iter().zip(&interfaces).map(|(part, interface)| supported(part, &interface.free)).collect();
    let coupled = Coupled::new(&parts, &interfaces);
    let plan = plan(&parts, &interfaces, &supported, &coupled, factory)?;
    let partitions = partitions(&parts, &coupled, &pairs, factory, ranks);
    let graphs = coupled.into_graphs();
    let owners = owners(&parts, &partitions, ranks);

    let mut interfaces = interfaces.into_iter();
    let mut supported = supported.into_iter();
    let mut graphs = graphs.into_iter();
    let mut gauged = gauged.into_iter();
    let mut unconstrained = unconstrained.into_iter();
    let mut whole = Vec::new();
    for (part, (owner, ranks)) in parts.into_iter().zip(owners) {
        let (interface, supported, unconstrained) =
            (next(&mut interfaces), next(&mut supported), next(&mut unconstrained));
        whole.push(Unassembled {
            load: interface.nodal_load.sum(),
            warning: warning(&part, scene.plane),
            unloaded: if keep { part.unloaded(mesh)? } else { Vec::new() },
            on_dofs: place_of(&partitions, whole.len())
                .map(|_| OnDofs::new(&part, &interface, &supported, &unconstrained)),
            part,
            interface,
            supported,
            graph: next(&mut graphs),
            owner,
            ranks,
            gauged: next(&mut gauged),
            unconstrained,
        });
    }
    let checked = whole.iter().zip(&*verified.checked);
    let bodies = checked.map(|(body, checked)| body.shared(&pairs, checked)).collect();
    let shared = Shared { bodies, pairs, contacts, mechanisms, balanced, fine, plan };
    Ok((shared, Whole { bodies: whole, partitions, keep }))
}

/// Return the next entry of a list that has one entry for each body.
fn next<T>(each: &mut std::vec::IntoIter<T>) -> T {
    each.next().unwrap_or_else(|| unreachable!("there is one for each body"))
}

/// The pairs of surfaces.
struct Paired<const D: usize> {
    pairs: Vec<ContactPair>,
    contacts: Vec<SharedContact>,
    /// Integration points of each pair, if meshes are kept.
    fine: Vec<contact::Fine<D>>,
}

fn pair_surfaces<const D: usize>(
    scene: &Scene,
    mesh: &Mesh<D>,
    cut: Cut<D>,
    parts: &[Part<D>],
    keep: bool,
) -> Result<Paired<D>> {
    let mut paired = Paired { pairs: Vec::new(), contacts: Vec::new(), fine: Vec::new() };
    for found in pairs::all(scene, mesh, cut, parts, keep)? {
        let Contact { origin, pair, fine, swapped, idle, chords, ends, surface } = found;
        paired.pairs.push(pair);
        paired.fine.extend(fine);
        paired.contacts.push(SharedContact { origin, swapped, idle, chords, ends, surface });
    }
    Ok(paired)
}

fn interfaces_of<const D: usize>(
    parts: &[Part<D>],
    pairs: &[ContactPair],
    mesh: &Mesh<D>,
) -> Result<Vec<Interface<D>>> {
    let interfaces = parts.iter().zip(interface::segments(parts.len(), pairs));
    interfaces.map(|(part, segments)| Interface::new(part, segments, pairs, mesh)).collect()
}

/// Return for each body the rank that owns it or most of it, and all ranks that own nodes of it. A body that is not distributed
/// stays whole; such bodies are assigned so that all ranks get about equally many of their dofs.
fn owners<const D: usize>(parts: &[Part<D>], partitions: &[Partition], ranks: usize) -> Vec<(usize, Vec<usize>)> {
    let dofs = |body: usize| if place_of(partitions, body).is_some() { 0 } else { parts[body].space.dofs() };
    let owners = crate::parallel::owners(&(0..parts.len()).map(dofs).collect::<Vec<_>>(), ranks);
    let of_body = |(body, owner): (usize, usize)| match place_of(partitions, body) {
        Some((partition, number)) => (partition.leader(number), partition.ranks(number)),
        None => (owner, vec![owner]),
    };
    owners.into_iter().enumerate().map(of_body).collect()
}

/// Return a warning for the user about the elasticity of a body, if there is reason for one.
fn warning<const D: usize>(part: &Part<D>, plane: Plane) -> Option<String> {
    elastic::warning(part.spec, elastic::poisson(part.spec, D, part.places(), plane))
}
