//! Roundoff of compressions and pressures where displacements are far larger than compressions.

use super::stop::Status;
use crate::model::surface::in_series;
use crate::model::{Layer, Model};

/// Squared factor between rounding errors and their estimate. The estimate counts the worst case of each row once, and smooth errors weigh more
/// in K^-1 than in the inverse of its diagonal. The root, a factor of 30 in the error, is an estimate: it has no benchmark yet.
pub(super) const ROUNDING: f64 = 1e3;

/// Return the error of every compression c = u_a + u_b - d by rounding of the gap d and of both displacements, n. `trace` is a trace vector (2n).
pub(super) fn of_compressions(model: &Model, trace: &[f64]) -> Vec<f64> {
    let points = model.points();
    let terms = |q: usize| trace[q].abs() + trace[points + q].abs() + model.gap[q].abs();
    (0..points).map(|q| f64::EPSILON * terms(q)).collect()
}

/// Return how many times its [roundoff](of_compressions) a compression may be off. Traces and gaps are sums, which are rounded before they are
/// added. Sweeps that roundoff ended have only reached the level of [`ROUNDING`], a square.
pub(super) fn safety(is_sweeps: bool, status: &Status) -> f64 {
    if is_sweeps && *status == Status::RoundoffLimited { ROUNDING.sqrt() } else { 2.0 }
}

/// Return the largest error of a pressure by rounding of the gap and of both displacements, relative to the `peak` by which pressures are
/// measured. `trace` is a trace vector (2n); `answer`, n, is the stiffness per area with which the bodies answer an error of the gap.
///
/// Where bodies fall far, the origin keeps the digits of every iterate, but the gap is data with the digits that it has. Layer and bodies answer an
/// error of the gap like springs in series, 1/(1/kappa + 1/answer). In Newton's method pressures are in equilibrium, the bodies answer with their
/// surfaces, and layer states lie on lines of slope rho. Sweeps take pressures from compressions, so that the layer answers alone: `answer` is
/// infinite.
pub(super) fn of_pressures(model: &Model, trace: &[f64], layer: &Layer, answer: &[f64], peak: f64) -> f64 {
    let roundoff = of_compressions(model, trace);
    let error = |q: usize| in_series(layer.tangent[q], answer[q]) * roundoff[q];
    let most = (0..roundoff.len()).filter(|&q| layer.pressure[q] > 0.0).map(error).fold(0.0, f64::max);
    if most > 0.0 { most / peak } else { 0.0 }
}
