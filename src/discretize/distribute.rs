//! The dofs of all bodies over the ranks: a partition of their nodes, and what each rank knows of it.

use super::draft::Draft;
use crate::contact::ContactPair;
use crate::fem::assemble::NodeGraph;
use crate::fem::{Couplings, ElasticBody, Interpolation};
use crate::linalg::Csr;
use crate::model::{Distribution, Exchange};
use std::rc::Rc;

/// A graph whose nodes are to be dealt out: compressed rows of neighbours, both ways, without the node itself.
pub struct Graph {
    /// Row starts.
    pub ptr: Vec<i32>,
    /// Neighbours.
    pub col: Vec<i32>,
    /// Work of each node: the entries of its row of K, in blocks.
    pub weight: Vec<i32>,
}

/// The nodes of all bodies, body by body, joined where K couples them, and at contact points.
pub fn graph<const D: usize>(graphs: &[&NodeGraph], drafts: &[Draft], pairs: &[ContactPair]) -> Graph {
    let mut first = vec![0];
    graphs.iter().for_each(|graph| first.push(first[first.len() - 1] + graph.ptr.len() - 1));
    // a contact point joins the first node on its one side with the first on the other
    let mut ends: Vec<[Option<i32>; 2]> = Vec::new();
    let mut begin = vec![0];
    for pair in pairs {
        ends.resize(ends.len() + pair.len(), [None; 2]);
        begin.push(ends.len());
    }
    for (body, draft) in drafts.iter().enumerate() {
        let mut row = 0;
        for segment in &draft.segments {
            for at in begin[segment.pair]..begin[segment.pair + 1] {
                let node = draft.rows.row(row).next().map(|(dof, _)| (first[body] + dof / D) as i32);
                ends[at][segment.side] = node;
                row += 1;
            }
        }
    }
    let mut joined: Vec<(i32, i32)> = ends.into_iter().filter_map(|[a, b]| Some((a?, b?))).collect();
    joined.extend(joined.clone().into_iter().map(|(a, b)| (b, a)));
    joined.sort_unstable();
    joined.dedup();
    let mut joined = joined.into_iter().peekable();
    let mut all = Graph { ptr: vec![0], col: Vec::new(), weight: Vec::new() };
    for (graph, &first) in graphs.iter().zip(&first) {
        for node in 0..graph.ptr.len() - 1 {
            let neighbours = &graph.col[graph.ptr[node] as usize..graph.ptr[node + 1] as usize];
            all.weight.push(neighbours.len() as i32);
            let own = (first + node) as i32;
            all.col.extend(neighbours.iter().map(|&other| first as i32 + other as i32).filter(|&other| other != own));
            while let Some((_, other)) = joined.next_if(|edge| edge.0 == own) {
                // in a body that touches itself K may couple the two, or they are one
                let inside =
                    u32::try_from(other - first as i32).is_ok_and(|other| neighbours.binary_search(&other).is_ok());
                all.col.extend(Some(other).filter(|_| !inside));
            }
            all.ptr.push(all.col.len() as i32);
        }
    }
    all
}

/// A body that is dealt out, as one rank sees it.
pub struct Dealt {
    /// The dofs of this rank.
    pub distribution: Distribution,
    /// The rank that speaks for the body.
    pub leader: usize,
    /// Number of each node in the matrix of all bodies.
    number: Vec<u32>,
}

/// What rank `rank` knows of each body when `owner` has the rank of every node, body by body.
pub fn distribute<const D: usize>(
    drafts: &[Draft],
    owner: &[u32],
    (rank, ranks): (usize, usize),
    exchange: &Rc<dyn Exchange>,
) -> Vec<Dealt> {
    let (number, starts) = numbered(owner, ranks);
    let (start, total) = (D * starts[rank] as usize, D * owner.len());
    let (mut owner, mut number) = (owner, &number[..]);
    let of_body = |draft: &Draft| {
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
        let mut rows = Csr::new(total);
        for q in 0..draft.rows.rows() {
            rows.push_row(draft.rows.row(q).map(|(dof, value)| (D * number[dof / D] as usize + dof % D, value)));
        }
        let distribution = Distribution {
            dofs: D * nodes,
            first: own.first().map_or(start, |&node| D * number[node] as usize),
            start,
            own: own.into_iter().flat_map(|node| (D * node..D * (node + 1)).map(|dof| dof as u32)).collect(),
            total,
            rows,
            leads: leader == rank,
            exchange: exchange.clone(),
        };
        Dealt { distribution, leader, number }
    };
    drafts.iter().map(of_body).collect()
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
pub struct DealtCoarse {
    /// Which nodes these are.
    pub nodes: Vec<u32>,
    /// Their numbers among the coarse nodes of all bodies.
    number: Vec<u32>,
    /// How many all bodies have, and this one on this rank.
    counts: [usize; 2],
}

/// The coarse `nodes` of each body when `owner` has the rank of every node, body by body; bodies have so many nodes.
pub fn distribute_coarse(
    nodes: Vec<Vec<u32>>,
    sizes: &[usize],
    owner: &[u32],
    (rank, ranks): (usize, usize),
) -> Vec<DealtCoarse> {
    let mut first = 0;
    let of_body = |(nodes, size): (&Vec<u32>, &usize)| {
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
        DealtCoarse { nodes, number: here.to_vec(), counts: [number.len(), own] }
    };
    nodes.into_iter().zip(owners).map(of_body).collect()
}

impl DealtCoarse {
    /// The rows of these dofs of an interpolation; columns are counted through all bodies.
    pub fn own<const D: usize>(&self, whole: &Interpolation, dofs: &[u32]) -> Interpolation {
        let [all, own] = self.counts;
        let mut rows = Csr::new(D * all);
        for &dof in dofs {
            let number = |j: usize| D * self.number[j / D] as usize + j % D;
            rows.push_row(whole.rows.row(dof as usize).map(|(j, weight)| (number(j), weight)));
        }
        Interpolation { rows, own: D * own }
    }
}

impl Dealt {
    /// Whether a node is an own one.
    pub fn is_own<const D: usize>(&self, node: usize) -> bool {
        let Distribution { first, own, .. } = &self.distribution;
        (*first..first + own.len()).contains(&(D * self.number[node] as usize))
    }

    /// A body that was assembled for own nodes alone, in its own dofs; columns of K are those of the matrix of all bodies.
    pub fn own<const D: usize>(&self, body: ElasticBody) -> ElasticBody {
        let own = &self.distribution.own;
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
            load: self.distribution.scatter(&body.load),
            prescribed: body.prescribed.iter().filter_map(place).collect(),
            held: Couplings::default(),
            lifting: if body.lifting.is_empty() { Vec::new() } else { self.distribution.scatter(&body.lifting) },
            ..body
        }
    }
}
