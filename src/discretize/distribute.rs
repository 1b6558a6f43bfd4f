//! The dofs of all bodies over the ranks: a partition of their nodes, and what each rank knows of it.

use super::draft::Draft;
use crate::contact::ContactPair;
use crate::fem::assemble::NodeGraph;
use crate::fem::{ElasticBody, Interpolation};
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
    pub distribution: Rc<Distribution>,
    /// The rank that speaks for the body.
    pub leader: usize,
    /// Number of each node in the matrix of all bodies.
    number: Vec<u32>,
    /// The same of its coarse nodes among all of these.
    coarse: Vec<u32>,
    /// Coarse nodes of all bodies, and those of this body that this rank has.
    coarse_nodes: [usize; 2],
}

/// What rank `rank` knows of each body when `owner` has the rank of every node, body by body; `coarse` are the coarse nodes of each.
pub fn distribute<const D: usize>(
    drafts: &[Draft],
    coarse: &[Vec<u32>],
    owner: &[u32],
    (rank, ranks): (usize, usize),
    exchange: &Rc<dyn Exchange>,
) -> Vec<Dealt> {
    // numbers of nodes in the matrix of all bodies: rank by rank, there body by body
    let starts = |owners: &mut dyn Iterator<Item = u32>| {
        let mut starts = vec![0; ranks + 1];
        owners.for_each(|owner| starts[owner as usize + 1] += 1);
        (0..ranks).for_each(|rank| starts[rank + 1] += starts[rank]);
        starts
    };
    let mut next = starts(&mut owner.iter().copied());
    let first = drafts.iter().scan(0, |first, draft| Some(std::mem::replace(first, *first + draft.rows.columns / D)));
    let of_coarse =
        coarse.iter().zip(first).flat_map(|(nodes, first)| nodes.iter().map(move |&node| owner[first + node as usize]));
    let mut next_coarse = starts(&mut of_coarse.clone());
    let coarse_total = next_coarse[ranks] as usize;
    let (start, total) = (D * next[rank] as usize, D * owner.len());
    let mut owner = owner;
    let of_body = |(draft, coarse): (&Draft, &Vec<u32>)| {
        let nodes = draft.rows.columns / D;
        let of_node;
        (of_node, owner) = owner.split_at(nodes);
        let number = of_node.iter().map(|&owner| {
            next[owner as usize] += 1;
            next[owner as usize] - 1
        });
        let number: Vec<u32> = number.collect();
        let own: Vec<usize> = (0..nodes).filter(|&node| of_node[node] as usize == rank).collect();
        let mut counts = vec![0; ranks];
        of_node.iter().for_each(|&owner| counts[owner as usize] += 1);
        // of equal ones the first
        let leader = (0..ranks).rev().max_by_key(|&rank| counts[rank]).unwrap_or(0);
        let mut rows = Csr::new(total);
        for q in 0..draft.rows.rows() {
            rows.push_row(draft.rows.row(q).map(|(dof, value)| (D * number[dof / D] as usize + dof % D, value)));
        }
        let mut coarse_here = 0;
        let number_coarse = |&node: &u32| {
            let owner = of_node[node as usize] as usize;
            coarse_here += usize::from(owner == rank);
            next_coarse[owner] += 1;
            next_coarse[owner] - 1
        };
        let coarse = coarse.iter().map(number_coarse).collect();
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
        Dealt { distribution: Rc::new(distribution), leader, number, coarse, coarse_nodes: [coarse_total, coarse_here] }
    };
    drafts.iter().zip(coarse).map(of_body).collect()
}

impl Dealt {
    /// Whether a node is an own one.
    pub fn is_own<const D: usize>(&self, node: usize) -> bool {
        let Distribution { first, own, .. } = &*self.distribution;
        (*first..first + own.len()).contains(&(D * self.number[node] as usize))
    }

    /// The rows of own dofs of an interpolation; columns are those of all bodies.
    pub fn interpolation<const D: usize>(&self, whole: &Interpolation) -> Interpolation {
        let [all, own] = self.coarse_nodes;
        let mut rows = Csr::new(D * all);
        for &dof in &self.distribution.own {
            let number = |j: usize| D * self.coarse[j / D] as usize + j % D;
            rows.push_row(whole.rows.row(dof as usize).map(|(j, weight)| (number(j), weight)));
        }
        Interpolation { rows, own: D * own }
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
            lifting: if body.lifting.is_empty() { Vec::new() } else { self.distribution.scatter(&body.lifting) },
            ..body
        }
    }
}
