//! The cells of bodies, from the rank that has read them to those that assemble their nodes.

use super::distribute::Deal;
use super::draft::Draft;
use super::elastic;
use super::part::Part;
use crate::error::Result;
use crate::fem::Elasticity;
use crate::model::Exchange;
use crate::parallel;
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
#[derive(Serialize, Deserialize)]
struct Cells {
    /// Their nodes.
    nodes: Vec<u32>,
    /// Number of the constants of each; empty if the body has no regions.
    regions: Vec<usize>,
}

/// Gives every rank the cells that it needs, which `parts` have afterwards, and their elasticity. `whole` is the elasticity of all cells, on the
/// first rank. Collective.
///
/// # Errors
/// None that the first rank has not found before.
pub fn deal<const D: usize>(
    parts: &mut [Part<D>],
    whole: Option<Vec<Elasticity>>,
    needs: &[Needs],
    plane: Plane,
    exchange: &dyn Exchange,
) -> Result<Vec<Elasticity>> {
    let ranks = exchange.ranks();
    if ranks == 1 {
        return Ok(whole.unwrap_or_default());
    }
    let near: Vec<Vec<Vec<u32>>> = match &whole {
        Some(_) => parts.iter().zip(needs).map(|(part, needs)| near(part, needs, ranks)).collect(),
        None => Vec::new(),
    };
    let of_rank = |rank: usize| -> Vec<Cells> {
        let bodies = parts.iter().zip(needs).zip(whole.iter().flatten()).zip(&near);
        let of_body = |(((part, needs), elasticity), near): (((&Part<D>, &Needs), _), &Vec<Vec<u32>>)| match needs {
            Needs::Owners(_) => some(part, elasticity, near[rank].iter().copied()),
            Needs::Whole(owner) if *owner != rank => some(part, elasticity, 0..0),
            _ => some(part, elasticity, 0..part.known.cells as u32),
        };
        bodies.map(of_body).collect()
    };
    let dealt = parallel::deal(exchange, of_rank)?;
    let take = |(part, Cells { nodes, regions }): (&mut Part<D>, Cells)| {
        part.space.cells = nodes;
        elastic::of_regions(part.spec, regions, D, plane)
    };
    parts.iter_mut().zip(dealt).map(take).collect()
}

/// Numbers of the cells that each rank needs of a body whose nodes are dealt out: those that touch a cell at one of its own nodes, so that
/// it knows all that meets at the nodes of the latter.
fn near<const D: usize>(part: &Part<D>, needs: &Needs, ranks: usize) -> Vec<Vec<u32>> {
    let mut near = vec![Vec::new(); ranks];
    let Needs::Owners(of_node) = needs else { return near };
    // tied nodes are assembled where their master is
    let owner = |&node: &u32| of_node[part.held.frame.node(node) as usize];
    let cells = || part.space.cells.chunks_exact(part.space.stride);
    // ranks that have a node next to one of another rank
    let next = |cell: &'_ [u32]| {
        let mut next = Vec::new();
        for rank in cell.iter().map(owner) {
            next.extend(cell.iter().filter(|node| owner(node) != rank).map(|&node| (node, rank)));
        }
        next
    };
    let mut others: Vec<(u32, u32)> = cells().flat_map(next).collect();
    others.sort_unstable();
    others.dedup();
    for (number, cell) in (0..).zip(cells()) {
        for node in cell {
            let first = others.partition_point(|(other, _)| other < node);
            let others = others[first..].iter().take_while(|(other, _)| other == node).map(|(_, rank)| *rank);
            for rank in std::iter::once(owner(node)).chain(others) {
                let near = &mut near[rank as usize];
                if near.last() != Some(&number) {
                    near.push(number);
                }
            }
        }
    }
    near
}

/// Some of the cells of a body of which this rank has all.
fn some<const D: usize>(part: &Part<D>, elasticity: &Elasticity, cells: impl Iterator<Item = u32> + Clone) -> Cells {
    let stride = part.space.stride;
    let of_cell = |cell: u32| part.space.cells[cell as usize * stride..][..stride].iter().copied();
    let regions = cells.clone().filter(|_| !part.spec.regions.is_empty());
    Cells {
        nodes: cells.flat_map(of_cell).collect(),
        regions: regions.map(|cell| elasticity.region(cell as usize)).collect(),
    }
}
