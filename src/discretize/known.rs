//! What all ranks know of a body whose cells the first rank alone has read.
//!
//! Nodes, surfaces, supports and loads are known everywhere, so that every rank finds the same contact points, rigid motions and
//! numbers; cells go, once dofs are dealt out, to the ranks that assemble their nodes ([`cells`](super::cells)).

use super::approach::Outer;
use crate::fem::{Facets, Space};
use crate::mesh::Mesh;
use crate::problem::body::BodySpec;
use crate::problem::elasticity::Plane;
use serde::{Deserialize, Serialize};

/// What all ranks know of a body.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Known {
    /// Point of the mesh of each node.
    pub points: Vec<u32>,
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
    /// Nodes of the cells behind surfaces, which say which side of a facet is out; none where one rank has all cells.
    pub behind: Vec<u32>,
    /// Area (volume) of the cells by their corners.
    pub measure: f64,
    /// Where it is loaded and held.
    pub outer: Outer,
}

impl Known {
    /// The space of a body on a rank that has not read its cells: with those behind surfaces.
    pub fn space<const D: usize>(&self, spec: &BodySpec, mesh: &Mesh<D>, plane: Plane) -> Space<D> {
        let space = Space::of_points(mesh, &self.points, spec.order, self.behind.clone(), self.measure);
        if plane == Plane::Axisymmetric { space.revolved() } else { space }
    }

    /// All facets of the boundary, if they were wanted.
    pub fn boundary<const D: usize>(&self, space: &Space<D>) -> Facets<D> {
        Facets::new(space.order, self.boundary.clone())
    }
}
