//! Boundary facets of a body: their search in its cells, their orientation and their normals.

use super::space::Space;
use super::{EDGES, cross, element, length, minus, pad, unit};
use crate::mesh::Group;
use crate::mesh::faces::{Face, Faces, Simplices};
use crate::problem::order::Order;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;

/// The facets of a part of a body's boundary, oriented so that [`Facets::normals`] points out of the body.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Facets<const D: usize> {
    /// Polynomial order.
    pub order: Order,
    /// Nodes per facet.
    pub stride: usize,
    /// Nodes of the facets, `stride` per facet, numbered within the body.
    pub nodes: Vec<u32>,
}

impl<const D: usize> Space<D> {
    /// Return the facets of a mesh group (of dimension `D - 1`) that bound a cell of this body, oriented outwards.
    pub fn facets(&self, group: &Group) -> Facets<D> {
        // This filter skips most cells. If there are few cells, several nodes share an entry, and `wanted` decides.
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
        // The cell next to each facet determines the outward direction.
        let mut found = vec![None; wanted.len()];
        for (index, cell) in self.cells.chunks_exact(self.stride).enumerate() {
            let touching = cell[..=D].iter().filter(|&&node| on_group[at(node)]).count();
            if touching < D {
                continue;
            }
            for opposite in 0..=D {
                if let Some(facet) = wanted.remove(&key(&face::<D>(cell, opposite))) {
                    found[facet] = Some((index, opposite));
                }
            }
        }
        self.facets_of(found.into_iter().flatten())
    }

    /// Return the cell that each of these facets of the boundary bounds.
    pub fn cells_at(&self, facets: &Facets<D>) -> Vec<usize> {
        let faces = Faces::new(self.simplices());
        (0..facets.count()).map(|i| faces.at(facets.facet(i)).next().map_or(0, Face::cell)).collect()
    }

    /// Return the cells without coordinates.
    fn simplices(&self) -> Simplices<'_, D> {
        Simplices { nodes: &self.cells, stride: self.stride }
    }

    /// Return all facets that bound one cell only, oriented outwards.
    pub fn boundary(&self) -> Facets<D> {
        self.facets_of(self.lone_facets().into_iter())
    }

    /// Return the same facets in the order of the cells, each as its cell and the local vertex opposite to it.
    pub fn lone_facets(&self) -> Vec<(usize, usize)> {
        let faces = Faces::new(self.simplices());
        let mut places: Vec<_> = faces.outer().map(|face| (face.cell(), face.opposite())).collect();
        places.sort_unstable();
        places
    }

    /// Return the facets that are given as a cell and the local vertex opposite to the facet, oriented out of the cell.
    pub fn facets_of(&self, places: impl Iterator<Item = (usize, usize)>) -> Facets<D> {
        let mut nodes = Vec::new();
        for (index, opposite) in places {
            let (cell, corners) = (self.cell(index), Face::<D>::at(index, opposite).corners());
            nodes.extend(corners.map(|corner| cell[corner]));
            for &(i, j) in &EDGES[..D * (D - 1) / 2] {
                let ends = [corners[i], corners[j]];
                nodes.extend(element::inside_edge(self.order, D + 1, ends).map(|local| cell[local]));
            }
        }
        Facets::new(self.order, nodes)
    }
}

/// Return the vertices of a cell without the local vertex `opposite`.
fn face<const D: usize>(cell: &[u32], opposite: usize) -> [u32; D] {
    std::array::from_fn(|i| cell[if i < opposite { i } else { i + 1 }])
}

/// Return the first `D` nodes, sorted.
fn key<const D: usize>(nodes: &[u32]) -> [u32; D] {
    let mut key = std::array::from_fn(|i| nodes[i]);
    key.sort_unstable();
    key
}

impl<const D: usize> Facets<D> {
    /// Make facets from their nodes.
    pub fn new(order: Order, nodes: Vec<u32>) -> Self {
        Self { order, stride: element::node_count(D, order), nodes }
    }

    /// Return the number of facets.
    pub fn count(&self) -> usize {
        self.nodes.len() / self.stride
    }

    /// Return the nodes of facet `i`, numbered within the body.
    pub fn facet(&self, i: usize) -> &[u32] {
        &self.nodes[i * self.stride..(i + 1) * self.stride]
    }

    /// Return the nodes of all facets, sorted, each once.
    pub fn distinct_nodes(&self) -> Vec<u32> {
        let mut nodes = self.nodes.clone();
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }

    /// Return the outer unit normals at the corners of all facets, `D` normals a facet.
    pub fn normals(&self, space: &Space<D>) -> Vec<[f64; D]> {
        let normals = |i: usize| {
            let x = self.coordinates(i, space);
            (0..D).map(move |at| unit(area_vector(self.order, &x, &element::place(Order::P1, D, at)[..D])))
        };
        (0..self.count()).flat_map(normals).collect()
    }

    /// Return the largest angle by which errors of coordinates turn the normal of a facet: those of two nodes, along
    /// and against the normal, over the least height of the facet. At a corner of a quadratic facet, the weights of the
    /// nodes in a tangent are 3, 4 and 1 instead of 1 and 1, and their sum grows with the square of the order.
    pub fn tilt(&self, space: &Space<D>, error: f64) -> f64 {
        let height = |i: usize| {
            let x = &self.coordinates(i, space)[..D];
            let edges = (0..D).map(|k| length(minus(x[k], x[(k + 1) % D])));
            let longest = edges.fold(0.0, f64::max);
            if D == 2 { longest } else { 2.0 * length(area_vector(Order::P1, x, &[1.0 / D as f64; D])) / longest }
        };
        let least = (0..self.count()).map(height).fold(f64::INFINITY, f64::min);
        let corner: [f64; D] = std::array::from_fn(|k| f64::from(u8::from(k == 0)));
        let weights: f64 = element::derivatives(self.order, &corner).iter().map(|d| (d[1] - d[0]).abs()).sum();
        weights * (D as f64).sqrt() * error / least
    }

    /// Return the facets for which `keep` holds, in their order.
    pub fn only(&self, keep: &[bool]) -> Self {
        let kept = (0..self.count()).filter(|&i| keep[i]).flat_map(|i| self.facet(i)).copied();
        Self { nodes: kept.collect(), ..*self }
    }

    /// Return the edges of facet `i` (in the plane its ends), each opposite to one vertex. An edge is its sorted
    /// vertices with a `u32::MAX` at the end, in place of the opposite vertex.
    pub fn edges(&self, i: usize) -> [[u32; D]; D] {
        let vertices = &self.facet(i)[..D];
        std::array::from_fn(|opposite| {
            let mut edge = std::array::from_fn(|k| if k == opposite { u32::MAX } else { vertices[k] });
            edge.sort_unstable();
            edge
        })
    }

    /// Return the facets at each edge, in their order.
    pub fn by_edge(&self) -> HashMap<[u32; D], Vec<usize>> {
        let mut around: HashMap<[u32; D], Vec<usize>> = HashMap::new();
        for i in 0..self.count() {
            self.edges(i).into_iter().for_each(|edge| around.entry(edge).or_default().push(i));
        }
        around
    }

    /// Return the point of facet `i` with barycentric coordinates `l`.
    pub fn point(&self, i: usize, space: &Space<D>, l: &[f64]) -> [f64; D] {
        element::interpolate(&self.coordinates(i, space), &element::values(self.order, l))
    }

    /// Return the coordinates of the nodes of facet `i`.
    pub fn coordinates(&self, i: usize, space: &Space<D>) -> Vec<[f64; D]> {
        self.facet(i).iter().map(|&node| space.nodes[node as usize]).collect()
    }
}

/// Return the outer normal times the length (2D) or area (3D) of a facet with node coordinates `x`, at barycentric
/// point `l`. An integral over the facet uses weights that sum to one.
pub fn area_vector<const D: usize>(order: Order, x: &[[f64; D]], l: &[f64]) -> [f64; D] {
    let tangent = |k: usize| element::tangent(order, x, l, k);
    let t = tangent(0);
    let vector = if D == 2 { [t[1], -t[0], 0.0] } else { cross(pad(t), pad(tangent(1))).map(|v| 0.5 * v) };
    std::array::from_fn(|c| vector[c])
}
