//! Forces at the nodes of a body.

use super::{length, pad, place};
use crate::exchange::Plain;
use crate::linalg::{Total, dot};
use serde::{Deserialize, Serialize};

/// The forces at nodes that are not zero, since most loads act on surfaces only.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(bound = "[f64; D]: Plain")]
pub struct NodalForces<const D: usize> {
    /// Nodes of the forces, sorted, each once.
    nodes: Vec<u32>,
    forces: Vec<[f64; D]>,
}

impl<const D: usize> NodalForces<D> {
    /// Collect the forces at the sorted `nodes`, with `D` components each.
    pub fn new(nodes: impl Iterator<Item = u32>, forces: &[f64]) -> Self {
        let forces = forces.chunks_exact(D).map(|force| std::array::from_fn(|c| force[c]));
        let (nodes, forces) = nodes.zip(forces).filter(|(_, force): &(u32, [f64; D])| *force != [0.0; D]).unzip();
        Self { nodes, forces }
    }

    /// Return the nodes and their forces.
    pub fn iter(&self) -> impl Iterator<Item = (u32, [f64; D])> {
        self.nodes.iter().copied().zip(self.forces.iter().copied())
    }

    /// Return the sum of these and other forces.
    #[must_use]
    pub fn and(self, others: Self) -> Self {
        if self.nodes.is_empty() || others.nodes.is_empty() {
            return if self.nodes.is_empty() { others } else { self };
        }
        // At each node the force of `self` is added first.
        self.iter().chain(others.iter()).collect()
    }

    /// Return the forces at the nodes for which `keep` holds.
    #[must_use]
    pub fn only(&self, keep: impl Fn(u32) -> bool) -> Self {
        let (nodes, forces) = self.iter().filter(|(node, _)| keep(*node)).unzip();
        Self { nodes, forces }
    }

    /// Return the resultant of the forces.
    pub fn sum(&self) -> [f64; 3] {
        std::array::from_fn(|c| self.forces.iter().map(|&force| pad(force)[c]).collect::<Total>().value())
    }

    /// Return the work of the forces on a displacement, and the largest work of forces and displacements of these sizes at each
    /// node. `at` gives the displacement of a node.
    pub fn works(&self, at: impl Fn(u32) -> [f64; D]) -> [f64; 2] {
        let [mut work, mut largest] = [Total::default(); 2];
        for (node, force) in self.iter() {
            let u = at(node);
            work.add(dot(&u, &force));
            largest.add(length(u) * length(force));
        }
        [work.value(), largest.value()]
    }

    /// Return the forces at all dofs of a body with so many nodes.
    pub fn all(&self, nodes: usize) -> Vec<f64> {
        let mut all = vec![0.0; D * nodes];
        self.iter().for_each(|(node, force)| all[D * node as usize..][..D].copy_from_slice(&force));
        all
    }

    /// Return the forces at the sorted `nodes`, renumbered by their positions in this slice.
    #[must_use]
    pub fn on(&self, nodes: &[u32]) -> Self {
        let (nodes, forces) = self.iter().filter_map(|(node, force)| Some((place(nodes, node)?, force))).unzip();
        Self { nodes, forces }
    }

    /// Return whether all forces are finite.
    pub fn is_finite(&self) -> bool {
        self.forces.as_flattened().iter().all(|f| f.is_finite())
    }
}

impl<const D: usize> FromIterator<(u32, [f64; D])> for NodalForces<D> {
    /// Collect forces at nodes in any order. The forces at one node are added in their order.
    fn from_iter<I: IntoIterator<Item = (u32, [f64; D])>>(forces: I) -> Self {
        let mut all: Vec<(u32, [f64; D])> = forces.into_iter().collect();
        all.sort_by_key(|entry| entry.0);
        let sum = |at: &[(u32, [f64; D])]| {
            (at[0].0, at[1..].iter().fold(at[0].1, |sum, (_, force)| std::array::from_fn(|c| sum[c] + force[c])))
        };
        let (nodes, forces) = all.chunk_by(|a, b| a.0 == b.0).map(sum).unzip();
        Self { nodes, forces }
    }
}
