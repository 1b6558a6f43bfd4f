//! Groups that a scene uses: their facets, edges and points lie where their purpose requires it.

use super::faces::{Cells, NONE, refuse};
use crate::error::{Error, Result};
use crate::mesh::faces::{Face, Faces};
use crate::mesh::{Group, Mesh};
use std::collections::HashSet;

/// The purpose of a group for a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Duty {
    /// A load, spring or contact, which acts on the boundary of the bodies that it serves.
    Acts,
    /// A support, which constrains nodes of bodies, also inside them.
    Holds,
}

/// A group of facets, edges or points in use, and what is known of its simplices so far.
pub struct InUse<'a> {
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
    pub fn new(group: &'a Group, duty: Duty) -> Self {
        Self { group, duty, found: vec![Relation::default(); group.len()] }
    }

    /// Compare the group with a body. `other` tells that the group does not serve this body. Only supports are compared
    /// with such a body: a support may constrain a part of its group, and the rest may lie on other bodies. `node`
    /// holds the body's node of each point.
    pub fn compare<const D: usize>(&mut self, cells: &Cells<D>, faces: &Faces<D>, node: &[u32], other: bool) {
        let dimension = self.group.dimension;
        if other && self.duty == Duty::Acts {
            return;
        }
        let corners = dimension + 1;
        let wanted = if cells.is_curved() { self.group.stride } else { corners };
        let edges = if dimension + 2 == D && dimension == 1 { self.edges(cells, node) } else { HashSet::new() };
        let mut own = Vec::with_capacity(wanted);
        for (simplex, found) in self.group.simplices().zip(&mut self.found) {
            own.clear();
            own.extend(simplex[..wanted].iter().map(|&point| node[point as usize]));
            if own.contains(&NONE) {
                continue;
            }
            found.touches |= !other;
            found.serves |= match (dimension, self.duty) {
                (0, _) => true,
                (1, _) if D == 3 => edges.contains(&[own[0].min(own[1]), own[0].max(own[1])]),
                (_, duty) => {
                    let has_all =
                        |face: &Face<D>| face.nodes(cells.simplices()).skip(D).all(|node| own.contains(&node));
                    let cells = faces.at(&own).filter(has_all).count();
                    cells == 1 || duty == Duty::Holds && cells > 0
                }
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

    /// Refuse a group that has a simplex twice, serves in part only, or has simplices that lie across its bodies. A
    /// group that touches no body is left to the caller, which reports the line of the scene that names it.
    pub fn judge<const D: usize>(&self, mesh: &Mesh<D>) -> Result<()> {
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
