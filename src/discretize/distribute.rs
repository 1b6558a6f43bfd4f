//! The dofs of all bodies over the ranks: a partition of their nodes, and what each rank knows of it.

use super::draft::Draft;
use super::part::Part;
use crate::exchange::Exchange;
use crate::fem::{Couplings, ElasticBody, Interpolation, place};
use crate::linalg::Csr;
use crate::mesh::Cuts;
use crate::model::Distribution;
use nalgebra::DMatrix;
use std::rc::Rc;

/// Bodies whose rows of K are in one matrix of all ranks.
pub struct Deal {
    /// Their numbers in the scene, in increasing order.
    pub bodies: Vec<usize>,
    /// The rank of each of their nodes, body by body.
    pub owner: Vec<u32>,
}

impl Deal {
    /// Of bodies with nodes at these places, each of which is coupled with so many, counted through all bodies.
    pub fn new<const D: usize>(bodies: Vec<usize>, places: &[&[[f64; D]]], couplings: &[u32], ranks: usize) -> Self {
        let mut starts = vec![0];
        places.iter().for_each(|nodes| starts.push(starts[starts.len() - 1] + nodes.len()));
        let at = |node: u32| {
            let body = starts.partition_point(|&start| start <= node as usize) - 1;
            places[body][node as usize - starts[body]]
        };
        let weight = |node: u32| u64::from(couplings[node as usize]);
        let cuts = Cuts::new(couplings.len(), at, &weight, ranks);
        Self { bodies, owner: (0..couplings.len() as u32).map(|node| cuts.part(&at(node), node) as u32).collect() }
    }
}

/// A body that is dealt out, as one rank sees it.
pub struct Dealt {
    /// The dofs of this rank.
    pub distribution: Distribution,
    /// The rank that speaks for the body.
    pub leader: usize,
    /// The ranks that have nodes of it.
    pub ranks: Vec<usize>,
    /// Number of each node in the matrix that has its rows: of the nodes that are known here, once these are chosen.
    number: Vec<u32>,
    /// First number of the nodes of each rank, and the end.
    starts: Vec<u32>,
    /// Its coarse nodes; none where no interpolation is wanted.
    coarse: Coarse,
}

/// What this rank knows of each body; none for those that are not dealt out. `coarse` tells the coarse nodes of a body.
pub fn distribute<const D: usize>(
    drafts: &[Draft<D>],
    coarse: &dyn Fn(usize) -> Vec<u32>,
    deals: &[Deal],
    exchange: &Rc<dyn Exchange>,
) -> Vec<Option<Dealt>> {
    let ranks = (exchange.rank(), exchange.ranks());
    let mut all: Vec<Option<Dealt>> = drafts.iter().map(|_| None).collect();
    for Deal { bodies, owner } in deals {
        let sizes = bodies.iter().map(|&body| drafts[body].rows.columns / D);
        let coarse = distribute_coarse(bodies.iter().map(|&body| coarse(body)).collect(), sizes, owner, ranks);
        let drafts = bodies.iter().map(|&body| &drafts[body]).zip(coarse);
        bodies
            .iter()
            .zip(of_deal::<D>(drafts, owner, ranks, exchange))
            .for_each(|(&body, dealt)| all[body] = Some(dealt));
    }
    all
}

/// The same of the bodies of one matrix, with the rank of every node, body by body.
fn of_deal<'a, const D: usize>(
    drafts: impl Iterator<Item = (&'a Draft<D>, Coarse)>,
    owner: &[u32],
    (rank, ranks): (usize, usize),
    exchange: &Rc<dyn Exchange>,
) -> Vec<Dealt> {
    let (number, starts) = numbered(owner, ranks);
    let (start, total) = (D * starts[rank] as usize, D * owner.len());
    let (mut owner, mut number) = (owner, &number[..]);
    let of_body = |(draft, coarse): (&Draft<D>, Coarse)| {
        let nodes = draft.rows.columns / D;
        let (of_node, numbers);
        (of_node, owner) = owner.split_at(nodes);
        (numbers, number) = number.split_at(nodes);
        let number = numbers.to_vec();
        let own: Vec<usize> = (0..nodes).filter(|&node| of_node[node] as usize == rank).collect();
        let mut counts = vec![0; ranks];
        of_node.iter().for_each(|&owner| counts[owner as usize] += 1);
        // of equal ones the first
        let leader = (0..ranks).rev().max_by_key(|&rank| counts[rank]).unwrap_or(0);
        let rows = draft.rows.of_columns(total, |dof| Some(D * number[dof / D] as usize + dof % D));
        let distribution = Distribution {
            dofs: D * nodes,
            first: own.first().map_or(start, |&node| D * number[node] as usize),
            start,
            own: own.into_iter().flat_map(|node| (D * node..D * (node + 1)).map(|dof| dof as u32)).collect(),
            places: Vec::new(),
            near: Vec::new(),
            products: DMatrix::zeros(0, 0),
            total,
            rows,
            leads: leader == rank,
            exchange: exchange.clone(),
        };
        let ranks = (0..ranks).filter(|&rank| counts[rank] > 0).collect();
        Dealt { distribution, leader, ranks, number, starts: starts.clone(), coarse }
    };
    drafts.map(of_body).collect()
}

/// Numbers of things that `owner` deals out: rank by rank, there in their order; and the first number of each rank.
fn numbered(owner: &[u32], ranks: usize) -> (Vec<u32>, Vec<u32>) {
    let mut starts = vec![0; ranks + 1];
    owner.iter().for_each(|&owner| starts[owner as usize + 1] += 1);
    (0..ranks).for_each(|rank| starts[rank + 1] += starts[rank]);
    let mut next = starts.clone();
    let number = owner.iter().map(|&owner| {
        next[owner as usize] += 1;
        next[owner as usize] - 1
    });
    (number.collect(), starts)
}

/// The coarse nodes of a body that is dealt out.
struct Coarse {
    /// Which nodes these are.
    nodes: Vec<u32>,
    /// Their numbers among the coarse nodes of the bodies in one matrix.
    number: Vec<u32>,
    /// How many all of these have, and this one on this rank.
    counts: [usize; 2],
}

/// The coarse `nodes` of each body when `owner` has the rank of every node, body by body; bodies have so many nodes.
fn distribute_coarse(
    nodes: Vec<Vec<u32>>,
    sizes: impl Iterator<Item = usize>,
    owner: &[u32],
    (rank, ranks): (usize, usize),
) -> Vec<Coarse> {
    let mut first = 0;
    let of_body = |(nodes, size): (&Vec<u32>, usize)| {
        let owner = &owner[first..first + size];
        first += size;
        nodes.iter().map(|&node| owner[node as usize]).collect()
    };
    let owners: Vec<Vec<u32>> = nodes.iter().zip(sizes).map(of_body).collect();
    let (number, _) = numbered(&owners.concat(), ranks);
    let mut rest = &number[..];
    let of_body = |(nodes, owners): (Vec<u32>, Vec<u32>)| {
        let own = owners.iter().filter(|&&owner| owner as usize == rank).count();
        let (here, others) = rest.split_at(nodes.len());
        rest = others;
        Coarse { nodes, number: here.to_vec(), counts: [number.len(), own] }
    };
    nodes.into_iter().zip(owners).map(of_body).collect()
}

impl Dealt {
    /// The nodes that a rank must know of its part of a body: own ones, those of its cells and of contact rows, and masters of tied ones.
    pub fn nodes_here<'a, const D: usize>(
        &'a self,
        part: &'a Part<D>,
        rows: [&'a Csr; 2],
    ) -> impl Iterator<Item = u32> + 'a {
        let own = self.distribution.own.iter().step_by(D).map(|dof| dof / D as u32);
        let of_rows = rows.into_iter().flat_map(|rows| rows.col.iter().map(|&dof| dof as u32 / D as u32));
        let masters = part.held.frame.master.values().copied();
        own.chain(part.space.cells.iter().copied()).chain(of_rows).chain(masters)
    }

    /// Turns to the nodes that are known here, sorted, and forgets the others; `products` are those of the motions that supports leave the body.
    pub fn choose<const D: usize>(&mut self, nodes: &[u32], products: DMatrix<f64>) {
        self.number = nodes.iter().map(|&node| self.number[node as usize]).collect();
        let own = (0..nodes.len()).filter(|&node| self.is_own::<D>(node));
        let places = own.flat_map(|node| D * node..D * (node + 1)).map(|dof| dof as u32).collect();
        let mut near = vec![(Vec::new(), Vec::new()); self.starts.len() - 1];
        for (node, &number) in self.number.iter().enumerate().filter(|(node, _)| !self.is_own::<D>(*node)) {
            let (at, numbers) = &mut near[self.starts.partition_point(|&start| start <= number) - 1];
            at.extend((D * node..D * (node + 1)).map(|dof| dof as u32));
            numbers.extend(D as u32 * number..D as u32 * (number + 1));
        }
        let of = &mut self.distribution;
        (of.places, of.near, of.products) = (places, near, products);
        let Coarse { nodes: coarse, number, counts } = &self.coarse;
        let here = coarse.iter().zip(number).filter_map(|(&node, &number)| Some((place(nodes, node)?, number)));
        let (coarse, number) = here.unzip();
        self.coarse = Coarse { nodes: coarse, number, counts: *counts };
    }

    /// The rows of own dofs of the interpolation that `whole` makes from coarse nodes; columns are counted through the bodies in one matrix.
    pub fn interpolation<const D: usize>(&self, whole: impl FnOnce(&[u32]) -> Interpolation) -> Interpolation {
        let Coarse { nodes, number, counts: [all, own] } = &self.coarse;
        let whole = whole(nodes);
        let mut rows = Csr::new(D * all);
        for &dof in &self.distribution.places {
            let number = |j: usize| D * number[j / D] as usize + j % D;
            rows.push_row(whole.rows.row(dof as usize).map(|(j, weight)| (number(j), weight)));
        }
        Interpolation { rows, own: D * own }
    }

    /// Whether a node is an own one.
    pub fn is_own<const D: usize>(&self, node: usize) -> bool {
        let Distribution { first, own, .. } = &self.distribution;
        (*first..first + own.len()).contains(&(D * self.number[node] as usize))
    }

    /// A body that was assembled for own nodes alone, in its own dofs; columns of K are those of the matrix that has its rows.
    pub fn own<const D: usize>(&self, body: ElasticBody) -> ElasticBody {
        let own = &self.distribution.places;
        let Csr { ptr, mut col, mut values, .. } = body.stiffness;
        let mut starts = vec![0];
        let mut row = Vec::new();
        for &dof in own {
            let range = ptr[dof as usize] as usize..ptr[dof as usize + 1] as usize;
            let number = |&j: &i32| D as i32 * self.number[j as usize / D] as i32 + j % D as i32;
            row.clear();
            row.extend(col[range.clone()].iter().map(number).zip(values[range.clone()].iter().copied()));
            row.sort_unstable_by_key(|entry| entry.0);
            for (k, &(j, value)) in range.clone().zip(&row) {
                (col[k], values[k]) = (j, value);
            }
            starts.push(range.end as i32);
        }
        let place = |&(dof, value): &(usize, f64)| Some((own.binary_search(&(dof as u32)).ok()?, value));
        ElasticBody {
            stiffness: Csr { columns: self.distribution.total, ptr: starts, col, values },
            load: self.distribution.of_known(&body.load),
            prescribed: body.prescribed.iter().filter_map(place).collect(),
            held: Couplings::default(),
            lifting: if body.lifting.is_empty() { Vec::new() } else { self.distribution.of_known(&body.lifting) },
            ..body
        }
    }
}
