//! The cells of bodies, from the rank that has read them to those that assemble their nodes or speak for the body.

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
    /// One rank needs all of them, others those at the nodes that they have.
    Owners {
        /// The rank that speaks for the body.
        leader: usize,
        /// The rank of each node; none where the leader has them all.
        of_node: Option<&'a [u32]>,
    },
}

impl<'a> Needs<'a> {
    /// Of so many bodies.
    pub fn everywhere(bodies: usize) -> Vec<Self> {
        (0..bodies).map(|_| Needs::Everywhere).collect()
    }

    /// Of bodies with these `leaders`, some of which are dealt out.
    pub fn of<const D: usize>(leaders: &[usize], drafts: &[Draft<D>], deals: &'a [Deal]) -> Vec<Self> {
        let mut needs: Vec<Self> = leaders.iter().map(|&leader| Needs::Owners { leader, of_node: None }).collect();
        for Deal { bodies, owner } in deals {
            let mut rest = &owner[..];
            for &body in bodies {
                let own;
                (own, rest) = rest.split_at(drafts[body].rows.columns / D);
                needs[body] = Needs::Owners { leader: leaders[body], of_node: Some(own) };
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
    let at_nodes: Vec<Vec<Vec<u32>>> = match &whole {
        Some(_) => parts.iter().zip(needs).map(|(part, needs)| at_nodes(part, needs, ranks)).collect(),
        None => Vec::new(),
    };
    let of_rank = |rank: usize| -> Vec<Cells> {
        let bodies = parts.iter().zip(needs).zip(whole.iter().flatten()).zip(&at_nodes);
        let of_body = |(((part, needs), elasticity), at_nodes): (((&Part<D>, &Needs), _), &Vec<Vec<u32>>)| {
            let all = 0..part.known.cells as u32;
            match needs {
                Needs::Owners { leader, .. } if *leader != rank => {
                    some(part, elasticity, at_nodes[rank].iter().copied())
                }
                _ => some(part, elasticity, all),
            }
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

/// Numbers of the cells at the nodes of each rank that does not need all cells.
fn at_nodes<const D: usize>(part: &Part<D>, needs: &Needs, ranks: usize) -> Vec<Vec<u32>> {
    let mut at_nodes = vec![Vec::new(); ranks];
    let Needs::Owners { leader, of_node: Some(of_node) } = needs else { return at_nodes };
    for (cell, nodes) in part.space.cells.chunks_exact(part.space.stride).enumerate() {
        for &node in nodes {
            // tied nodes are assembled where their master is
            let of_rank = &mut at_nodes[of_node[part.held.frame.node(node) as usize] as usize];
            if of_rank.last() != Some(&(cell as u32)) {
                of_rank.push(cell as u32);
            }
        }
    }
    at_nodes[*leader] = Vec::new();
    at_nodes
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
