//! Contact points projected to side b: how the mean distance around a point differs from the distance at the point itself.

use super::pair::ContactPair;
use super::pieces::Common;
use super::side::{Side, length};
use crate::exchange::Plain;
use crate::fem::minus;
use crate::linalg::dot;
use crate::problem::order::Order;
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};
use std::collections::HashMap;

/// The projections of the contact points of a pair to side b, one entry a point.
#[derive(Default, Serialize, Deserialize)]
#[serde(bound = "[f64; D]: Plain")]
pub struct Projections<const D: usize> {
    /// Nearest facet of side b.
    pub facet: Vec<usize>,
    /// Barycentric coordinates of the projection along the normal. It lies outside of the facet by a part of the facet's size
    /// where side b ends before.
    pub at: Vec<[f64; D]>,
    /// Unit normal from side a to side b.
    pub normal: Vec<[f64; D]>,
    /// Mean distance of the meshes around the point less the distance at the point itself.
    pub distance: Vec<f64>,
}

impl<const D: usize> Projections<D> {
    /// Project the points of `pair`, which was made of these sides and common pieces. `gap(x)` is the gap that the scene adds
    /// to the distance of the meshes; with `None` all differences of distances are zero.
    pub fn new(
        a: &Side<D>,
        b: &Side<D>,
        common: &Common<D>,
        pair: &ContactPair,
        gap: Option<&dyn Fn([f64; 3]) -> f64>,
    ) -> Self {
        let rounding = a.rounding_along_normals();
        let position = |q: usize| -> [f64; D] { std::array::from_fn(|c| pair.position[q][c] - a.space.datum[c]) };
        let mut projections = Self::default();
        for (q, facet) in nearest_facets(a, common, pair, position).into_iter().enumerate() {
            let (from, normal) = (position(q), std::array::from_fn(|c| pair.normal[q][c]));
            let at = project(b, facet, from, normal);
            let difference = |gap: &dyn Fn([f64; 3]) -> f64| {
                pair.gap[q] - gap(pair.position[q]) - distance(b, facet, &at, from, normal)
            };
            // Between planes the difference is no more than the rounding of the coordinates.
            let rounding = rounding.max(1e-12 * length(b.area(facet)).powf(1.0 / (D - 1) as f64));
            let difference = gap.map(difference).filter(|difference| difference.abs() >= rounding);
            projections.distance.push(difference.unwrap_or(0.0));
            projections.facet.push(facet);
            projections.at.push(at);
            projections.normal.push(normal);
        }
        projections
    }
}

/// Return the facet of side b for each contact point: the partner of the nearest integration point on a facet of side a at
/// its node. `position` gives the place of a contact point, measured from the datum of the mesh.
fn nearest_facets<const D: usize>(
    a: &Side<D>,
    common: &Common<D>,
    pair: &ContactPair,
    position: impl Fn(usize) -> [f64; D],
) -> Vec<usize> {
    let point_of: HashMap<u32, usize> = pair.nodes.iter().enumerate().map(|(q, &node)| (node, q)).collect();
    let mut nearest = vec![(f64::INFINITY, 0); pair.len()];
    for point in &common.points {
        let from = a.facets.point(point.facet_a, a.space, &point.at_a);
        for q in a.facets.facet(point.facet_a).iter().filter_map(|node| point_of.get(node).copied()) {
            let distance = length(minus(position(q), from));
            if distance < nearest[q].0 {
                nearest[q] = (distance, point.facet_b);
            }
        }
    }
    nearest.into_iter().map(|(_, facet)| facet).collect()
}

/// Return where the line from a point along a normal meets the plane of a facet's corners, in barycentric coordinates.
fn project<const D: usize>(b: &Side<D>, facet: usize, from: [f64; D], normal: [f64; D]) -> [f64; D] {
    let x = b.facets.coordinates(facet, b.space);
    let matrix = DMatrix::from_fn(D, D, |c, k| if k + 1 < D { x[k + 1][c] - x[0][c] } else { normal[c] });
    let right = DVector::from_fn(D, |c, _| from[c] - x[0][c]);
    let Some(solution) = matrix.lu().solve(&right) else { return [1.0 / D as f64; D] };
    let others: f64 = (0..D - 1).map(|k| solution[k]).sum();
    std::array::from_fn(|k| if k == 0 { 1.0 - others } else { solution[k - 1] })
}

/// Return the distance along a normal from a point to the surface at the barycentric coordinates `at` of a facet.
fn distance<const D: usize>(b: &Side<D>, facet: usize, at: &[f64; D], from: [f64; D], normal: [f64; D]) -> f64 {
    dot(&normal, &minus(b.facets.point(facet, b.space, at), from)) - rise(b, facet, at)
}

/// Return the height of the surface of a side above a facet at barycentric coordinates.
///
/// A quadratic facet is the surface itself. Over a straight facet the surface is taken to rise by
/// l_i l_j (n_j - n_i).(x_j - x_i)/2 for each edge ij, since a curve between two normals is a parabola. Here l_i is the
/// barycentric coordinate, n_i the normal and x_i the place of corner i.
pub(super) fn rise<const D: usize>(side: &Side<D>, facet: usize, at: &[f64; D]) -> f64 {
    if side.facets.order != Order::P1 {
        return 0.0;
    }
    let x = side.facets.coordinates(facet, side.space);
    let normals: Vec<[f64; D]> = side.facets.facet(facet).iter().map(|node| side.normals[node]).collect();
    let mut rise = 0.0;
    for i in 0..D {
        for j in i + 1..D {
            rise += 0.5 * at[i] * at[j] * dot(&minus(normals[j], normals[i]), &minus(x[j], x[i]));
        }
    }
    rise
}
