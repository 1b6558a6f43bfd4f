//! A body whose nodes are cut apart where its material changes.

use super::elasticity::{Elasticity, Material};
use super::facets::Facets;
use super::space::Space;
use std::borrow::Cow;
use std::collections::{HashMap, HashSet};
use std::rc::Rc;

/// A body with several nodes in place of each one at which its material jumps, one for each material there.
///
/// Strains and stresses jump with the material. So means over the cells around a node, and polynomials fitted to them,
/// belong to one of these nodes and to the cells of one material.
pub struct Split<const D: usize> {
    whole: Rc<Space<D>>,
    /// The nodes and cells after the cut. Cells have the same order as in the body.
    pub space: Rc<Space<D>>,
    /// Node of the body in place of which each node stands.
    origin: Vec<u32>,
}

/// Share of a stiffness by which it changes where a material jumps.
const JUMP: f64 = 1e-3;

/// Distance from a node, as a share of that to the middle of a cell, at which the material of the cell is looked up. An
/// elasticity that changes smoothly, be it by the factor e^100 within a cell, differs by less than [`JUMP`] between the
/// cells around a node.
const BESIDE: f64 = 1e-6;

impl<const D: usize> Split<D> {
    /// Cut a body at all nodes where the material jumps.
    pub fn new(whole: &Rc<Space<D>>, elasticity: &Elasticity) -> Self {
        let origin = (0..whole.nodes.len() as u32).collect();
        let same = Self { whole: whole.clone(), space: whole.clone(), origin };
        if elasticity.is_constant() {
            return same;
        }
        // the first cell of each material at each node, with the number of the new node
        let mut first: Vec<Vec<(usize, usize)>> = vec![Vec::new(); whole.nodes.len()];
        let (mut cells, mut origin) = (Vec::with_capacity(whole.cells.len()), Vec::new());
        for (cell, nodes) in whole.cells.chunks_exact(whole.stride).enumerate() {
            for &node in nodes {
                let at_node = &mut first[node as usize];
                let known = at_node.iter().find(|(other, _)| !jumps(whole, elasticity, node, [*other, cell]));
                cells.push(known.map_or(origin.len(), |known| known.1));
                if known.is_none() {
                    at_node.push((cell, origin.len()));
                    origin.push(node);
                }
            }
        }
        if origin.len() == whole.nodes.len() {
            return same;
        }
        // nodes keep the order of the body
        let mut order: Vec<usize> = (0..origin.len()).collect();
        order.sort_by_key(|&node| origin[node]);
        let mut number = vec![0; order.len()];
        (0..).zip(&order).for_each(|(new, &old)| number[old] = new);
        let origin: Vec<u32> = order.iter().map(|&node| origin[node]).collect();
        let nodes = origin.iter().map(|&node| whole.nodes[node as usize]).collect();
        let cells = cells.into_iter().map(|node| number[node]).collect();
        Self { whole: whole.clone(), space: Rc::new(whole.with(nodes, cells)), origin }
    }

    /// Return the node of the body in place of which a node stands.
    pub fn origin(&self, node: u32) -> u32 {
        self.origin[node as usize]
    }

    /// Return the values at all nodes of values at the nodes of the body, `D` each.
    pub fn values<'v>(&self, of_body: &'v [f64]) -> Cow<'v, [f64]> {
        if self.is_whole() {
            return Cow::Borrowed(of_body);
        }
        self.origin.iter().flat_map(|&node| &of_body[D * node as usize..][..D]).copied().collect()
    }

    /// Return the sums of `values` over the nodes in place of each node of the body, `D` each.
    pub fn sums(&self, values: Vec<f64>) -> Vec<f64> {
        if self.is_whole() {
            return values;
        }
        let mut sums = vec![0.0; self.whole.dofs()];
        for (value, &node) in values.chunks_exact(D).zip(&self.origin) {
            (0..D).for_each(|c| sums[D * node as usize + c] += value[c]);
        }
        sums
    }

    /// Return facets of the boundary of the body with the nodes of the cells that they bound.
    pub fn facets<'f>(&self, facets: &'f Facets<D>) -> Cow<'f, Facets<D>> {
        if self.is_whole() {
            return Cow::Borrowed(facets);
        }
        let mut split = facets.clone();
        for (nodes, cell) in split.nodes.chunks_exact_mut(facets.stride).zip(self.whole.cells_at(facets)) {
            for node in nodes {
                let local = self.whole.cell(cell).iter().position(|corner| corner == node);
                local.iter().for_each(|&local| *node = self.space.cell(cell)[local]);
            }
        }
        Cow::Owned(split)
    }

    fn is_whole(&self) -> bool {
        self.origin.len() == self.whole.nodes.len()
    }
}

/// Return those of some nodes at which the material of a body jumps.
pub fn jumping<const D: usize>(space: &Space<D>, elasticity: &Elasticity, nodes: &[u32]) -> HashSet<u32> {
    let mut found = HashSet::new();
    if elasticity.is_constant() {
        return found;
    }
    let mut first: HashMap<u32, Option<usize>> = nodes.iter().map(|&node| (node, None)).collect();
    for (cell, corners) in space.cells.chunks_exact(space.stride).enumerate() {
        for node in corners {
            if let Some(first) = first.get_mut(node)
                && jumps(space, elasticity, *node, [*first.get_or_insert(cell), cell])
            {
                found.insert(*node);
            }
        }
    }
    found
}

/// Return whether the material of one cell at a node differs from that of another cell there, in stiffness or in
/// expansion.
fn jumps<const D: usize>(space: &Space<D>, elasticity: &Elasticity, node: u32, cells: [usize; 2]) -> bool {
    if elasticity.region(cells[0]) == elasticity.region(cells[1]) && elasticity.is_constant_in(cells[0]) {
        return false;
    }
    let at = space.nodes[node as usize];
    let beside = |cell: usize| {
        let corners = || space.cell(cell)[..=D].iter().map(|&corner| space.nodes[corner as usize]);
        let middle = |c: usize| corners().map(|x| x[c]).sum::<f64>() / (D + 1) as f64;
        let near = std::array::from_fn(|c| at[c] + BESIDE * (middle(c) - at[c]));
        let near = space.in_scene(near);
        (elasticity.at(cell, near).ok(), elasticity.expansion(cell, near).ok())
    };
    let [(stiffness, expansion), (other_stiffness, other_expansion)] = cells.map(beside);
    stiffness.zip(other_stiffness).is_some_and(|(one, other)| differ(&one, &other))
        || expansion.zip(other_expansion).is_some_and(|(one, other)| is_jump(&[one, other]))
}

/// Return whether two laws give stresses that differ by more than a share of [`JUMP`] for some strain of one component.
fn differ(one: &Material, other: &Material) -> bool {
    let stresses = |component: usize| {
        let strain = std::array::from_fn(|i| f64::from(i == component));
        [one.stress(&strain), other.stress(&strain)]
    };
    (0..6).any(|component| is_jump(&stresses(component)))
}

/// Return whether two vectors differ by more than a share of [`JUMP`].
fn is_jump([p, q]: &[[f64; 6]; 2]) -> bool {
    let norm = |vector: &[f64; 6]| vector.iter().map(|v| v * v).sum::<f64>().sqrt();
    let difference = std::array::from_fn(|i| p[i] - q[i]);
    norm(&difference) > JUMP * norm(p).max(norm(q))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::space::sample::block;
    use crate::problem::order::Order;
    use crate::problem::{BodySpec, Plane};

    /// Nodes at the interface of two materials are two nodes, those of facets are of the cells there, and equal
    /// materials have no interface.
    #[test]
    fn nodes_at_an_interface_are_one_for_each_material() {
        for (order, upper) in [(Order::P1, 3.0), (Order::P2, 3.0), (Order::P2, 2.0)] {
            let space = Rc::new(block::<3>(2, order));
            let specs = [2.0, upper].map(|young| BodySpec::new("block", young, 0.3).elasticity());
            let is_upper = |cell: usize| space.cell_nodes(cell)[..4].iter().map(|x| x[2]).sum::<f64>() > 2.0;
            let regions = (0..space.cell_count()).map(|cell| usize::from(is_upper(cell))).collect();
            let elasticity = Elasticity::new(&specs.each_ref(), regions, 3, Plane::Strain).expect("two materials");
            let split = Split::new(&space, &elasticity);
            let between: Vec<usize> = (0..space.nodes.len())
                .filter(|&node| upper != 2.0 && (space.nodes[node][2] - 0.5).abs() < 1e-12)
                .collect();
            assert_eq!(split.space.nodes.len(), space.nodes.len() + between.len());
            assert!(
                (0..split.space.nodes.len())
                    .all(|node| { split.space.nodes[node] == space.nodes[split.origin(node as u32) as usize] })
            );
            let sums = split.sums(split.values(&vec![1.0; space.dofs()]).into_owned());
            assert!(
                (0..space.nodes.len()).all(|node| sums[3 * node] == if between.contains(&node) { 2.0 } else { 1.0 })
            );
            let boundary = space.boundary();
            let facets = split.facets(&boundary);
            for (i, cell) in space.cells_at(&boundary).into_iter().enumerate() {
                let own = split.space.cell(cell);
                assert!(facets.facet(i).iter().all(|node| own.contains(node)));
                assert!(facets.facet(i).iter().zip(boundary.facet(i)).all(|(&new, &old)| split.origin(new) == old));
            }
        }
    }
}
