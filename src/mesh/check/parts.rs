//! The connected parts of a body: cells join through whole facets.

use super::faces::{Cells, NONE};
use crate::error::Result;
use crate::linalg::{DisjointSets, bounds};
use crate::mesh::faces::Faces;
use crate::mesh::{Group, Mesh};
use serde::{Deserialize, Serialize};

/// The parts of a body, numbered 0, 1, ... in the order of their first cells.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Components {
    /// Number of parts.
    pub count: usize,
    /// Part of each node of the body; empty if there is one part.
    pub of_node: Vec<u32>,
}

/// Return the parts of a body.
///
/// # Errors
/// Two parts share nodes: an edge or a corner alone does not join elastic bodies.
pub fn of<const D: usize>(cells: &Cells<D>, faces: &Faces<D>) -> Result<Components> {
    let (count, of_cell) = classes(cells, faces);
    let of_node = if count == 1 { Vec::new() } else { of_nodes(cells, &of_cell)? };
    Ok(Components { count, of_node })
}

/// Return the number of parts, and the part of each cell.
fn classes<const D: usize>(cells: &Cells<D>, faces: &Faces<D>) -> (usize, Vec<u32>) {
    let mut joined = DisjointSets::new(cells.count());
    for two in faces.alike().flat_map(|alike| alike.windows(2)) {
        joined.join(two[0].1.cell() as u32, two[1].1.cell() as u32);
    }
    joined.classes()
}

/// Largest difference of coordinates that count as equal in the order of parts, as a share of the size of their group.
/// Files with eight characters for a number (`.bdf`) have six digits.
const ALIKE: f64 = 1e-6;

impl<const D: usize> Mesh<D> {
    /// Add the parts of a group of cells that are connected by facets as groups `NAME_1`, `NAME_2`, ... They are in the
    /// order of x, then y, then z of the middle of their boxes. Parts with one middle are in the order of the sizes of
    /// their boxes.
    ///
    /// # Errors
    /// The mesh has a group of such a name already; the error is the name.
    pub fn split(&mut self, name: &str) -> std::result::Result<(), String> {
        let Some(group) = self.group(name).filter(|group| group.dimension == D) else { return Ok(()) };
        let cells = Cells::new(self, group, D + 1, &mut vec![NONE; self.points.len()]);
        let (count, of_cell) = classes(&cells, &cells.faces());
        let mut members = vec![Vec::new(); count];
        of_cell.iter().zip(0..).for_each(|(&part, cell): (_, u32)| members[part as usize].push(cell));
        let middles: Vec<[f64; 6]> = members.iter().map(|members| middle(&cells, members)).collect();
        let [low, high] = bounds((0..cells.node_count() as u32).map(|node| cells.at(node)));
        let size = (0..D).map(|c| high[c] - low[c]).fold(0.0, f64::max);
        let mut order: Vec<usize> = (0..count).collect();
        arrange(&mut order, &middles, ALIKE * size, 0);
        let named = order.iter().zip(1..).map(|(&part, number): (_, usize)| (part, format!("{name}_{number}")));
        let parts: Vec<Group> = named.map(|(part, name)| only(group, &members[part], name)).collect();
        if let Some(taken) = parts.iter().find(|part| self.groups.iter().any(|group| group.name == part.name)) {
            return Err(taken.name.clone());
        }
        self.groups.add_parts(name, parts);
        Ok(())
    }
}

/// Return the middle of the box around some cells, and then the size of the box.
fn middle<const D: usize>(cells: &Cells<D>, members: &[u32]) -> [f64; 6] {
    let nodes = members.iter().flat_map(|&cell| cells.cell(cell as usize));
    let [low, high] = bounds(nodes.map(|&node| cells.at(node)));
    std::array::from_fn(|k| if k < 3 { 0.5 * (low[k] + high[k]) } else { high[k - 3] - low[k - 3] })
}

/// Sort the indices `order` by their keys from entry `from` on. Entries that a chain of differences of at most `alike`
/// connects count as equal.
fn arrange(order: &mut [usize], keys: &[[f64; 6]], alike: f64, from: usize) {
    if from == 6 {
        return order.sort_unstable();
    }
    order.sort_by(|&a, &b| keys[a][from].total_cmp(&keys[b][from]));
    for equal in order.chunk_by_mut(|&a, &b| keys[b][from] - keys[a][from] <= alike) {
        arrange(equal, keys, alike, from + 1);
    }
}

/// Return the group of some cells of a group.
fn only(group: &Group, members: &[u32], name: String) -> Group {
    let simplex = |&cell: &u32| &group.connectivity[cell as usize * group.stride..][..group.stride];
    let connectivity = members.iter().flat_map(simplex).copied().collect();
    let tags = members.iter().filter_map(|&cell| group.tags.get(cell as usize)).copied().collect();
    Group { name, dimension: group.dimension, stride: group.stride, connectivity, tags }
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
