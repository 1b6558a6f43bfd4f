//! What all ranks know of a body of whose cells each has some.
//!
//! Nodes, surfaces, supports and loads are known everywhere, so that every rank finds the same contact points, rigid motions and
//! numbers; cells go, once dofs are dealt out, to the ranks that assemble their nodes ([`cells`](super::cells)).

use super::approach::Outer;
use crate::fem::{Extent, Facets, NodalForces, Space, place};

/// What all ranks know of a body.
#[derive(Debug, Clone, Default)]
pub struct Known<const D: usize> {
    /// Nodes of the cells that are here, sorted, and the number of each among the points of the mesh.
    pub points: Vec<(u32, u32)>,
    /// Nodes that are points of this rank, sorted: each is one of one rank.
    pub own: Vec<u32>,
    /// How many nodes it has, and where.
    pub extent: Extent,
    /// Number of cells.
    pub cells: usize,
    /// Area (volume) of the body; of one of revolution that of the rings.
    pub volume: f64,
    /// Means of the moduli along x, y, z over it ([`moduli`](super::elastic::moduli)).
    pub moduli: [f64; 3],
    /// Forces of the body force at own nodes.
    pub force: NodalForces<D>,
    /// Nodes of all facets of the boundary, oriented outwards, where contacts are to be found.
    pub boundary: Vec<u32>,
    /// Area (volume) of the cells by their corners.
    pub measure: f64,
    /// Where it is loaded and held.
    pub outer: Outer,
}

impl<const D: usize> Known<D> {
    /// The same of some nodes, sorted, by their places among these; boundaries and loads are no longer asked for.
    pub fn on(&self, nodes: &[u32]) -> Self {
        Self {
            points: self.points.iter().filter_map(|&(node, point)| Some((place(nodes, node)?, point))).collect(),
            outer: self.outer.on(nodes),
            own: Vec::new(),
            force: NodalForces::default(),
            boundary: Vec::new(),
            ..*self
        }
    }

    /// Whether a node is a point of this rank.
    pub fn is_own(&self, node: u32) -> bool {
        self.own.binary_search(&node).is_ok()
    }

    /// The number of a node of the cells that are here among the points of the mesh.
    pub fn point(&self, node: u32) -> Option<u32> {
        self.points.binary_search_by_key(&node, |entry| entry.0).ok().map(|place| self.points[place].1)
    }

    /// All facets of the boundary, if they were wanted.
    pub fn boundary(&self, space: &Space<D>) -> Facets<D> {
        Facets::new(space.order, self.boundary.clone())
    }
}
