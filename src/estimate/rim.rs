//! The pressure at rims of a contact, where no smoother solution can be recovered.
//!
//! Without a layer, the pressure at the distance r from a rim is K r^(lambda - 1). Recovered polynomials are no nearer to it than the
//! discrete pressure. A facet of size h at the rim misses the order h^(lambda - 1/2) of it in the mean square, whatever the degree of its
//! polynomials. So the part of the highest degree, that is, p_h less its projection p_- on polynomials of one degree less, has the order of the
//! error. [`missed`] is the ratio of the error to this part.
//!
//! A layer limits the pressure. A pressure that is missed by q changes the deflection of the bodies by s q, with their compliance s to a
//! pressure that varies within the facet, and the law with the tangent stiffness kappa then changes the pressure by s kappa/(1 + s kappa) q.

use crate::discretize::meshes::{FinePoints, Meshes};
use crate::model::{Layer, Model};
use crate::problem::order::Order;
use std::ops::Range;

/// Return the ratio of the error to the part of the highest degree of a pressure on a facet of side a.
///
/// Stresses of elements of degree 2 have the degree 1. Let lambda be 0.774, the rim of a punch with right angles on a block of the same material.
/// By its coefficients in Legendre polynomials, r^(lambda - 1) less the nearest line is 1.69 times its part of degree 2, which pressures of degree 2
/// show, and 0.97 times its part of degree 1, which linear pressures show. For linear elements the ratio would be 1.39 by the same rule. Their
/// nodal pressures are means over two facets, which flattens the rise: on such a punch with 3, 6 and 12 elements a unit of length under a layer of 1e6
/// the measured ratio is 2.8, 2.5 and 2.2.
fn missed(points: &FinePoints, g: usize) -> f64 {
    match points.order {
        Order::P1 => 2.8,
        Order::P2 if points.is_quadratic[g] => 1.69,
        Order::P2 => 0.97,
    }
}

/// What the pressures of a pair may lack at its rims.
#[derive(Debug, Default, Clone, Copy)]
pub(super) struct RimError {
    /// Integral of the squared error over all facets at rims.
    pub squared: f64,
    /// Contact point near the largest error, counted from the first one of the pair.
    pub worst: usize,
}

impl RimError {
    /// Compute the error of a pair with contact points `range`.
    pub fn new(points: &FinePoints, layer: &Layer, range: Range<usize>) -> Self {
        let (pressure, tangent) = (&layer.pressure[range.clone()], &layer.tangent[range]);
        let (mut error, mut largest, mut first) = (Self::default(), 0.0, 0);
        for chunk in points.facet.chunk_by(|f, g| f == g) {
            let on_facet = first..first + chunk.len();
            first = on_facet.end;
            if !points.at_rim[on_facet.start] {
                continue;
            }
            let missed = missed(points, on_facet.start);
            for (g, q) in on_facet.clone().zip(highest_part(points, on_facet, pressure)) {
                let stiffness = points.interpolation.row(g).map(|(q, _)| tangent[q]).fold(0.0, f64::max);
                let unresolved = points.compliance[g] * stiffness / (1.0 + points.compliance[g] * stiffness);
                let squared = points.weight[g] * (missed * unresolved * q).powi(2);
                error.squared += squared;
                if squared > largest {
                    (largest, error.worst) = (squared, points.nearest[g]);
                }
            }
        }
        error
    }
}

/// Return the errors of all pairs at their rims.
pub(super) fn of_pairs(meshes: &dyn Meshes, model: &Model, layer: &Layer) -> Vec<RimError> {
    (0..model.pairs.len()).map(|pair| RimError::new(&meshes.points(pair), layer, model.range(pair))).collect()
}

/// Return the part of the highest degree of the pressure at each integration point of a facet. `pressure` has the pressures of the contact
/// points.
fn highest_part(points: &FinePoints, on_facet: Range<usize>, pressure: &[f64]) -> Vec<f64> {
    let value = |g: usize| points.interpolation.row(g).map(|(q, share)| share * pressure[q]).sum::<f64>();
    let area: f64 = points.weight[on_facet.clone()].iter().sum();
    let mean = |of: &dyn Fn(usize) -> f64| on_facet.clone().map(|g| points.weight[g] * of(g)).sum::<f64>() / area;
    let (middle, level) = (mean(&|g| points.along[g]), mean(&value));
    let spread = mean(&|g| (points.along[g] - middle).powi(2));
    let is_quadratic = points.is_quadratic[on_facet.start] && spread > 0.0;
    let slope = if is_quadratic { mean(&|g| (points.along[g] - middle) * value(g)) / spread } else { 0.0 };
    on_facet.map(|g| value(g) - level - slope * (points.along[g] - middle)).collect()
}
