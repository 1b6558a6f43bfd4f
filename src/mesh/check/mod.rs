//! The check that the cells of a body are a mesh of it.
//!
//! A body must satisfy six conditions. The name in parentheses is that of the code that checks each of them.
//!
//! 1. Cells have positive volume. Straight cells have it since they were read; curved ones are checked ([`curved`]).
//! 2. At most two cells share a facet, from its two sides ([`faces`]).
//! 3. Facets of the boundary, which are those of one cell alone, meet in common corners and edges only ([`surface`]).
//! 4. Behind each closed surface of the boundary there is one cell ([`surface`]).
//! 5. Cells join through facets, not by an edge or a corner alone ([`parts()`]).
//! 6. Bodies have nodes of their own, and the facets of groups in use bound the bodies that they serve ([`InUse`]).
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

mod curved;
mod faces;
mod surface;
#[cfg(test)]
mod tests;

use super::{Group, Mesh};
use crate::error::{Error, Result};
use crate::linalg::{DisjointSets, bounds};
use crate::problem::order::Order;
use faces::{Cells, Faces, NONE, refuse};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, HashSet};
use surface::BoundarySurface;

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
pub struct BodyCheck {
    /// Number of facets between two cells.
    pub inner: usize,
    /// Number of facets of the boundary.
    pub outer: usize,
    /// Parts of the body that are connected by facets.
    pub parts: Components,
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
            let surface = BoundarySurface::new(&cells, faces.outer().collect());
            surface.check()?;
            surface.check_nesting()?;
            let (inner, outer) = (faces.inner().count(), surface.faces.len());
            let parts = parts(&cells, &faces)?;
            for ((name, duty), group) in &mut in_use {
                let served =
                    body.groups.contains(&(*name, *duty)) || contacts().any(|contact| contact == (*name, *duty));
                group.compare(&cells, &faces, &node, !served);
            }
            cells.points.iter().for_each(|&point| node[point as usize] = NONE);
            checked.push(BodyCheck { inner, outer, parts, points: cells.points });
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

/// The purpose of a group for a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Duty {
    /// A load, spring or contact, which acts on the boundary of the bodies that it serves.
    Acts,
    /// A support, which constrains nodes of bodies, also inside them.
    Holds,
}

/// A group of facets, edges or points in use, and what is known of its simplices so far.
struct InUse<'a> {
    group: &'a Group,
    duty: Duty,
    /// The relation of each simplex to the bodies.
    found: Vec<Relation>,
}

/// The relation of a simplex to the bodies that were compared so far.
#[derive(Clone, Copy, Default)]
struct Relation {
    /// Whether it lies where the duty requires it.
    serves: bool,
    /// Whether its nodes are nodes of a body that it serves.
    touches: bool,
}

impl<'a> InUse<'a> {
    fn new(group: &'a Group, duty: Duty) -> Self {
        Self { group, duty, found: vec![Relation::default(); group.len()] }
    }

    /// Compare the group with a body. `other` tells that the group does not serve this body. Only supports are compared with
    /// such a body: a support may constrain a part of its group, and the rest may lie on other bodies. `node` holds the body's
    /// node of each point.
    fn compare<const D: usize>(&mut self, cells: &Cells<D>, faces: &Faces<D>, node: &[u32], other: bool) {
        let dimension = self.group.dimension;
        if other && self.duty == Duty::Acts {
            return;
        }
        let corners = dimension + 1;
        let wanted = if cells.is_quadratic() { self.group.stride } else { corners };
        let edges = if dimension + 2 == D && dimension == 1 { self.edges(cells, node) } else { HashSet::new() };
        for (simplex, found) in self.group.simplices().zip(&mut self.found) {
            let mut own = [NONE; 6];
            own.iter_mut().zip(&simplex[..wanted]).for_each(|(own, &point)| *own = node[point as usize]);
            let own = &own[..wanted];
            if own.contains(&NONE) {
                continue;
            }
            found.touches |= !other;
            found.serves |= match (dimension, self.duty) {
                (0, _) => true,
                (1, _) if D == 3 => edges.contains(&[own[0].min(own[1]), own[0].max(own[1])]),
                (_, Duty::Acts) => faces.cells_at(cells, own) == 1,
                (_, Duty::Holds) => faces.cells_at(cells, own) > 0,
            };
        }
    }

    /// Return the edges of the body between nodes of the group, for groups of edges in space.
    fn edges<const D: usize>(&self, cells: &Cells<D>, node: &[u32]) -> HashSet<[u32; 2]> {
        let mut on_group = vec![false; cells.node_count()];
        let nodes = self.group.connectivity.iter().map(|&point| node[point as usize]);
        nodes.filter(|&node| node != NONE).for_each(|node| on_group[node as usize] = true);
        let mut edges = HashSet::new();
        for cell in 0..cells.count() {
            let corners = &cells.cell(cell)[..=D];
            let marked = corners.iter().copied().filter(|&node| on_group[node as usize]).collect::<Vec<_>>();
            for (k, &a) in marked.iter().enumerate() {
                edges.extend(marked[..k].iter().map(|&b| [a.min(b), a.max(b)]));
            }
        }
        edges
    }

    /// Refuse a group that has a simplex twice, serves in part only, or has simplices that lie across its bodies. A group that
    /// touches no body is left to the caller, which reports the line of the scene that names it.
    fn judge<const D: usize>(&self, mesh: &Mesh<D>) -> Result<()> {
        if let Some(twice) = self.twice() {
            return Err(self.refuse(mesh, twice, "stands twice in it", "mesh the geometry again"));
        }
        let any = self.found.iter().any(|found| found.serves);
        let Some(bad) = self.found.iter().position(|found| !found.serves && (any || found.touches)) else {
            return Ok(());
        };
        Err(match self.duty {
            Duty::Acts => self.refuse(
                mesh,
                bad,
                "bounds no body that it serves",
                "loads, springs and contacts act on boundaries: let the group have those of its own bodies alone",
            ),
            Duty::Holds => self.refuse(
                mesh,
                bad,
                "belongs to no body of the scene",
                "supports hold nodes of bodies: let the group have those of bodies alone",
            ),
        })
    }

    /// Return the index of a simplex that has the corners of an earlier one.
    fn twice(&self) -> Option<usize> {
        let corners = |index: usize| {
            let mut corners = [NONE; 3];
            let simplex = &self.group.connectivity[index * self.group.stride..][..=self.group.dimension];
            corners.iter_mut().zip(simplex).for_each(|(corner, &point)| *corner = point);
            corners.sort_unstable();
            corners
        };
        let mut seen = HashSet::with_capacity(self.group.len());
        (0..self.group.len()).find(|&index| !seen.insert(corners(index)))
    }

    /// Return the refusal of a simplex of the group.
    fn refuse<const D: usize>(&self, mesh: &Mesh<D>, index: usize, what: &str, help: &str) -> Error {
        let points = &self.group.connectivity[index * self.group.stride..][..=self.group.dimension];
        let thing = match (self.group.dimension, D) {
            (0, _) => "point",
            (1, 3) => "edge",
            _ => "facet",
        };
        let mean = |c: usize| points.iter().map(|&p| mesh.points[p as usize][c]).sum::<f64>() / points.len() as f64;
        let at = std::array::from_fn(|c| if c < D { mean(c) } else { 0.0 });
        let what = format!("a {thing} of group `{}` {what},", self.group.name);
        refuse(mesh, self.group, what, &[index], at).help(help)
    }
}

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
fn parts<const D: usize>(cells: &Cells<D>, faces: &Faces<D>) -> Result<Components> {
    let (count, of_cell) = classes(cells, faces);
    let of_node = if count == 1 { Vec::new() } else { of_nodes(cells, &of_cell)? };
    Ok(Components { count, of_node })
}

/// Return the number of parts, and the part of each cell.
fn classes<const D: usize>(cells: &Cells<D>, faces: &Faces<D>) -> (usize, Vec<u32>) {
    let mut joined = DisjointSets::new(cells.count());
    for two in faces.alike().flat_map(|alike| alike.windows(2)) {
        joined.join(two[0].cell() as u32, two[1].cell() as u32);
    }
    joined.classes()
}

/// Largest difference of coordinates that count as equal in the order of parts, as a share of the size of their group. Files with
/// eight characters for a number (`.bdf`) have six digits.
const ALIKE: f64 = 1e-6;

impl<const D: usize> Mesh<D> {
    /// Add the parts of a group of cells that are connected by facets as groups `NAME_1`, `NAME_2`, ... They are in the order of
    /// x, then y, then z of the middle of their boxes. Parts with one middle are in the order of the sizes of their boxes.
    ///
    /// # Errors
    /// The mesh has a group of such a name already; the error is the name.
    pub fn split(&mut self, name: &str) -> std::result::Result<(), String> {
        let Some(group) = self.group(name).filter(|group| group.dimension == D) else { return Ok(()) };
        let cells = Cells::new(self, group, D + 1, &mut vec![NONE; self.points.len()]);
        let (count, of_cell) = classes(&cells, &Faces::new(&cells));
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

/// Sort the indices `order` by their keys from entry `from` on. Entries that a chain of differences of at most `alike` connects
/// count as equal.
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
