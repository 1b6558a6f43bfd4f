//! The cells of one body, with nodes numbered within the body.

use crate::error::Error;
use crate::linalg::pad;
use crate::mesh::{Group, Mesh};

/// Edges of a simplex in the order of its mid-edge nodes, which follow the corners.
pub const EDGES: [[usize; 2]; 6] = [[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]];

/// The entry of a point that is not a node of the body.
pub const NONE: u32 = u32::MAX;

/// The cells of one body.
#[derive(Clone)]
pub struct Cells<'a, const D: usize> {
    mesh: &'a Mesh<D>,
    /// The group of the body.
    group: &'a Group,
    /// Nodes per cell: corners, then mid-edge nodes if its elements are quadratic.
    pub stride: usize,
    /// Point of the mesh of each node.
    pub points: Vec<u32>,
    /// Nodes of all cells, `stride` per cell.
    nodes: Vec<u32>,
}

impl<'a, const D: usize> Cells<'a, D> {
    /// Number the nodes of the body of this group, `stride` per cell, in order of first appearance in the cells. `node` holds
    /// [`NONE`] for every point before, and the nodes of the body's points afterwards.
    pub fn new(mesh: &'a Mesh<D>, group: &'a Group, stride: usize, node: &mut [u32]) -> Self {
        let (mut points, mut nodes) = (Vec::new(), Vec::with_capacity(group.len() * stride));
        for &point in group.simplices().flat_map(|cell| &cell[..stride]) {
            let node = &mut node[point as usize];
            if *node == NONE {
                *node = points.len() as u32;
                points.push(point);
            }
            nodes.push(*node);
        }
        Self { mesh, group, stride, points, nodes }
    }

    /// Return the number of nodes.
    pub fn node_count(&self) -> usize {
        self.points.len()
    }

    /// Return the number of cells.
    pub fn count(&self) -> usize {
        self.nodes.len() / self.stride
    }

    /// Return whether edges have nodes between their ends.
    pub fn is_quadratic(&self) -> bool {
        self.stride > D + 1
    }

    /// Return the nodes of a cell.
    pub fn cell(&self, cell: usize) -> &[u32] {
        &self.nodes[cell * self.stride..][..self.stride]
    }

    /// Return the coordinates (x, y, z) of a node, z = 0 in the plane.
    pub fn at(&self, node: u32) -> [f64; 3] {
        pad(self.mesh.points[self.points[node as usize] as usize])
    }

    /// Return the mid-edge node of a cell between two of its corners.
    pub fn middle(&self, cell: usize, ends: [usize; 2]) -> u32 {
        let ends = [ends[0].min(ends[1]), ends[0].max(ends[1])];
        self.cell(cell)[D + 1 + EDGES.iter().position(|edge| *edge == ends).unwrap_or(0)]
    }

    /// Return the refusal of the body because of `what` is wrong with some of its cells, at the point `at`.
    pub fn refuse(&self, what: &str, cells: &[usize], at: [f64; 3]) -> Error {
        let mesh = self.mesh;
        let at = mesh.in_scene(std::array::from_fn(|c| at[c]));
        let place = at[..D].iter().map(|x| x.to_string()).collect::<Vec<_>>().join(", ");
        let error = Error::mesh(&mesh.path, None, format!("body `{}`: {what} at ({place})", self.group.name));
        let tags: Vec<String> =
            cells.iter().filter_map(|&cell| self.group.tags.get(cell)).map(u64::to_string).collect();
        match &tags[..] {
            [] => error,
            [one] => error.because(format!("it is element {one} of the mesh file")),
            _ => error.because(format!("they are elements {} of the mesh file", tags.join(" and "))),
        }
    }
}
