//! The cells of one body, their nodes numbered within it.

use crate::error::Error;
use crate::mesh::{Group, Mesh};
use crate::problem::order::Order;

/// Mid-edge nodes of a simplex stand behind its corners in the order of these edges.
const EDGES: [[usize; 2]; 6] = [[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]];

/// No node of the body.
pub const NONE: u32 = u32::MAX;

/// The cells of one body.
pub struct Cells<'a, const D: usize> {
    mesh: &'a Mesh<D>,
    group: &'a Group,
    /// Nodes per cell: corners, then mid-edge nodes if its elements are quadratic.
    pub stride: usize,
    /// Point of the mesh of each node.
    pub points: Vec<u32>,
    /// Nodes of all cells.
    nodes: Vec<u32>,
}

impl<'a, const D: usize> Cells<'a, D> {
    /// Numbers the nodes of a body with elements of an order. `node` is [`NONE`] for every point of the mesh before, and has
    /// the nodes of the body after.
    pub fn new(mesh: &'a Mesh<D>, group: &'a Group, order: Order, node: &mut [u32]) -> Self {
        let stride = if order == Order::P1 { D + 1 } else { group.stride };
        let mut points = Vec::new();
        let mut number = |&point: &u32| {
            let node = &mut node[point as usize];
            if *node == NONE {
                *node = points.len() as u32;
                points.push(point);
            }
            *node
        };
        let nodes = group.simplices().flat_map(|cell| &cell[..stride]).map(&mut number).collect();
        Self { mesh, group, stride, points, nodes }
    }

    /// Number of cells.
    pub fn count(&self) -> usize {
        self.group.len()
    }

    /// Whether edges have nodes between their ends.
    pub fn is_quadratic(&self) -> bool {
        self.stride > D + 1
    }

    /// Nodes of a cell.
    pub fn cell(&self, cell: usize) -> &[u32] {
        &self.nodes[cell * self.stride..][..self.stride]
    }

    /// Coordinates of a node, z = 0 in the plane.
    pub fn at(&self, node: u32) -> [f64; 3] {
        let x = &self.mesh.points[self.points[node as usize] as usize];
        std::array::from_fn(|c| x.get(c).copied().unwrap_or(0.0))
    }

    /// The mid-edge node of a cell between two of its corners.
    pub fn middle(&self, cell: usize, ends: [usize; 2]) -> u32 {
        let ends = [ends[0].min(ends[1]), ends[0].max(ends[1])];
        self.cell(cell)[D + 1 + EDGES.iter().position(|edge| *edge == ends).unwrap_or(0)]
    }

    /// The refusal of the body for what is the matter with some of its cells, at a point.
    pub fn refuse(&self, what: &str, cells: &[usize], at: [f64; 3]) -> Error {
        let place = &at[..D].iter().map(|x| x.to_string()).collect::<Vec<_>>().join(", ");
        let error = Error::mesh(&self.mesh.path, None, format!("body `{}`: {what} at ({place})", self.group.name));
        let tags: Vec<String> =
            cells.iter().filter_map(|&cell| self.group.tags.get(cell)).map(u64::to_string).collect();
        match &tags[..] {
            [] => error,
            [one] => error.because(format!("it is element {one} of the mesh file")),
            _ => error.because(format!("they are elements {} of the mesh file", tags.join(" and "))),
        }
    }
}
