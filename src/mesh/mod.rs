//! Simplicial meshes with named groups, from Gmsh.

use crate::scene::Order;
use std::path::PathBuf;

/// A mesh: points and named groups of simplices.
///
/// Groups are Gmsh's physical groups. Cells are groups of dimension `D`; surfaces, edges and points have lower
/// dimension. Local numbering is VTK's: vertices first, then for `Order::P2` mid-edges in the order
/// `01` (line), `01 12 02` (triangle), `01 12 02 03 13 23` (tetrahedron).
#[derive(Debug, Clone)]
pub struct Mesh<const D: usize> {
    /// The file that was read, for messages.
    pub path: PathBuf,
    /// Coordinates of the points, only those that some group uses.
    pub points: Vec<[f64; D]>,
    /// Order of all elements (points have none).
    pub order: Order,
    /// Named groups.
    pub groups: Vec<Group>,
}

/// A named group of simplices of one dimension.
#[derive(Debug, Clone)]
pub struct Group {
    /// Name of the physical group.
    pub name: String,
    /// Dimension of its simplices: 0 points, 1 lines, 2 triangles, 3 tetrahedra.
    pub dimension: usize,
    /// Points per simplex.
    pub stride: usize,
    /// Point numbers, `stride` per simplex.
    pub connectivity: Vec<u32>,
}
