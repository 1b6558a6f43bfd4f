//! Bodies that nothing holds, moved to where a state in equilibrium fits the laws best.
//!
//! Free rigid motions E strain nothing: with (u, p) also (u + E a, p) is in equilibrium, for any a. Where no pressure is negative, the laws
//! can have these pressures, and the Moreau envelope of the layers, met on lines of slope rho, is least where the places balance the loads. So pressures that
//! statics alone give need no steps by which compressions follow them.

use super::digits::of_compressions;
use super::path::Equilibrium;
use super::start;
use crate::model::Model;
use crate::model::field::Field;
use crate::model::rigid::Motions;

/// What a motion may leave of the squared distance from the laws, at most: half of the distance. With 0.01 to 0.5 random scenes took the same
/// steps within a per cent; with one, which lets rounding move bodies on stiff layers, one of 900 was not solved (docs/methods.md).
const PART: f64 = 0.25;

/// Moves u, which a step x led to with pressures p, n, and both with it, if that brings it much nearer to the laws; places are met on lines of slope rho,
/// n, and loads balanced to the `tolerance` of the run.
pub(super) fn fit(model: &Model, [u, x]: [&mut Field; 2], p: &[f64], rho: &[f64], tolerance: f64) {
    let motions = Motions::of(model);
    if motions.count() == 0 || p.iter().any(|&p| p < 0.0) {
        return;
    }
    let c = model.compression(&u.trace);
    let off = |u: &Field, compression: &[f64]| {
        let roundoff = &of_compressions(model, &u.trace)[..];
        Equilibrium { compression, roundoff, pressure: p, rho }.distance(model, &[])
    };
    let here = off(u, &c);
    let motion = || Some(motions.field(model, &start::balance(model, &motions, [&c, p], rho, tolerance)?));
    if let Some(motion) = (here > 0.0).then(motion).flatten() {
        let mut there = u.clone();
        there.add(1.0, &motion);
        if off(&there, &model.compression(&there.trace)) <= PART * here {
            *u = there;
            x.add(1.0, &motion);
        }
    }
}
