//! The coupling of the nodes of bodies in their matrix, which determines the work and the memory of each node.

use super::interface::Interface;
use super::part::Part;
use crate::contact::ContactPair;
use crate::fem::NodeGraph;
use std::cell::OnceCell;
use std::collections::HashMap;

/// The couplings of the nodes of all bodies, computed when they are first requested.
pub struct Coupled<'a, const D: usize> {
    parts: &'a [Part<'a, D>],
    interfaces: &'a [Interface<D>],
    graphs: Vec<OnceCell<NodeGraph>>,
}

impl<'a, const D: usize> Coupled<'a, D> {
    /// Prepare the couplings of these bodies without computing them.
    pub fn new(parts: &'a [Part<'a, D>], interfaces: &'a [Interface<D>]) -> Self {
        Self { parts, interfaces, graphs: vec![OnceCell::new(); parts.len()] }
    }

    /// Return the coupling of the nodes of a body by K.
    pub fn graph(&self, body: usize) -> &NodeGraph {
        let (part, rows) = (&self.parts[body], &self.interfaces[body].rows);
        self.graphs[body].get_or_init(|| NodeGraph::with_rows(&part.space, rows, &part.held.frame))
    }

    /// Return, for each node of these `bodies`, the number of nodes with which it is coupled in a matrix of all of them, itself
    /// included. Nodes are coupled by the cells around them and by contact rows. The result runs over one body after the other.
    pub fn of_nodes(&self, bodies: &[usize], pairs: &[ContactPair]) -> Vec<u32> {
        let (mut first, mut all) = (HashMap::new(), Vec::new());
        for &body in bodies {
            first.insert(body, all.len());
            all.extend(self.graph(body).ptr.windows(2).map(|ends| ends[1] - ends[0]));
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

    /// Return the graphs that were requested.
    pub fn into_graphs(self) -> Vec<Option<NodeGraph>> {
        self.graphs.into_iter().map(OnceCell::into_inner).collect()
    }
}
