//! Which nodes of bodies are coupled with which in their matrix: the work and the memory that each takes.

use super::cells;
use super::draft::Draft;
use super::part::Part;
use super::parts::Stock;
use crate::contact::ContactPair;
use crate::exchange::Exchange;
use crate::fem::{NodeGraph, place};
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
        match self.exchange.ranks() {
            1 => self.graph(body).col.len(),
            _ => self.inside(body).iter().map(|&count| count as usize).sum(),
        }
    }

    /// With how many nodes each of these `bodies`, one body after the other, is coupled in a matrix of all of them: in cells around it, and in
    /// contact rows. Collective.
    pub fn of(&self, bodies: &[usize], pairs: &[ContactPair]) -> Vec<u32> {
        let (mut first, mut all) = (HashMap::new(), Vec::new());
        for &body in bodies {
            first.insert(body, all.len());
            all.extend_from_slice(self.inside(body));
        }
        for pair in pairs {
            let [Some(a), Some(b)] = pair.bodies.map(|body| first.get(&body).copied()) else { continue };
            let nodes = |side: usize, q: usize| pair.rows[side].row(q).map(|(dof, _)| dof / D);
            let both =
                |q: usize| nodes(0, q).flat_map(move |i| nodes(1, q).map(move |j| ((a + i) as u32, (b + j) as u32)));
            let mut across: Vec<(u32, u32)> = (0..pair.len()).flat_map(both).collect();
            across.sort_unstable();
            across.dedup();
            across.into_iter().flat_map(|(i, j)| [i, j]).for_each(|node| all[node as usize] += 1);
        }
        all
    }

    /// The same within a body, by the ranks that have the cells around its nodes. Collective.
    fn inside(&self, body: usize) -> &[u32] {
        let (parts, stocks, drafts) = self.of;
        let (part, stock, rows) = (&parts[body], &stocks[body], &drafts[body].rows);
        self.numbers[body].get_or_init(|| {
            // of the nodes of these cells and of contact rows alone
            let of_rows = rows.col.iter().map(|&dof| dof as u32 / D as u32);
            let masters = part.held.frame.master.values().copied();
            let nodes = part.space.among(stock.nodes.iter().copied().chain(of_rows).chain(masters));
            let dof = |dof: usize| Some(D * place(&nodes, (dof / D) as u32)? as usize + dof % D);
            let space = part.space.on(&stock.nodes, &nodes);
            let rows = rows.of_columns(D * nodes.len(), dof);
            let NodeGraph { ptr, .. } = NodeGraph::with_rows(&space, &rows, &part.held.frame.on(&nodes));
            let mut couplings = vec![0.0; part.space.nodes.len()];
            for node in stock.own() {
                let at = place(&nodes, node).map_or(0, |at| at as usize);
                couplings[node as usize] = f64::from(ptr[at + 1] - ptr[at]);
            }
            self.exchange.sum(&mut couplings);
            couplings.into_iter().map(|count| count as u32).collect()
        })
    }

    /// The graphs that were asked for.
    pub fn into_graphs(self) -> Vec<Option<NodeGraph>> {
        self.graphs.into_iter().map(OnceCell::into_inner).collect()
    }
}
