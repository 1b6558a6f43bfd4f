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
//!
//! On several ranks each looks at what it has ([`Portion`]) and is complete there, without others: 1 at its cells; 2 at facets whose least corner
//! is its own; 6 at facets with an own corner, and whether bodies share an own node. Of others it needs: the numbers of nodes, which all sort by the
//! cells in which they are met first ([`nodes`]); for 3 and 4 on the first rank the facets of the whole boundary, with the cells behind
//! them; for 5 which of its parts hang together by cells of other ranks. Errors have the place at which one rank would meet them, and the first
//! one counts.

mod cells;
mod curved;
mod distance;
mod faces;
mod groups;
mod nesting;
mod nodes;
mod parts;
mod surface;
#[cfg(test)]
mod tests;

use serde::{Deserialize, Serialize};
pub use groups::Duty;
pub use nodes::Nodes;
pub use parts::{Joined, Parts};

pub(super) use cells::EDGES;
pub(super) use curved::is_folded;

use super::Portion;
use crate::error::{Error, Result};
use crate::exchange::{Exchange, first, trade};
use crate::problem::order::Order;
use cells::{Cells, Found, NONE, Sent};
use faces::{Face, Faces};
use groups::InUse;
use std::collections::BTreeMap;
use std::sync::Arc;
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
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Checked {
    /// Facets between two cells.
    pub inner: usize,
    /// Facets of the boundary.
    pub outer: usize,
    /// What hangs together.
    pub parts: Parts,
    /// Its nodes, as the cells of all ranks meet them.
    #[serde(skip)]
    pub nodes: Arc<Nodes>,
}

impl<const D: usize> Portion<D> {
    /// Checks the bodies that are asked for, with the groups that serve them; `contacts` serve any body, and with `shared` bodies
    /// may have nodes in common. Names that are no groups of the mesh are left to others, which know where they stand. Collective.
    ///
    /// # Errors
    /// What is no mesh of a body, with body, place and elements; on one rank of several.
    pub fn check(
        &self,
        bodies: &[Asked],
        contacts: &[&str],
        shared: bool,
        exchange: &dyn Exchange,
    ) -> Result<Vec<Checked>> {
        let mesh = &self.mesh;
        let mut in_use: BTreeMap<(&str, Duty), InUse> = BTreeMap::new();
        let contacts = || contacts.iter().map(|&name| (name, Duty::Acts));
        for (name, duty) in bodies.iter().flat_map(|body| body.groups.iter().copied()).chain(contacts()) {
            // every cell of a group is one of a body, or of none; and ranks have different ones
            if let Some(group) = mesh.group(name).filter(|group| group.dimension < D) {
                in_use.entry((name, duty)).or_insert_with(|| InUse::new(group, duty));
            }
        }
        let mut node = vec![NONE; mesh.points.len()];
        let mut owner = vec![NONE; if shared { 0 } else { mesh.points.len() }];
        let place = |body: &Asked| mesh.groups.place(body.name).filter(|&place| mesh.groups[place].dimension == D);
        let stride =
            |body: &Asked, place: usize| if body.order == Order::P1 { D + 1 } else { mesh.groups[place].stride };
        let found = bodies.iter().filter_map(|body| place(body).map(|place| (place, stride(body, place))));
        let mut nodes = nodes::number(self, &found.collect::<Vec<_>>(), exchange).into_iter();
        let mut checked = Vec::new();
        for (index, body) in bodies.iter().enumerate() {
            let Some((place, known)) = place(body).and_then(|place| Some((place, Arc::new(nodes.next()?)))) else {
                continue;
            };
            let cells = Cells::new(self, place, stride(body, place), known, &mut node);
            let mut twice = None;
            if !shared {
                for (number, &point) in (0..).zip(&cells.known.points) {
                    let other = std::mem::replace(&mut owner[point as usize], index as u32);
                    if other != NONE && twice.is_none() {
                        twice = Some((number, bodies[other as usize].name));
                    }
                }
            }
            let alone = twice
                .filter(|(node, _)| cells.is_own(*node))
                .map_or(Ok(()), |(node, other)| Err(two(&cells, node, other)));
            let local = alone.and_then(|()| curved::check(&cells)).and_then(|()| {
                let faces = Faces::new(&cells);
                faces.check(&cells).map(|()| faces)
            });
            let faces = first(exchange, local)?;
            let outer: Vec<_> = faces.outer(&cells).collect();
            let mut counts = [faces.count(&cells), outer.len()].map(|count| count as f64);
            exchange.sum(&mut counts);
            let bounded = boundary(&cells, outer, exchange);
            let parts = parts::parts(&cells, &faces, bounded, exchange)?;
            for ((name, duty), group) in &mut in_use {
                let served =
                    body.groups.contains(&(*name, *duty)) || contacts().any(|contact| contact == (*name, *duty));
                group.compare(&cells, &faces, &node, !served);
            }
            let [inner, outer] = counts.map(|count| count as usize);
            cells.known.points.iter().for_each(|&point| node[point as usize] = NONE);
            checked.push(Checked { inner, outer, parts, nodes: cells.known });
        }
        in_use.values_mut().for_each(|group| group.agree(exchange));
        let judged = in_use.values().try_for_each(|group| group.judge(mesh));
        // all have found the same; the first rank has the numbers of elements
        first(exchange, judged.map_err(|error| (exchange.rank(), error)))?;
        Ok(checked)
    }
}

/// The refusal of a body that shares a node with another one.
fn two<const D: usize>(cells: &Cells<D>, node: u32, other: &str) -> ((u8, u64, u32, u32), Error) {
    let what = format!("it shares a node with body `{other}`");
    let cell = (0..cells.count()).find(|&cell| cells.cell(cell).contains(&node));
    let error = cells.refuse(&what, &Vec::from_iter(cell), cells.at(node)).help(
        "shared nodes join nothing: give each body its own points, curves and surfaces, \
         or let contacts be found: between = \"auto\"",
    );
    ((0, u64::from(cells.number(node)), 0, 0), error)
}

/// Checks the boundary, of which each rank has some facets with their least corners: the first rank gets all, with the cells behind them. Collective.
fn boundary<const D: usize>(cells: &Cells<D>, outer: Vec<(u32, Face<D>)>, exchange: &dyn Exchange) -> Found {
    let look = |cells: &Cells<D>, faces: Vec<(u32, Face<D>)>| {
        let surface = Surface::new(cells, faces.into_iter().map(|(_, face)| face).collect());
        let found = surface.check().and_then(|()| nesting::check(cells, &surface));
        found.map_err(|error| ((3, 0, 0, 0), error))
    };
    if exchange.ranks() == 1 {
        return look(cells, outer);
    }
    let mut behind: Vec<usize> = outer.iter().map(|(_, face)| face.cell()).collect();
    behind.sort_unstable();
    behind.dedup();
    let here = |face: Face<D>| behind.binary_search(&face.cell()).map_or(face, |place| face.of_cell(place));
    // those of one least corner are of one rank, in the order that all would have
    let faces: Vec<_> = outer.into_iter().map(|(least, face)| (cells.number(least), here(face))).collect();
    let mut mine = vec![Default::default(); exchange.ranks()];
    mine[0] = (cells.some(behind.iter().copied()), faces);
    let (mut all, mut rim, mut before) = (Vec::new(), Vec::new(), 0);
    for (sent, faces) in trade::<(Sent, Vec<(u32, Face<D>)>)>(exchange, mine) {
        all.extend(faces.into_iter().map(|(least, face)| (least, face.of_cell(before + face.cell()))));
        before += sent.keys.len();
        rim.push(sent);
    }
    if exchange.rank() > 0 {
        return Ok(());
    }
    all.sort_unstable();
    look(&cells.of(rim.into_iter()), all)
}
