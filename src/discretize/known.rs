//! What all ranks know of a body of whose cells each has some.
//!
//! Nodes, surfaces, supports and loads are known everywhere, so that every rank finds the same contact points, rigid motions and
//! numbers; cells go, once dofs are dealt out, to the ranks that assemble their nodes ([`cells`](super::cells)).

use super::approach::Outer;
use crate::fem::{Facets, Space, place};

/// What all ranks know of a body.
#[derive(Debug, Clone, Default)]
pub struct Known {
    /// Nodes of the cells that are here, sorted, and the number of each among the points of the mesh.
    pub points: Vec<(u32, u32)>,
    /// Number of cells.
    pub cells: usize,
    /// Area (volume) of the body; of one of revolution that of the rings.
    pub volume: f64,
    /// Means of the moduli along x, y, z over it ([`moduli`](super::elastic::moduli)).
    pub moduli: [f64; 3],
    /// Nodal forces of the body force; empty without one.
    pub force: Vec<f64>,
    /// The corners of cells, of a body whose elements are quadratic.
    pub corners: Vec<u32>,
    /// Nodes of all facets of the boundary, oriented outwards, where contacts are to be found.
    pub boundary: Vec<u32>,
    /// Area (volume) of the cells by their corners.
    pub measure: f64,
    /// Where it is loaded and held.
    pub outer: Outer,
}

impl Known {
    /// The same of some nodes, sorted, by their places among these; boundaries and loads are no longer asked for.
    pub fn on(&self, nodes: &[u32]) -> Self {
        Self {
            points: self.points.iter().filter_map(|&(node, point)| Some((place(nodes, node)?, point))).collect(),
            corners: self.corners.iter().filter_map(|&node| place(nodes, node)).collect(),
            outer: self.outer.on(nodes),
            force: Vec::new(),
            boundary: Vec::new(),
            ..*self
        }
    }

    /// The number of a node of the cells that are here among the points of the mesh.
    pub fn point(&self, node: u32) -> Option<u32> {
        self.points.binary_search_by_key(&node, |entry| entry.0).ok().map(|place| self.points[place].1)
    }

    /// All facets of the boundary, if they were wanted.
    pub fn boundary<const D: usize>(&self, space: &Space<D>) -> Facets<D> {
        Facets::new(space.order, self.boundary.clone())
    }
}
