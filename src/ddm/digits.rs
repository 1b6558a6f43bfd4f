//! Digits that pressures lose where displacements are far larger than compressions.

use super::start::{in_series, surface_slopes};
use crate::model::{Layer, Model};

/// What rounding of the gap and of both displacements, a trace vector, can make of a pressure, as a share of the largest pressure: the
/// most over all contact points.
///
/// A compression c = u_a + u_b - d is known to eps (|u_a| + |u_b| + |d|): origins of bodies that fall far keep the digits of every
/// iterate, but the gap is data, with the digits that it has. Layer and surfaces answer an error of it like springs in a row,
/// 1/(1/kappa + 1/rho0).
pub(super) fn lost(model: &Model, trace: &[f64], layer: &Layer) -> f64 {
    let (points, slopes) = (model.points(), surface_slopes(model));
    let error = |q: usize| {
        let terms = trace[q].abs() + trace[points + q].abs() + model.gap[q].abs();
        in_series(layer.tangent[q], slopes[q]) * f64::EPSILON * terms
    };
    let most = (0..points).filter(|&q| layer.pressure[q] > 0.0).map(error).fold(0.0, f64::max);
    if most > 0.0 { most / layer.peak() } else { 0.0 }
}
