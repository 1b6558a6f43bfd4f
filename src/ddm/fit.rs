//! The rigid correction: bodies without supports are moved to where a state in equilibrium is closest to the laws.
//!
//! Free rigid motions E strain nothing. With (u, p) also (u + E a, p) is in equilibrium, for any amounts a. If no pressure is negative, the laws
//! can have these pressures. Then the Moreau envelope of the layers, resolved on lines of slope rho, is least where the layer states balance the
//! loads. So pressures that follow from statics alone need no steps in which the compressions follow them.

use super::path::Equilibrium;
use super::roundoff::of_compressions;
use super::start;
use crate::model::Model;
use crate::model::field::Field;
use crate::model::rigid::Motions;

/// Largest share of the squared distance from the laws that a motion may leave: half of the distance. With 0.01 to 0.5 random scenes took the
/// same steps within a per cent; with one, which lets rounding move bodies on stiff layers, one of 900 was not solved (docs/methods.md).
const PART: f64 = 0.25;

/// Move u by a free rigid motion, and the step x that led to u with it, if this brings u much nearer to the laws. `p` are the pressures of
/// the step and `rho` the slopes of the lines on which the laws are resolved, n each. The loads are balanced to the `tolerance` of the run.
pub(super) fn rigid_correction(model: &Model, [u, x]: [&mut Field; 2], p: &[f64], rho: &[f64], tolerance: f64) {
    let motions = Motions::of(model);
    if motions.count() == 0 || p.iter().any(|&p| p < 0.0) {
        return;
    }
    let compression = model.compression(&u.trace);
    let before = distance(model, u, &compression, p, rho);
    let balance = || start::balance(model, &motions, [&compression, p], rho, tolerance);
    let Some(amounts) = (before > 0.0).then(balance).flatten() else { return };
    let motion = motions.field(model, &amounts);
    let mut moved = u.clone();
    moved.add(1.0, &motion);
    if distance(model, &moved, &model.compression(&moved.trace), p, rho) <= PART * before {
        *u = moved;
        x.add(1.0, &motion);
    }
}

/// Return the squared distance of displacements u with pressures p from the laws.
fn distance(model: &Model, u: &Field, compression: &[f64], pressure: &[f64], rho: &[f64]) -> f64 {
    let roundoff = &of_compressions(model, &u.trace)[..];
    Equilibrium { compression, roundoff, pressure, rho }.distance(model, &[])
}
