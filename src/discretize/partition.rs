//! The partition of the nodes of bodies over the ranks. Each node of the bodies in one matrix has one owner, and a
//! number in that matrix. The coupling of the nodes determines the work and the memory of each.

use super::body_mesh::BodyMesh;
use super::scene_body::SceneBody;
use crate::contact::ContactPair;
use crate::exchange::Serial;
use crate::fem::{NodalBlock, Space, place};
use crate::linalg::Csr;
use crate::mesh::bisect;
use crate::model::Distribution;
use nalgebra::DMatrix;
use std::cell::OnceCell;
use std::collections::HashMap;
use std::rc::Rc;

/// The ranks of a body.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BodyRanks {
    /// The rank that owns the body or, if it is distributed, most of it.
    pub leader: usize,
    /// All ranks that own nodes of it.
    pub all: Vec<usize>,
}

/// Bodies whose rows of K are in one matrix, with the owner of each of their nodes. It exists on the first rank.
pub struct Partition {
    /// Indices of the bodies in the scene, in increasing order.
    pub bodies: Vec<usize>,
    ranks: usize,
    /// Rank that owns each node of each body.
    owner: Vec<Vec<u32>>,
    /// Numbers of all nodes of each body.
    nodes: NodeNumbers,
    /// Numbers of the nodes of each body from which displacements are interpolated, if an interpolation is requested.
    coarse: NodeNumbers,
    /// [`BodyMesh::products`] of each body.
    products: Vec<DMatrix<f64>>,
}

/// Numbers of nodes of the bodies in one matrix. They run rank by rank, within a rank body by body, and within a body
/// in the order of the nodes.
struct NodeNumbers {
    /// Number of each node of each body; [`NONE`] for nodes without a number.
    of_node: Vec<Vec<u32>>,
    /// Count of the nodes of each body on each rank: `counts[rank][body]`.
    counts: Vec<Vec<usize>>,
}

/// The mark of a node without a number. No node has it, since numbers of dofs, at least twice as large, fit 32 bits
/// with a sign.
const NONE: u32 = u32::MAX;

impl NodeNumbers {
    /// Number the nodes for which `is_counted(body, node)` is true.
    fn new(owner: &[Vec<u32>], ranks: usize, is_counted: impl Fn(usize, u32) -> bool) -> Self {
        let is_counted = &is_counted;
        let counted = |body: usize| {
            let nodes = (0..).zip(&owner[body]).map(|(node, &rank)| (node, rank as usize));
            nodes.filter(move |(node, _)| is_counted(body, *node))
        };
        let mut counts = vec![vec![0; owner.len()]; ranks];
        for body in 0..owner.len() {
            counted(body).for_each(|(_, rank)| counts[rank][body] += 1);
        }
        let mut first = 0;
        let mut next: Vec<Vec<u32>> = vec![vec![0; owner.len()]; ranks];
        for (next, count) in next.iter_mut().flatten().zip(counts.iter().flatten()) {
            *next = first;
            first += *count as u32;
        }
        let mut of_node: Vec<Vec<u32>> = owner.iter().map(|owner| vec![NONE; owner.len()]).collect();
        for (body, of_node) in of_node.iter_mut().enumerate() {
            for (node, rank) in counted(body) {
                of_node[node as usize] = next[rank][body];
                next[rank][body] += 1;
            }
        }
        Self { of_node, counts }
    }

    /// Return how many nodes these ranks own.
    fn sum(&self, ranks: std::ops::Range<usize>) -> usize {
        self.counts[ranks].iter().flatten().sum()
    }
}

impl Partition {
    /// Distribute the nodes of the bodies in `set` by recursive bisection. The weight of a node is the number of nodes
    /// with which it is coupled in the matrix. The pole of a rigid surface that turns gets the owner of the master.
    /// `wants_coarse(body)` returns whether a body is interpolated from its coarse nodes.
    pub fn new<const D: usize>(
        set: Vec<usize>,
        bodies: &[SceneBody<D>],
        pairs: &[ContactPair],
        ranks: usize,
        wants_coarse: &dyn Fn(usize) -> bool,
    ) -> Self {
        let nodes_of = |body: usize| &bodies[body].mesh.space.nodes;
        let places: Vec<[f64; D]> = set.iter().flat_map(|&body| nodes_of(body).iter().copied()).collect();
        let mut all = bisect(&places, &couplings(bodies, &set, pairs), ranks).into_iter();
        let of_body = |&body: &usize| all.by_ref().take(nodes_of(body).len()).collect();
        let mut owner: Vec<Vec<u32>> = set.iter().map(of_body).collect();
        for (owner, &body) in owner.iter_mut().zip(&set) {
            for [pole, master] in bodies[body].mesh.held.frame.poles() {
                owner[pole as usize] = owner[master as usize];
            }
        }
        let coarse_nodes =
            |&body: &usize| if wants_coarse(body) { bodies[body].mesh.coarse_nodes() } else { Vec::new() };
        let coarse: Vec<Vec<u32>> = set.iter().map(coarse_nodes).collect();
        let nodes = NodeNumbers::new(&owner, ranks, |_, _| true);
        let coarse = NodeNumbers::new(&owner, ranks, |body, node| coarse[body].binary_search(&node).is_ok());
        let products = set.iter().map(|&body| bodies[body].mesh.products()).collect();
        Self { bodies: set, ranks, owner, nodes, coarse, products }
    }

    /// Return the rank that owns a node. `number` is the index of the body among those of the matrix.
    fn owner(&self, number: usize, node: u32) -> usize {
        self.owner[number][node as usize] as usize
    }

    /// Return the rank that owns most nodes of a body, the first of equal ones.
    pub fn leader(&self, number: usize) -> usize {
        (0..self.ranks).rev().max_by_key(|&rank| self.nodes.counts[rank][number]).unwrap_or(0)
    }

    /// Return the ranks that own nodes of a body.
    pub fn ranks(&self, number: usize) -> Vec<usize> {
        (0..self.ranks).filter(|&rank| self.nodes.counts[rank][number] > 0).collect()
    }

    /// Return the part of a body on the nodes that a rank needs, or on all nodes if `wants_all`. `number` is the index
    /// of the body in its matrix.
    pub fn restrict<const D: usize>(
        &self,
        body: &BodyMesh<D>,
        number: usize,
        rank: usize,
        wants_all: bool,
    ) -> BodyMesh<D> {
        let cells = if wants_all { (0..body.space.cell_count()).collect() } else { self.cells(number, body, rank) };
        let nodes = self.nodes(number, body, &cells, rank);
        let here = |node: u32| place(&nodes, node);
        let dof_here = |dof: usize| Some(D * here((dof / D) as u32)? as usize + dof % D);
        let rows_here = |rows: &Csr| rows.of_columns(D * nodes.len(), dof_here);
        let spring_here = |&NodalBlock { nodes: [a, b], block }: &NodalBlock<D>| {
            Some(NodalBlock { nodes: [here(a)?, here(b)?], block })
        };
        let springs = body.springs.iter().map(|blocks| blocks.iter().filter_map(spring_here).collect());
        let is_assembled = |node: u32| self.owner(number, body.held.frame.node(node)) == rank;
        BodyMesh {
            space: Rc::new(body.space.on(&body.space.corners(&cells), &nodes)),
            regions: if body.regions.is_empty() {
                Vec::new()
            } else {
                cells.iter().map(|&cell| body.regions[cell]).collect()
            },
            held: body.held.on(&nodes),
            springs: springs.collect(),
            points: nodes.iter().map(|&node| body.points[node as usize]).collect(),
            extent: body.extent,
            rows: rows_here(&body.rows),
            nodal_rows: rows_here(&body.nodal_rows),
            approach: rows_here(&body.approach),
            load: body.load.only(is_assembled).on(&nodes),
            motions: body.motions.clone(),
            free: body.free,
            is_owned: true,
            graph: OnceCell::new(),
            distribution: Some(self.distribution::<D>(number, &nodes, &body.rows, rank)),
        }
    }

    /// Return the indices of the cells of a body that a rank needs. These are the cells at its owned nodes, and all
    /// cells that touch these. So the rank has every cell at a node of the cells at its owned nodes. Tied nodes are
    /// assembled on the rank of their master.
    fn cells<const D: usize>(&self, number: usize, body: &BodyMesh<D>, rank: usize) -> Vec<usize> {
        let BodyMesh { space, held, .. } = body;
        let is_own = |node: &u32| self.owner(number, held.frame.node(*node)) == rank;
        let cells = || space.cells.chunks_exact(space.stride);
        let mut is_near = vec![false; space.nodes.len()];
        for cell in cells().filter(|cell| cell.iter().any(is_own)) {
            cell.iter().for_each(|&node| is_near[node as usize] = true);
        }
        let is_wanted = |cell: &[u32]| cell.iter().any(|&node| is_near[node as usize]);
        cells().enumerate().filter(|(_, cell)| is_wanted(cell)).map(|(cell, _)| cell).collect()
    }

    /// Return the nodes of a body that a rank with these cells needs, sorted. They are its owned nodes, those of its
    /// cells and of contact rows, and those that move tied nodes.
    fn nodes<const D: usize>(&self, number: usize, body: &BodyMesh<D>, cells: &[usize], rank: usize) -> Vec<u32> {
        let BodyMesh { space, held, .. } = body;
        let own = (0..space.nodes.len() as u32).filter(|&node| self.owner(number, node) == rank);
        let of_cells = space.corners(cells).into_iter();
        let of_rows = [&body.rows, &body.nodal_rows].into_iter().flat_map(|rows| &rows.col);
        let of_rows = of_rows.map(|&dof| dof as u32 / D as u32);
        Space::<D>::among(own.chain(of_cells).chain(of_rows).chain(held.frame.leaders()))
    }

    /// Return what a rank with these `nodes` of a body has of its dofs. `rows` are the contact rows of the body.
    fn distribution<const D: usize>(&self, number: usize, nodes: &[u32], rows: &Csr, rank: usize) -> Distribution {
        let numbers = &self.nodes.of_node[number];
        let dofs = |node: u32| D as u32 * node..D as u32 * (node + 1);
        let mut others = vec![(Vec::new(), Vec::new()); self.ranks];
        let (mut own, mut owned_positions) = (Vec::new(), Vec::new());
        for (place, &node) in (0..).zip(nodes) {
            let owner = self.owner(number, node);
            if owner == rank {
                own.extend(dofs(node));
                owned_positions.extend(dofs(place));
            } else {
                others[owner].0.extend(dofs(place));
                others[owner].1.extend(dofs(numbers[node as usize]));
            }
        }
        let start = self.nodes.sum(0..rank);
        let before: usize = self.nodes.counts[rank][..number].iter().sum();
        let total = D * self.nodes.sum(0..self.ranks);
        let column = |dof: usize| Some(D * numbers[dof / D] as usize + dof % D);
        let coarse = (0..).zip(nodes).map(|(place, &node)| (place, self.coarse.of_node[number][node as usize]));
        let (coarse_nodes, coarse_number) = coarse.filter(|(_, coarse)| *coarse != NONE).unzip();
        Distribution {
            dofs: D * numbers.len(),
            first: D * (start + before),
            start: D * start,
            own,
            owned_positions,
            ghosts: others,
            products: self.products[number].clone(),
            total,
            rows: rows.of_columns(total, column),
            leads: self.leader(number) == rank,
            coarse_nodes,
            coarse_number,
            coarse_count: self.coarse.sum(0..self.ranks),
            own_coarse: self.coarse.counts[rank][number],
            exchange: Rc::new(Serial),
        }
    }
}

/// Return, for each node of the bodies in `set`, the number of nodes with which it is coupled in a matrix of all of
/// them, itself included. Nodes are coupled by the cells around them and by contact rows. The result runs over one body
/// after the other.
fn couplings<const D: usize>(bodies: &[SceneBody<D>], set: &[usize], pairs: &[ContactPair]) -> Vec<u32> {
    let (mut first, mut all) = (HashMap::new(), Vec::new());
    for &body in set {
        first.insert(body, all.len());
        all.extend(bodies[body].mesh.graph().ptr.windows(2).map(|ends| ends[1] - ends[0]));
    }
    for pair in pairs.iter().filter(|pair| pair.bodies.iter().all(|body| first.contains_key(body))) {
        let nodes = |side: usize, q: usize| pair.rows[side].row(q).map(|(dof, _)| (dof / D) as u32);
        let both = |q: usize| nodes(0, q).flat_map(move |i| nodes(1, q).map(move |j| [i, j]));
        let mut across: Vec<[u32; 2]> = (0..pair.len()).flat_map(both).collect();
        across.sort_unstable();
        across.dedup();
        for nodes in across {
            (0..2).for_each(|side| all[first[&pair.bodies[side]] + nodes[side] as usize] += 1);
        }
    }
    all
}
