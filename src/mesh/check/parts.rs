//! Parts of a body: cells that hang together by faces.

use super::cells::{Cells, Found, NONE};
use super::faces::Faces;
use crate::error::Result;
use crate::exchange::{Exchange, first, gather, share, trade};
use crate::mesh::Key;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// What hangs together, numbered 0, 1, ... in the order of their first cells.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Parts {
    /// Number of parts.
    pub count: usize,
    /// Part of each node of the body; none where all are one.
    pub of_node: Vec<u32>,
}

/// The parts of a body, unless some rank has found an error `before`. Collective.
///
/// # Errors
/// Parts that share nodes: an edge or a corner alone does not join elastic bodies.
pub fn parts<const D: usize>(
    cells: &Cells<D>,
    faces: &Faces<D>,
    before: Found,
    exchange: &dyn Exchange,
) -> Result<Parts> {
    let mut joined = Joined::new(cells.count());
    faces.inner().for_each(|[a, b]| joined.join(a.cell() as u32, b.cell() as u32));
    let (mut count, mut of_cell) = joined.classes();
    if exchange.ranks() > 1 {
        count = of_all(cells, count, &mut of_cell, exchange);
    }
    if count == 1 {
        return first(exchange, before).map(|()| Parts { count, of_node: Vec::new() });
    }
    let of_own = first(exchange, before.and_then(|()| apart(cells, &of_cell)))?;
    let of_node = gather(exchange, &of_own).into_iter().map(|(_, part)| part).collect();
    Ok(Parts { count, of_node })
}

/// Numbers of own nodes, and the parts of their cells, which are the same.
fn apart<const D: usize>(cells: &Cells<D>, of_cell: &[u32]) -> Found<Vec<(u32, u32)>> {
    let mut first = vec![NONE; cells.node_count()];
    let mut of_own = Vec::new();
    for cell in 0..cells.count() {
        for (corner, &node) in (0..).zip(cells.cell(cell)).filter(|(_, node)| cells.is_own(**node)) {
            let first = &mut first[node as usize];
            if *first == NONE {
                *first = cell as u32;
                of_own.push((cells.number(node), of_cell[cell]));
            }
            let other = *first as usize;
            if of_cell[cell] != of_cell[other] {
                let what = "cells hang together by an edge or a corner alone";
                let error = cells.refuse(what, &[other, cell], cells.at(node)).help(
                    "cells of a body join through whole facets: let them overlap in the geometry, or make bodies of them",
                );
                return Err(((4, cells.key(cell).0, cells.key(cell).1, corner), error));
            }
        }
    }
    Ok(of_own)
}

/// From what hangs together on this rank, so many parts, to what does on all: a cell of several ranks joins their parts. Collective.
fn of_all<const D: usize>(cells: &Cells<D>, count: usize, of_cell: &mut [u32], exchange: &dyn Exchange) -> usize {
    let (rank, ranks) = (exchange.rank(), exchange.ranks());
    // the one that speaks for a cell hears from others to which of their parts it belongs
    let mut away: Vec<Vec<(Key, u32)>> = vec![Vec::new(); ranks];
    let mut firsts: Vec<Key> = Vec::with_capacity(count);
    for (cell, &part) in of_cell.iter().enumerate() {
        if cells.home(cell) != rank {
            away[cells.home(cell)].push((cells.key(cell), part));
        }
        if part as usize == firsts.len() {
            firsts.push(cells.key(cell));
        }
    }
    let mut links: BTreeSet<(u32, u32, u32)> = BTreeSet::new();
    for (from, theirs) in (0..).zip(trade(exchange, away)) {
        let here = theirs.into_iter().filter_map(|(key, part)| Some((from, part, of_cell[cells.find(key)?])));
        links.extend(here);
    }
    let all = share(exchange, (firsts, links));
    let mut starts = vec![0];
    all.iter().for_each(|(firsts, _)| starts.push(starts[starts.len() - 1] + firsts.len() as u32));
    let mut joined = Joined::new(starts[ranks] as usize);
    for (rank, (_, links)) in all.iter().enumerate() {
        links.iter().for_each(|&(from, theirs, ours)| joined.join(starts[from as usize] + theirs, starts[rank] + ours));
    }
    let (count, of_part) = joined.classes();
    let mut order: Vec<(Key, u32)> = (0..count as u32).map(|part| ((u64::MAX, u32::MAX), part)).collect();
    for (&part, &first) in of_part.iter().zip(all.iter().flat_map(|(firsts, _)| firsts)) {
        let least = &mut order[part as usize].0;
        *least = first.min(*least);
    }
    order.sort_unstable();
    let mut number = vec![0; count];
    (0..).zip(&order).for_each(|(new, &(_, part))| number[part as usize] = new);
    of_cell.iter_mut().for_each(|part| *part = number[of_part[(starts[rank] + *part) as usize] as usize]);
    count
}

/// Things that are joined, directly or by others.
pub struct Joined(Vec<u32>);

impl Joined {
    /// So many things, each alone.
    pub fn new(count: usize) -> Self {
        Self((0..count as u32).collect())
    }

    fn root(&mut self, mut thing: u32) -> u32 {
        while self.0[thing as usize] != thing {
            // half of the way up is saved for the next one
            let above = self.0[self.0[thing as usize] as usize];
            self.0[thing as usize] = above;
            thing = above;
        }
        thing
    }

    /// Joins two of them.
    pub fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b) as usize] = a.min(b);
    }

    /// How many remain, and the number of each thing, which those that are joined share: in the order of the first ones.
    pub fn classes(mut self) -> (usize, Vec<u32>) {
        let mut of_thing: Vec<u32> = vec![NONE; self.0.len()];
        let mut count = 0;
        for thing in 0..self.0.len() {
            // the least of all that are joined
            let root = self.root(thing as u32) as usize;
            if root == thing {
                of_thing[thing] = count;
                count += 1;
            }
            of_thing[thing] = of_thing[root];
        }
        (count as usize, of_thing)
    }
}
