//! Contact points seen from the other side: by how much a mean over its facets differs from the value at the point itself.

use serde::{Deserialize, Serialize};
use crate::exchange::Plain;
use super::pair::ContactPair;
use super::pieces::Common;
use super::side::{Side, length};
use crate::fem::assemble::interpolate;
use crate::fem::element;
use crate::problem::order::Order;
use nalgebra::{DMatrix, DVector};
use std::collections::HashMap;

/// Where the contact points of a pair lie on side b.
#[derive(Serialize, Deserialize)]
#[serde(bound = "[f64; D]: Plain")]
pub struct Near<const D: usize> {
    /// Facet nearest to each.
    pub facet: Vec<usize>,
    /// Barycentric coordinates there of the projection along the normal; beyond the facet by a part of its size where it ends before.
    pub at: Vec<[f64; D]>,
    /// Unit normal from side a to side b.
    pub normal: Vec<[f64; D]>,
    /// Mean distance of the meshes around each point less the distance at the point itself.
    pub distance: Vec<f64>,
}

impl<const D: usize> Near<D> {
    /// That of `pair`, made of these sides and common pieces; `gap(x)` is the scene's own gap, none where the meshes have no distance.
    pub fn new(
        a: &Side<D>,
        b: &Side<D>,
        common: &Common<D>,
        pair: &ContactPair,
        gap: Option<&dyn Fn([f64; 3]) -> f64>,
    ) -> Self {
        let point_of: HashMap<u32, usize> = pair.nodes.iter().enumerate().map(|(q, &node)| (node, q)).collect();
        let position = |q: usize| -> [f64; D] { std::array::from_fn(|c| pair.position[q][c] - a.space.datum[c]) };
        let coordinates = 2.0 * (D as f64).sqrt() * a.rounding();
        let mut nearest = vec![(f64::INFINITY, 0); pair.len()];
        for point in &common.points {
            let x = a.facets.coordinates(point.facet_a, a.space);
            let from = interpolate(&x, &element::values(a.facets.order, &point.at_a));
            for q in a.facets.facet(point.facet_a).iter().filter_map(|node| point_of.get(node).copied()) {
                let to = position(q);
                let distance = length(std::array::from_fn::<f64, D, _>(|c| to[c] - from[c]));
                if distance < nearest[q].0 {
                    nearest[q] = (distance, point.facet_b);
                }
            }
        }
        let mut near = Self { facet: Vec::new(), at: Vec::new(), normal: Vec::new(), distance: Vec::new() };
        for (q, (_, facet)) in nearest.into_iter().enumerate() {
            let (from, normal) = (position(q), std::array::from_fn(|c| pair.normal[q][c]));
            let at = project(b, facet, from, normal);
            let less = |gap: &dyn Fn([f64; 3]) -> f64| {
                pair.gap[q] - gap(pair.position[q]) - distance(b, facet, &at, from, normal)
            };
            // planes have no more than the rounding of coordinates
            let rounding = coordinates.max(1e-12 * length(b.area(facet)).powf(1.0 / (D - 1) as f64));
            near.distance.push(gap.map(less).filter(|distance| distance.abs() >= rounding).unwrap_or(0.0));
            near.facet.push(facet);
            near.at.push(at);
            near.normal.push(normal);
        }
        near
    }
}

/// Barycentric coordinates, in the plane of a facet's corners, of where the line from a point along a normal meets it.
fn project<const D: usize>(b: &Side<D>, facet: usize, from: [f64; D], normal: [f64; D]) -> [f64; D] {
    let x = b.facets.coordinates(facet, b.space);
    let matrix = DMatrix::from_fn(D, D, |c, k| if k + 1 < D { x[k + 1][c] - x[0][c] } else { normal[c] });
    let right = DVector::from_fn(D, |c, _| from[c] - x[0][c]);
    let Some(solution) = matrix.lu().solve(&right) else { return [1.0 / D as f64; D] };
    let others: f64 = (0..D - 1).map(|k| solution[k]).sum();
    std::array::from_fn(|k| if k == 0 { 1.0 - others } else { solution[k - 1] })
}

/// Distance from a point to the surface at these coordinates of a facet. A quadratic facet is the surface. Over a straight one it rises by
/// l_i l_j (n_j - n_i).(x_j - x_i)/2 for each edge ij: between two normals a curve is a parabola.
fn distance<const D: usize>(b: &Side<D>, facet: usize, at: &[f64; D], from: [f64; D], normal: [f64; D]) -> f64 {
    let x = b.facets.coordinates(facet, b.space);
    let to: [f64; D] = interpolate(&x, &element::values(b.facets.order, at));
    let mut distance: f64 = (0..D).map(|c| normal[c] * (to[c] - from[c])).sum();
    if b.facets.order == Order::P1 {
        let normals: Vec<[f64; D]> = b.facets.facet(facet).iter().map(|node| b.normals[node]).collect();
        for i in 0..D {
            for j in i + 1..D {
                let bend: f64 = (0..D).map(|c| (normals[j][c] - normals[i][c]) * (x[j][c] - x[i][c])).sum();
                distance -= 0.5 * at[i] * at[j] * bend;
            }
        }
    }
    distance
}
