//! The dofs of all bodies over the ranks: a partition of their nodes, and what each rank knows of it.

use super::draft::Draft;
use super::places::Places;
use crate::contact::ContactPair;
use crate::fem::assemble::NodeGraph;
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

/// What rank `rank` knows of each body when `owner` has the rank of every node, body by body; and which node of each body it has at
/// which place: own ones, then ghosts.
pub fn distribute<const D: usize>(
    graphs: &[&NodeGraph],
    drafts: &[Draft],
    owner: &[u32],
    (rank, ranks): (usize, usize),
    exchange: &Rc<dyn Exchange>,
) -> Vec<(Distribution, Places)> {
    // numbers of nodes in the matrix of all bodies: rank by rank, there body by body
    let mut next = vec![0; ranks + 1];
    owner.iter().for_each(|&owner| next[owner as usize + 1] += 1);
    (0..ranks).for_each(|rank| next[rank + 1] += next[rank]);
    let start = next[rank];
    let number = |&owner: &u32| {
        next[owner as usize] += 1;
        next[owner as usize] - 1
    };
    let number: Vec<u32> = owner.iter().map(number).collect();
    let mut begin = 0;
    let mut all = Vec::new();
    for (graph, draft) in graphs.iter().zip(drafts) {
        let nodes = graph.ptr.len() - 1;
        let (owner, number) = (&owner[begin..begin + nodes], &number[begin..begin + nodes]);
        begin += nodes;
        let own: Vec<usize> = (0..nodes).filter(|&node| owner[node] as usize == rank).collect();
        let mut ghosts = Vec::new();
        for &node in &own {
            let neighbours = &graph.col[graph.ptr[node] as usize..graph.ptr[node + 1] as usize];
            let others = neighbours.iter().filter(|&&other| owner[other as usize] as usize != rank);
            ghosts.extend(others.map(|&other| (number[other as usize], other as usize)));
        }
        ghosts.sort_unstable();
        ghosts.dedup();
        let mut of_node = vec![-1; nodes];
        own.iter()
            .chain(ghosts.iter().map(|(_, node)| node))
            .enumerate()
            .for_each(|(i, &node)| of_node[node] = i as i32);
        let dofs = |node: u32| (0..D as u32).map(move |c| D as u32 * node + c);
        let mut share = vec![0; ranks];
        owner.iter().for_each(|&owner| share[owner as usize] += 1);
        // of equal ones the first
        let most = (0..ranks).rev().max_by_key(|&rank| share[rank]).unwrap_or(0);
        let mut rows = Csr::new(D * next[ranks - 1] as usize);
        for q in 0..draft.rows.rows() {
            rows.push_row(draft.rows.row(q).map(|(dof, value)| (D * number[dof / D] as usize + dof % D, value)));
        }
        let distribution = Distribution {
            dofs: D * nodes,
            first: D * own.first().map_or(start, |&node| number[node]) as usize,
            start: D * start as usize,
            own: own.iter().flat_map(|&node| dofs(node as u32)).collect(),
            ghosts: ghosts.iter().flat_map(|&(number, _)| dofs(number)).map(|dof| dof as i32).collect(),
            total: D * next[ranks - 1] as usize,
            rows,
            leads: most == rank,
            exchange: exchange.clone(),
        };
        all.push((distribution, Places { of_node, leader: most }));
    }
    all
}
