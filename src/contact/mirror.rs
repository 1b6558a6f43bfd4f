//! Planes of symmetry at the end of a contact surface, where the surface goes on as its mirror image.
//!
//! A plane of symmetry is a plane face of the body whose displacement along its own normal is held at zero, and which
//! meets the contact surface in an edge. The axis of a body of revolution is one, too.

use crate::fem::{Facets, Frame, Space};
use crate::linalg::dot;
use std::collections::{BTreeMap, HashMap, HashSet};

/// Square of the part of a unit vector that supports leave free up to which they hold it. Axes of supports are those of
/// the scene or of facets, known to 1e-9 or better; a support that is inclined to a plane by more than 1e-3 is none of
/// a plane of symmetry.
const HELD: f64 = 1e-6;

/// The planes of symmetry that meet a surface at its ends.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mirrors<const D: usize> {
    /// Unit normals of the planes through each node.
    planes: HashMap<u32, Vec<[f64; D]>>,
}

impl<const D: usize> Mirrors<D> {
    /// Find the planes of symmetry that meet a surface.
    pub fn new(space: &Space<D>, facets: &Facets<D>, prescribed: &BTreeMap<usize, f64>, frame: &Frame<D>) -> Self {
        let is_held = |node: u32, normal: [f64; D]| {
            let components = frame
                .force(node, normal)
                .flat_map(|(node, components)| (0..D).map(move |c| D * node as usize + c).zip(components));
            let held = components.filter(|(dof, _)| prescribed.get(dof) == Some(&0.0));
            1.0 - held.map(|(_, component)| component * component).sum::<f64>() <= HELD
        };
        let mut planes: HashMap<u32, Vec<[f64; D]>> = HashMap::new();
        for (nodes, normals) in
            beside(space, facets, |node| (0..D).any(|c| prescribed.contains_key(&(D * frame.node(node) as usize + c))))
        {
            let is_plane = normals.iter().all(|n| 1.0 - dot(n, &normals[0]) <= HELD);
            if !is_plane || !nodes.iter().all(|&node| is_held(node, normals[0])) {
                continue;
            }
            for node in nodes {
                let through = planes.entry(node).or_default();
                if through.iter().all(|n| dot(n, &normals[0]).abs() < 1.0 - HELD) {
                    through.push(normals[0]);
                }
            }
        }
        Self { planes }
    }

    /// Return the sum of the normals of facets around a node and of their mirror images, from the sum of the facets
    /// alone. A plane at which the surface turns by an angle whose cosine is less than `least` is an edge, and does not
    /// count. A surface of revolution is always continued beyond its axis.
    pub fn mean(&self, space: &Space<D>, node: u32, sum: [f64; D], least: f64) -> [f64; D] {
        let mut mean = sum;
        if space.on_axis(node) && mean[1] != 0.0 {
            mean[0] = 0.0;
        }
        for plane in self.planes.get(&node).into_iter().flatten() {
            let part = dot(&mean, plane);
            if 1.0 - 2.0 * part * part / dot(&mean, &mean) >= least {
                (0..D).for_each(|c| mean[c] -= part * plane[c]);
            }
        }
        mean
    }

    /// Return the unit normal of the plane beyond which a surface goes on smoothly as its mirror image from a node,
    /// where it has this unit normal.
    pub fn plane_at(&self, space: &Space<D>, node: u32, normal: [f64; D]) -> Option<[f64; D]> {
        let axis = std::array::from_fn(|c| f64::from(u8::from(c == 0)));
        let of_axis = space.on_axis(node).then_some(axis);
        let mut planes = self.planes.get(&node).into_iter().flatten().copied().chain(of_axis);
        planes.find(|plane| dot(&normal, plane).abs() <= HELD)
    }

    /// Return whether a surface goes on as its mirror image beyond an edge with these `(node, normal)` at its ends.
    pub fn continue_beyond(&self, edge: &[(u32, [f64; D])]) -> bool {
        let is_in = |plane: &[f64; D]| {
            edge.iter().all(|(node, normal)| {
                let planes = self.planes.get(node).into_iter().flatten();
                planes.copied().any(|other| other == *plane) && dot(normal, plane).abs() <= HELD
            })
        };
        self.planes.get(&edge[0].0).into_iter().flatten().any(is_in)
    }
}

/// Return the nodes and normals of the facets of a body that meet the end of a surface, where supports hold some of its
/// nodes.
fn beside<const D: usize>(
    space: &Space<D>,
    facets: &Facets<D>,
    is_supported: impl Fn(u32) -> bool,
) -> Vec<(Vec<u32>, Vec<[f64; D]>)> {
    let lone = facets.by_edge().into_iter().filter(|(_, around)| around.len() == 1).map(|(edge, _)| edge);
    let ends: HashSet<[u32; D]> = lone.filter(|edge| edge[..D - 1].iter().all(|&node| is_supported(node))).collect();
    if ends.is_empty() {
        return Vec::new();
    }
    let own: HashSet<u32> = facets.nodes.iter().copied().collect();
    let boundary = space.boundary();
    let meets = |i: &usize| {
        let is_other = boundary.facet(*i).iter().any(|node| !own.contains(node));
        is_other && boundary.edges(*i).iter().any(|edge| ends.contains(edge))
    };
    let places: Vec<usize> = (0..boundary.count()).filter(meets).collect();
    let normals = |i: usize| Facets::new(boundary.order, boundary.facet(i).to_vec()).normals(space);
    places.into_iter().map(|i| (boundary.facet(i).to_vec(), normals(i))).collect()
}
