//! Digits that pressures lose where displacements are far larger than compressions.

use super::solve::Outcome;
use super::start::surface_slopes;
use crate::model::Model;

/// What rounding of the gap and of both displacements can make of a pressure, as a share of the largest pressure: the most over all
/// contact points.
///
/// A compression c = u_a + u_b - d is known to eps (|u_a| + |u_b| + |d|). Layer and surfaces answer an error of it like springs in
/// a row, 1/(1/kappa + 1/rho0).
pub fn lost(model: &Model, outcome: &Outcome) -> f64 {
    let Outcome { iterate, layer, .. } = outcome;
    let (points, slopes) = (model.points(), surface_slopes(model));
    let error = |q: usize| {
        let terms = iterate.trace[q].abs() + iterate.trace[points + q].abs() + model.gap[q].abs();
        let spring = (layer.tangent[q].recip() + slopes[q].recip()).recip();
        spring * f64::EPSILON * terms
    };
    let most = (0..points).filter(|&q| layer.pressure[q] > 0.0).map(error).fold(0.0, f64::max);
    if most > 0.0 { most / layer.peak() } else { 0.0 }
}
