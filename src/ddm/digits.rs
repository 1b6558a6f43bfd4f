//! Digits that pressures lose where displacements are far larger than compressions.

use super::stop::Status;
use crate::model::surface::in_series;
use crate::model::{Layer, Model};

/// Squared factor between rounding errors and their estimate, which counts each row's worst case once: smooth errors weigh more in
/// K^-1 than in the inverse of its diagonal.
pub(super) const ROUNDING: f64 = 1e3;

/// What rounding of the gap and of both displacements, a trace vector, leaves unknown of every compression c = u_a + u_b - d, n.
pub(super) fn of_compressions(model: &Model, trace: &[f64]) -> Vec<f64> {
    let points = model.points();
    let terms = |q: usize| trace[q].abs() + trace[points + q].abs() + model.gap[q].abs();
    (0..points).map(|q| f64::EPSILON * terms(q)).collect()
}

/// How many times its [digits](of_compressions) a compression may be off: traces and gaps are sums, rounded before they meet. `sweeps` that rounding
/// ended have only met the floor that [`ROUNDING`] says, a square.
pub(super) fn lacking(sweeps: bool, status: &Status) -> f64 {
    if sweeps && *status == Status::RoundoffLimited { ROUNDING.sqrt() } else { 2.0 }
}

/// What rounding of the gap and of both displacements, a trace vector, can make of a pressure, as a share of the `peak` by which pressures
/// are measured: the most over all contact points. `answer`, n, is the stiffness per area with which the bodies answer.
///
/// Origins of bodies that fall far keep the digits of every iterate, but the gap is data, with the digits that it has. Layer and bodies answer an error of it like springs in a row,
/// 1/(1/kappa + 1/answer). Newton's method carries pressures that are in equilibrium, and the bodies answer with their surfaces; its places lie on lines of
/// the slope rho. Sweeps take pressures from compressions, which the layer answers alone: `answer` is infinite.
pub(super) fn lost(model: &Model, trace: &[f64], layer: &Layer, answer: &[f64], peak: f64) -> f64 {
    let digits = of_compressions(model, trace);
    let error = |q: usize| in_series(layer.tangent[q], answer[q]) * digits[q];
    let most = (0..digits.len()).filter(|&q| layer.pressure[q] > 0.0).map(error).fold(0.0, f64::max);
    if most > 0.0 { most / peak } else { 0.0 }
}
