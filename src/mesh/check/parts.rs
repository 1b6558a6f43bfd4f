//! Parts of a body: cells that hang together by faces.

use super::cells::{Cells, NONE};
use super::faces::Faces;
use crate::error::Result;
use serde::{Deserialize, Serialize};

/// What hangs together, numbered 0, 1, ... in the order of their first cells.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Parts {
    /// Number of parts.
    pub count: usize,
    /// Part of each cell; none where all are one.
    pub of_cell: Vec<u32>,
}

/// The parts of a body.
///
/// # Errors
/// Parts that share nodes: an edge or a corner alone does not join elastic bodies.
pub fn parts<const D: usize>(cells: &Cells<D>, faces: &Faces<D>) -> Result<Parts> {
    let mut joined = Joined::new(cells.count());
    faces.inner().for_each(|[a, b]| joined.join(a.cell() as u32, b.cell() as u32));
    let parts = joined.classes();
    if parts.count == 1 {
        return Ok(Parts { of_cell: Vec::new(), ..parts });
    }
    let mut first = vec![NONE; cells.points.len()];
    for cell in 0..cells.count() {
        for &node in cells.cell(cell) {
            let first = &mut first[node as usize];
            if *first == NONE {
                *first = cell as u32;
            }
            let other = *first as usize;
            if parts.of_cell[cell] != parts.of_cell[other] {
                let what = "cells hang together by an edge or a corner alone";
                return Err(cells.refuse(what, &[other, cell], cells.at(node)).help(
                    "cells of a body join through whole facets: let them overlap in the geometry, or make bodies of them",
                ));
            }
        }
    }
    Ok(parts)
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

    /// What is joined gets the same number.
    pub fn classes(mut self) -> Parts {
        let mut of_cell: Vec<u32> = vec![NONE; self.0.len()];
        let mut count = 0;
        for thing in 0..self.0.len() {
            // the least of all that are joined
            let root = self.root(thing as u32) as usize;
            if root == thing {
                of_cell[thing] = count;
                count += 1;
            }
            of_cell[thing] = of_cell[root];
        }
        Parts { count: count as usize, of_cell }
    }
}
