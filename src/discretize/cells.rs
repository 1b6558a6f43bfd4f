//! The cells of bodies, from the ranks that have their points to those that assemble their nodes.

use super::distribute::Deal;
use super::elastic;
use super::part::Part;
use super::parts::Stock;
use crate::error::Result;
use crate::exchange::{Exchange, trade};
use crate::fem::{Elasticity, NodalForces, NodeGraph};
use crate::linalg::Csr;
use crate::mesh::{Key, Numbering};
use crate::problem::elasticity::Plane;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Which ranks need cells of a body.
#[derive(Clone, Copy)]
pub enum Needs<'a, const D: usize> {
    /// Every rank needs all.
    Everywhere,
    /// This rank has the body.
    Whole(usize),
    /// Ranks have its nodes, as a body of this number is dealt out: each needs the cells at its own ones, and those next to them.
    Owners(&'a Deal, usize),
}

impl<'a, const D: usize> Needs<'a, D> {
    /// Of bodies of these `leaders`, some of which are dealt out.
    pub fn of(leaders: &[usize], deals: &'a [Deal]) -> Vec<Self> {
        let mut needs: Vec<Self> = leaders.iter().map(|&leader| Needs::Whole(leader)).collect();
        for deal in deals {
            deal.bodies.iter().enumerate().for_each(|(number, &body)| needs[body] = Needs::Owners(deal, number));
        }
        needs
    }

    /// The ranks, of so many, that need the load at a node. Tied nodes are assembled where their master is.
    fn at(&self, part: &Part<D>, node: u32, ranks: usize) -> Range<usize> {
        let one = |rank: usize| rank..rank + 1;
        match self {
            Needs::Everywhere => 0..ranks,
            Needs::Whole(owner) => one(*owner),
            Needs::Owners(deal, number) => one(deal.owner(*number, part, part.held.frame.node(node))),
        }
    }
}

/// Cells of a body, and loads at nodes of them.
#[derive(Clone, Default, Serialize, Deserialize)]
struct Cells {
    keys: Vec<Key>,
    /// Their nodes, sorted, each once.
    nodes: Vec<u32>,
    /// The numbers of these among the points of the mesh.
    points: Vec<u32>,
    /// Where they are, `D` coordinates each.
    places: Vec<f64>,
    /// The nodes of each cell, by their places among these.
    corners: Vec<u32>,
    /// Number of the constants of each; empty if the body has no regions.
    regions: Vec<usize>,
    /// Nodes with loads.
    loaded: Vec<u32>,
    /// The nodal forces there, `D` components each.
    forces: Vec<f64>,
}

/// Gives every rank the cells that it needs, which `parts` have afterwards, their elasticity, and the nodal `loads` at its own nodes. Each rank has
/// `stocks`. Collective.
///
/// # Errors
/// None that were not found before.
pub fn deal<const D: usize>(
    parts: &mut [Part<D>],
    stocks: Vec<Stock<D>>,
    loads: &mut [&mut NodalForces<D>],
    needs: &[Needs<D>],
    plane: Plane,
    exchange: &dyn Exchange,
) -> Result<Vec<Elasticity>> {
    let (rank, ranks) = (exchange.rank(), exchange.ranks());
    let mut elasticities = Vec::new();
    for (((part, stock), needs), load) in parts.iter_mut().zip(stocks).zip(needs).zip(loads) {
        if ranks == 1 {
            elasticities.push(stock.elasticity);
            continue;
        }
        let home = |wanted: bool| stock.home(rank).filter(|_| wanted).map(|cell| cell as u32).collect::<Vec<_>>();
        let cells: Vec<Vec<u32>> = match needs {
            Needs::Owners(deal, number) => near(part, &stock, deal, *number, ranks),
            Needs::Whole(owner) => (0..ranks).map(|rank| home(rank == *owner)).collect(),
            Needs::Everywhere => vec![home(true); ranks],
        };
        let mut of_ranks: Vec<Cells> = cells.iter().map(|cells| some(part, &stock, cells)).collect();
        for (node, force) in load.iter() {
            for of_rank in &mut of_ranks[needs.at(part, node, ranks)] {
                of_rank.loaded.push(node);
                of_rank.forces.extend(force);
            }
        }
        drop(stock);
        let dealt = trade(exchange, of_ranks);
        // cells at points of several ranks come from each of these
        let mut order: Vec<(Key, usize, usize)> = Vec::new();
        for (from, cells) in dealt.iter().enumerate() {
            order.extend(cells.keys.iter().zip(0..).map(|(&key, number)| (key, from, number)));
        }
        order.sort_unstable();
        order.dedup_by_key(|(key, ..)| *key);
        let points = dealt.iter().flat_map(|cells| cells.nodes.iter().copied().zip(cells.points.iter().copied()));
        let mut points: Vec<(u32, u32)> = points.collect();
        points.sort_unstable();
        points.dedup();
        part.known.points = points;
        let place = |x: &[f64]| std::array::from_fn(|c| x[c]);
        let places = dealt.iter().flat_map(|cells| cells.nodes.iter().copied().zip(cells.places.chunks_exact(D)));
        part.space.nodes.learn(places.map(|(node, x)| (node, place(x))));
        let forces = dealt.iter().flat_map(|cells| cells.loaded.iter().copied().zip(cells.forces.chunks_exact(D)));
        **load = forces.map(|(node, force)| (node, place(force))).collect();
        let stride = part.space.stride;
        let nodes = order.iter().flat_map(|&(_, from, number)| {
            let of_rank = &dealt[from];
            of_rank.corners[number * stride..][..stride].iter().map(|&corner| of_rank.nodes[corner as usize])
        });
        part.space.cells = nodes.collect();
        let regions = order.iter().filter_map(|&(_, from, number)| dealt[from].regions.get(number)).copied();
        elasticities.push(elastic::of_regions(part.spec, regions.collect(), D, plane)?);
    }
    Ok(elasticities)
}

/// Which nodes of a body K couples; of several ranks the first has the graph, and all cells meanwhile. Collective.
pub fn graph<const D: usize>(part: &Part<D>, stock: &Stock<D>, rows: &Csr, exchange: &dyn Exchange) -> NodeGraph {
    if exchange.ranks() == 1 {
        return NodeGraph::with_rows(&part.space, rows, &part.held.frame);
    }
    let mut mine = vec![Vec::new(); exchange.ranks()];
    let stride = part.space.stride;
    mine[0] = stock.home(exchange.rank()).flat_map(|cell| stock.nodes[cell * stride..][..stride].to_vec()).collect();
    let (space, _) = part.space.clone().of_cells(trade(exchange, mine).concat(), 0.0);
    NodeGraph::with_rows(&space, rows, &part.held.frame)
}

/// Numbers of the cells at own points that each rank needs of a body whose nodes are dealt out: those that touch a cell at one of its nodes, so that
/// it knows all that meets at the nodes of the latter.
fn near<const D: usize>(part: &Part<D>, stock: &Stock<D>, deal: &Deal, number: usize, ranks: usize) -> Vec<Vec<u32>> {
    let mut near = vec![Vec::new(); ranks];
    // tied nodes are assembled where their master is
    let owner: Vec<usize> =
        part.space.nodes.known().map(|node| deal.owner(number, part, part.held.frame.node(node))).collect();
    let number_of = Numbering::in_order(part.space.nodes.known());
    let owner = |&node: &u32| number_of.get(node).map_or(0, |place| owner[place as usize]) as u32;
    // all cells at an own point are here
    let cells = || (0..).zip(stock.nodes.chunks_exact(part.space.stride));
    // ranks that have a node next to one of another rank
    let next = |(number, cell): (u32, &'_ [u32])| {
        let mut next = Vec::new();
        for rank in cell.iter().map(owner) {
            let others = stock.own_of(number, cell).filter(|node| owner(node) != rank);
            next.extend(others.map(|node| (node, rank)));
        }
        next
    };
    let mut others: Vec<(u32, u32)> = cells().flat_map(next).collect();
    others.sort_unstable();
    others.dedup();
    for (number, cell) in cells() {
        for node in stock.own_of(number, cell) {
            let first = others.partition_point(|(other, _)| *other < node);
            let others = others[first..].iter().take_while(|(other, _)| *other == node).map(|(_, rank)| *rank);
            for rank in std::iter::once(owner(&node)).chain(others) {
                let near = &mut near[rank as usize];
                if near.last() != Some(&number) {
                    near.push(number);
                }
            }
        }
    }
    near
}

/// Some of the cells of a body that are here.
fn some<const D: usize>(part: &Part<D>, stock: &Stock<D>, cells: &[u32]) -> Cells {
    let stride = part.space.stride;
    let of_cell = |cell: u32| stock.nodes[cell as usize * stride..][..stride].iter().copied();
    let corners = || cells.iter().flat_map(|&cell| of_cell(cell));
    let number = Numbering::in_order(corners());
    let nodes: Vec<u32> = number.points().collect();
    let regions = cells.iter().filter(|_| !part.spec.regions.is_empty());
    Cells {
        keys: cells.iter().map(|&cell| stock.keys()[cell as usize]).collect(),
        points: nodes.iter().filter_map(|&node| stock.number(node)).collect(),
        places: nodes.iter().flat_map(|&node| part.space.nodes[node as usize]).collect(),
        corners: corners().filter_map(|node| number.get(node)).collect(),
        regions: regions.map(|&cell| stock.elasticity.region(cell as usize)).collect(),
        nodes,
        ..Cells::default()
    }
}
