//! The dofs of all bodies over the ranks: a partition of their nodes, and what each rank knows of it.

use super::draft::Draft;
use super::part::Part;
use crate::exchange::{Exchange, share, trade};
use crate::fem::{Couplings, ElasticBody, Interpolation, Space, place};
use crate::linalg::Csr;
use crate::mesh::Cuts;
use crate::model::Distribution;
use nalgebra::DMatrix;
use std::collections::HashMap;
use std::rc::Rc;

/// Bodies whose rows of K are in one matrix of all ranks.
pub struct Deal {
    /// Their numbers in the scene, in increasing order.
    pub bodies: Vec<usize>,
    /// The number of the first node of each among those of all, and the end.
    starts: Vec<u32>,
    /// What says which rank has a node.
    cuts: Cuts,
}

impl Deal {
    /// Of `bodies`, each own node of which, one body after the other, is coupled with so many nodes of all. Collective.
    pub fn new<const D: usize>(
        bodies: Vec<usize>,
        parts: &[Part<D>],
        couplings: &[u32],
        exchange: &dyn Exchange,
    ) -> Self {
        let (mut starts, mut own) = (vec![0], Vec::with_capacity(couplings.len()));
        for &body in &bodies {
            let (start, Part { space, known, .. }) = (starts[starts.len() - 1], &parts[body]);
            own.extend(known.own.iter().map(|&node| (space.nodes[node as usize], start + node)));
            starts.push(start + space.nodes.len() as u32);
        }
        let weight = |at: u32| u64::from(couplings[at as usize]);
        let cuts = Cuts::new(own.len(), &|at| own[at as usize], &weight, exchange.ranks(), exchange);
        Self { bodies, starts, cuts }
    }

    /// The rank of a node whose place is known, of the body with this number among those of the matrix.
    pub fn owner<const D: usize>(&self, number: usize, part: &Part<D>, node: u32) -> usize {
        self.cuts.part(&part.space.nodes[node as usize], self.starts[number] + node)
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
    /// The nodes that this rank must know, sorted: own ones, those of its cells and of contact rows, and masters of tied ones.
    pub nodes: Vec<u32>,
    /// Number of each of these in the matrix that has its rows.
    number: Vec<u32>,
    /// Its coarse nodes; none where no interpolation is wanted.
    coarse: Coarse,
}

/// The coarse nodes of a body that is dealt out.
#[derive(Default)]
struct Coarse {
    /// Which of the nodes that are known here these are: their places.
    nodes: Vec<u32>,
    /// Their numbers among the coarse nodes of the bodies in one matrix.
    number: Vec<u32>,
    /// How many all of these have, and this one on this rank.
    counts: [usize; 2],
}

/// What this rank knows of each body, once it has its cells; none for those that are not dealt out. `wants_coarse` tells whether the coarse nodes of a
/// body are wanted. `told` numbers nodes; iterations go by `exchange`. Collective.
pub fn distribute<const D: usize>(
    parts: &[Part<D>],
    drafts: &[Draft<D>],
    wants_coarse: &dyn Fn(usize) -> bool,
    deals: &[Deal],
    told: &dyn Exchange,
    exchange: &Rc<dyn Exchange>,
) -> Vec<Option<Dealt>> {
    let mut all: Vec<Option<Dealt>> = drafts.iter().map(|_| None).collect();
    for deal in deals {
        let near = |(number, &body): (usize, &usize)| {
            Near::new(deal, number, &parts[body], &drafts[body], wants_coarse(body), told.rank())
        };
        let near: Vec<Near> = deal.bodies.iter().enumerate().map(near).collect();
        let drafts = deal.bodies.iter().map(|&body| &drafts[body]);
        deal.bodies.iter().zip(of_deal::<D>(drafts, near, told, exchange)).for_each(|(&body, of)| all[body] = Some(of));
    }
    all
}

/// What a rank knows of a body that is dealt out before nodes have numbers in the matrix.
struct Near {
    /// The nodes that it must know, sorted.
    nodes: Vec<u32>,
    /// The rank of each.
    owner: Vec<u32>,
    /// Whether each is a coarse one.
    is_coarse: Vec<bool>,
    /// Nodes of the body.
    count: usize,
}

impl Near {
    fn new<const D: usize>(
        deal: &Deal,
        number: usize,
        part: &Part<D>,
        draft: &Draft<D>,
        wants_coarse: bool,
        rank: usize,
    ) -> Self {
        let owner = |node: u32| deal.owner(number, part, node) as u32;
        let own: Vec<u32> = part.space.nodes.known().filter(|&node| owner(node) as usize == rank).collect();
        let of_rows = [&draft.rows, &draft.nodal_rows].into_iter().flat_map(|rows| &rows.col);
        let of_rows = of_rows.map(|&dof| dof as u32 / D as u32);
        let masters = part.held.frame.master.values().copied();
        let all = own.iter().copied().chain(part.space.cells.iter().copied()).chain(of_rows).chain(masters);
        let nodes = Space::<D>::among(all);
        let coarse = if wants_coarse { part.coarse_nodes() } else { Vec::new() };
        Self {
            owner: nodes.iter().map(|&node| owner(node)).collect(),
            is_coarse: nodes.iter().map(|node| coarse.binary_search(node).is_ok()).collect(),
            nodes,
            count: part.space.nodes.len(),
        }
    }

    /// Places of the nodes of a rank.
    fn of_rank(&self, rank: usize) -> impl Iterator<Item = usize> + Clone {
        (0..self.nodes.len()).filter(move |&place| self.owner[place] as usize == rank)
    }
}

/// Number in the matrix of a node, and among the coarse nodes.
type Numbers = (u32, Option<u32>);

/// The same of the bodies of one matrix. Collective.
fn of_deal<'a, const D: usize>(
    drafts: impl Iterator<Item = &'a Draft<D>>,
    near: Vec<Near>,
    told: &dyn Exchange,
    exchange: &Rc<dyn Exchange>,
) -> Vec<Dealt> {
    let (rank, ranks) = (told.rank(), told.ranks());
    // rank by rank, there body by body, there in the order of the nodes
    let count = |near: &Near| {
        let coarse = near.of_rank(rank).filter(|&place| near.is_coarse[place]).count();
        [near.of_rank(rank).count(), coarse]
    };
    let counts: Vec<Vec<[usize; 2]>> = share(told, near.iter().map(count).collect());
    let sum = |of_ranks: &[Vec<[usize; 2]>], which: usize| {
        of_ranks.iter().flatten().map(|counts| counts[which]).sum::<usize>()
    };
    let [start, first_coarse] = [0, 1].map(|which| sum(&counts[..rank], which) as u32);
    let (mut next, mut next_coarse) = (start, first_coarse);
    let mut own: Vec<HashMap<u32, Numbers>> = Vec::new();
    for near in &near {
        let number = |place: usize| {
            let coarse = near.is_coarse[place].then_some(next_coarse);
            next_coarse += u32::from(coarse.is_some());
            next += 1;
            (near.nodes[place], (next - 1, coarse))
        };
        own.push(near.of_rank(rank).map(number).collect());
    }
    // each node is asked for at its rank, which may be this one
    let mut asked: Vec<Vec<(u32, u32)>> = vec![Vec::new(); ranks];
    for (body, near) in (0..).zip(&near) {
        near.nodes.iter().zip(&near.owner).for_each(|(&node, &owner)| asked[owner as usize].push((body, node)));
    }
    let answer = |(body, node): (u32, u32)| own[body as usize].get(&node).copied().unwrap_or_default();
    let answers = trade(told, asked).into_iter().map(|asked| asked.into_iter().map(answer).collect::<Vec<Numbers>>());
    let mut answers: Vec<_> = trade(told, answers.collect()).into_iter().map(Vec::into_iter).collect();
    let (total, all_coarse) = (D * sum(&counts, 0), sum(&counts, 1));
    let of_body = |((body, draft), near): ((usize, &Draft<D>), Near)| {
        let numbers: Vec<Numbers> =
            near.owner.iter().map(|&owner| answers[owner as usize].next().unwrap_or_default()).collect();
        let dofs = |node: u32| D as u32 * node..D as u32 * (node + 1);
        let mut others = vec![(Vec::new(), Vec::new()); ranks];
        for place in (0..near.nodes.len()).filter(|&place| near.owner[place] as usize != rank) {
            let (places, of_matrix) = &mut others[near.owner[place] as usize];
            places.extend(dofs(place as u32));
            of_matrix.extend(dofs(numbers[place].0));
        }
        let of_ranks = || counts.iter().map(|of_rank| of_rank[body][0]);
        // of equal ones the first
        let leader = (0..ranks).rev().max_by_key(|&rank| counts[rank][body][0]).unwrap_or(0);
        let number = |dof: usize| {
            let place = place(&near.nodes, (dof / D) as u32)? as usize;
            Some(D * numbers[place].0 as usize + dof % D)
        };
        let distribution = Distribution {
            dofs: D * near.count,
            first: D * near.of_rank(rank).next().map_or(start, |place| numbers[place].0) as usize,
            start: D * start as usize,
            own: near.of_rank(rank).flat_map(|place| dofs(near.nodes[place])).collect(),
            places: near.of_rank(rank).flat_map(|place| dofs(place as u32)).collect(),
            near: others,
            products: DMatrix::zeros(0, 0),
            total,
            rows: draft.rows.of_columns(total, number),
            leads: leader == rank,
            exchange: exchange.clone(),
        };
        let coarse = (0..).zip(&numbers).filter_map(|(place, (_, coarse))| Some((place, (*coarse)?)));
        let (nodes, number) = coarse.unzip();
        Dealt {
            distribution,
            leader,
            ranks: (0..ranks).zip(of_ranks()).filter(|(_, count)| *count > 0).map(|(rank, _)| rank).collect(),
            coarse: Coarse { nodes, number, counts: [all_coarse, counts[rank][body][1]] },
            number: numbers.into_iter().map(|(number, _)| number).collect(),
            nodes: near.nodes,
        }
    };
    drafts.enumerate().zip(near).map(of_body).collect()
}

impl Dealt {
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
