//! The finite element space of one body: its nodes, cells and boundary facets, numbered within the body.

use serde::{Deserialize, Serialize};
use crate::exchange::Plain;
use super::{Slope, cross, element, pad};
use crate::mesh::{Group, Mesh, Numbering, datum};
use crate::problem::order::Order;
use std::cell::OnceCell;
use std::collections::{HashMap, HashSet};

/// Share of the largest radius below which a node lies on the axis of a body of revolution.
pub const ON_AXIS: f64 = 1e-10;

/// Nodes and cells of one body. Nodes are numbered as the cells meet them, so that neighbours in the mesh file
/// stay neighbours in memory.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(bound = "[f64; D]: Plain")]
pub struct Space<const D: usize> {
    /// Polynomial order.
    pub order: Order,
    /// Where the nodes are, measured from `datum`.
    pub nodes: Vec<[f64; D]>,
    /// The point of the scene from which coordinates are measured; see [`Mesh::datum`].
    pub datum: [f64; D],
    /// Nodes per cell.
    pub stride: usize,
    /// Body node numbers, `stride` per cell, in the local order of [`element`].
    pub cells: Vec<u32>,
    /// Whether the body is one of revolution, of which this is the meridian: x is the radius, y runs along the axis.
    pub axisymmetric: bool,
    /// Body node of each mesh point; unknown in parts of a body.
    #[serde(skip)]
    from_mesh: Numbering,
    /// Area (volume) of all cells, once it was asked for.
    #[serde(skip)]
    measure: OnceCell<f64>,
}

/// Facets of a body's boundary, oriented so that [`Facets::normals`] points out of the body.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Facets<const D: usize> {
    /// Polynomial order.
    pub order: Order,
    /// Nodes per facet.
    pub stride: usize,
    /// Body node numbers, `stride` per facet.
    pub nodes: Vec<u32>,
}

impl<const D: usize> Space<D> {
    /// The space of `order` on the cells of `group` (of dimension `D`); the mesh is of that order or a higher one.
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

    /// Some of the cells, in this order, with their nodes alone in the order that they have here; and which nodes these are, sorted. Surfaces
    /// of the mesh are not known there.
    pub fn part(&self, cells: impl Iterator<Item = usize>) -> (Self, Vec<u32>) {
        let cells = cells.flat_map(|cell| &self.cells[cell * self.stride..(cell + 1) * self.stride]);
        let cells: Vec<u32> = cells.copied().collect();
        let nodes = Self::among(cells.iter().copied());
        (self.on(&cells, &nodes), nodes)
    }

    /// Return the nodes of some cells, one after the other.
    pub fn corners(&self, cells: &[usize]) -> Vec<u32> {
        cells.iter().flat_map(|&cell| &self.cells[cell * self.stride..][..self.stride]).copied().collect()
    }

    /// These nodes, sorted, each once.
    pub fn among(nodes: impl Iterator<Item = u32> + Clone) -> Vec<u32> {
        Numbering::in_order(nodes).points().collect()
    }

    /// Cells with nodes among these, which are sorted and get the numbers of their places. Surfaces of the mesh are not known there.
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

    /// The meridian of a body of revolution. Nodes whose radius is rounding of the largest one get the radius zero.
    pub fn revolved(mut self) -> Self {
        let largest = self.nodes.iter().fold(0.0, |max: f64, x| max.max(x[0].abs()));
        self.nodes.iter_mut().filter(|x| x[0].abs() <= ON_AXIS * largest).for_each(|x| x[0] = 0.0);
        self.axisymmetric = true;
        self
    }

    /// Length 2 pi r of the circle that a point of a meridian stands for; 1 in other bodies. Integrals over cells and facets
    /// are weighted with it.
    pub fn circle(&self, at: &[f64; D]) -> f64 {
        if self.axisymmetric { std::f64::consts::TAU * at[0] } else { 1.0 }
    }

    /// Stretch u_r/r of the circle through a point off the axis; zero in bodies that are not of revolution.
    pub fn hoop(&self, at: &[f64; D], radial: f64) -> f64 {
        if self.axisymmetric { radial / at[0] } else { 0.0 }
    }

    /// Whether a node lies on the axis of a body of revolution.
    pub fn on_axis(&self, node: u32) -> bool {
        self.axisymmetric && self.nodes[node as usize][0] == 0.0
    }

    /// What a force at nodes, in a body of revolution on their circles, adds to the sum of forces: radial ones cancel.
    pub fn net_force(&self, force: [f64; D]) -> [f64; 3] {
        let mut net = pad(force);
        if self.axisymmetric {
            net[0] = 0.0;
        }
        net
    }

    /// Return the coordinates (x, y, z) that a point has in the scene.
    pub fn in_scene(&self, x: [f64; D]) -> [f64; 3] {
        pad(datum::in_scene(&self.datum, x))
    }

    /// What a force at a node adds to the sum of moments about the datum: nothing in a body of revolution.
    pub fn net_moment(&self, node: u32, force: [f64; D]) -> [f64; 3] {
        let (x, f) = (pad(self.nodes[node as usize]), pad(force));
        if self.axisymmetric { [0.0; 3] } else { cross(x, f) }
    }

    /// Number of degrees of freedom.
    pub fn dofs(&self) -> usize {
        D * self.nodes.len()
    }

    /// Number of cells.
    pub fn cell_count(&self) -> usize {
        self.cells.len() / self.stride
    }

    /// Area (volume) of all cells, by their corners; of a body of revolution the area of its meridian.
    pub fn measure(&self) -> f64 {
        *self.measure.get_or_init(|| (0..self.cell_count()).map(|i| self.cell_measure(i)).sum())
    }

    /// The points of the mesh that are nodes of the body, in the order of the mesh.
    pub fn mesh_points(&self) -> impl Iterator<Item = u32> {
        self.from_mesh.points()
    }

    /// What a cell adds to the measure of the body, by its corners: in a body of revolution the volume of a ring.
    pub fn share(&self, i: usize) -> f64 {
        self.cell_measure(i) * self.circle(&self.centroid(i))
    }

    /// Area (volume) of cell `i`, by its corners.
    pub fn cell_measure(&self, i: usize) -> f64 {
        let x = self.cell_nodes(i);
        let edge = |j: usize| -> [f64; D] { std::array::from_fn(|c| x[j][c] - x[0][c]) };
        let (a, b) = (edge(1), edge(2));
        if D == 2 {
            return 0.5 * (a[0] * b[1] - a[1] * b[0]).abs();
        }
        let c = edge(3);
        let normal = [0, 1, 2].map(|i| a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3]);
        (0..3).map(|i| normal[i] * c[i]).sum::<f64>().abs() / 6.0
    }

    /// Gradient of a displacement in a cell (its node numbers) at a point `at`, where its shape functions have the values `phi`
    /// and these gradients; `u` has one entry a dof.
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
            // the limit of u_r/r
            true if at[0] == 0.0 => h[0][0],
            true => radial() / at[0],
        };
        Slope { h, hoop }
    }

    /// Mean of the corners of cell `i`.
    pub fn centroid(&self, i: usize) -> [f64; D] {
        let corners = &self.cells[i * self.stride..][..=D];
        std::array::from_fn(|c| corners.iter().map(|&node| self.nodes[node as usize][c]).sum::<f64>() / (D + 1) as f64)
    }

    /// Numbers of the body's cells that are in a mesh group of dimension `D`.
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

    /// Coordinates of the nodes of cell `i`.
    pub fn cell_nodes(&self, i: usize) -> Vec<[f64; D]> {
        self.cells[i * self.stride..(i + 1) * self.stride].iter().map(|&node| self.nodes[node as usize]).collect()
    }

    /// The body's node numbers of one simplex of a mesh group (vertices, then mid-edges for a quadratic
    /// space), or `None` if it is not part of this body.
    fn simplex(&self, points: &[u32], dimension: usize) -> Option<Vec<u32>> {
        let vertices = dimension + 1;
        let wanted = element::node_count(vertices, self.order);
        let mut nodes = Vec::with_capacity(wanted);
        for &point in &points[..wanted] {
            nodes.push(self.from_mesh.get(point)?);
        }
        Some(nodes)
    }

    /// All body nodes on a mesh group of any dimension, sorted; empty if the group does not touch the body.
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

    /// The facets of a mesh group (of dimension `D - 1`) that bound a cell of this body, oriented outwards.
    pub fn facets(&self, group: &Group) -> Facets<D> {
        // where cells are few, a place may stand for several nodes: `wanted` decides
        let mut on_group = vec![false; self.cells.len().next_power_of_two()];
        let at = |node: u32| node as usize & (self.cells.len().next_power_of_two() - 1);
        let mut wanted: HashMap<[u32; D], usize> = HashMap::new();
        for points in group.connectivity.chunks_exact(group.stride) {
            if let Some(nodes) = self.simplex(points, D - 1) {
                nodes[..D].iter().for_each(|&node| on_group[at(node)] = true);
                let next = wanted.len();
                wanted.entry(key(&nodes)).or_insert(next);
            }
        }
        // the cell next to each facet decides which way is out
        let mut found = vec![None; wanted.len()];
        for (index, cell) in self.cells.chunks_exact(self.stride).enumerate() {
            let touching = cell[..=D].iter().filter(|&&node| on_group[at(node)]).count();
            if touching < D {
                continue;
            }
            for opposite in 0..=D {
                if let Some(place) = wanted.remove(&key(&face::<D>(cell, opposite))) {
                    found[place] = Some((index, opposite));
                }
            }
        }
        self.facets_of(found.into_iter().flatten())
    }

    /// All facets that bound one cell only, oriented outwards.
    pub fn boundary(&self) -> Facets<D> {
        self.facets_of(self.lone_facets())
    }

    /// The same facets, each by its cell and the vertex opposite to it.
    pub fn lone_facets(&self) -> impl Iterator<Item = (usize, usize)> + use<D> {
        let mut faces: Vec<([u32; D], u32)> = Vec::with_capacity(self.cell_count() * (D + 1));
        for (index, cell) in self.cells.chunks_exact(self.stride).enumerate() {
            faces
                .extend((0..=D).map(|opposite| (key(&face::<D>(cell, opposite)), (index * (D + 1) + opposite) as u32)));
        }
        faces.sort_unstable();
        let lone = faces.chunk_by(|a, b| a.0 == b.0).filter(|group| group.len() == 1);
        let mut places: Vec<u32> = lone.map(|group| group[0].1).collect();
        places.sort_unstable();
        places.into_iter().map(|place| (place as usize / (D + 1), place as usize % (D + 1)))
    }

    /// The facets opposite a vertex of a cell each, oriented out of the cell.
    pub fn facets_of(&self, places: impl Iterator<Item = (usize, usize)>) -> Facets<D> {
        let mut nodes = Vec::new();
        for (index, opposite) in places {
            let cell = &self.cells[index * self.stride..(index + 1) * self.stride];
            let mut facet = face::<D>(cell, opposite).to_vec();
            if self.points_inwards(&facet, cell[opposite]) {
                facet.swap(0, 1);
            }
            if self.order == Order::P2 {
                let local = |node: u32| cell.iter().position(|&other| other == node).unwrap_or(0);
                let ends: Vec<usize> = facet.iter().map(|&node| local(node)).collect();
                for &(i, j) in &element::EDGES[..D * (D - 1) / 2] {
                    let (from, to) = (ends[i].min(ends[j]), ends[i].max(ends[j]));
                    let edge = element::EDGES.iter().position(|&edge| edge == (from, to)).unwrap_or(0);
                    facet.push(cell[D + 1 + edge]);
                }
            }
            nodes.extend(facet);
        }
        Facets::new(self.order, nodes)
    }

    fn points_inwards(&self, facet: &[u32], opposite: u32) -> bool {
        let x: Vec<_> = facet[..D].iter().map(|&node| self.nodes[node as usize]).collect();
        let normal = area_vector::<D>(Order::P1, &x, &[1.0 / D as f64; D]);
        let inner = self.nodes[opposite as usize];
        (0..D).map(|i| normal[i] * (inner[i] - x[0][i])).sum::<f64>() > 0.0
    }
}

/// The vertices of a cell without one of them.
fn face<const D: usize>(cell: &[u32], opposite: usize) -> [u32; D] {
    std::array::from_fn(|i| cell[if i < opposite { i } else { i + 1 }])
}

/// The first `D` nodes, sorted.
fn key<const D: usize>(nodes: &[u32]) -> [u32; D] {
    let mut key = std::array::from_fn(|i| nodes[i]);
    key.sort_unstable();
    key
}

impl<const D: usize> Facets<D> {
    /// Facets by their nodes.
    pub fn new(order: Order, nodes: Vec<u32>) -> Self {
        Self { order, stride: element::node_count(D, order), nodes }
    }

    /// Number of facets.
    pub fn count(&self) -> usize {
        self.nodes.len() / self.stride
    }

    /// Body node numbers of facet `i`.
    pub fn facet(&self, i: usize) -> &[u32] {
        &self.nodes[i * self.stride..(i + 1) * self.stride]
    }

    /// Their nodes, sorted, each once.
    pub fn distinct_nodes(&self) -> Vec<u32> {
        let mut nodes = self.nodes.clone();
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }

    /// Outer unit normals at the corners of all facets.
    pub fn normals(&self, space: &Space<D>) -> Vec<[f64; D]> {
        let normals = |i: usize| {
            let x = self.coordinates(i, space);
            (0..D).map(move |at| {
                let area = area_vector(self.order, &x, &element::place(D, at)[..D]);
                let size = area.iter().map(|a| a * a).sum::<f64>().sqrt();
                area.map(|a| a / size)
            })
        };
        (0..self.count()).flat_map(normals).collect()
    }

    /// The facets for which `keep` holds, in their order.
    pub fn only(&self, keep: &[bool]) -> Self {
        let kept = (0..self.count()).filter(|&i| keep[i]).flat_map(|i| self.facet(i)).copied();
        Self { nodes: kept.collect(), ..*self }
    }

    /// Coordinates of the nodes of facet `i`.
    pub fn coordinates(&self, i: usize, space: &Space<D>) -> Vec<[f64; D]> {
        self.facet(i).iter().map(|&node| space.nodes[node as usize]).collect()
    }
}

/// Outer normal times length (2D) or area (3D) measure of a facet with node coordinates `x`, at barycentric
/// point `l`: integrate with weights that sum to one.
pub fn area_vector<const D: usize>(order: Order, x: &[[f64; D]], l: &[f64]) -> [f64; D] {
    let d = element::derivatives(order, l);
    let tangent =
        |c: usize| -> [f64; D] { std::array::from_fn(|i| (0..x.len()).map(|n| (d[n][c] - d[n][0]) * x[n][i]).sum()) };
    let mut vector = [0.0; D];
    let t = tangent(1);
    if D == 2 {
        vector[0] = t[1];
        vector[1] = -t[0];
    } else {
        let s = tangent(2);
        for (i, v) in vector.iter_mut().enumerate() {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            *v = 0.5 * (t[j] * s[k] - t[k] * s[j]);
        }
    }
    vector
}
