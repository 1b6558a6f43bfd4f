//! The finite element space of one body: its nodes and cells, numbered within the body, and displacements at points of
//! cells.

use super::element::{self, Gradients, Rule, Slopes, Values};
use super::{cross, lagrange, minus, pad};
use crate::exchange::Plain;
use crate::linalg::dot;
use crate::mesh::{self, Group, Mesh, Numbering, datum};
use crate::problem::order::Order;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::cell::OnceCell;
use std::collections::HashSet;

/// The nodes and cells of one body. Nodes are numbered in order of first appearance in the cells, so that neighbours in
/// the mesh file stay neighbours in memory.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(bound = "[f64; D]: Plain")]
pub struct Space<const D: usize> {
    /// Polynomial order.
    pub order: Order,
    /// Coordinates of the nodes, measured from `datum`.
    pub nodes: Vec<[f64; D]>,
    /// The point of the scene from which coordinates are measured; see [`Mesh::datum`].
    pub datum: [f64; D],
    /// See [`Mesh::uncertainty`].
    pub uncertainty: f64,
    /// Nodes per cell.
    pub stride: usize,
    /// Nodes of the cells, `stride` per cell, numbered within the body in the local order of [`element`].
    pub cells: Vec<u32>,
    /// Whether this is the meridian of a body of revolution, where x is the radius and y runs along the axis.
    pub axisymmetric: bool,
    /// Body node of each vertex of the mesh; unknown in a part of a body.
    #[serde(skip)]
    from_mesh: Numbering,
    /// First of the nodes inside each edge for the [point](edge_point) of the mesh that stands for the edge. They lie
    /// in the direction from the end with the lower number in the mesh to the other one.
    #[serde(skip)]
    edges: Numbering,
    /// Area (volume) of all cells, once it has been requested.
    #[serde(skip)]
    measure: OnceCell<f64>,
}

impl<const D: usize> Space<D> {
    /// Make the space of `order` on the cells of `group` (of dimension `D`). The mesh is not linear unless `order` is
    /// 1.
    ///
    /// Vertices are points of the mesh, and other nodes lie on the map of the cell.
    pub fn new(mesh: &Mesh<D>, group: &Group, order: Order) -> Self {
        let stride = element::node_count(D + 1, order);
        let cells = || group.connectivity.chunks_exact(group.stride);
        let edges = || cells().filter(move |_| order > Order::P1).flat_map(|cell| mesh::edges(cell, D));
        let mut space = Space {
            order,
            nodes: Vec::new(),
            datum: mesh.datum,
            uncertainty: mesh.uncertainty,
            stride,
            cells: Vec::with_capacity(group.connectivity.len() / group.stride * stride),
            axisymmetric: false,
            from_mesh: Numbering::new(cells().flat_map(|cell| &cell[..=D]).copied()),
            edges: Numbering::new(edges().map(|(_, inside)| edge_point(inside))),
            measure: OnceCell::new(),
        };
        let places = (D + 1..stride).map(|node| element::place(order, D + 1, node));
        let weights: Vec<Vec<f64>> = places.map(|l| mesh::weights(mesh.order, &l[..=D])).collect();
        cells().for_each(|cell| space.add_cell(mesh, cell, &weights));
        space
    }

    /// Add the nodes of a cell of the mesh. Those that are no vertices have these `weights` of its points.
    fn add_cell(&mut self, mesh: &Mesh<D>, cell: &[u32], weights: &[Vec<f64>]) {
        let at = |point: &u32| mesh.points[*point as usize];
        for point in &cell[..=D] {
            let (node, is_new) = self.from_mesh.number(*point, self.nodes.len() as u32);
            if is_new {
                self.nodes.push(at(point));
            }
            self.cells.push(node);
        }
        if self.order == Order::P1 {
            return;
        }
        let x: Vec<[f64; D]> = cell.iter().map(at).collect();
        let place = |local: usize| element::interpolate(&x, &weights[local - D - 1]);
        let count = self.order.degree() as u32 - 1;
        for ([i, j], inside) in mesh::edges(cell, D) {
            let is_forward = cell[i] < cell[j];
            let (first, is_new) = self.edges.number(edge_point(inside), self.nodes.len() as u32);
            if is_new {
                let ends = if is_forward { [i, j] } else { [j, i] };
                self.nodes.extend(element::inside_edge(self.order, D + 1, ends).map(place));
            }
            self.cells.extend((0..count).map(|k| first + if is_forward { k } else { count - 1 - k }));
        }
        for local in D + 1 + D * (D + 1) / 2 * count as usize..self.stride {
            self.cells.push(self.nodes.len() as u32);
            self.nodes.push(place(local));
        }
    }

    /// Return the space of some cells, in this order, and its nodes as numbered here, sorted. They are renumbered in
    /// the same order. The part has no link to points of the mesh.
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

    /// Return the space of cells with nodes in the sorted slice `nodes`, which are renumbered by their positions there.
    /// The part has no link to points of the mesh.
    pub fn on(&self, cells: &[u32], nodes: &[u32]) -> Self {
        let number = Numbering::in_order(nodes.iter().copied());
        let own = nodes.iter().map(|&node| self.nodes[node as usize]).collect();
        self.with(own, cells.iter().filter_map(|&node| number.get(node)).collect())
    }

    /// Return the space with other nodes and cells, which has no link to points of the mesh.
    pub fn with(&self, nodes: Vec<[f64; D]>, cells: Vec<u32>) -> Self {
        let none = Numbering::default;
        Space { nodes, cells, from_mesh: none(), edges: none(), measure: OnceCell::new(), ..*self }
    }

    /// Turn the space into the meridian of a body of revolution.
    pub fn revolved(mut self) -> Self {
        self.axisymmetric = true;
        self
    }

    /// Return the length 2 pi r of the circle through a point of a meridian; 1 in other bodies. It is a factor of
    /// integrals over cells and facets.
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

    /// Return the contribution of a nodal force to the resultant. In a body of revolution it acts on a circle, so
    /// radial forces cancel.
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

    /// Return the area (volume) of all cells from their corners. In a body of revolution it is the area of the
    /// meridian.
    pub fn measure(&self) -> f64 {
        *self.measure.get_or_init(|| (0..self.cell_count()).map(|i| self.cell_measure(i)).sum())
    }

    /// Return the points of the mesh on the cells of the body.
    pub fn mesh_points(&self) -> impl Iterator<Item = u32> {
        self.from_mesh.points().chain(self.edges.points())
    }

    /// Return the point of a mesh of some order that each node is, or `u32::MAX` for those on maps of its cells.
    pub fn points_of_nodes(&self, mesh: Order) -> Vec<u32> {
        let mut points = vec![u32::MAX; self.nodes.len()];
        let middles = (self.order.max(mesh) == Order::P2).then_some(&self.edges);
        for numbering in [&self.from_mesh].into_iter().chain(middles) {
            numbering.points().for_each(|at| numbering.get(at).into_iter().for_each(|node| points[node as usize] = at));
        }
        points
    }

    /// Return the contribution of a cell to the measure of the body, from its corners. In a body of revolution it is
    /// the volume of a ring.
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

    /// Return the point with barycentric coordinates `l` in cell `i`, whose nodes have the coordinates `x`. Its
    /// `weight` in an integral over the body is that of a quadrature point with this `weight`. The result is `None` if
    /// the map of the cell is singular or inverted there.
    pub fn point<'a>(&'a self, i: usize, x: &[[f64; D]], l: &'a [f64], weight: f64) -> Option<CellPoint<'a, D>> {
        let shape = (element::values(self.order, l), element::derivatives(self.order, l));
        self.point_of(i, x, l, weight, Cow::Owned(shape))
    }

    /// Return the point of a cell as [`Space::point`] does, with the values and derivatives of the shape functions
    /// there.
    fn point_of<'a>(
        &'a self,
        i: usize,
        x: &[[f64; D]],
        l: &'a [f64],
        weight: f64,
        shape: Cow<'_, (Values, Slopes)>,
    ) -> Option<CellPoint<'a, D>> {
        let (gradient, measure) = element::gradients(x, &shape.1)?;
        let phi = match shape {
            Cow::Owned((phi, _)) => phi,
            Cow::Borrowed((phi, _)) => phi.clone(),
        };
        let at = element::interpolate(x, &phi);
        let weight = weight * measure * self.circle(&at);
        Some(CellPoint { space: self, cell: self.cell(i), l, at, phi, gradient, measure, weight })
    }

    /// Return the points of a quadrature rule in cell `i`; `None` for those where the map of the cell is singular or
    /// inverted.
    pub fn points<'a>(&'a self, i: usize, rule: &'a Rule) -> impl Iterator<Item = Option<CellPoint<'a, D>>> {
        let x = self.cell_nodes(i);
        let shape = |k: usize| rule.shape(k, self.order);
        rule.iter().enumerate().map(move |(k, (l, weight))| self.point_of(i, &x, l, weight, shape(k)))
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

    /// Return whether the edges of cell `i` are straight.
    pub fn is_straight(&self, i: usize) -> bool {
        self.order == Order::P1 || element::is_straight(self.order, &self.cell_nodes(i), D + 1)
    }

    /// Return the coordinates of the nodes of cell `i`.
    pub fn cell_nodes(&self, i: usize) -> Vec<[f64; D]> {
        self.cell(i).iter().map(|&node| self.nodes[node as usize]).collect()
    }

    /// Return the body's nodes of one simplex of a mesh group, or `None` if it is not part of this body: vertices, then
    /// those on edges, which are not sorted above order two. Nodes inside the simplex are left out.
    pub(super) fn simplex(&self, points: &[u32], dimension: usize) -> Option<Vec<u32>> {
        let vertices = points[..=dimension].iter().map(|&point| self.from_mesh.get(point));
        let mut nodes = vertices.collect::<Option<Vec<u32>>>()?;
        for (_, inside) in mesh::edges(points, dimension).filter(|_| self.order > Order::P1) {
            let first = self.edges.get(edge_point(inside))?;
            nodes.extend(first..first + self.order.degree() as u32 - 1);
        }
        Some(nodes)
    }

    /// Return all body nodes on a mesh group of any dimension, sorted. The result is empty if the group does not touch
    /// the body.
    pub fn nodes_on(&self, group: &Group) -> Vec<u32> {
        let mut nodes: Vec<u32> = match group.dimension {
            dimension if dimension == D => self.corners(&self.cells_in(group)),
            dimension => group
                .connectivity
                .chunks_exact(group.stride)
                .filter_map(|points| self.simplex(points, dimension))
                .flatten()
                .collect(),
        };
        if group.dimension == 0 {
            // a set of nodes holds the edges whose middles it has
            let firsts = group.connectivity.iter().filter_map(|&point| self.edges.get(point));
            nodes.extend(firsts.flat_map(|first| first..first + self.order.degree() as u32 - 1));
        }
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }
}

/// Return the point of the mesh that stands for the edge with these points inside: the middle of a quadratic one.
fn edge_point(inside: &[u32]) -> u32 {
    inside.iter().copied().min().unwrap_or_default()
}

/// A point of a cell, with the shape functions of the cell there.
pub struct CellPoint<'a, const D: usize> {
    space: &'a Space<D>,
    /// Nodes of the cell.
    pub cell: &'a [u32],
    /// Barycentric coordinates of the point.
    pub l: &'a [f64],
    /// The place of the point.
    pub at: [f64; D],
    /// Values of the shape functions.
    pub phi: Values,
    /// Gradients of the shape functions.
    pub gradient: Gradients<D>,
    /// Area (volume) of the affine simplex that has the Jacobian of the cell here.
    pub measure: f64,
    /// Weight of the point in an integral over the body.
    pub weight: f64,
}

impl<const D: usize> CellPoint<'_, D> {
    /// Return the order of the shape functions.
    pub fn order(&self) -> Order {
        self.space.order
    }

    /// Return the gradient here of a displacement `u`, one entry a dof.
    pub fn slope(&self, u: &[f64]) -> Slope<D> {
        let mut h = [[0.0; D]; D];
        for (&node, gradient) in self.cell.iter().zip(&self.gradient) {
            for i in 0..D {
                for j in 0..D {
                    h[i][j] += u[D * node as usize + i] * gradient[j];
                }
            }
        }
        let radial = || self.cell.iter().zip(&self.phi).map(|(&node, phi)| phi * u[D * node as usize]).sum::<f64>();
        let hoop = match self.space.axisymmetric {
            false => 0.0,
            // On the axis this is the limit of u_r/r.
            true if self.at[0] == 0.0 => h[0][0],
            true => radial() / self.at[0],
        };
        Slope { h, hoop }
    }

    /// Return a displacement `u`, one entry a dof, here.
    pub fn value(&self, u: &[f64]) -> [f64; D] {
        let at = |c| self.cell.iter().zip(&self.phi).map(|(&node, phi)| phi * u[D * node as usize + c]).sum();
        std::array::from_fn(at)
    }

    /// Return the force on node `a` of the cell of a stress (xx yy zz xy yz xz) per volume: its product with the
    /// gradient of the shape function of the node.
    pub fn force(&self, stress: &[f64; 6], a: usize) -> [f64; D] {
        let along = |c: usize| (0..D).map(|j| stress[component(c, j)] * self.gradient[a][j]).sum();
        let mut force = std::array::from_fn(along);
        force[0] += stress[2] * self.space.hoop(&self.at, self.phi[a]);
        force
    }

    /// Add `weight sigma : grad v` for the shape functions v of the cell to `sum`, one entry per dof.
    pub fn add_stress(&self, weight: f64, stress: &[f64; 6], sum: &mut [f64]) {
        for (a, &node) in self.cell.iter().enumerate() {
            let force = self.force(stress, a);
            (0..D).for_each(|c| sum[D * node as usize + c] += weight * force[c]);
        }
    }
}

/// Index pairs of the components xx yy zz xy yz xz of stress and strain, in the order of VTK.
pub const PAIRS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)];

/// Return the index of the component (i, j) of a symmetric tensor in [`PAIRS`].
pub fn component(i: usize, j: usize) -> usize {
    match (i.min(j), i.max(j)) {
        (i, j) if i == j => i,
        (0, 1) => 3,
        (1, _) => 4,
        _ => 5,
    }
}

/// The gradient of a displacement at a point.
///
/// In a body of revolution x is the radius r and y runs along the axis. The radial displacement u_r also stretches the
/// circle through the point, so that the third normal strain is u_r/r.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slope<const D: usize> {
    /// Derivatives du_i/dx_j.
    pub h: [[f64; D]; D],
    /// Strain u_r/r of the circle in a body of revolution, zero in others.
    pub hoop: f64,
}

impl<const D: usize> Slope<D> {
    /// The gradient of a constant displacement.
    pub const ZERO: Self = Self { h: [[0.0; D]; D], hoop: 0.0 };

    /// Add `factor` times another gradient.
    pub fn add(&mut self, factor: f64, other: &Self) {
        for (sum, term) in self.h.iter_mut().flatten().zip(other.h.iter().flatten()) {
            *sum += factor * term;
        }
        self.hoop += factor * other.hoop;
    }

    /// Return the strain (xx yy zz, and 2 eps of xy yz xz) (3). The strain of the circles is zz.
    pub fn strain(&self) -> [f64; 6] {
        let mut strain = strain(&self.h);
        strain[2] += self.hoop;
        strain
    }

    /// Return the sum of the squares of all entries.
    pub fn square(&self) -> f64 {
        self.h.as_flattened().iter().map(|h| h * h).sum::<f64>() + self.hoop * self.hoop
    }
}

/// Return the strain (xx yy zz, and 2 eps of xy yz xz) of a displacement gradient (3).
pub fn strain<const D: usize>(h: &[[f64; D]; D]) -> [f64; 6] {
    PAIRS.map(|(i, j)| match (i < D && j < D, i == j) {
        (false, _) => 0.0,
        (_, true) => h[i][i],
        _ => h[i][j] + h[j][i],
    })
}

/// Return, from values at the nodes of a space, those at equally spaced points in place of the nodes, with which files
/// are written. Up to order two they are the same.
pub fn at_equally_spaced<'v, const D: usize, const N: usize>(
    space: &Space<D>,
    values: Cow<'v, [[f64; N]]>,
) -> Cow<'v, [[f64; N]]> {
    if space.order <= Order::P2 {
        return values;
    }
    let places = lagrange::equally_spaced(space.order, D + 1);
    // rounding leaves the points of an edge on that edge
    let exact = |l: &[f64; 3]| -> element::Values {
        element::values(space.order, l).iter().map(|phi| if phi.abs() < 1e-12 { 0.0 } else { *phi }).collect()
    };
    let shapes: Vec<element::Values> = places.iter().map(exact).collect();
    let mut moved = values.to_vec();
    for cell in space.cells.chunks_exact(space.stride) {
        for (node, phi) in cell.iter().zip(&shapes).skip(D + 1) {
            let at = |c: usize| cell.iter().zip(phi).map(|(&other, phi)| phi * values[other as usize][c]).sum();
            moved[*node as usize] = std::array::from_fn(at);
        }
    }
    moved.into()
}

#[cfg(test)]
pub(crate) mod sample {
    use super::*;

    /// Make the space of a cube with `n` cells in each direction, which are divided into simplices that share one
    /// diagonal. The coordinates are skewed.
    pub fn block<const D: usize>(n: usize, order: Order) -> Space<D> {
        let count = 2 * n + 1;
        let number = |at: [usize; D]| at.iter().rev().fold(0, |sum, &k| sum * count + k) as u32;
        let place = |mut index: usize| -> [f64; D] {
            let at: [f64; D] = std::array::from_fn(|_| {
                let k = index % count;
                index /= count;
                k as f64 / (2 * n) as f64
            });
            std::array::from_fn(|c| at[c] + 0.2 * at[(c + 1) % D] * usize::from(c + 1 < D) as f64)
        };
        let mut connectivity = Vec::new();
        let permutations: &[&[usize]] = if D == 2 {
            &[&[0, 1], &[1, 0]]
        } else {
            &[&[0, 1, 2], &[1, 2, 0], &[2, 0, 1], &[0, 2, 1], &[2, 1, 0], &[1, 0, 2]]
        };
        for cell in 0..n.pow(D as u32) {
            let corner: [usize; D] = std::array::from_fn(|c| 2 * (cell / n.pow(c as u32) % n));
            for permutation in permutations {
                let mut path = vec![corner];
                for &axis in *permutation {
                    let mut next = path[path.len() - 1];
                    next[axis] += 2;
                    path.push(next);
                }
                let even =
                    permutation.iter().enumerate().map(|(i, p)| permutation[i..].iter().filter(|q| *q < p).count());
                if even.sum::<usize>() % 2 == 1 {
                    path.swap(0, 1);
                }
                connectivity.extend(path.iter().map(|&at| number(at)));
                for &(i, j) in &element::EDGES[..D * (D + 1) / 2] {
                    connectivity.push(number(std::array::from_fn(|c| (path[i][c] + path[j][c]) / 2)));
                }
            }
        }
        let stride = element::node_count(D + 1, Order::P2);
        let group = Group { name: "block".into(), dimension: D, stride, connectivity, tags: Vec::new() };
        let points = (0..count.pow(D as u32)).map(place).collect();
        let mesh = Mesh::new("block".into(), points, Order::P2, vec![group].into());
        Space::new(&mesh, &mesh.groups[0], order)
    }
}
