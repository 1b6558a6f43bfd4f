//! The finite element space of one body: its nodes and cells, numbered within the body.

use super::{Slope, cross, element, minus, pad};
use crate::exchange::Plain;
use crate::linalg::dot;
use crate::mesh::{Group, Mesh, Numbering, datum};
use crate::problem::order::Order;
use serde::{Deserialize, Serialize};
use std::cell::OnceCell;
use std::collections::HashSet;

/// Share of the largest radius up to which a node lies on the axis of a body of revolution.
const ON_AXIS: f64 = 1e-10;

/// The nodes and cells of one body. Nodes are numbered in order of first appearance in the cells, so that neighbours in the mesh
/// file stay neighbours in memory.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(bound = "[f64; D]: Plain")]
pub struct Space<const D: usize> {
    /// Polynomial order.
    pub order: Order,
    /// Coordinates of the nodes, measured from `datum`.
    pub nodes: Vec<[f64; D]>,
    /// The point of the scene from which coordinates are measured; see [`Mesh::datum`].
    pub datum: [f64; D],
    /// Nodes per cell.
    pub stride: usize,
    /// Nodes of the cells, `stride` per cell, numbered within the body in the local order of [`element`].
    pub cells: Vec<u32>,
    /// Whether this is the meridian of a body of revolution, where x is the radius and y runs along the axis.
    pub axisymmetric: bool,
    /// Body node of each mesh point; unknown in a part of a body.
    #[serde(skip)]
    from_mesh: Numbering,
    /// Area (volume) of all cells, once it has been requested.
    #[serde(skip)]
    measure: OnceCell<f64>,
}

impl<const D: usize> Space<D> {
    /// Make the space of `order` on the cells of `group` (of dimension `D`). The order of the mesh is at least `order`.
    pub fn new(mesh: &Mesh<D>, group: &Group, order: Order) -> Self {
        let stride = element::node_count(D + 1, order);
        let corners = group.connectivity.chunks_exact(group.stride).flat_map(|cell| &cell[..stride]).copied();
        let mut space = Space {
            order,
            nodes: Vec::new(),
            datum: mesh.datum,
            stride,
            cells: Vec::with_capacity(group.connectivity.len() / group.stride * stride),
            axisymmetric: false,
            from_mesh: Numbering::new(corners.clone()),
            measure: OnceCell::new(),
        };
        for point in corners {
            let (node, is_new) = space.from_mesh.number(point, space.nodes.len() as u32);
            if is_new {
                space.nodes.push(mesh.points[point as usize]);
            }
            space.cells.push(node);
        }
        space
    }

    /// Return the space of some cells, in this order, and its nodes as numbered here, sorted. They are renumbered in the same order.
    /// The part has no link to points of the mesh.
    pub fn part(&self, cells: impl Iterator<Item = usize>) -> (Self, Vec<u32>) {
        let cells = cells.flat_map(|cell| self.cell(cell));
        let cells: Vec<u32> = cells.copied().collect();
        let nodes = Self::among(cells.iter().copied());
        (self.on(&cells, &nodes), nodes)
    }

    /// Return the nodes of some cells, one after the other.
    pub fn corners(&self, cells: &[usize]) -> Vec<u32> {
        cells.iter().flat_map(|&cell| &self.cells[cell * self.stride..][..self.stride]).copied().collect()
    }

    /// Return these nodes sorted, each once.
    pub fn among(nodes: impl Iterator<Item = u32> + Clone) -> Vec<u32> {
        Numbering::in_order(nodes).points().collect()
    }

    /// Return the space of cells with nodes in the sorted slice `nodes`, which are renumbered by their positions there. The part has
    /// no link to points of the mesh.
    pub fn on(&self, cells: &[u32], nodes: &[u32]) -> Self {
        let number = Numbering::in_order(nodes.iter().copied());
        Space {
            nodes: nodes.iter().map(|&node| self.nodes[node as usize]).collect(),
            cells: cells.iter().filter_map(|&node| number.get(node)).collect(),
            from_mesh: Numbering::default(),
            measure: OnceCell::new(),
            ..*self
        }
    }

    /// Turn the space into the meridian of a body of revolution. A radius that is rounding of the largest one becomes zero.
    pub fn revolved(mut self) -> Self {
        let largest = self.nodes.iter().fold(0.0, |max: f64, x| max.max(x[0].abs()));
        self.nodes.iter_mut().filter(|x| x[0].abs() <= ON_AXIS * largest).for_each(|x| x[0] = 0.0);
        self.axisymmetric = true;
        self
    }

    /// Return the length 2 pi r of the circle through a point of a meridian; 1 in other bodies. It is a factor of integrals over cells
    /// and facets.
    pub fn circle(&self, at: &[f64; D]) -> f64 {
        if self.axisymmetric { std::f64::consts::TAU * at[0] } else { 1.0 }
    }

    /// Return the strain u_r/r of the circle through a point off the axis; zero in bodies that are not of revolution.
    pub fn hoop(&self, at: &[f64; D], radial: f64) -> f64 {
        if self.axisymmetric { radial / at[0] } else { 0.0 }
    }

    /// Return whether a node lies on the axis of a body of revolution.
    pub fn on_axis(&self, node: u32) -> bool {
        self.axisymmetric && self.nodes[node as usize][0] == 0.0
    }

    /// Return the contribution of a nodal force to the resultant. In a body of revolution it acts on a circle, so radial forces cancel.
    pub fn net_force(&self, force: [f64; D]) -> [f64; 3] {
        let mut net = pad(force);
        if self.axisymmetric {
            net[0] = 0.0;
        }
        net
    }

    /// Return the coordinates (x, y, z) of a point in the scene.
    pub fn in_scene(&self, x: [f64; D]) -> [f64; 3] {
        pad(datum::in_scene(&self.datum, x))
    }

    /// Return the contribution of a nodal force to the moment about the datum, which is zero in a body of revolution.
    pub fn net_moment(&self, node: u32, force: [f64; D]) -> [f64; 3] {
        let (x, f) = (pad(self.nodes[node as usize]), pad(force));
        if self.axisymmetric { [0.0; 3] } else { cross(x, f) }
    }

    /// Return the number of degrees of freedom.
    pub fn dofs(&self) -> usize {
        D * self.nodes.len()
    }

    /// Return the number of cells.
    pub fn cell_count(&self) -> usize {
        self.cells.len() / self.stride
    }

    /// Return the nodes of cell `i`, in the local order of [`element`].
    pub fn cell(&self, i: usize) -> &[u32] {
        &self.cells[i * self.stride..(i + 1) * self.stride]
    }

    /// Return the area (volume) of all cells from their corners. In a body of revolution it is the area of the meridian.
    pub fn measure(&self) -> f64 {
        *self.measure.get_or_init(|| (0..self.cell_count()).map(|i| self.cell_measure(i)).sum())
    }

    /// Return the points of the mesh that are nodes of the body, in the order of the mesh.
    pub fn mesh_points(&self) -> impl Iterator<Item = u32> {
        self.from_mesh.points()
    }

    /// Return the contribution of a cell to the measure of the body, from its corners. In a body of revolution it is the volume of a
    /// ring.
    pub fn share(&self, i: usize) -> f64 {
        self.cell_measure(i) * self.circle(&self.centroid(i))
    }

    /// Return the area (volume) of cell `i` from its corners.
    pub fn cell_measure(&self, i: usize) -> f64 {
        let x = self.cell_nodes(i);
        let edge = |j: usize| pad(minus(x[j], x[0]));
        let normal = cross(edge(1), edge(2));
        if D == 2 { 0.5 * normal[2].abs() } else { dot(&normal, &edge(3)).abs() / 6.0 }
    }

    /// Return the gradient of a displacement `u`, one entry a dof, in a cell with these nodes at the point `at`. The shape functions of
    /// the cell have the values `phi` and these gradients there.
    pub fn slope(&self, cell: &[u32], at: &[f64; D], phi: &[f64], gradient: &[[f64; D]], u: &[f64]) -> Slope<D> {
        let mut h = [[0.0; D]; D];
        for (&node, gradient) in cell.iter().zip(gradient) {
            for i in 0..D {
                for j in 0..D {
                    h[i][j] += u[D * node as usize + i] * gradient[j];
                }
            }
        }
        let radial = || cell.iter().zip(phi).map(|(&node, phi)| phi * u[D * node as usize]).sum::<f64>();
        let hoop = match self.axisymmetric {
            false => 0.0,
            // On the axis this is the limit of u_r/r.
            true if at[0] == 0.0 => h[0][0],
            true => radial() / at[0],
        };
        Slope { h, hoop }
    }

    /// Return the mean of the corners of cell `i`.
    pub fn centroid(&self, i: usize) -> [f64; D] {
        let corners = &self.cell(i)[..=D];
        std::array::from_fn(|c| corners.iter().map(|&node| self.nodes[node as usize][c]).sum::<f64>() / (D + 1) as f64)
    }

    /// Return the indices of the body's cells that are in a mesh group of dimension `D`.
    pub fn cells_in(&self, group: &Group) -> Vec<usize> {
        let sorted = |nodes: &[u32]| {
            let mut key = nodes[..=D].to_vec();
            key.sort_unstable();
            key
        };
        let wanted: HashSet<Vec<u32>> = group
            .connectivity
            .chunks_exact(group.stride)
            .filter_map(|points| self.simplex(points, D))
            .map(|nodes| sorted(&nodes))
            .collect();
        let cells = self.cells.chunks_exact(self.stride).enumerate();
        cells.filter(|(_, cell)| wanted.contains(&sorted(cell))).map(|(index, _)| index).collect()
    }

    /// Return the coordinates of the nodes of cell `i`.
    pub fn cell_nodes(&self, i: usize) -> Vec<[f64; D]> {
        self.cell(i).iter().map(|&node| self.nodes[node as usize]).collect()
    }

    /// Return the body's nodes of one simplex of a mesh group (vertices, then mid-edges for a quadratic space), or `None` if it is
    /// not part of this body.
    pub(super) fn simplex(&self, points: &[u32], dimension: usize) -> Option<Vec<u32>> {
        let vertices = dimension + 1;
        let wanted = element::node_count(vertices, self.order);
        let mut nodes = Vec::with_capacity(wanted);
        for &point in &points[..wanted] {
            nodes.push(self.from_mesh.get(point)?);
        }
        Some(nodes)
    }

    /// Return all body nodes on a mesh group of any dimension, sorted. The result is empty if the group does not touch the body.
    pub fn nodes_on(&self, group: &Group) -> Vec<u32> {
        let mut nodes: Vec<u32> = group
            .connectivity
            .chunks_exact(group.stride)
            .filter_map(|points| self.simplex(points, group.dimension))
            .flatten()
            .collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }
}
