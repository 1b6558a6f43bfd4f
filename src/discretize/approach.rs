//! The motion of a body relative to its contact: the displacement of the support that moves it, or the one that is conjugate to its
//! load, or the mean displacement of where it is constrained.

use super::patterns::find_group;
use super::supports::axis_vector;
use crate::contact::add;
use crate::error::Result;
use crate::fem::{Facets, NodalForces, Space, Subdivision, assemble, length, pad, place, surface};
use crate::linalg::dot;
use crate::mesh::Mesh;
use crate::problem::body::{BodySpec, SpringKind};
use serde::{Deserialize, Serialize};

/// Smallest cosine of the angle between a force or a constrained direction and the contact normal at which a place is included.
/// It belongs to 60 degrees, up to which facets are pairs without the key `angle`.
const ALONG: f64 = 0.5;

/// Weights of nodes in a mean.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
struct NodeWeights {
    /// Weights of the nodes of this rank.
    of_nodes: Vec<(u32, f64)>,
    /// Sum of the weights of all nodes.
    total: f64,
}

impl NodeWeights {
    /// Make the weights from those of all nodes.
    fn new(of_nodes: Vec<(u32, f64)>) -> Self {
        Self { total: of_nodes.iter().map(|entry| entry.1).sum(), of_nodes }
    }

    /// Restrict the weights to the nodes in the sorted slice `nodes`, which are renumbered by their positions there.
    fn on(&self, nodes: &[u32]) -> Self {
        let here = |(node, weight): &(u32, f64)| Some((place(nodes, *node)?, *weight));
        Self { of_nodes: self.of_nodes.iter().filter_map(here).collect(), total: self.total }
    }
}

/// A surface or a set of nodes on which the body is constrained.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct BoundarySet {
    /// Unit vectors: the constrained directions.
    directions: Vec<[f64; 3]>,
    /// Integrals of the shape functions of nodes over the surface; 1 for each node if there is no surface.
    weights: NodeWeights,
    /// Whether this is a surface.
    has_area: bool,
}

impl BoundarySet {
    /// Collect the nodes of a group.
    fn new<const D: usize>(space: &Space<D>, group: &crate::mesh::Group, directions: Vec<[f64; 3]>) -> Self {
        let facets = if group.dimension + 1 == D { Some(space.facets(group)) } else { None };
        let areas = facets.map_or(Vec::new(), |facets| areas(space, &facets));
        let has_area = !areas.is_empty();
        let nodes = || space.nodes_on(group).into_iter().map(|node| (node, 1.0)).collect();
        Self { directions, weights: NodeWeights::new(if has_area { areas } else { nodes() }), has_area }
    }

    fn on(&self, nodes: &[u32]) -> Self {
        Self { directions: self.directions.clone(), weights: self.weights.on(nodes), ..*self }
    }

    fn acts_along(&self, n: [f64; 3]) -> bool {
        self.directions.iter().any(|d| dot(d, &n).abs() >= ALONG)
    }
}

/// The nodal forces of a load at its full value.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct LoadForces {
    /// Forces at the nodes of this rank.
    forces: Vec<(u32, [f64; 3])>,
    /// Sum of the forces at all nodes.
    net: [f64; 3],
    /// Sum of their magnitudes.
    size: f64,
}

impl LoadForces {
    /// Take the forces at all nodes.
    pub fn new<const D: usize>(forces: impl Iterator<Item = (u32, [f64; D])>) -> Self {
        let forces: Vec<_> = forces.map(|(node, force)| (node, pad(force))).collect();
        let mut net = [0.0; 3];
        forces.iter().for_each(|(_, force)| add(&mut net, *force));
        Self { net, size: forces.iter().map(|(_, force)| length(*force)).sum(), forces }
    }

    fn on(&self, nodes: &[u32]) -> Self {
        let here = |(node, force): &(u32, [f64; 3])| Some((place(nodes, *node)?, *force));
        Self { forces: self.forces.iter().filter_map(here).collect(), ..*self }
    }

    /// Return the weights of the mean displacement along `n` on which the load works, or `None` if the load does not push along
    /// it. A moment and a pressure all around have no sum.
    fn along(&self, n: [f64; 3]) -> Option<NodeWeights> {
        let net = dot(&self.net, &n);
        let of_nodes = self.forces.iter().map(|(node, force)| (*node, net.signum() * dot(force, &n)));
        (net.abs() >= ALONG * self.size && net != 0.0)
            .then(|| NodeWeights { of_nodes: of_nodes.collect(), total: net.abs() })
    }
}

/// The places where a body is moved, loaded, and constrained.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Outer {
    /// Supports that prescribe displacements other than zero.
    moved: Vec<BoundarySet>,
    /// Loads on surfaces and points.
    loaded: Vec<LoadForces>,
    held: Vec<BoundarySet>,
    /// Integrals of the shape functions over the body, if it has no loads, supports or springs.
    whole: NodeWeights,
    nodes: usize,
}

impl Outer {
    /// Find the places where a body is constrained. `loaded` holds its loads on surfaces and points. The whole body is used if it
    /// has no loads, supports or springs.
    ///
    /// # Errors
    /// A group is missing.
    pub fn new<const D: usize>(
        spec: &BodySpec,
        space: &Space<D>,
        mesh: &Mesh<D>,
        loaded: Vec<LoadForces>,
    ) -> Result<Self> {
        let mut outer = Self { loaded, nodes: space.nodes.len(), ..Self::default() };
        for fix in &spec.fix {
            let group = find_group(mesh, &fix.on, &(0..=D).rev().collect::<Vec<_>>(), "support")?;
            let components = || (0..D).filter_map(|c| Some((axis_vector(c), fix.value[c].as_ref()?)));
            let along = fix.normal.as_ref().and_then(|value| Some((normal(space, group)?, value)));
            let all: Vec<_> = components().chain(along).collect();
            let moved: Vec<_> = all.iter().filter(|(_, value)| !value.is_zero()).map(|(n, _)| *n).collect();
            if !moved.is_empty() {
                outer.moved.push(BoundarySet::new(space, group, moved));
            }
            outer.held.push(BoundarySet::new(space, group, all.into_iter().map(|(n, _)| n).collect()));
        }
        for spring in &spec.spring {
            let group = find_group(mesh, &spring.on, &[D - 1, 0], "spring")?;
            let directions = match &spring.kind {
                SpringKind::Vector(fields) => (0..D).filter(|&c| !fields[c].is_zero()).map(axis_vector).collect(),
                SpringKind::Normal(_) => normal(space, group).into_iter().collect(),
            };
            outer.held.push(BoundarySet::new(space, group, directions));
        }
        if spec.load.is_empty() && spec.fix.is_empty() && spec.spring.is_empty() {
            outer.whole = NodeWeights::new(volumes(space));
        }
        Ok(outer)
    }

    /// Restrict the places to the nodes in the sorted slice `nodes`, which are renumbered by their positions there.
    pub fn on(&self, nodes: &[u32]) -> Self {
        let on = |places: &[BoundarySet]| places.iter().map(|place| place.on(nodes)).collect();
        Self {
            moved: on(&self.moved),
            loaded: self.loaded.iter().map(|load| load.on(nodes)).collect(),
            held: on(&self.held),
            whole: self.whole.on(nodes),
            nodes: self.nodes,
        }
    }

    /// Return the contribution of owned nodes to the displacement of the body, from the displacements `u` of the nodes of this
    /// rank. It is the mean over the supports that move the body along `direction`, without them the one on which the loads along
    /// it work, else the mean over supports and springs that constrain this direction, and without these over the whole body.
    pub fn mean<const D: usize>(&self, u: &[f64], own: &[bool], direction: [f64; 3]) -> [f64; 3] {
        let chosen = |places: &[BoundarySet]| {
            let along = || places.iter().filter(|place| place.acts_along(direction));
            let surfaces = along().any(|place| place.has_area);
            let chosen = along().filter(|place| place.has_area || !surfaces);
            mean::<D>(u, own, chosen.map(|place| &place.weights))
        };
        let loaded = || {
            let along: Vec<_> = self.loaded.iter().filter_map(|load| load.along(direction)).collect();
            mean::<D>(u, own, along.iter())
        };
        let of_nodes = || {
            let own = (0..).zip(own).filter(|(_, own)| **own).map(|(node, _)| (node, 1.0));
            NodeWeights { of_nodes: own.collect(), total: self.nodes as f64 }
        };
        let whole = || {
            let whole = Some(self.whole.clone()).filter(|whole| whole.total > 0.0);
            mean::<D>(u, own, [&whole.unwrap_or_else(of_nodes)].into_iter())
        };
        chosen(&self.moved).or_else(loaded).or_else(|| chosen(&self.held)).or_else(whole).unwrap_or_default()
    }
}

/// Return the contribution of owned nodes to a mean of nodal displacements, or `None` without nodes.
fn mean<'a, const D: usize>(u: &[f64], own: &[bool], all: impl Iterator<Item = &'a NodeWeights>) -> Option<[f64; 3]> {
    let (mut sum, mut total) = ([0.0; 3], 0.0);
    for NodeWeights { of_nodes, total: of_all } in all {
        for &(node, weight) in of_nodes.iter().filter(|(node, _)| own[*node as usize]) {
            add(&mut sum, pad(std::array::from_fn::<f64, D, _>(|c| weight * u[D * node as usize + c])));
        }
        total += of_all;
    }
    (total > 0.0).then(|| sum.map(|sum| sum / total))
}

/// Return the integrals of the shape functions over a surface.
fn areas<const D: usize>(space: &Space<D>, facets: &Facets<D>) -> Vec<(u32, f64)> {
    first_components(&surface::surface_load(space, facets, Subdivision::Whole, &|_, _| axis_vector(0)))
}

/// Return the integrals of the shape functions over the body.
fn volumes<const D: usize>(space: &Space<D>) -> Vec<(u32, f64)> {
    first_components(&assemble::body_force(space, Subdivision::Whole, &|_| axis_vector(0)))
}

fn first_components<const D: usize>(all: &NodalForces<D>) -> Vec<(u32, f64)> {
    all.iter().map(|(node, weight)| (node, weight[0])).collect()
}

/// Return the mean unit normal of a surface, if it has one.
fn normal<const D: usize>(space: &Space<D>, group: &crate::mesh::Group) -> Option<[f64; 3]> {
    if group.dimension + 1 != D {
        return None;
    }
    let mut sum = [0.0; 3];
    space.facets(group).normals(space).into_iter().for_each(|n| add(&mut sum, pad(n)));
    normalized(sum)
}

fn normalized(v: [f64; 3]) -> Option<[f64; 3]> {
    let size = length(v);
    (size > 0.0).then(|| v.map(|v| v / size))
}
