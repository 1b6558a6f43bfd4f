//! Is every rigid motion of every body held, by supports or by its Robin term?

use super::joint::Joint;
use super::model::{BodySlot, Model};
use crate::linalg::kernel;
use nalgebra::{DMatrix, DVector};

/// A spring stiffness below this share of the largest stiffness in the body drowns in rounding.
const SAFE: f64 = 1e-13;

/// A rigid motion that nothing holds, or not enough.
#[derive(Debug, Clone, PartialEq)]
pub struct FreeMotion {
    /// Number of the body.
    pub body: usize,
    /// Name of the motion.
    pub name: String,
}

/// The first body that nothing holds under the Robin term `weight` (omega psi kappa of the contact rows), and its motion.
pub fn unheld(model: &Model, weight: &[f64]) -> Option<FreeMotion> {
    (0..model.bodies.len()).find_map(|body| {
        let slot = &model.bodies[body];
        let free = kernel(&springs(slot, &model.of_body(body, weight)), slot.scale, SAFE);
        Some(FreeMotion { body, name: name(slot, free.first()?) })
    })
}

/// A motion of a body that `weight` holds with less than `share` of the stiffness that [`natural_springs`] give it, if
/// these hold it at all.
pub fn weak_motion(model: &Model, body: usize, weight: &[f64], share: f64) -> Option<FreeMotion> {
    let slot = &model.bodies[body];
    if slot.motions.is_empty() {
        return None;
    }
    let natural = springs(slot, &natural_springs(model, body));
    let have = springs(slot, &model.of_body(body, weight));
    // motions that even the natural springs do not feel are not a matter of the Robin term
    let difference = have - share * &natural;
    let largest = natural.diagonal().max().max(f64::MIN_POSITIVE);
    let weak = kernel(&difference, largest, -1e-9);
    Some(FreeMotion { body, name: name(slot, weak.first()?) })
}

/// Whether some rigid motion of all bodies together is hardly resisted by the layers' stiffness `weight` = omega kappa at the
/// points: then the Newton matrix is singular, or so near to it that a factorisation means nothing.
pub fn joint_is_weak(model: &Model, weight: &[f64]) -> bool {
    let of_body = |(body, slot): (usize, &BodySlot)| {
        springs(slot, &natural_springs(model, body)).diagonal().iter().copied().fold(0.0, f64::max)
    };
    let natural = model.bodies.iter().enumerate().map(of_body).fold(0.0, f64::max);
    !kernel(&Joint::of(model).stiffness(weight), natural, 1e-9).is_empty()
}

/// A motion of all bodies as motions of each body that it moves.
pub fn parts(model: &Model, joint: &Joint, amounts: &DVector<f64>) -> Vec<FreeMotion> {
    let moves = |body: &usize| joint.of_body(*body).any(|i| amounts[i].abs() > 1e-6 * amounts.amax());
    let part = |body: usize| {
        let own = joint.of_body(body);
        FreeMotion { body, name: name(&model.bodies[body], &amounts.rows(own.start, own.len()).into_owned()) }
    };
    (0..model.bodies.len()).filter(moves).map(part).collect()
}

/// Springs at a body's contact rows that together are about as stiff as the body: the stiffness under each point, spread
/// over all of them.
pub fn natural_springs(model: &Model, body: usize) -> Vec<f64> {
    let slot = &model.bodies[body];
    let rows = slot.row_stiffness.len().max(1) as f64;
    slot.row_stiffness.iter().map(|stiffness| stiffness / rows).collect()
}

/// Stiffness of the springs in terms of the body's free motions.
fn springs(slot: &BodySlot, weight: &[f64]) -> DMatrix<f64> {
    let count = slot.motions.len();
    DMatrix::from_fn(count, count, |i, j| {
        let (s, t) = (&slot.motions[i].trace, &slot.motions[j].trace);
        (0..weight.len()).map(|q| weight[q] * s[q] * t[q]).sum()
    })
}

fn name(slot: &BodySlot, motion: &DVector<f64>) -> String {
    let largest = motion.amax();
    let parts = (0..slot.motions.len()).filter(|&i| motion[i].abs() > 1e-6 * largest);
    parts.map(|i| slot.motions[i].name.as_str()).collect::<Vec<_>>().join(" with ")
}
