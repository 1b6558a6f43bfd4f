//! The parts of a body: sets of cells that are connected by faces.

use super::cells::{Cells, NONE};
use super::faces::Faces;
use crate::error::Result;
use serde::{Deserialize, Serialize};

/// The parts of a body, numbered 0, 1, ... in the order of their first cells.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Parts {
    /// Number of parts.
    pub count: usize,
    /// Part of each node of the body; empty if there is one part.
    pub of_node: Vec<u32>,
}

/// Return the parts of a body.
///
/// # Errors
/// Two parts share nodes: an edge or a corner alone does not join elastic bodies.
pub fn parts<const D: usize>(cells: &Cells<D>, faces: &Faces<D>) -> Result<Parts> {
    let mut joined = Joined::new(cells.count());
    faces.inner().for_each(|[a, b]| joined.join(a.cell() as u32, b.cell() as u32));
    let (count, of_cell) = joined.classes();
    let of_node = if count == 1 { Vec::new() } else { of_nodes(cells, &of_cell)? };
    Ok(Parts { count, of_node })
}

/// Return the part of each node, which must be the part of all its cells.
fn of_nodes<const D: usize>(cells: &Cells<D>, of_cell: &[u32]) -> Result<Vec<u32>> {
    // This is the first cell of each node.
    let mut first = vec![NONE; cells.node_count()];
    for cell in 0..cells.count() {
        for &node in cells.cell(cell) {
            let first = &mut first[node as usize];
            if *first == NONE {
                *first = cell as u32;
            }
            let other = *first as usize;
            if of_cell[cell] != of_cell[other] {
                let what = "cells hang together by an edge or a corner alone";
                return Err(cells.refuse(what, &[other, cell], cells.at(node)).help(
                    "cells of a body join through whole facets: let them overlap in the geometry, or make bodies of them",
                ));
            }
        }
    }
    Ok(first.into_iter().map(|cell| of_cell[cell as usize]).collect())
}

/// Disjoint sets of things that are joined directly or through others.
pub struct Joined(Vec<u32>);

impl Joined {
    /// Start with `count` things, each in a set of its own.
    pub fn new(count: usize) -> Self {
        Self((0..count as u32).collect())
    }

    fn root(&mut self, mut thing: u32) -> u32 {
        while self.0[thing as usize] != thing {
            // The thing now points to the one two steps above, which halves the way up for the next search.
            let above = self.0[self.0[thing as usize] as usize];
            self.0[thing as usize] = above;
            thing = above;
        }
        thing
    }

    /// Join two things.
    pub fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b) as usize] = a.min(b);
    }

    /// Return the number of sets, and the index of the set of each thing. Sets are numbered in the order of their first things.
    pub fn classes(mut self) -> (usize, Vec<u32>) {
        let mut of_thing: Vec<u32> = vec![NONE; self.0.len()];
        let mut count = 0;
        for thing in 0..self.0.len() {
            // The root is the least of all things in the set.
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
