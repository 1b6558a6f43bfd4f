//! Slip along the surfaces of a pair in the place of the compression, for the shear of a bond.
//!
//! With the unit normal n from side a to side b, a direction t along the surface, and the distance d of the surfaces,
//!
//! ```text
//! s = t.(u_a - u_b) - d/2 n.(du_a/dt + du_b/dt)
//! ```
//!
//! The second part is the turn of the surfaces, without which a film between surfaces that are apart would resist a
//! rigid motion of both bodies together, and its tractions would leave the moment d t unbalanced.

use super::pair::ContactPair;
use super::pieces::Intersection;
use super::side::Side;
use crate::fem::{Facets, Space, cross, element, length, pad};
use crate::linalg::{Csr, dot};
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// One of the directions along a surface, at any normal.
#[derive(Debug, Clone, Copy)]
pub struct Tangents {
    /// Axis of the scene whose part along the surface is the first direction.
    axis: usize,
    /// Whether it is the second direction, which completes right-handed axes with the normal and the first one.
    is_second: bool,
}

impl Tangents {
    /// Return the first or second direction along a surface with these normals. It varies smoothly wherever no normal
    /// is along the axis to which they are least inclined.
    pub fn new(normals: &[[f64; 3]], direction: usize) -> Self {
        let along = |axis: usize| normals.iter().map(|n| n[axis] * n[axis]).sum::<f64>();
        let axis = (0..3).min_by(|&i, &j| along(i).total_cmp(&along(j))).unwrap_or(0);
        Self { axis, is_second: direction == 1 }
    }

    /// Return the direction at a unit normal; in the plane the normal turned to the left.
    pub fn at<const D: usize>(&self, normal: [f64; D]) -> [f64; D] {
        let n = pad(normal);
        if D == 2 {
            return std::array::from_fn(|c| if c == 0 { -n[1] } else { n[0] });
        }
        let others = [0, 1, 2].map(|k| (self.axis + k) % 3);
        let axis = others.into_iter().find(|&axis| n[axis] * n[axis] < 0.9).unwrap_or(self.axis);
        let across: [f64; 3] = std::array::from_fn(|c| f64::from(u8::from(c == axis)) - n[axis] * n[c]);
        let first = across.map(|c| c / length(across));
        let second = cross(n, first);
        std::array::from_fn(|c| if self.is_second { second[c] } else { first[c] })
    }
}

/// The turns of both surfaces in the slip: rows of `-d/2 n.du/dt` at each integration point, with displacements of
/// nodes as columns.
#[derive(Serialize, Deserialize)]
pub struct Turns(pub [Csr; 2]);

impl Turns {
    /// Return the turns at the integration points of two sides. Rows are empty where the surfaces touch.
    pub fn new<const D: usize>(sides: [&Side<D>; 2], common: &Intersection<D>, tangents: Tangents) -> Self {
        let rounding = sides[0].rounding_along_normals();
        Self([0, 1].map(|k| {
            let side = sides[k];
            let mut rows = Csr::new(side.space.dofs());
            for point in &common.points {
                let n = sides[0].vector_at(point.facet_a, &point.at_a, |at| at.direction);
                let (facet, at) = if k == 0 { (point.facet_a, &point.at_a) } else { (point.facet_b, &point.at_b) };
                let distance = if point.gap.abs() > rounding { point.gap } else { 0.0 };
                let slopes = slopes(&side.facets, facet, side.space, at, tangents.at(n));
                let nodes = side.facets.facet(facet).iter().zip(slopes);
                let entries = nodes.flat_map(|(&node, slope)| {
                    n.into_iter().enumerate().map(move |(c, n)| (D * node as usize + c, -0.5 * distance * slope * n))
                });
                rows.push_row(entries.filter(|_| distance != 0.0).collect::<Vec<_>>());
            }
            rows
        }))
    }

    /// Return whether the surfaces are apart anywhere.
    pub fn are_apart(&self) -> bool {
        !self.0[0].values.is_empty()
    }

    /// Return the means of the rows of a side around each contact point of a pair, by the nodes of the body.
    fn means<const D: usize>(
        &self,
        side: usize,
        pair: &ContactPair,
        a: &Side<D>,
        common: &Intersection<D>,
    ) -> Vec<Vec<(u32, [f64; D])>> {
        let (point_of, mut weights) = (pair.point_of(a.nodes.len()), vec![0.0; pair.len()]);
        let mut means: Vec<BTreeMap<u32, [f64; D]>> = vec![BTreeMap::new(); pair.len()];
        for (g, point) in common.points.iter().enumerate() {
            let Some(basis) = &pair.cover[point.facet_a].basis else { continue };
            for (&node, mu) in a.on_facet(point.facet_a).iter().zip(&basis.functions(&point.at_a)) {
                let Some(q) = point_of[node as usize] else { continue };
                weights[q] += point.weight * mu;
                for (dof, value) in self.0[side].row(g) {
                    means[q].entry((dof / D) as u32).or_insert([0.0; D])[dof % D] += point.weight * mu * value;
                }
            }
        }
        let mean = |(sum, weight): (BTreeMap<u32, [f64; D]>, f64)| {
            sum.into_iter().map(|(node, sum)| (node, sum.map(|value| value / weight))).collect()
        };
        means.into_iter().zip(weights).map(mean).collect()
    }
}

impl ContactPair {
    /// Let slip along the surface take the place of the compression: the normals become these tangents. `common` has
    /// the distances of the surfaces. [`ContactPair::hold`] then makes the rows of dofs.
    pub fn slide<const D: usize>(
        &mut self,
        tangents: Tangents,
        turns: &Turns,
        [a, b]: [&Side<D>; 2],
        common: &Intersection<D>,
    ) {
        let along = self.normal.iter().map(|n| tangents.at(std::array::from_fn(|c| n[c]))).collect::<Vec<[f64; D]>>();
        let means = [0, 1].map(|side| turns.means(side, self, a, common));
        self.turn_with(&along, [a.space, b.space], |side, q| &means[side][q]);
        // warnings about normals belong to the bond itself
        self.is_turned = false;
        self.spread.clear();
        self.tilt.fill(0.0);
    }
}

/// Return the derivatives of the shape functions of a facet along the tangent `t` at barycentric coordinates `l`.
fn slopes<const D: usize>(facets: &Facets<D>, facet: usize, space: &Space<D>, l: &[f64; D], t: [f64; D]) -> Vec<f64> {
    let (x, derivatives) = (facets.coordinates(facet, space), element::derivatives(facets.order, l));
    let by = |node: usize, k: usize| derivatives[node][k + 1] - derivatives[node][0];
    let edge =
        |k: usize| -> [f64; D] { std::array::from_fn(|c| (0..x.len()).map(|node| by(node, k) * x[node][c]).sum()) };
    let gram = DMatrix::from_fn(D - 1, D - 1, |i, j| dot(&edge(i), &edge(j)));
    let along = gram.lu().solve(&DVector::from_fn(D - 1, |i, _| dot(&edge(i), &t)));
    let along = along.unwrap_or_else(|| DVector::zeros(D - 1));
    (0..x.len()).map(|node| (0..D - 1).map(|k| along[k] * by(node, k)).sum()).collect()
}
