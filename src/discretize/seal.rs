//! Seals: what pressure a contact surface holds between two of its ends.
//!
//! A fluid of the pressure s passes where the contact pressure is below s. It is held if the contact pressure reaches s
//! somewhere on every way along the surface from one end to the other. The largest such s, the sealing pressure, is the
//! least over all ways of the largest contact pressure on the way. Pressures are linear between the points of the
//! mesh of the surface. Two points with pressures below s that a way below s joins are then joined by such a way
//! along edges, so that edges are enough.

use super::contact_surface::{ContactSurface, corners, places};
use super::groups::find_group;
use crate::contact::Side;
use crate::error::{Error, Located, Result};
use crate::linalg::DisjointSets;
use crate::mesh::{Group, Mesh};
use crate::problem::ContactSpec;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeSet, HashSet};

/// The ways along a contact surface from one end to the other.
#[derive(Serialize, Deserialize)]
pub struct Seal {
    /// Edges between points of the mesh of the surface, and from the points at either end to a point for the end. These
    /// two follow the points of the mesh.
    edges: Vec<[u32; 2]>,
}

/// A surface that may carry the contact points of a seal.
pub struct Sealing<'a, const D: usize> {
    pub side: &'a Side<'a, D>,
    /// Point of the mesh of each node of the body.
    pub points: &'a [u32],
}

/// Indices in [`Side::corners`] of the nodes at each end of a seal.
type Ends = [Vec<usize>; 2];

impl Seal {
    /// Find the ways along a contact surface between the groups with these names. `surface` is its mesh for output.
    ///
    /// # Errors
    /// The mesh lacks a group, both groups meet the surface at the same nodes, or no way leads from one to the other.
    fn new<const D: usize>(
        names: &[Located<String>; 2],
        mesh: &Mesh<D>,
        sealing: &Sealing<D>,
        surface: &ContactSurface,
    ) -> Result<Self> {
        let ends = sealing.ends(names, mesh)?;
        let (side, points) = (sealing.side, surface.connectivity());
        let nodes = |end: &Vec<usize>| end.iter().map(|&at| side.facets.nodes[at]).collect::<BTreeSet<u32>>();
        let [first, second] = ends.each_ref().map(nodes);
        let ([a, b], on) = (names.each_ref().map(|name| &name.value), side.name);
        if first.is_subset(&second) || second.is_subset(&first) {
            let message = format!("`{a}` and `{b}` meet the contact surface `{on}` at the same place");
            return Err(Error::scene(&names[1].place, message)
                .help("name groups at different ends of it, such as its bore and its outer face"));
        }
        let (mut edges, count) = (edges(side, points), surface.points().len());
        for (end, at) in (count as u32..).zip(&ends) {
            edges.extend(at.iter().map(|&at| [points[at], end]));
        }
        let seal = Self { edges };
        if seal.weakest(&vec![0.0; count]).is_none() {
            let message = format!("no way along the contact surface `{on}` leads from `{a}` to `{b}`");
            return Err(Error::scene(&names[1].place, message).help("name two ends of one connected part of it"));
        }
        Ok(seal)
    }

    /// Return the point of the mesh with the largest pressure on the way where this is least, from the pressures of all
    /// points of the mesh. There is none if there is no way.
    pub fn weakest(&self, pressure: &[f64]) -> Option<usize> {
        // the points for the ends have no pressure
        let at = |point: u32| pressure.get(point as usize).copied().unwrap_or(f64::NEG_INFINITY);
        let higher = |[i, j]: [u32; 2]| if at(j) > at(i) { j } else { i };
        let mut edges: Vec<(u32, [u32; 2])> = self.edges.iter().map(|&edge| (higher(edge), edge)).collect();
        edges.sort_by(|(p, _), (q, _)| at(*p).total_cmp(&at(*q)));
        // as the pressure of a fluid rises, it joins more and more points, at last both ends
        let mut joined = DisjointSets::new(pressure.len() + 2);
        let ends = [0, 1].map(|end| pressure.len() as u32 + end);
        let last = edges.into_iter().find(|&(_, [i, j])| {
            joined.join(i, j);
            joined.are_joined(ends[0], ends[1])
        });
        last.map(|(point, _)| point as usize)
    }
}

/// Return the seal of a pair, if the scene names its ends. The shear of a bond has none of its own.
///
/// # Errors
/// See [`Seal::new`].
pub fn of_pair<const D: usize>(
    spec: &ContactSpec,
    mesh: &Mesh<D>,
    sealing: &Sealing<D>,
    surface: &ContactSurface,
) -> Result<Option<Seal>> {
    let names = spec.seal.as_ref().filter(|_| spec.slip.is_none());
    names.map(|names| Seal::new(names, mesh, sealing, surface)).transpose()
}

/// Return which of the surfaces of a pair carries its points: the `usual` one if both ends of the seal are on it, else
/// the other one. An obstacle has no surface.
///
/// # Errors
/// The mesh lacks a group, or the ends are not those of one surface.
pub fn carrier<const D: usize>(
    names: &[Located<String>; 2],
    mesh: &Mesh<D>,
    surfaces: &[Sealing<D>],
    usual: usize,
) -> Result<usize> {
    let ends: Vec<Ends> = surfaces.iter().map(|surface| surface.ends(names, mesh)).collect::<Result<_>>()?;
    let has_both = |&k: &usize| ends.get(k).is_some_and(|ends| ends.iter().all(|end| !end.is_empty()));
    if let Some(carrier) = [usual, 1 - usual].into_iter().find(has_both) {
        return Ok(carrier);
    }
    let missed = (0..2).find(|&end| ends.iter().all(|ends| ends[end].is_empty()));
    let [a, b] = names.each_ref().map(|name| &name.value);
    Err(match missed {
        Some(end) => {
            let on: Vec<String> = surfaces.iter().map(|surface| format!("`{}`", surface.side.name)).collect();
            let message = format!("`{}` does not touch the contact surface {}", names[end].value, on.join(" or "));
            let what = if D == 2 { "a point" } else { "an edge" };
            let help =
                format!("a seal is between two groups that share {what} with it, such as its bore and its outer face");
            Error::scene(&names[end].place, message).help(help)
        }
        None => Error::scene(&names[1].place, format!("`{a}` and `{b}` are at surfaces of different bodies"))
            .help("name two groups of one of the bodies: ways along its surface lead from one to the other"),
    })
}

impl<const D: usize> Sealing<'_, D> {
    /// Return the nodes at both ends of a seal. An end that does not touch the surface has none.
    ///
    /// # Errors
    /// The mesh lacks a group.
    fn ends(&self, names: &[Located<String>; 2], mesh: &Mesh<D>) -> Result<Ends> {
        let mut ends = Ends::default();
        for (end, name) in ends.iter_mut().zip(names) {
            *end = self.on(find_group(mesh, name, &[D - 1, D - 2], "seal")?);
        }
        Ok(ends)
    }

    /// Return the nodes of the surface on edges (in the plane at points) of a group.
    fn on(&self, group: &Group) -> Vec<usize> {
        let facets = &self.side.facets;
        let elements = group.connectivity.chunks_exact(group.stride).map(|all| &all[..=group.dimension]);
        let on_group: HashSet<[u32; 3]> = elements.flat_map(rims::<D>).collect();
        let (places, mut found) = (places::<D>(facets.order), Vec::new());
        for i in 0..facets.count() {
            let vertices: Vec<u32> = facets.facet(i)[..D].iter().map(|&node| self.points[node as usize]).collect();
            for (opposite, _) in rims::<D>(&vertices).enumerate().filter(|(_, rim)| on_group.contains(rim)) {
                let on_rim = places.iter().enumerate().filter(|(_, place)| place[opposite] == 0.0);
                found.extend(on_rim.map(|(k, _)| i * facets.stride + k));
            }
        }
        found
    }
}

/// Return the edges (in the plane the ends) of a facet with these corners, each opposite to a corner; an edge itself.
fn rims<const D: usize>(of: &[u32]) -> impl Iterator<Item = [u32; 3]> {
    // without the corner D, which there is not, all are left
    let left_out = if of.len() == D { 0..D } else { D..D + 1 };
    left_out.map(move |left| corners(of.iter().enumerate().filter(|(k, _)| *k != left).map(|(_, &point)| point)))
}

/// Return the edges of the mesh of a surface, whose facets have these points: those of the simplices into which the
/// points of a facet cut it, and those between the points that a node at an edge of the surface has on each face.
fn edges<const D: usize>(side: &Side<D>, points: &[u32]) -> Vec<[u32; 2]> {
    let (places, stride) = (places::<D>(side.facets.order), side.facets.stride);
    // neighbours differ by one step in two of the coordinates, others by more steps in one
    let near = 1.5 / side.facets.order.degree() as f64;
    let is_near = |&[i, j]: &[usize; 2]| (0..D).all(|c| (places[i][c] - places[j][c]).abs() < near);
    let within: Vec<[usize; 2]> = (0..stride).flat_map(|i| (0..i).map(move |j| [i, j])).filter(is_near).collect();
    let of_facet = |facet: &[u32]| within.iter().map(|ends| ends.map(|k| facet[k])).collect::<Vec<_>>();
    let mut edges: Vec<[u32; 2]> = points.chunks_exact(stride).flat_map(of_facet).collect();
    let mut point_of = vec![0; side.nodes.len()];
    side.corners.iter().zip(points).for_each(|(&at, &point)| point_of[at as usize] = point);
    let faces = side.nodes.windows(2).zip(point_of.windows(2)).filter(|(at, _)| at[0].node == at[1].node);
    edges.extend(faces.map(|(_, points)| [points[0], points[1]]));
    edges
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The result on a square of 6 by 6 points with diagonals is that of all ways, by Floyd and Warshall.
    #[test]
    fn the_weakest_point_is_that_of_all_ways() {
        // few enough points for a cubic number of steps in each trial
        const SIDE: usize = 6;
        let count = SIDE * SIDE;
        let number = |i: usize, j: usize| (SIDE * j + i) as u32;
        let mut edges = Vec::new();
        for (i, j) in (0..SIDE).flat_map(|i| (0..SIDE).map(move |j| (i, j))) {
            let last = SIDE - 1;
            edges.extend((i < last).then(|| [number(i, j), number(i + 1, j)]));
            edges.extend((j < last).then(|| [number(i, j), number(i, j + 1)]));
            edges.extend((i < last && j < last).then(|| [number(i + 1, j), number(i, j + 1)]));
            edges.extend((i == 0).then(|| [number(i, j), count as u32]));
            edges.extend((i == last).then(|| [number(i, j), count as u32 + 1]));
        }
        let seal = Seal { edges };
        for trial in 1..40usize {
            let pressure: Vec<f64> = (0..count).map(|q| ((q + 1) * (q + 7) * trial * 7919 % 1009) as f64).collect();
            let at = |q: usize| pressure.get(q).copied().unwrap_or(f64::NEG_INFINITY);
            let mut least = vec![vec![f64::INFINITY; count + 2]; count + 2];
            for [i, j] in seal.edges.iter().map(|edge| edge.map(|q| q as usize)) {
                (least[i][j], least[j][i]) = (at(i).max(at(j)), at(i).max(at(j)));
            }
            for k in 0..count + 2 {
                for (i, j) in (0..count + 2).flat_map(|i| (0..count + 2).map(move |j| (i, j))) {
                    least[i][j] = least[i][j].min(least[i][k].max(least[k][j]));
                }
            }
            let weakest = seal.weakest(&pressure).expect("a way");
            assert_eq!(pressure[weakest], least[count][count + 1], "{trial}");
        }
        assert_eq!(Seal { edges: vec![[0, 2], [1, 3]] }.weakest(&[1.0, 2.0]), None);
    }
}
