//! The linear system of a body: stiffness matrix and loads by direct scatter into compressed rows, and the elimination
//! of supports.
//!
//! The pattern is built once from the node graph, which holds the couplings through cells and through contact rows.
//! Positions of entries follow from the graph by arithmetic, so that assembly adds each value directly to its entry.

use super::elasticity::{Elasticity, Flaw, Material};
use super::element::{self, Rule};
use super::frame::{Frame, place};
use super::space::{CellPoint, Space};
use super::{lagrange, length, pad};
use crate::exchange::Plain;
use crate::linalg::{Csr, Total, axpy, dot};
use crate::problem::order::Order;
use nalgebra::SMatrix;
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

    /// Build the graph of a space's cells plus `extra` sets of nodes that are coupled among themselves. These are the
    /// nodes of each contact row, the pattern of B'B. The nodes that `frame` ties are represented by those that move
    /// them. Their own rows have the diagonal alone.
    pub fn new<const D: usize>(space: &Space<D>, extra: &[Vec<u32>], frame: &Frame<D>) -> Self {
        let n = space.nodes.len();
        let merged: Vec<u32> =
            if frame.is_empty() { Vec::new() } else { space.cells.iter().map(|&node| frame.node(node)).collect() };
        let cells = if merged.is_empty() { &space.cells } else { &merged };
        let constrained: Vec<Vec<u32>> =
            constrained_cells(space, frame).chain(frame.tied().map(|node| vec![node])).collect();
        let others: Vec<&[u32]> = extra.iter().chain(&constrained).map(Vec::as_slice).collect();
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

    /// Add a block k of nodal stiffness between two nodes to a matrix on this graph, as C'k C in the rows and columns
    /// of the dofs that move them. Rows that the graph lacks are left out.
    fn add_moved<const D: usize>(&self, [a, b]: [&MovedNode<D>; 2], k: SMatrix<f64, D, D>, matrix: &mut Csr) {
        let no_columns = |i: u32, k: SMatrix<f64, D, D>, matrix: &mut Csr| {
            if !self.has(i) {
                return;
            }
            if b.row.is_empty() {
                self.add_block([i, b.node], k, matrix);
            }
            b.row.iter().for_each(|(j, c)| self.add_block([i, *j], k * c, matrix));
        };
        if a.row.is_empty() {
            no_columns(a.node, k, matrix);
        }
        a.row.iter().for_each(|(i, c)| no_columns(*i, c.tr_mul(&k), matrix));
    }

    /// Add a block to a matrix on this graph, in the rows of node `i` and the columns of node `j`.
    fn add_block<const D: usize>(&self, [i, j]: [u32; 2], block: SMatrix<f64, D, D>, matrix: &mut Csr) {
        let (from, to) = (self.ptr[i as usize] as usize, self.ptr[i as usize + 1] as usize);
        let Ok(place) = self.col[from..to].binary_search(&j) else {
            unreachable!("the graph holds every pair of nodes of a cell")
        };
        let (start, row_length) = (D * D * from + D * place, D * (to - from));
        for i in 0..D {
            for j in 0..D {
                matrix.values[start + i * row_length + j] += block[(i, j)];
            }
        }
    }
}

/// A node with the dofs that move it.
struct MovedNode<'a, const D: usize> {
    node: u32,
    /// Its row of u = T v; empty if it has its own dofs.
    row: &'a [(u32, SMatrix<f64, D, D>)],
}

impl<'a, const D: usize> MovedNode<'a, D> {
    fn new(node: u32, frame: &'a Frame<D>) -> Self {
        Self { node, row: frame.row(node) }
    }
}

/// Return, for each cell with nodes that the dofs of several nodes move, the nodes of these dofs.
fn constrained_cells<'a, const D: usize>(
    space: &'a Space<D>,
    frame: &'a Frame<D>,
) -> impl Iterator<Item = Vec<u32>> + use<'a, D> {
    let cells = space.cells.chunks_exact(space.stride).filter(|_| !frame.is_empty());
    let cells = cells.filter(|cell| cell.iter().any(|&node| frame.row(node).len() > 1));
    cells.map(|cell| {
        let others = cell.iter().flat_map(|&node| frame.row(node).iter().map(|entry| entry.0));
        Space::<D>::among(cell.iter().map(|&node| frame.node(node)).chain(others))
    })
}

/// Invert a list of sets of nodes below `n`. Return row starts, n + 1 entries, and the indices of the sets that contain
/// each node.
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
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
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
        let [a, b] = nodes.map(|node| MovedNode::new(node, frame));
        graph.add_moved([&a, &b], SMatrix::from_fn(|i, j| block[i][j]), matrix);
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
        let of_degree = |degree: usize| element::rule(D + 1, degree).with_shapes(order);
        let degree = order.degree();
        let varying = element::rule_of_products(D + 1, order).with_shapes(order);
        Self { affine: of_degree(2 * degree - 2), curved: of_degree(2 * degree + 1), varying }
    }

    /// Return the rule for a cell.
    fn of<const D: usize>(&self, space: &Space<D>, elasticity: &Elasticity, cell: usize) -> &Rule {
        match elasticity.is_constant_in(cell) && !space.axisymmetric {
            false => &self.varying,
            true if space.is_straight(cell) => &self.affine,
            true => &self.curved,
        }
    }
}

/// Visit the integration points of the strain energy of a cell, with Hooke's law there.
///
/// # Errors
/// [`Defect`]: a point where the map of the cell is not invertible, or without elasticity.
pub fn visit<const D: usize>(
    space: &Space<D>,
    elasticity: &Elasticity,
    rules: &Rules,
    cell: usize,
    mut each: impl FnMut(&CellPoint<D>, &Material),
) -> Result<(), Defect> {
    for point in space.points(cell, rules.of(space, elasticity, cell)) {
        let point = point.ok_or(Defect::Inverted(cell))?;
        let at = space.in_scene(point.at);
        let flawed = |flaw| Defect::Elasticity(elasticity.region(cell), at, flaw);
        each(&point, &elasticity.at(cell, at).map_err(flawed)?);
    }
    Ok(())
}

/// Assemble the stiffness matrix of a space in the dofs of `frame` on a graph, which may have the rows of some nodes
/// only.
///
/// Where the elasticity varies within a cell, and in bodies of revolution, it is evaluated at the points of a rule of
/// degree 2 (P1) or 5 (P2). All of these points lie off the axis.
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
    let (rules, stride) = (Rules::new::<D>(space.order), space.stride);
    // Only the blocks with row <= column are set.
    let mut blocks = vec![[[0.0; D]; D]; stride * stride];
    for index in 0..space.cell_count() {
        let nodes: Vec<MovedNode<D>> = space.cell(index).iter().map(|&node| MovedNode::new(node, frame)).collect();
        if !nodes.iter().any(|moved| graph.has(frame.node(moved.node))) {
            continue;
        }
        blocks.fill([[0.0; D]; D]);
        let is_affine = space.order > Order::P2 && !space.axisymmetric && elasticity.is_constant_in(index);
        if is_affine && space.is_straight(index) {
            affine(space, elasticity, index, &mut blocks)?
        } else {
            visit(space, elasticity, &rules, index, |point, material| {
                let hoop = |phi: &f64| space.hoop(&point.at, *phi);
                let hoops: Vec<f64> = point.phi.iter().filter(|_| space.axisymmetric).map(hoop).collect();
                material.accumulate(&point.gradient, &hoops, point.weight, &mut blocks);
            })?
        }
        scatter(graph, &nodes, &blocks, &mut matrix);
    }
    Ok(matrix)
}

/// Compute the blocks of a straight triangle with one elasticity from the products of the derivatives on the reference
/// triangle: with the gradients g_c of the barycentric coordinates, phi_a has the gradient sum_c phi_a,c g_c.
fn affine<const D: usize>(
    space: &Space<D>,
    elasticity: &Elasticity,
    cell: usize,
    blocks: &mut [[[f64; D]; D]],
) -> Result<(), Defect> {
    let corners = &space.cell_nodes(cell)[..=D];
    let centre = [1.0 / (D + 1) as f64; 4];
    let (gradient, measure) =
        element::gradients(corners, &element::derivatives(Order::P1, &centre[..=D])).ok_or(Defect::Inverted(cell))?;
    let at = space.in_scene(element::interpolate(corners, &centre));
    let material = elasticity.at(cell, at).map_err(|flaw| Defect::Elasticity(elasticity.region(cell), at, flaw))?;
    let (pairs, stride) = (material.blocks_of(&gradient[1..], measure), space.stride);
    for (index, (block, products)) in blocks.iter_mut().zip(lagrange::of(space.order, D + 1).products()).enumerate() {
        if index % stride < index / stride {
            continue;
        }
        for (pair, product) in pairs.iter().zip(products.as_flattened()) {
            for (sum, term) in block.as_flattened_mut().iter_mut().zip(pair.as_flattened()) {
                *sum += product * term;
            }
        }
    }
    Ok(())
}

/// Add the symmetric stiffness matrix of a cell to a matrix.
fn scatter<const D: usize>(graph: &NodeGraph, nodes: &[MovedNode<D>], blocks: &[[[f64; D]; D]], matrix: &mut Csr) {
    let stride = nodes.len();
    if nodes.iter().all(|node| node.row.is_empty()) {
        return scatter_free(graph, nodes, blocks, matrix);
    }
    for (a, of_a) in nodes.iter().enumerate() {
        for (b, of_b) in nodes.iter().enumerate().skip(a) {
            let block = SMatrix::from_fn(|i, j| blocks[a * stride + b][i][j]);
            graph.add_moved([of_a, of_b], block, matrix);
            if a != b {
                graph.add_moved([of_b, of_a], block.transpose(), matrix);
            }
        }
    }
}

/// Add the symmetric stiffness matrix of a cell whose nodes have their own dofs. Rows of the graph are sorted, so that
/// one walk finds all nodes of the cell.
fn scatter_free<const D: usize>(graph: &NodeGraph, nodes: &[MovedNode<D>], blocks: &[[[f64; D]; D]], matrix: &mut Csr) {
    let stride = nodes.len();
    let mut sorted: Vec<usize> = (0..stride).collect();
    sorted.sort_unstable_by_key(|&a| nodes[a].node);
    for (a, of_a) in nodes.iter().enumerate().filter(|(_, of_a)| graph.has(of_a.node)) {
        let (from, to) = (graph.ptr[of_a.node as usize] as usize, graph.ptr[of_a.node as usize + 1] as usize);
        let (row, length) = (&graph.col[from..to], D * (to - from));
        let mut place = 0;
        for &b in &sorted {
            while row[place] != nodes[b].node {
                place += 1;
            }
            let block = &blocks[a.min(b) * stride + a.max(b)];
            for i in 0..D {
                let at = &mut matrix.values[D * D * from + i * length + D * place..][..D];
                for (j, value) in at.iter_mut().enumerate() {
                    *value += if a <= b { block[i][j] } else { block[j][i] };
                }
            }
        }
    }
}

/// The forces at nodes that are not zero, since most loads act on surfaces only.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(bound = "[f64; D]: Plain")]
pub struct NodalForces<const D: usize> {
    /// Nodes of the forces, sorted, each once.
    nodes: Vec<u32>,
    forces: Vec<[f64; D]>,
}

impl<const D: usize> NodalForces<D> {
    /// Collect the forces at the sorted `nodes`, with `D` components each.
    pub fn new(nodes: impl Iterator<Item = u32>, forces: &[f64]) -> Self {
        let forces = forces.chunks_exact(D).map(|force| std::array::from_fn(|c| force[c]));
        let (nodes, forces) = nodes.zip(forces).filter(|(_, force): &(u32, [f64; D])| *force != [0.0; D]).unzip();
        Self { nodes, forces }
    }

    /// Return the nodes and their forces.
    pub fn iter(&self) -> impl Iterator<Item = (u32, [f64; D])> {
        self.nodes.iter().copied().zip(self.forces.iter().copied())
    }

    /// Return the sum of these and other forces.
    #[must_use]
    pub fn and(self, others: Self) -> Self {
        if self.nodes.is_empty() || others.nodes.is_empty() {
            return if self.nodes.is_empty() { others } else { self };
        }
        // At each node the force of `self` is added first.
        self.iter().chain(others.iter()).collect()
    }

    /// Return the forces at the nodes for which `keep` holds.
    #[must_use]
    pub fn only(&self, keep: impl Fn(u32) -> bool) -> Self {
        let (nodes, forces) = self.iter().filter(|(node, _)| keep(*node)).unzip();
        Self { nodes, forces }
    }

    /// Return the resultant of the forces.
    pub fn sum(&self) -> [f64; 3] {
        std::array::from_fn(|c| self.forces.iter().map(|&force| pad(force)[c]).collect::<Total>().value())
    }

    /// Return the work of the forces on a displacement, and the largest work of forces and displacements of these sizes
    /// at each node. `at` gives the displacement of a node.
    pub fn works(&self, at: impl Fn(u32) -> [f64; D]) -> [f64; 2] {
        let [mut work, mut largest] = [Total::default(); 2];
        for (node, force) in self.iter() {
            let u = at(node);
            work.add(dot(&u, &force));
            largest.add(length(u) * length(force));
        }
        [work.value(), largest.value()]
    }

    /// Return the forces at all dofs of a body with so many nodes.
    pub fn all(&self, nodes: usize) -> Vec<f64> {
        let mut all = vec![0.0; D * nodes];
        self.iter().for_each(|(node, force)| all[D * node as usize..][..D].copy_from_slice(&force));
        all
    }

    /// Return the forces at the sorted `nodes`, renumbered by their positions in this slice.
    #[must_use]
    pub fn on(&self, nodes: &[u32]) -> Self {
        let (nodes, forces) = self.iter().filter_map(|(node, force)| Some((place(nodes, node)?, force))).unzip();
        Self { nodes, forces }
    }

    /// Return whether all forces are finite.
    pub fn is_finite(&self) -> bool {
        self.forces.as_flattened().iter().all(|f| f.is_finite())
    }
}

impl<const D: usize> FromIterator<(u32, [f64; D])> for NodalForces<D> {
    /// Collect forces at nodes in any order. The forces at one node are added in their order.
    fn from_iter<I: IntoIterator<Item = (u32, [f64; D])>>(forces: I) -> Self {
        let mut all: Vec<(u32, [f64; D])> = forces.into_iter().collect();
        all.sort_by_key(|entry| entry.0);
        let sum = |at: &[(u32, [f64; D])]| {
            (at[0].0, at[1..].iter().fold(at[0].1, |sum, (_, force)| std::array::from_fn(|c| sum[c] + force[c])))
        };
        let (nodes, forces) = all.chunk_by(|a, b| a.0 == b.0).map(sum).unzip();
        Self { nodes, forces }
    }
}

/// Return the nodal forces of a body force `density` (per volume) on the cells of a space.
pub fn body_force<const D: usize>(space: &Space<D>, density: &dyn Fn([f64; D]) -> [f64; D]) -> NodalForces<D> {
    let low = space.order == Order::P1 && !space.axisymmetric;
    let of_order = if low { Order::P1 } else { space.order.max(Order::P2) };
    let rule = element::rule_of_products(D + 1, of_order).with_shapes(space.order);
    let (space, nodes) = space.part(0..space.cell_count());
    let mut load = vec![0.0; space.dofs()];
    for index in 0..space.cell_count() {
        for point in space.points(index, &rule).flatten() {
            let force = density(point.at);
            for (phi, &node) in point.phi.iter().zip(point.cell) {
                for c in 0..D {
                    load[D * node as usize + c] += point.weight * phi * force[c];
                }
            }
        }
    }
    NodalForces::new(nodes.into_iter(), &load)
}

/// The load of initial strains eps0 = alpha T, which act like a stress C eps0 at every point.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct InitialLoad {
    /// `int eps0 : C eps(v)` for every shape function v, one entry a dof; empty without initial strains.
    pub force: Vec<f64>,
    /// `int eps0 : C eps0`.
    pub energy: f64,
}

/// Return the load of the initial strains at the nodes of a space. Its energy is that of the cells for which `counts`
/// holds.
///
/// # Errors
/// [`Defect`]: a cell whose map is not invertible at an integration point, or a point without elasticity or
/// temperature.
pub fn initial_load<const D: usize>(
    space: &Space<D>,
    elasticity: &Elasticity,
    counts: impl Fn(&[u32]) -> bool,
) -> Result<InitialLoad, Defect> {
    if !elasticity.is_heated() {
        return Ok(InitialLoad::default());
    }
    let rule = element::rule_of_products(D + 1, space.order).with_shapes(space.order);
    let mut load = InitialLoad { force: vec![0.0; space.dofs()], energy: 0.0 };
    for index in 0..space.cell_count() {
        for point in space.points(index, &rule) {
            let point = point.ok_or(Defect::Inverted(index))?;
            let at = space.in_scene(point.at);
            let flawed = |flaw| Defect::Elasticity(elasticity.region(index), at, flaw);
            let strain = elasticity.initial_strain(index, at).map_err(flawed)?;
            let stress = elasticity.at(index, at).map_err(flawed)?.stress(&strain);
            point.add_stress(point.weight, &stress, &mut load.force);
            load.energy += if counts(point.cell) { point.weight * dot(&stress, &strain) } else { 0.0 };
        }
    }
    Ok(load)
}

/// The load f of a discretised elastic body, and the terms that were eliminated from K with the prescribed dofs.
///
/// A prescribed dof c with the value u_c stays as a row of K with one entry, `K[c][c]` = a typical diagonal, and `f[c]
/// = K[c][c] u_c`. Its residual then vanishes at the prescribed value. Its column is moved to the right-hand side.
#[derive(Debug, Clone, Default)]
pub struct Loads {
    /// Load vector f, one entry a dof.
    pub load: Vec<f64>,
    /// Prescribed (dof, value), sorted by dof.
    pub prescribed: Vec<(usize, f64)>,
    /// K_fc u_c less the load of initial strains on the free dofs f, the part of -f that belongs to the strain energy;
    /// empty if no prescribed value differs from zero and there are no initial strains.
    pub lifting: Vec<f64>,
    /// Constant to be added to u'Ku/2 - f'u to give the potential energy of the body.
    pub energy_constant: f64,
    /// Constant to be added to u'Ku + 2 lifting'u to give twice the strain energy: u_c'K_cc u_c with the original K_cc
    /// less the value with the scaled diagonal, and what initial strains add.
    pub strain_constant: f64,
    /// The entries (row, column, value) of K that were eliminated in the columns of the prescribed dofs, row by row.
    /// [`Loads::reload`] needs them; empty where it is not used.
    pub eliminated: Vec<(u32, u32, f64)>,
    /// Present value of `K[c][c]` of prescribed dofs c.
    pub diagonal: f64,
}

impl Loads {
    /// Replace the loads f without those of initial strains, one entry a dof, the `initial` ones, and the values at the
    /// same prescribed dofs (dof, value).
    pub fn reload(&mut self, load: Vec<f64>, initial: &InitialLoad, mut prescribed: Vec<(usize, f64)>) {
        let n = load.len();
        let (mut value, mut has_row, scale) = (vec![None; n], vec![false; n], self.diagonal);
        prescribed.iter().for_each(|&(dof, u)| value[dof] = Some(u));
        let is_moved = prescribed.iter().any(|&(_, u)| u != 0.0);
        self.lifting = if is_moved { vec![0.0; n] } else { Vec::new() };
        self.strain_constant = 0.0;
        for &(i, j, k) in &self.eliminated {
            let (i, j) = (i as usize, j as usize);
            has_row[i] |= i == j;
            let of_column = k * value[j].unwrap_or(0.0);
            match value[i] {
                None if is_moved => self.lifting[i] += of_column,
                None => {}
                Some(u) => self.strain_constant += u * of_column,
            }
        }
        prescribed.retain(|entry| has_row[entry.0]);
        self.load = load;
        self.load.iter_mut().zip(&self.lifting).for_each(|(load, lifting)| *load -= lifting);
        self.add_initial(initial, &prescribed);
        self.energy_constant = 0.5 * self.strain_constant;
        for &(dof, u) in &prescribed {
            self.energy_constant += 0.5 * scale * u * u - self.load[dof] * u;
            self.strain_constant -= scale * u * u;
            self.load[dof] = scale * u;
        }
        self.prescribed = prescribed;
    }

    /// Add initial strains to the strain energy u'Ku, which becomes the integral of (eps - eps0) : C (eps - eps0), and
    /// to the loads of free dofs.
    fn add_initial(&mut self, initial: &InitialLoad, prescribed: &[(usize, f64)]) {
        if initial.force.is_empty() {
            return;
        }
        let mut free = initial.force.clone();
        prescribed.iter().for_each(|entry| free[entry.0] = 0.0);
        self.lifting.resize(free.len(), 0.0);
        axpy(-1.0, &free, &mut self.lifting);
        axpy(1.0, &free, &mut self.load);
        let work: f64 = prescribed.iter().map(|&(dof, u)| initial.force[dof] * u).sum();
        self.strain_constant += initial.energy - 2.0 * work;
    }
}

/// Eliminate prescribed dofs from K and f, symmetrically, and keep the terms that energies need.
///
/// `prescribed` holds (dof, value), sorted, without repetition. Empty rows of K belong to other ranks, which also
/// account for their energies. `initial` is the load of initial strains, which f does not have.
pub fn support(stiffness: &mut Csr, load: Vec<f64>, initial: &InitialLoad, prescribed: Vec<(usize, f64)>) -> Loads {
    let n = load.len();
    let mut is_free = vec![true; n];
    prescribed.iter().for_each(|entry| is_free[entry.0] = false);
    let free: Vec<f64> =
        (0..n).filter(|&i| is_free[i]).filter_map(|i| stiffness.position(i, i).map(|k| stiffness.values[k])).collect();
    let diagonal = if free.is_empty() { 1.0 } else { free.iter().sum::<f64>() / free.len() as f64 };
    let mut eliminated = Vec::new();
    for i in 0..n {
        for k in stiffness.range(i) {
            let j = stiffness.col[k] as usize;
            if !is_free[j] {
                eliminated.push((i as u32, j as u32, stiffness.values[k]));
            }
            if !(is_free[i] && is_free[j]) {
                stiffness.values[k] = if i == j { diagonal } else { 0.0 };
            }
        }
    }
    let mut loads = Loads { eliminated, diagonal, ..Loads::default() };
    loads.reload(load, initial, prescribed);
    loads
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Return the matrix K = [[3, -1], [-1, 2]] of two dofs with springs between them and to the ground.
    fn springs() -> Csr {
        let mut k = Csr::new(2);
        k.push_row([(0, 3.0), (1, -1.0)]);
        k.push_row([(0, -1.0), (1, 2.0)]);
        k
    }

    /// Return loads of initial strains with this share.
    fn initial(share: f64) -> InitialLoad {
        InitialLoad { force: vec![0.3 * share, -0.2 * share], energy: 0.9 * share * share }
    }

    #[test]
    fn a_prescribed_value_keeps_energies_and_equilibrium() {
        for heat in [InitialLoad::default(), initial(1.0), initial(-2.0)] {
            let of_heat = |i: usize| heat.force.get(i).copied().unwrap_or(0.0);
            let mut stiffness = springs();
            let body = support(&mut stiffness, vec![5.0, 0.7], &heat, vec![(1, 0.4)]);
            let u = [(5.0 + of_heat(0) + 0.4) / 3.0, 0.4];
            let mut ku = [0.0; 2];
            stiffness.multiply(&u, &mut ku);
            let residual: f64 = (0..2).map(|i| (body.load[i] - ku[i]).abs()).sum();
            assert!(residual < 1e-15, "{residual}");
            let mut full = [0.0; 2];
            springs().multiply(&u, &mut full);
            let elastic = dot(&u, &full) - 2.0 * (of_heat(0) * u[0] + of_heat(1) * u[1]) + heat.energy;
            let strain = dot(&u, &ku) + 2.0 * dot(&body.lifting, &u) + body.strain_constant;
            assert!((strain - elastic).abs() < 1e-14);
            let energy = 0.5 * dot(&u, &ku) - dot(&body.load, &u) + body.energy_constant;
            let exact = 0.5 * elastic - 5.0 * u[0] - 0.7 * u[1];
            assert!((energy - exact).abs() < 1e-14, "{energy} {exact}");
        }
    }

    /// Reloaded loads equal those that are made with the other values.
    #[test]
    fn a_body_takes_other_loads() {
        for (u, heat) in [(0.4, InitialLoad::default()), (0.0, initial(1.0)), (0.4, initial(3.0))] {
            let mut body = support(&mut springs(), vec![1.0, 2.0], &initial(-1.0), vec![(1, -0.3)]);
            body.reload(vec![5.0, 0.7], &heat, vec![(1, u)]);
            let new = support(&mut springs(), vec![5.0, 0.7], &heat, vec![(1, u)]);
            assert_eq!((&body.load, &body.prescribed, &body.lifting), (&new.load, &new.prescribed, &new.lifting));
            assert_eq!([body.energy_constant, body.strain_constant], [new.energy_constant, new.strain_constant]);
        }
    }
}
