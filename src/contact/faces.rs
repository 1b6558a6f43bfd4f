//! Smooth faces of a surface: the parts between its edges.

use super::side::{Side, length, unit};
use crate::fem::{area_vector, element};
use crate::linalg::{Joined, dot};
use std::collections::HashMap;

/// Rounding of the cosine of the angle between two facets. A facet of a millionth of its mesh has normals to 2e-10, the rounding of
/// coordinates over its size; so a regular polygon that turns by just the angle of an edge is smooth.
pub const ROUNDING: f64 = 1e-9;

/// The smooth faces of a surface. Facets with a common vertex at which they turn by no more than the angle of an edge are of
/// one face.
#[derive(Debug, Clone)]
pub struct Faces {
    /// Face of each facet. Faces are numbered in the order of their first facets.
    pub of_facet: Vec<usize>,
    /// Number of faces.
    pub count: usize,
}

impl Faces {
    /// Find the faces of a surface between edges at which facets turn by more than `edge` degrees.
    pub fn new<const D: usize>(side: &Side<D>, edge: f64) -> Self {
        let least = edge.to_radians().cos() - ROUNDING;
        let mut joined = Joined::new(side.facets.count());
        for around in normals_at_vertices(side).values() {
            for (k, (facet, normal)) in around.iter().enumerate() {
                for (other, other_normal) in &around[..k] {
                    if dot(normal, other_normal) >= least {
                        joined.join(*facet as u32, *other as u32);
                    }
                }
            }
        }
        let (count, of_facet) = joined.classes();
        Self { count, of_facet: of_facet.into_iter().map(|face| face as usize).collect() }
    }

    /// Return whether facets of different faces have a common vertex, and so meet at an edge. Only facets in `used` count.
    pub fn meet<const D: usize>(&self, side: &Side<D>, used: &[bool]) -> bool {
        let mut face_at: HashMap<u32, usize> = HashMap::new();
        let facets = (0..side.facets.count()).filter(|&i| used[i]);
        let mut vertices = facets.flat_map(|i| side.facets.facet(i)[..D].iter().map(move |&node| (node, i)));
        vertices.any(|(node, i)| *face_at.entry(node).or_insert(self.of_facet[i]) != self.of_facet[i])
    }

    /// Return the middle of a face: the mean of the middles of its facets, weighted by their lengths (areas).
    pub fn middle<const D: usize>(&self, side: &Side<D>, face: usize) -> [f64; D] {
        let (mut sum, mut total) = ([0.0; D], 0.0);
        for i in (0..self.of_facet.len()).filter(|&i| self.of_facet[i] == face) {
            let (x, size) = (side.facets.coordinates(i, side.space), length(side.area(i)));
            (0..D).for_each(|c| sum[c] += size * x[..D].iter().map(|x| x[c]).sum::<f64>() / D as f64);
            total += size;
        }
        sum.map(|sum| sum / total)
    }
}

/// Return the facets at each vertex, with their unit normals there.
fn normals_at_vertices<const D: usize>(side: &Side<D>) -> HashMap<u32, Vec<(usize, [f64; D])>> {
    let mut around: HashMap<u32, Vec<(usize, [f64; D])>> = HashMap::new();
    let vertices = &element::nodes::<D>(side.facets.order)[..D];
    for i in 0..side.facets.count() {
        let x = side.facets.coordinates(i, side.space);
        for (l, &node) in vertices.iter().zip(side.facets.facet(i)) {
            around.entry(node).or_default().push((i, unit(area_vector(side.facets.order, &x, l))));
        }
    }
    around
}
