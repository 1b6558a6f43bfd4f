//! Assembly of stiffness matrix and loads by direct scatter into compressed rows.
//!
//! The pattern is built once from the node graph (cells, and couplings through contact rows); entry positions
//! follow from the graph by arithmetic, so that assembly writes each value straight to its place.

use serde::{Deserialize, Serialize};
use crate::exchange::Plain;
use super::elasticity::{Elasticity, Flaw};
use super::element;
use super::forces::NodalForces;
use super::frame::Frame;
use super::quadrature::{self, Parts, Rule};
use super::space::Space;
use crate::linalg::Csr;
use crate::problem::order::Order;

/// Which nodes of a body are coupled: compressed rows of sorted node numbers, symmetric, with diagonal.
#[derive(Debug, Clone)]
pub struct NodeGraph {
    /// Row starts.
    pub ptr: Vec<u32>,
    /// Neighbours of each node, the node itself included, sorted.
    pub col: Vec<u32>,
    /// Node that stands for each node; empty if each stands for itself.
    master: Vec<u32>,
}

impl NodeGraph {
    /// Which nodes K couples: those of a cell of a space, and those of a contact row.
    pub fn with_rows<const D: usize>(space: &Space<D>, rows: &Csr, frame: &Frame<D>) -> Self {
        let coupled = (0..rows.rows()).map(|q| {
            let mut nodes: Vec<u32> = rows.row(q).map(|(dof, _)| (dof / D) as u32).collect();
            nodes.dedup();
            nodes
        });
        Self::new(space, &coupled.filter(|nodes| nodes.len() > 1).collect::<Vec<_>>(), frame)
    }

    /// The graph of a space's cells plus `extra` sets of nodes that are coupled among themselves (the nodes of
    /// each contact row: pattern of B'B). The nodes that `frame` ties are one node in it, their master; alone they only
    /// meet themselves.
    pub fn new<const D: usize>(space: &Space<D>, extra: &[Vec<u32>], frame: &Frame<D>) -> Self {
        let n = space.nodes.len();
        let merged: Vec<u32> = match frame.master.is_empty() {
            true => Vec::new(),
            false => space.cells.iter().map(|&node| frame.node(node)).collect(),
        };
        let cells = if merged.is_empty() { &space.cells } else { &merged };
        let tied: Vec<[u32; 1]> = frame.master.keys().map(|&node| [node]).collect();
        let alone = tied.iter().map(|node| &node[..]);
        let sets = || cells.chunks_exact(space.stride).chain(extra.iter().map(Vec::as_slice)).chain(alone.clone());
        // node -> sets that contain it
        let mut start = vec![0u32; n + 1];
        sets().flatten().for_each(|&node| start[node as usize + 1] += 1);
        for i in 0..n {
            start[i + 1] += start[i];
        }
        let mut next = start.clone();
        let mut member = vec![0u32; start[n] as usize];
        for (index, set) in sets().enumerate() {
            for &node in set {
                member[next[node as usize] as usize] = index as u32;
                next[node as usize] += 1;
            }
        }
        let cell_count = space.cell_count();
        let set = |index: u32| -> &[u32] {
            let index = index as usize;
            if index < cell_count {
                &cells[index * space.stride..(index + 1) * space.stride]
            } else {
                extra.get(index - cell_count).map_or_else(|| &tied[index - cell_count - extra.len()][..], Vec::as_slice)
            }
        };
        let mut seen = vec![u32::MAX; n];
        let master = if merged.is_empty() { Vec::new() } else { (0..n as u32).map(|node| frame.node(node)).collect() };
        let mut graph = NodeGraph { ptr: vec![0], col: Vec::with_capacity(8 * n), master };
        for i in 0..n {
            let first = graph.col.len();
            for &index in &member[start[i] as usize..start[i + 1] as usize] {
                for &node in set(index) {
                    if seen[node as usize] != i as u32 {
                        seen[node as usize] = i as u32;
                        graph.col.push(node);
                    }
                }
            }
            graph.col[first..].sort_unstable();
            graph.ptr.push(graph.col.len() as u32);
        }
        graph
    }

    /// The rows of some nodes; those of others are empty.
    pub fn of(&self, keep: impl Fn(usize) -> bool) -> Self {
        let mut graph = Self { ptr: vec![0], col: Vec::new(), master: self.master.clone() };
        for node in 0..self.ptr.len() - 1 {
            if keep(node) {
                graph.col.extend(&self.col[self.ptr[node] as usize..self.ptr[node + 1] as usize]);
            }
            graph.ptr.push(graph.col.len() as u32);
        }
        graph
    }

    /// Whether the graph has the row of the node that stands for a node.
    fn has(&self, node: u32) -> bool {
        let node = self.master.get(node as usize).copied().unwrap_or(node) as usize;
        self.ptr[node] < self.ptr[node + 1]
    }

    /// Entries of the matrix on this graph with D x D blocks.
    pub fn entries<const D: usize>(&self) -> usize {
        D * D * self.col.len()
    }

    /// Scalar compressed rows with D x D blocks on this graph, all zero.
    fn matrix<const D: usize>(&self) -> Csr {
        let n = self.ptr.len() - 1;
        let mut ptr = Vec::with_capacity(D * n + 1);
        let mut col = Vec::with_capacity(self.entries::<D>());
        ptr.push(0);
        for i in 0..n {
            let neighbours = &self.col[self.ptr[i] as usize..self.ptr[i + 1] as usize];
            for _ in 0..D {
                col.extend(neighbours.iter().flat_map(|&j| (0..D).map(move |c| (D * j as usize + c) as i32)));
                ptr.push(col.len() as i32);
            }
        }
        Csr { columns: D * n, ptr, values: vec![0.0; col.len()], col }
    }

    /// Where block (i, j) starts in the values of [`NodeGraph::matrix`], and the distance between its rows.
    fn block<const D: usize>(&self, i: u32, j: u32) -> (usize, usize) {
        let [i, j] = [i, j].map(|node| self.master.get(node as usize).copied().unwrap_or(node));
        let (from, to) = (self.ptr[i as usize] as usize, self.ptr[i as usize + 1] as usize);
        let slot = match self.col[from..to].binary_search(&j) {
            Ok(slot) => slot,
            Err(_) => unreachable!("the graph holds every pair of nodes of a cell"),
        };
        (D * D * from + D * slot, D * (to - from))
    }
}

/// A stiffness between two nodes of one cell or facet, as springs to the ground give it.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(bound = "[[f64; D]; D]: Plain")]
pub struct NodalBlock<const D: usize> {
    /// The two nodes.
    pub nodes: [u32; 2],
    /// Force at the first one for a displacement of the second.
    pub block: [[f64; D]; D],
}

/// Adds springs to a stiffness matrix on a graph.
pub fn add_blocks<const D: usize>(graph: &NodeGraph, blocks: &[NodalBlock<D>], matrix: &mut Csr) {
    for NodalBlock { nodes: [a, b], block } in blocks.iter().filter(|block| graph.has(block.nodes[0])) {
        let (start, step) = graph.block::<D>(*a, *b);
        for (i, row) in block.iter().enumerate() {
            for (j, value) in row.iter().enumerate() {
                matrix.values[start + i * step + j] += value;
            }
        }
    }
}

/// Why a body could not be assembled.
#[derive(Debug, Clone, PartialEq)]
pub enum Defect {
    /// Cell (number within the body) with a singular or inverted map.
    Inverted(usize),
    /// No elasticity: number of the cell's spec, place, and why.
    Elasticity(usize, [f64; 3], Flaw),
}

/// Quadrature of strain energies.
pub struct Rules {
    affine: Rule,
    curved: Rule,
    varying: Rule,
}

impl Rules {
    /// Make the rules for elements of this order.
    pub fn new<const D: usize>(order: Order) -> Self {
        let of_degree = |degree: usize| quadrature::simplex(D + 1, degree);
        let (affine, varying) = if order == Order::P1 { (1, 2) } else { (2, 5) };
        Self { affine: of_degree(affine), curved: of_degree(5), varying: of_degree(varying) }
    }

    /// Return the rule for a cell with these nodes, where Hooke's law `is_constant` or not.
    pub fn of<const D: usize>(&self, x: &[[f64; D]], is_constant: bool, axisymmetric: bool) -> &Rule {
        match is_constant && !axisymmetric {
            false => &self.varying,
            true if is_straight(x, D + 1) => &self.affine,
            true => &self.curved,
        }
    }
}

/// Stiffness matrix of a space on a graph, which may have the rows of some nodes only. Where the elasticity varies within a cell, and
/// in bodies of revolution, it is taken at the points of a rule of degree 2 (P1) or 5 (P2); all of these lie off the axis.
///
/// # Errors
/// [`Defect`]: a cell whose map is not invertible at an integration point, or a point without elasticity.
pub fn stiffness<const D: usize>(space: &Space<D>, graph: &NodeGraph, elasticity: &Elasticity) -> Result<Csr, Defect> {
    let mut matrix = graph.matrix::<D>();
    let rules = Rules::new::<D>(space.order);
    let mut hoop = Vec::new();
    let stride = space.stride;
    let mut local = vec![[[0.0; D]; D]; stride * stride];
    let mut x = vec![[0.0; D]; stride];
    for (index, cell) in space.cells.chunks_exact(stride).enumerate() {
        let mut here = [false; element::MOST];
        here.iter_mut().zip(cell).for_each(|(here, &node)| *here = graph.has(node));
        if !here.contains(&true) {
            continue;
        }
        for (x, &node) in x.iter_mut().zip(cell) {
            *x = space.nodes[node as usize];
        }
        let constant = elasticity.constant_in(index);
        let rule = rules.of(&x, constant.is_some(), space.axisymmetric);
        local.fill([[0.0; D]; D]);
        for (l, weight) in rule.iter() {
            let (gradient, measure) = element::gradients(space.order, &x, l).ok_or(Defect::Inverted(index))?;
            let gradient = &gradient[..stride];
            let mut weight = weight * measure;
            if space.axisymmetric {
                let phi = element::values(space.order, l);
                let at = interpolate(&x, &phi);
                weight *= space.circle(&at);
                hoop.clear();
                hoop.extend(phi[..stride].iter().map(|&phi| space.hoop(&at, phi)));
            }
            match constant {
                Some(material) => material.accumulate(gradient, &hoop, weight, &mut local),
                None => {
                    let at = space.in_scene(interpolate(&x, &element::values(space.order, l)));
                    let material = elasticity
                        .at(index, at)
                        .map_err(|flaw| Defect::Elasticity(elasticity.region(index), at, flaw))?;
                    material.accumulate(gradient, &hoop, weight, &mut local);
                }
            }
        }
        for a in 0..stride {
            for b in a..stride {
                let block = &local[a * stride + b];
                if here[a] {
                    let (start, step) = graph.block::<D>(cell[a], cell[b]);
                    for i in 0..D {
                        for j in 0..D {
                            matrix.values[start + i * step + j] += block[i][j];
                        }
                    }
                }
                if a != b && here[b] {
                    let (start, step) = graph.block::<D>(cell[b], cell[a]);
                    for i in 0..D {
                        for j in 0..D {
                            matrix.values[start + i * step + j] += block[j][i];
                        }
                    }
                }
            }
        }
    }
    Ok(matrix)
}

/// Whether the mid-edge nodes of a simplex with `vertices` vertices lie in the middle of straight edges (to rounding of the
/// coordinates).
pub fn is_straight<const D: usize>(x: &[[f64; D]], vertices: usize) -> bool {
    element::EDGES[..x.len() - vertices].iter().enumerate().all(|(k, &(i, j))| {
        let length: f64 = (0..D).map(|c| (x[i][c] - x[j][c]).abs()).sum();
        (0..D).all(|c| (2.0 * x[vertices + k][c] - x[i][c] - x[j][c]).abs() <= 1e-9 * length)
    })
}

/// Nodal forces of a body force density (per volume) on the cells that are here.
pub fn body_force<const D: usize>(
    space: &Space<D>,
    parts: Parts,
    density: &dyn Fn([f64; D]) -> [f64; D],
) -> NodalForces<D> {
    let (space, nodes) = space.part(0..space.cell_count());
    let mut load = vec![0.0; space.dofs()];
    let low = space.order == Order::P1 && !space.axisymmetric;
    let mut rule = quadrature::simplex(D + 1, if low { 2 } else { 5 });
    if parts == Parts::Halves {
        rule = rule.on_parts();
    }
    for index in 0..space.cell_count() {
        let x = space.cell_nodes(index);
        let cell = &space.cells[index * space.stride..(index + 1) * space.stride];
        for (l, weight) in rule.iter() {
            let Some((_, measure)) = element::gradients(space.order, &x, l) else { continue };
            let phi = element::values(space.order, l);
            let at = interpolate(&x, &phi);
            let force = density(at);
            let weight = weight * measure * space.circle(&at);
            for (a, &node) in cell.iter().enumerate() {
                for c in 0..D {
                    load[D * node as usize + c] += weight * phi[a] * force[c];
                }
            }
        }
    }
    NodalForces::new(nodes.into_iter(), &load)
}

/// Point of an element with node coordinates `x` and shape function values `phi`.
pub fn interpolate<const D: usize>(x: &[[f64; D]], phi: &[f64]) -> [f64; D] {
    std::array::from_fn(|i| x.iter().zip(phi).map(|(x, phi)| phi * x[i]).sum())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cell_is_straight_if_each_edge_is() {
        let straight = [[0.0, 0.0], [2.0, 0.0], [0.0, 4.0], [1.0, 0.0], [1.0, 2.0], [0.0, 2.0]];
        assert!(is_straight(&straight, 3) && is_straight(&straight[..3], 3));
        for (node, c) in [(3, 1), (4, 0), (5, 1)] {
            let mut bent = straight;
            bent[node][c] += 1e-6;
            assert!(!is_straight(&bent, 3), "{node}");
            bent[node][c] = straight[node][c] + 1e-10;
            assert!(is_straight(&bent, 3), "{node}");
        }
    }
}
