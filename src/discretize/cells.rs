//! The cells of bodies, from the ranks that have their points to those that assemble their nodes.

use super::distribute::Deal;
use super::draft::Draft;
use super::elastic;
use super::part::Part;
use super::parts::Stock;
use crate::error::Result;
use crate::exchange::{Exchange, trade};
use crate::fem::{Elasticity, NodeGraph};
use crate::linalg::Csr;
use crate::mesh::Key;
use crate::problem::elasticity::Plane;
use serde::{Deserialize, Serialize};

/// Which ranks need cells of a body.
pub enum Needs<'a> {
    /// Every rank needs all.
    Everywhere,
    /// This rank has the body.
    Whole(usize),
    /// These ranks have its nodes: each needs the cells at its own ones, and those next to them.
    Owners(&'a [u32]),
}

impl<'a> Needs<'a> {
    /// Of so many bodies.
    pub fn everywhere(bodies: usize) -> Vec<Self> {
        (0..bodies).map(|_| Needs::Everywhere).collect()
    }

    /// Of bodies of these `leaders`, some of which are dealt out.
    pub fn of<const D: usize>(leaders: &[usize], drafts: &[Draft<D>], deals: &'a [Deal]) -> Vec<Self> {
        let mut needs: Vec<Self> = leaders.iter().map(|&leader| Needs::Whole(leader)).collect();
        for Deal { bodies, owner } in deals {
            let mut rest = &owner[..];
            for &body in bodies {
                let own;
                (own, rest) = rest.split_at(drafts[body].rows.columns / D);
                needs[body] = Needs::Owners(own);
            }
        }
        needs
    }
}

/// Cells of a body.
#[derive(Clone, Default, Serialize, Deserialize)]
struct Cells {
    keys: Vec<Key>,
    /// Their nodes.
    nodes: Vec<u32>,
    /// The numbers of these among the points of the mesh.
    points: Vec<u32>,
    /// Number of the constants of each; empty if the body has no regions.
    regions: Vec<usize>,
}

/// Gives every rank the cells that it needs, which `parts` have afterwards, and their elasticity. Each rank has `stocks`. Collective.
///
/// # Errors
/// None that were not found before.
pub fn deal<const D: usize>(
    parts: &mut [Part<D>],
    stocks: Vec<Stock<D>>,
    needs: &[Needs],
    plane: Plane,
    exchange: &dyn Exchange,
) -> Result<Vec<Elasticity>> {
    let (rank, ranks) = (exchange.rank(), exchange.ranks());
    let mut elasticities = Vec::new();
    for ((part, stock), needs) in parts.iter_mut().zip(stocks).zip(needs) {
        if ranks == 1 {
            elasticities.push(stock.elasticity);
            continue;
        }
        let home = |wanted: bool| stock.home(rank).filter(move |_| wanted).map(|cell| cell as u32);
        let of_rank: Vec<Cells> = match needs {
            Needs::Owners(_) => near(part, &stock, needs, ranks)
                .into_iter()
                .map(|cells| some(part, &stock, cells.into_iter()))
                .collect(),
            Needs::Whole(owner) => (0..ranks).map(|rank| some(part, &stock, home(rank == *owner))).collect(),
            Needs::Everywhere => vec![some(part, &stock, home(true)); ranks],
        };
        drop(stock);
        let dealt = trade(exchange, of_rank);
        // cells at points of several ranks come from each of these
        let mut order: Vec<(Key, usize, usize)> = Vec::new();
        for (from, cells) in dealt.iter().enumerate() {
            order.extend(cells.keys.iter().zip(0..).map(|(&key, number)| (key, from, number)));
        }
        order.sort_unstable();
        order.dedup_by_key(|(key, ..)| *key);
        let mut points = vec![None; part.space.nodes.len()];
        for cells in &dealt {
            cells.nodes.iter().zip(&cells.points).for_each(|(&node, &point)| points[node as usize] = Some(point));
        }
        part.known.points = (0..).zip(points).filter_map(|(node, point)| Some((node, point?))).collect();
        let stride = part.space.stride;
        let nodes = order.iter().flat_map(|&(_, from, number)| &dealt[from].nodes[number * stride..][..stride]);
        part.space.cells = nodes.copied().collect();
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
    mine[0] = some(part, stock, stock.home(exchange.rank()).map(|cell| cell as u32)).nodes;
    let (space, _) = part.space.clone().of_cells(trade(exchange, mine).concat(), 0.0);
    NodeGraph::with_rows(&space, rows, &part.held.frame)
}

/// Numbers of the cells at own points that each rank needs of a body whose nodes are dealt out: those that touch a cell at one of its nodes, so that
/// it knows all that meets at the nodes of the latter.
fn near<const D: usize>(part: &Part<D>, stock: &Stock<D>, needs: &Needs, ranks: usize) -> Vec<Vec<u32>> {
    let mut near = vec![Vec::new(); ranks];
    let Needs::Owners(of_node) = needs else { return near };
    // tied nodes are assembled where their master is
    let owner = |&node: &u32| of_node[part.held.frame.node(node) as usize];
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
fn some<const D: usize>(part: &Part<D>, stock: &Stock<D>, cells: impl Iterator<Item = u32> + Clone) -> Cells {
    let stride = part.space.stride;
    let of_cell = |cell: u32| stock.nodes[cell as usize * stride..][..stride].iter().copied();
    let regions = cells.clone().filter(|_| !part.spec.regions.is_empty());
    Cells {
        keys: cells.clone().map(|cell| stock.keys()[cell as usize]).collect(),
        regions: regions.map(|cell| stock.elasticity.region(cell as usize)).collect(),
        points: cells.clone().flat_map(|cell| stock.numbers(cell, stride)).collect(),
        nodes: cells.flat_map(of_cell).collect(),
    }
}
