//! The check that the cells of a body are a mesh of it.
//!
//! A body must satisfy six conditions. The module in parentheses checks each of them.
//!
//! 1. Cells have positive volume. Straight cells have it since they were read; curved ones are checked ([`curved`]).
//! 2. At most two cells share a facet, from its two sides ([`faces`]).
//! 3. Facets of the boundary, which are those of one cell alone, meet in common corners and edges only ([`surface`]).
//! 4. Behind each closed surface of the boundary there is one cell ([`nesting`]).
//! 5. Cells join through facets, not by an edge or a corner alone ([`parts`]).
//! 6. Bodies have nodes of their own, and the facets of groups in use bound the bodies that they serve ([`groups`]).
//!
//! Then every point of the body is covered once. By 1 and 2 the cells are a chain. The boundary of this chain is that of 3 with
//! its outer normals. The number of cells at a point off the boundary is therefore the number of times that the boundary goes
//! around the point. It is the degree of the map from cells to space. This number changes by one across each facet of the
//! boundary, and nowhere else. By 3 the boundary divides space into regions with a closed surface between any two neighbours.
//! By 4 the number is one inside and zero outside of each closed surface. Angles inside the body need no check, because folded
//! cells show at the boundary. Condition 3 also excludes cracks: a hanging node and a facet with two sets of nodes are places
//! where the boundary touches itself.
//!
//! The checks have these limits. For quadratic elements, 3 and 4 replace the boundary by flat pieces between its nodes. Where
//! facets without common nodes seem to meet, 3 uses eight pieces per edge. Condition 3 counts facets as touching if they are
//! nearer than 1e-9 of the size of a facet. No check can tell whether a point of the boundary is where the user wants it: a
//! mesh with a node moved a little is another mesh. A body may be pinched at a point, if its cells join through facets
//! elsewhere.
//!
//! All costs are linear in the number of cells, except for that of the search tree of the boundary.

mod cells;
mod curved;
mod distance;
mod faces;
mod groups;
mod nesting;
mod parts;
mod surface;
#[cfg(test)]
mod tests;

pub use groups::Duty;
pub use parts::Parts;

pub(super) use cells::EDGES;
pub(super) use curved::is_folded;

use super::Mesh;
use crate::error::{Error, Result};
use crate::problem::order::Order;
use cells::{Cells, NONE};
use faces::Faces;
use groups::InUse;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use surface::Surface;

/// A body to check, and the groups that serve it.
#[derive(Debug, Clone)]
pub struct Asked<'a> {
    /// Name of the body, which is that of a group of cells.
    pub name: &'a str,
    /// Order of its elements, at most that of the mesh.
    pub order: Order,
    /// Names of groups, with their duties.
    pub groups: Vec<(&'a str, Duty)>,
}

/// Results of the check of a body.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Checked {
    /// Number of facets between two cells.
    pub inner: usize,
    /// Number of facets of the boundary.
    pub outer: usize,
    /// Parts of the body that are connected by facets.
    pub parts: Parts,
    /// Point of the mesh of each node of the body.
    #[serde(skip)]
    pub points: Vec<u32>,
}

impl<const D: usize> Mesh<D> {
    /// Check these bodies with the groups that serve them. `contacts` names groups that serve any body. With `shared`, bodies
    /// may have nodes in common. Names that are not groups of the mesh are skipped, because the caller knows where they stand
    /// in the scene.
    ///
    /// # Errors
    /// A group of cells is not a mesh of a body. The error gives the body, the place and the elements.
    pub fn check(&self, bodies: &[Asked], contacts: &[&str], shared: bool) -> Result<Vec<Checked>> {
        let mut in_use: BTreeMap<(&str, Duty), InUse> = BTreeMap::new();
        let contacts = || contacts.iter().map(|&name| (name, Duty::Acts));
        for (name, duty) in bodies.iter().flat_map(|body| body.groups.iter().copied()).chain(contacts()) {
            // Groups of cells need no comparison: every cell of a group belongs to one body, or to none.
            if let Some(group) = self.group(name).filter(|group| group.dimension < D) {
                in_use.entry((name, duty)).or_insert_with(|| InUse::new(group, duty));
            }
        }
        let mut node = vec![NONE; self.points.len()];
        // This is the last body found at each point.
        let mut owner = vec![NONE; if shared { 0 } else { self.points.len() }];
        let mut checked = Vec::new();
        for (index, body) in bodies.iter().enumerate() {
            let Some(group) = self.group(body.name).filter(|group| group.dimension == D) else { continue };
            let stride = if body.order == Order::P1 { D + 1 } else { group.stride };
            let cells = Cells::new(self, group, stride, &mut node);
            for (number, &point) in (0..).zip(&cells.points).filter(|_| !shared) {
                let other = std::mem::replace(&mut owner[point as usize], index as u32);
                if other != NONE {
                    return Err(two(&cells, number, bodies[other as usize].name));
                }
            }
            curved::check(&cells)?;
            let faces = Faces::new(&cells);
            faces.check(&cells)?;
            let surface = Surface::new(&cells, faces.outer().collect());
            surface.check()?;
            nesting::check(&cells, &surface)?;
            let (inner, outer) = (faces.inner().count(), surface.faces.len());
            let parts = parts::parts(&cells, &faces)?;
            for ((name, duty), group) in &mut in_use {
                let served =
                    body.groups.contains(&(*name, *duty)) || contacts().any(|contact| contact == (*name, *duty));
                group.compare(&cells, &faces, &node, !served);
            }
            cells.points.iter().for_each(|&point| node[point as usize] = NONE);
            checked.push(Checked { inner, outer, parts, points: cells.points });
        }
        in_use.values().try_for_each(|group| group.judge(self))?;
        Ok(checked)
    }
}

/// Return the refusal of a body that shares a node with another one.
fn two<const D: usize>(cells: &Cells<D>, node: u32, other: &str) -> Error {
    let what = format!("it shares a node with body `{other}`");
    let cell = (0..cells.count()).find(|&cell| cells.cell(cell).contains(&node));
    cells.refuse(&what, &Vec::from_iter(cell), cells.at(node)).help(
        "shared nodes join nothing: give each body its own points, curves and surfaces, \
         or let contacts be found: between = \"auto\"",
    )
}
