//! Assembly of stiffness matrix and loads by direct scatter into compressed rows.
//!
//! The pattern is built once from the node graph, which holds the couplings through cells and through contact rows. Positions
//! of entries follow from the graph by arithmetic, so that assembly adds each value directly to its entry.

use super::elasticity::{Elasticity, Flaw};
use super::element;
use super::forces::NodalForces;
use super::frame::{Frame, Movers};
use super::lever::Rotation;
use super::quadrature::{self, Parts, Rule};
use super::space::Space;
use crate::exchange::Plain;
use crate::linalg::Csr;
use crate::problem::order::Order;
use serde::{Deserialize, Serialize};

/// The symmetric graph of coupled nodes of a body, as compressed rows with diagonal.
#[derive(Debug, Clone)]
pub struct NodeGraph {
    /// Row starts.
    pub ptr: Vec<u32>,
    /// Neighbours of each node, the node itself included, sorted.
    pub col: Vec<u32>,
}

impl NodeGraph {
    /// Build the graph of the nodes that K couples, which share a cell of the space or a contact row.
    pub fn with_rows<const D: usize>(space: &Space<D>, rows: &Csr, frame: &Frame<D>) -> Self {
        let coupled = (0..rows.rows()).map(|q| {
            let mut nodes: Vec<u32> = rows.row(q).map(|(dof, _)| (dof / D) as u32).collect();
            nodes.dedup();
            nodes
        });
        Self::new(space, &coupled.filter(|nodes| nodes.len() > 1).collect::<Vec<_>>(), frame)
    }

    /// Build the graph of a space's cells plus `extra` sets of nodes that are coupled among themselves. These are the nodes of
    /// each contact row, the pattern of B'B. The nodes that `frame` ties are represented by their master, and on surfaces that turn
    /// also by the pole. Their own rows have the diagonal alone.
    pub fn new<const D: usize>(space: &Space<D>, extra: &[Vec<u32>], frame: &Frame<D>) -> Self {
        let n = space.nodes.len();
        let merged: Vec<u32> = match frame.master.is_empty() {
            true => Vec::new(),
            false => space.cells.iter().map(|&node| frame.node(node)).collect(),
        };
        let cells = if merged.is_empty() { &space.cells } else { &merged };
        let tied = frame.master.keys().map(|&node| vec![node]);
        let turned: Vec<Vec<u32>> = turned_cells(space, frame).chain(tied).collect();
        let others: Vec<&[u32]> = extra.iter().chain(&turned).map(Vec::as_slice).collect();
        let sets = || cells.chunks_exact(space.stride).chain(others.iter().copied());
        let (start, sets_of_nodes) = sets_by_node(n, sets);
        let cell_count = space.cell_count();
        let set = |index: u32| -> &[u32] {
            let index = index as usize;
            if index < cell_count {
                &cells[index * space.stride..(index + 1) * space.stride]
            } else {
                others[index - cell_count]
            }
        };
        let mut last_row = vec![u32::MAX; n];
        let mut graph = NodeGraph { ptr: vec![0], col: Vec::with_capacity(8 * n) };
        for i in 0..n {
            let first = graph.col.len();
            for &index in &sets_of_nodes[start[i] as usize..start[i + 1] as usize] {
                for &node in set(index) {
                    if last_row[node as usize] != i as u32 {
                        last_row[node as usize] = i as u32;
                        graph.col.push(node);
                    }
                }
            }
            graph.col[first..].sort_unstable();
            graph.ptr.push(graph.col.len() as u32);
        }
        graph
    }

    /// Return the graph with the rows of some nodes only; the rows of others are empty.
    pub fn of(&self, keep: impl Fn(usize) -> bool) -> Self {
        let mut graph = Self { ptr: vec![0], col: Vec::new() };
        for node in 0..self.ptr.len() - 1 {
            if keep(node) {
                graph.col.extend(&self.col[self.ptr[node] as usize..self.ptr[node + 1] as usize]);
            }
            graph.ptr.push(graph.col.len() as u32);
        }
        graph
    }

    /// Return whether the graph has the row of a node.
    fn has(&self, node: u32) -> bool {
        self.ptr[node as usize] < self.ptr[node as usize + 1]
    }

    /// Return the number of entries of the matrix on this graph with D x D blocks.
    pub fn entries<const D: usize>(&self) -> usize {
        D * D * self.col.len()
    }

    /// Return the zero matrix on this graph, as scalar compressed rows with D x D blocks.
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

    /// Add a block of nodal stiffness to a matrix on this graph, in the rows and columns of the nodes that move two nodes.
    fn add_moved<const D: usize>(
        &self,
        [rows, columns]: [&Movers<D>; 2],
        entry: impl Fn(usize, usize) -> f64,
        matrix: &mut Csr,
    ) {
        self.add_block::<D>([rows.node, columns.node], &entry, matrix);
        let right = |rotation: &Rotation<D>, i, j| (0..D).map(|k| entry(i, k) * rotation.matrix[k][j]).sum::<f64>();
        if let Some(column) = &columns.rotation {
            self.add_block::<D>([rows.node, column.pole], |i, j| right(column, i, j), matrix);
        }
        let Some(row) = &rows.rotation else { return };
        let left = |k: usize, i: usize| row.matrix[k][i];
        self.add_block::<D>([row.pole, columns.node], |i, j| (0..D).map(|k| left(k, i) * entry(k, j)).sum(), matrix);
        if let Some(column) = &columns.rotation {
            let both = |i, j| (0..D).map(|k| left(k, i) * right(column, k, j)).sum();
            self.add_block::<D>([row.pole, column.pole], both, matrix);
        }
    }

    /// Add a block to a matrix on this graph, in the rows of node `i` and the columns of node `j`.
    fn add_block<const D: usize>(&self, [i, j]: [u32; 2], entry: impl Fn(usize, usize) -> f64, matrix: &mut Csr) {
        let (from, to) = (self.ptr[i as usize] as usize, self.ptr[i as usize + 1] as usize);
        let Ok(place) = self.col[from..to].binary_search(&j) else {
            unreachable!("the graph holds every pair of nodes of a cell")
        };
        let (start, row_length) = (D * D * from + D * place, D * (to - from));
        for i in 0..D {
            for j in 0..D {
                matrix.values[start + i * row_length + j] += entry(i, j);
            }
        }
    }
}

/// Return, for each cell with nodes on surfaces that turn, the nodes that move its nodes.
fn turned_cells<'a, const D: usize>(
    space: &'a Space<D>,
    frame: &'a Frame<D>,
) -> impl Iterator<Item = Vec<u32>> + use<'a, D> {
    let cells = space.cells.chunks_exact(space.stride).filter(|_| !frame.levers.is_empty());
    cells.filter_map(|cell| {
        let poles = cell.iter().filter_map(|&node| Some(frame.movers(node).rotation?.pole));
        let mut nodes: Vec<u32> = poles.collect();
        if nodes.is_empty() {
            return None;
        }
        nodes.extend(cell.iter().map(|&node| frame.node(node)));
        nodes.sort_unstable();
        nodes.dedup();
        Some(nodes)
    })
}

/// Invert a list of sets of nodes below `n`. Return row starts, n + 1 entries, and the indices of the sets that contain each node.
fn sets_by_node<'a, I: Iterator<Item = &'a [u32]>>(n: usize, sets: impl Fn() -> I) -> (Vec<u32>, Vec<u32>) {
    let mut start = vec![0u32; n + 1];
    sets().flatten().for_each(|&node| start[node as usize + 1] += 1);
    for i in 0..n {
        start[i + 1] += start[i];
    }
    let mut next = start.clone();
    let mut indices = vec![0u32; start[n] as usize];
    for (index, set) in sets().enumerate() {
        for &node in set {
            indices[next[node as usize] as usize] = index as u32;
            next[node as usize] += 1;
        }
    }
    (start, indices)
}

/// A stiffness between two nodes of one cell or facet, as springs to the ground give it.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(bound = "[[f64; D]; D]: Plain")]
pub struct NodalBlock<const D: usize> {
    /// The two nodes.
    pub nodes: [u32; 2],
    /// Force at the first node for a displacement of the second.
    pub block: [[f64; D]; D],
}

/// Add springs to a stiffness matrix on a graph.
pub fn add_blocks<const D: usize>(graph: &NodeGraph, frame: &Frame<D>, blocks: &[NodalBlock<D>], matrix: &mut Csr) {
    for NodalBlock { nodes, block } in blocks {
        let [rows, columns] = nodes.map(|node| frame.movers(node));
        if graph.has(rows.node) {
            graph.add_moved([&rows, &columns], |i, j| block[i][j], matrix);
        }
    }
}

/// The reason why a body could not be assembled.
#[derive(Debug, Clone, PartialEq)]
pub enum Defect {
    /// The cell of this index within the body has a singular or inverted map.
    Inverted(usize),
    /// A point has no elasticity: index of the cell's spec, point (x, y, z), and reason.
    Elasticity(usize, [f64; 3], Flaw),
}

/// The quadrature rules of strain energies.
pub struct Rules {
    /// Rule of straight cells with constant elasticity.
    affine: Rule,
    /// Rule of curved cells with constant elasticity.
    curved: Rule,
    /// Rule of cells with varying elasticity, and of bodies of revolution.
    varying: Rule,
}

impl Rules {
    /// Make the rules for elements of this order.
    pub fn new<const D: usize>(order: Order) -> Self {
        let of_degree = |degree: usize| quadrature::simplex(D + 1, degree);
        let (affine, varying) = if order == Order::P1 { (1, 2) } else { (2, 5) };
        Self { affine: of_degree(affine), curved: of_degree(5), varying: of_degree(varying) }
    }

    /// Return the rule for a cell with node coordinates `x`, in which Hooke's law `is_constant` or not.
    pub fn of<const D: usize>(&self, x: &[[f64; D]], is_constant: bool, axisymmetric: bool) -> &Rule {
        match is_constant && !axisymmetric {
            false => &self.varying,
            true if is_straight(x, D + 1) => &self.affine,
            true => &self.curved,
        }
    }
}

/// Assemble the stiffness matrix of a space on a graph, which may have the rows of some nodes only. `frame` ties nodes; its axes are
/// not applied. The rows of the pole of a surface that turns are on the graph if those of the master are.
///
/// Where the elasticity varies within a cell, and in bodies of revolution, it is evaluated at the points of a rule of degree 2
/// (P1) or 5 (P2). All of these points lie off the axis.
///
/// # Errors
/// [`Defect`]: a cell whose map is not invertible at an integration point, or a point without elasticity.
pub fn stiffness<const D: usize>(
    space: &Space<D>,
    graph: &NodeGraph,
    frame: &Frame<D>,
    elasticity: &Elasticity,
) -> Result<Csr, Defect> {
    let mut matrix = graph.matrix::<D>();
    let mut integrator = CellIntegrator::new(space, elasticity);
    for (index, cell) in space.cells.chunks_exact(space.stride).enumerate() {
        let mut movers = [Movers { node: 0, rotation: None }; element::MOST];
        movers.iter_mut().zip(cell).for_each(|(movers, &node)| *movers = frame.movers(node));
        let movers = &movers[..cell.len()];
        if movers.iter().any(|movers| graph.has(movers.node)) {
            let blocks = integrator.stiffness(index)?;
            scatter(graph, movers, blocks, &mut matrix);
        }
    }
    Ok(matrix)
}

/// An integrator of cell stiffness matrices, with its work arrays.
struct CellIntegrator<'a, const D: usize> {
    space: &'a Space<D>,
    elasticity: &'a Elasticity,
    rules: Rules,
    /// Node coordinates of the cell.
    x: Vec<[f64; D]>,
    /// Shape functions over the radius at a point of a body of revolution; empty in other bodies.
    hoop: Vec<f64>,
    /// Blocks of the cell's stiffness matrix, `stride` x `stride`. Only those with row <= column are set.
    blocks: Vec<[[f64; D]; D]>,
}

impl<'a, const D: usize> CellIntegrator<'a, D> {
    fn new(space: &'a Space<D>, elasticity: &'a Elasticity) -> Self {
        let (rules, stride) = (Rules::new::<D>(space.order), space.stride);
        let (x, blocks) = (vec![[0.0; D]; stride], vec![[[0.0; D]; D]; stride * stride]);
        Self { space, elasticity, rules, x, hoop: Vec::new(), blocks }
    }

    /// Return the blocks of the stiffness matrix of cell `index`.
    fn stiffness(&mut self, index: usize) -> Result<&[[[f64; D]; D]], Defect> {
        let Self { space, elasticity, rules, x, hoop, blocks } = self;
        let stride = space.stride;
        for (x, &node) in x.iter_mut().zip(space.cell(index)) {
            *x = space.nodes[node as usize];
        }
        blocks.fill([[0.0; D]; D]);
        let constant = elasticity.constant_in(index);
        for (l, weight) in rules.of(x, constant.is_some(), space.axisymmetric).iter() {
            let (gradient, measure) = element::gradients(space.order, x, l).ok_or(Defect::Inverted(index))?;
            let gradient = &gradient[..stride];
            let mut weight = weight * measure;
            if space.axisymmetric {
                let phi = element::values(space.order, l);
                let at = interpolate(x, &phi);
                weight *= space.circle(&at);
                hoop.clear();
                hoop.extend(phi[..stride].iter().map(|&phi| space.hoop(&at, phi)));
            }
            match constant {
                Some(material) => material.accumulate(gradient, hoop, weight, blocks),
                None => {
                    let at = space.in_scene(interpolate(x, &element::values(space.order, l)));
                    let material = elasticity
                        .at(index, at)
                        .map_err(|flaw| Defect::Elasticity(elasticity.region(index), at, flaw))?;
                    material.accumulate(gradient, hoop, weight, blocks);
                }
            }
        }
        Ok(blocks)
    }
}

/// Add the symmetric stiffness matrix of a cell to a matrix. `movers` are the nodes that move each node of the cell.
fn scatter<const D: usize>(graph: &NodeGraph, movers: &[Movers<D>], blocks: &[[[f64; D]; D]], matrix: &mut Csr) {
    let stride = movers.len();
    for (a, of_a) in movers.iter().enumerate() {
        for (b, of_b) in movers.iter().enumerate().skip(a) {
            let block = &blocks[a * stride + b];
            if graph.has(of_a.node) {
                graph.add_moved([of_a, of_b], |i, j| block[i][j], matrix);
            }
            if a != b && graph.has(of_b.node) {
                graph.add_moved([of_b, of_a], |i, j| block[j][i], matrix);
            }
        }
    }
}

/// Return whether the mid-edge nodes of a simplex with `vertices` vertices lie in the middle of straight edges, up to rounding of
/// the coordinates `x`.
pub fn is_straight<const D: usize>(x: &[[f64; D]], vertices: usize) -> bool {
    element::EDGES[..x.len() - vertices].iter().enumerate().all(|(k, &(i, j))| {
        let length: f64 = (0..D).map(|c| (x[i][c] - x[j][c]).abs()).sum();
        (0..D).all(|c| (2.0 * x[vertices + k][c] - x[i][c] - x[j][c]).abs() <= 1e-9 * length)
    })
}

/// Return the nodal forces of a body force `density` (per volume) on the cells of a space.
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
        let cell = space.cell(index);
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

/// Return the point of an element with node coordinates `x` and shape function values `phi`.
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
