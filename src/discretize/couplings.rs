//! Which nodes of bodies are coupled with which in their matrix: the work and the memory that each takes.

use super::cells;
use super::draft::Draft;
use super::part::Part;
use super::parts::Stock;
use crate::contact::ContactPair;
use crate::exchange::Exchange;
use crate::fem::{NodeGraph, Space, place};
use std::cell::OnceCell;
use std::collections::HashMap;

/// Couplings of the nodes of all bodies, found when they are first asked for.
pub struct Coupled<'a, const D: usize> {
    of: (&'a [Part<'a, D>], &'a [Stock<'a, D>], &'a [Draft<D>]),
    exchange: &'a dyn Exchange,
    graphs: Vec<OnceCell<NodeGraph>>,
    numbers: Vec<OnceCell<Vec<u32>>>,
}

impl<'a, const D: usize> Coupled<'a, D> {
    /// Of bodies of which ranks have these parts.
    pub fn new(of: (&'a [Part<'a, D>], &'a [Stock<'a, D>], &'a [Draft<D>]), exchange: &'a dyn Exchange) -> Self {
        let bodies = of.0.len();
        Self { of, exchange, graphs: vec![OnceCell::new(); bodies], numbers: vec![OnceCell::new(); bodies] }
    }

    /// Which nodes of a body K couples; of several ranks the first has the graph, and all cells meanwhile. Collective.
    pub fn graph(&self, body: usize) -> &NodeGraph {
        let (parts, stocks, drafts) = self.of;
        self.graphs[body].get_or_init(|| cells::graph(&parts[body], &stocks[body], &drafts[body].rows, self.exchange))
    }

    /// The couplings of all nodes of a body, each with itself included. Collective.
    pub fn count(&self, body: usize) -> usize {
        if self.exchange.ranks() == 1 {
            return self.graph(body).col.len();
        }
        let mut count = [self.inside(body).iter().map(|&count| f64::from(count)).sum()];
        self.exchange.sum(&mut count);
        count[0] as usize
    }

    /// With how many nodes each own node of these `bodies`, one body after the other, is coupled in a matrix of all of them: in cells around it, and
    /// in contact rows.
    pub fn of(&self, bodies: &[usize], pairs: &[ContactPair]) -> Vec<u32> {
        let (mut first, mut all) = (HashMap::new(), Vec::new());
        for &body in bodies {
            first.insert(body, all.len());
            all.extend_from_slice(self.inside(body));
        }
        // the place of a node among own ones
        let place = |body: usize, node: u32| {
            let known = &self.of.0[body].known;
            Some(first.get(&body)? + place(&known.own, node)? as usize)
        };
        for pair in pairs.iter().filter(|pair| pair.bodies.iter().all(|body| first.contains_key(body))) {
            let nodes = |side: usize, q: usize| pair.rows[side].row(q).map(|(dof, _)| (dof / D) as u32);
            let both = |q: usize| nodes(0, q).flat_map(move |i| nodes(1, q).map(move |j| [i, j]));
            let mut across: Vec<[u32; 2]> = (0..pair.len()).flat_map(both).collect();
            across.sort_unstable();
            across.dedup();
            let own = across.into_iter().flat_map(|nodes| [0, 1].map(|side| place(pair.bodies[side], nodes[side])));
            own.flatten().for_each(|node| all[node] += 1);
        }
        all
    }

    /// The same within a body.
    fn inside(&self, body: usize) -> &[u32] {
        let (parts, stocks, drafts) = self.of;
        let (part, stock, rows) = (&parts[body], &stocks[body], &drafts[body].rows);
        self.numbers[body].get_or_init(|| {
            // of the nodes of these cells and of contact rows alone
            let of_rows = rows.col.iter().map(|&dof| dof as u32 / D as u32);
            let masters = part.held.frame.master.values().copied();
            let nodes = Space::<D>::among(stock.nodes.iter().copied().chain(of_rows).chain(masters));
            let dof = |dof: usize| Some(D * place(&nodes, (dof / D) as u32)? as usize + dof % D);
            let space = part.space.on(&stock.nodes, &nodes);
            let rows = rows.of_columns(D * nodes.len(), dof);
            let NodeGraph { ptr, .. } = NodeGraph::with_rows(&space, &rows, &part.held.frame.on(&nodes));
            let at = |node: &u32| place(&nodes, *node).map_or(0, |at| at as usize);
            part.known.own.iter().map(at).map(|at| ptr[at + 1] - ptr[at]).collect()
        })
    }

    /// The graphs that were asked for.
    pub fn into_graphs(self) -> Vec<Option<NodeGraph>> {
        self.graphs.into_iter().map(OnceCell::into_inner).collect()
    }
}
