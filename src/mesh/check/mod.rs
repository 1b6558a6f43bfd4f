//! Whether the cells of a body are a mesh of it.
//!
//! What a body must be, and what is looked at:
//!
//! 1. Cells have positive volume: straight ones since they were read, curved ones by [`curved`].
//! 2. Two cells at most share a facet, from its two sides ([`faces`]).
//! 3. Facets of the boundary, those of one cell alone, meet in common corners and edges only ([`surface`]).
//! 4. Behind each closed surface of the boundary there is one cell ([`nesting`]).
//! 5. Cells join through facets, not by an edge or a corner alone ([`parts`]).
//! 6. Bodies have nodes of their own, and the facets of groups in use bound the bodies that they serve ([`groups`]).
//!
//! Then every point is covered once. By 1 and 2 the cells are a chain, whose boundary is that of 3 with its outer
//! normals. The number of cells at a point off the boundary is therefore how often the boundary goes around it (the degree
//! of the map from cells to space): it changes by one across each facet, and nowhere else. By 3 the boundary divides space
//! into regions with a closed surface between any two neighbours, and by 4 the number is one inside and zero outside of
//! each. No angle inside need be looked at: folded cells show at the boundary. By 3, too, there is no crack: a hanging node and
//! a facet with two sets of nodes are places where the boundary touches itself.
//!
//! Not proven: for quadratic elements 3 and 4 see the boundary with flat pieces between its nodes, eight to an edge where
//! facets without common nodes seem to meet. 3 takes for touching what is nearer than 1e-9 of a facet. Whether a point of the
//! boundary is where the user wants it nobody can tell: a mesh with a node moved a little is another mesh. A body may be pinched at a
//! point, if its cells join through facets elsewhere. All costs are linear in the number of cells, but for the search tree of the
//! boundary.

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

use super::Mesh;
use crate::error::Result;
use crate::problem::order::Order;
use cells::{Cells, NONE};
use faces::Faces;
use groups::InUse;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use surface::Surface;

/// A body and the groups that serve it.
#[derive(Debug, Clone)]
pub struct Asked<'a> {
    /// Name of the body: a group of cells.
    pub name: &'a str,
    /// Order of its elements, not above that of the mesh.
    pub order: Order,
    /// Names of groups, with what they do.
    pub groups: Vec<(&'a str, Duty)>,
}

/// What was found of a body.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Checked {
    /// Facets between two cells.
    pub inner: usize,
    /// Facets of the boundary.
    pub outer: usize,
    /// What hangs together.
    pub parts: Parts,
}

impl Checked {
    /// The same without the part of each cell.
    pub fn counted(&self) -> Self {
        Self { parts: Parts { of_cell: Vec::new(), ..self.parts }, ..*self }
    }
}

impl<const D: usize> Mesh<D> {
    /// Checks the bodies that are asked for, with the groups that serve them; `contacts` serve any body, and with `shared` bodies
    /// may have nodes in common. Names that are no groups of the mesh are left to others, which know where they stand.
    ///
    /// # Errors
    /// What is no mesh of a body, with body, place and elements.
    pub fn check(&self, bodies: &[Asked], contacts: &[&str], shared: bool) -> Result<Vec<Checked>> {
        let mut in_use: HashMap<(&str, Duty), InUse> = HashMap::new();
        let contacts = || contacts.iter().map(|&name| (name, Duty::Acts));
        for (name, duty) in bodies.iter().flat_map(|body| body.groups.iter().copied()).chain(contacts()) {
            if let Some(group) = self.group(name) {
                in_use.entry((name, duty)).or_insert_with(|| InUse::new(group, duty));
            }
        }
        let mut node = vec![NONE; self.points.len()];
        let mut owner = vec![NONE; if shared { 0 } else { self.points.len() }];
        let mut checked = Vec::new();
        for (index, body) in bodies.iter().enumerate() {
            let Some(group) = self.group(body.name).filter(|group| group.dimension == D) else { continue };
            let cells = Cells::new(self, group, body.order, &mut node);
            if !shared {
                for (number, &point) in cells.points.iter().enumerate() {
                    let other = std::mem::replace(&mut owner[point as usize], index as u32);
                    if other != NONE {
                        let what = format!("it shares a node with body `{}`", bodies[other as usize].name);
                        let cell = (0..cells.count()).find(|&cell| cells.cell(cell).contains(&(number as u32)));
                        let error = cells.refuse(&what, &Vec::from_iter(cell), cells.at(number as u32));
                        return Err(error.help(
                            "shared nodes join nothing: give each body its own points, curves and surfaces, \
                             or let contacts be found: between = \"auto\"",
                        ));
                    }
                }
            }
            curved::check(&cells)?;
            let faces = Faces::new(&cells);
            faces.check(&cells)?;
            let surface = Surface::new(&cells, &faces);
            surface.check()?;
            nesting::check(&cells, &surface)?;
            let parts = parts::parts(&cells, &faces)?;
            for ((name, duty), group) in &mut in_use {
                let served =
                    body.groups.contains(&(*name, *duty)) || contacts().any(|contact| contact == (*name, *duty));
                group.compare(&cells, &faces, &node, !served);
            }
            checked.push(Checked { inner: faces.inner().count(), outer: surface.faces.len(), parts });
            cells.points.iter().for_each(|&point| node[point as usize] = NONE);
        }
        let mut all: Vec<_> = in_use.into_iter().collect();
        all.sort_unstable_by_key(|((name, _), _)| *name);
        all.iter().try_for_each(|(_, group)| group.judge(self))?;
        Ok(checked)
    }
}
