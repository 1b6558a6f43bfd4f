//! Forces and moments on a body in the solution: loads, contacts, supports, springs, rigid surfaces, and the imbalance of their
//! sum.

use super::owned::OwnedPart;
use super::supports::Constraints;
use crate::contact::{add, pad};
use crate::fem::{Elasticity, Extent, Frame, NodalBlock, NodeGraph, Space, assemble};
use crate::linalg::Csr;
use std::rc::Rc;

/// A force and its moment about the datum (x, y, z).
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Resultant {
    /// Force.
    pub force: [f64; 3],
    /// Moment.
    pub moment: [f64; 3],
}

impl Resultant {
    /// Add a force at a node.
    fn add<const D: usize>(&mut self, space: &Space<D>, node: u32, force: [f64; D]) {
        add(&mut self.force, space.net_force(force));
        add(&mut self.moment, space.net_moment(node, force));
    }
}

/// All external forces on a body. In equilibrium their sum is zero.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Balance {
    /// Loads without those on rigid surfaces; contacts; then each support, each spring, each rigid surface.
    pub parts: Vec<Resultant>,
    /// Sum of the magnitudes of all nodal forces, and of these times their distances from the datum. They are the scale of the
    /// sum of all parts. About a distant origin, moments would be little else than that of the sum of forces.
    pub size: [f64; 2],
}

/// The data from which the forces on the owned nodes of a part of a body are computed.
pub struct Forces<const D: usize> {
    /// Part of the body.
    pub part: OwnedPart<D>,
    /// Elasticity of its cells.
    pub elasticity: Rc<Elasticity>,
    /// Supports and rigid surfaces.
    pub held: Rc<Constraints<D>>,
    /// Springs.
    pub springs: Vec<Vec<NodalBlock<D>>>,
    /// Number of supports in the scene.
    pub supports: usize,
    /// Nodal forces of the loads.
    pub load: Vec<f64>,
    /// Forces on rigid surfaces, at few nodes of each, all of which have one owner.
    pub rigid: Vec<(u32, [f64; D])>,
    /// Contact rows with displacements of nodes as columns.
    pub rows: Csr,
    /// Extent of the whole body.
    pub extent: Extent,
    /// Number of nodes of the whole body.
    pub nodes: usize,
}

impl<const D: usize> Forces<D> {
    /// Return the contribution of owned nodes to the balance, for displacements `u` of the nodes of the part and the forces omega
    /// p of the contact rows.
    ///
    /// Reactions are the internal forces of the cells around the constrained nodes minus all known forces there.
    pub fn balance(&self, u: &[f64], force: &[f64]) -> Balance {
        let mut contact = vec![0.0; u.len()];
        self.rows.add_transpose(-1.0, force, &mut contact);
        let space = &*self.part.space;
        let mut sum = Sum { size: [0.0; 2], part: &self.part };
        let parts = vec![sum.of(&self.load), sum.of(&contact)];
        let mut known: Vec<f64> = self.load.iter().zip(&contact).map(|(load, contact)| load + contact).collect();
        let mut springs = Vec::new();
        for blocks in &self.springs {
            let mut pull = vec![0.0; u.len()];
            for NodalBlock { nodes: [a, b], block } in blocks {
                for (i, row) in block.iter().enumerate() {
                    let at = D * *b as usize;
                    pull[D * *a as usize + i] -= (0..D).map(|j| row[j] * u[at + j]).sum::<f64>();
                }
            }
            springs.push(sum.of(&pull));
            crate::linalg::axpy(1.0, &pull, &mut known);
        }
        let mut supports = vec![Resultant::default(); self.supports];
        let mut rigid = vec![Resultant::default(); self.held.rigid.len()];
        for (node, reaction) in self.reactions(u, &known) {
            sum.grow(node, reaction);
            match self.held.rigid.iter().position(|(_, nodes)| nodes.binary_search(&node).is_ok()) {
                Some(surface) => rigid[surface].add(space, node, reaction),
                None => {
                    for (support, part) in self.held.split(node, reaction) {
                        supports[support].add(space, node, part);
                    }
                }
            }
        }
        Balance { parts: [parts, supports, springs, rigid].concat(), size: sum.size }
    }

    /// Return the reactions at the owned nodes of supports and rigid surfaces, in increasing order of the nodes.
    fn reactions(&self, u: &[f64], known: &[f64]) -> Vec<(u32, [f64; D])> {
        let OwnedPart { space, own, .. } = &self.part;
        let mut held = vec![false; own.len()];
        let nodes = self.held.nodes().filter(|&node| own[node as usize]);
        nodes.for_each(|node| held[node as usize] = true);
        let touched = |cell: &[u32]| cell.iter().any(|&node| held[node as usize]);
        let cells = space.cells.chunks_exact(space.stride).enumerate().filter(|(_, cell)| touched(cell));
        let cells: Vec<usize> = cells.map(|(number, _)| number).collect();
        let (around, nodes) = space.part(cells.iter().copied());
        let elasticity = self.elasticity.of_cells(&cells);
        let frame = Frame::default();
        let graph = NodeGraph::new(&around, &[], &frame);
        let Ok(stiffness) = assemble::stiffness(&around, &graph, &frame, &elasticity) else { return Vec::new() };
        let dof = |row: usize| D * nodes[row / D] as usize + row % D;
        let force = |row: usize| stiffness.row(row).map(|(j, k)| k * u[dof(j)]).sum::<f64>() - known[dof(row)];
        let at = |place: usize| (nodes[place], std::array::from_fn(|c| force(D * place + c)));
        (0..nodes.len()).filter(|&place| held[nodes[place] as usize]).map(at).collect()
    }
}

/// A sum of forces at owned nodes.
struct Sum<'a, const D: usize> {
    size: [f64; 2],
    part: &'a OwnedPart<D>,
}

impl<const D: usize> Sum<'_, D> {
    fn of(&mut self, forces: &[f64]) -> Resultant {
        let mut resultant = Resultant::default();
        for (node, force) in forces.chunks_exact(D).enumerate().filter(|(node, _)| self.part.own[*node]) {
            let force: [f64; D] = std::array::from_fn(|c| force[c]);
            resultant.add(&self.part.space, node as u32, force);
            self.grow(node as u32, force);
        }
        resultant
    }

    fn grow(&mut self, node: u32, force: [f64; D]) {
        let length = |v: [f64; 3]| v.iter().map(|v| v * v).sum::<f64>().sqrt();
        let size = length(self.part.space.net_force(force));
        self.size[0] += size;
        self.size[1] += size * length(pad(self.part.space.nodes[node as usize]));
    }
}
