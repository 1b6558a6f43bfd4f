//! The check that the cells of a body are a mesh of it, one file a question.
//!
//! 1. Each node inside an edge serves one edge ([`curved`]). Cells have positive volume since the mesh was read.
//! 2. At most two cells share a facet, from its two sides, with the same mid-edge nodes ([`faces`]).
//! 3. No node of the boundary lies on a facet to which it does not belong, which would leave a crack ([`boundary`]).
//! 4. Cells join through facets, not by an edge or a corner alone ([`parts`]).
//! 5. Bodies have nodes of their own.
//! 6. The facets of groups in use bound the bodies that they serve ([`groups`]).
//!
//! Facets that cross each other are not looked for, nor parts that were meshed again inside other ones: no mesher makes
//! them. No check can tell whether a point of the boundary is where the user wants it. All costs are linear in the
//! number of cells, except for that of the search tree of the boundary.

mod boundary;
mod curved;
mod faces;
mod groups;
mod parts;
#[cfg(test)]
mod tests;

use super::Mesh;
use super::faces::Face;
use crate::error::{Error, Result};
use crate::problem::order::Order;
use faces::{Cells, NONE};
pub use groups::Duty;
use groups::InUse;
pub use parts::Components;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

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
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct BodyCheck {
    /// Number of facets between two cells.
    pub inner: usize,
    /// Number of facets of the boundary.
    pub outer: usize,
    /// Area (length in the plane) of the boundary, from its corners.
    pub surface: f64,
    /// Parts of the body that are connected by facets.
    pub parts: Components,
    /// Point of the mesh of each node of the body.
    #[serde(skip)]
    pub points: Vec<u32>,
}

impl<const D: usize> Mesh<D> {
    /// Check these bodies with the groups that serve them. `contacts` names groups that serve any body. With `shared`,
    /// bodies may have nodes in common. Names that are not groups of the mesh are skipped, because the caller knows
    /// where they stand in the scene.
    ///
    /// # Errors
    /// A group of cells is not a mesh of a body. The error gives the body, the place and the elements.
    pub fn check(&self, bodies: &[Asked], contacts: &[&str], shared: bool) -> Result<Vec<BodyCheck>> {
        let mut in_use: BTreeMap<(&str, Duty), InUse> = BTreeMap::new();
        let contacts = || contacts.iter().map(|&name| (name, Duty::Acts));
        for (name, duty) in bodies.iter().flat_map(|body| body.groups.iter().copied()).chain(contacts()) {
            // Groups of cells need no comparison: every cell of a group belongs to one body, or to none.
            if let Some(group) = self.group(name).filter(|group| group.dimension < D) {
                in_use.entry((name, duty)).or_insert_with(|| InUse::new(group, duty));
            }
        }
        let mut node = vec![NONE; self.points.len()];
        let mut owner = vec![NONE; if shared { 0 } else { self.points.len() }];
        let mut checked = Vec::new();
        for (index, body) in bodies.iter().enumerate() {
            let Some(group) = self.group(body.name).filter(|group| group.dimension == D) else { continue };
            let stride = if body.order == Order::P1 { D + 1 } else { group.stride };
            let cells = Cells::new(self, group, stride, &mut node);
            if !shared {
                own_nodes(&cells, index, bodies, &mut owner)?;
            }
            curved::check(&cells)?;
            let faces = cells.faces();
            faces::check(&faces, &cells)?;
            let outer: Vec<Face<D>> = faces.outer().collect();
            boundary::check(&cells, &outer)?;
            let parts = parts::of(&cells, &faces)?;
            let surface = outer.iter().map(|face| cells.area(*face)).sum();
            for ((name, duty), group) in &mut in_use {
                let served =
                    body.groups.contains(&(*name, *duty)) || contacts().any(|contact| contact == (*name, *duty));
                group.compare(&cells, &faces, &node, !served);
            }
            cells.points.iter().for_each(|&point| node[point as usize] = NONE);
            checked.push(BodyCheck { inner: faces.inner(), outer: outer.len(), surface, parts, points: cells.points });
        }
        in_use.values().try_for_each(|group| group.judge(self))?;
        Ok(checked)
    }
}

/// Refuse a body that shares a node with another one. `owner` has the last body found at each point of the mesh.
fn own_nodes<const D: usize>(cells: &Cells<D>, index: usize, bodies: &[Asked], owner: &mut [u32]) -> Result<()> {
    for (node, &point) in (0..).zip(&cells.points) {
        let other = std::mem::replace(&mut owner[point as usize], index as u32);
        if other != NONE {
            return Err(two(cells, node, bodies[other as usize].name));
        }
    }
    Ok(())
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
