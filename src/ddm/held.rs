//! Is every rigid motion of every body held, by supports or by its Robin term?

use super::model::{BodySlot, Model};
use crate::linalg::kernel;
use nalgebra::DMatrix;

/// A spring stiffness below this share of the largest stiffness in the body drowns in rounding.
const SAFE: f64 = 1e-13;

/// The first body that nothing holds under the Robin term `weight` (omega psi kappa at the points), and the name of
/// the motion.
pub fn unheld(model: &Model, weight: &[f64]) -> Option<(usize, String)> {
    (0..model.bodies.len()).find_map(|body| {
        let slot = &model.bodies[body];
        if slot.motions.is_empty() {
            return None;
        }
        free_motion(slot, &model.at_rows(body, weight)).map(|name| (body, name))
    })
}

fn free_motion(slot: &BodySlot, weight: &[f64]) -> Option<String> {
    let count = slot.motions.len();
    let springs = DMatrix::from_fn(count, count, |i, j| {
        let (s, t) = (&slot.motions[i].trace, &slot.motions[j].trace);
        (0..weight.len()).map(|q| weight[q] * s[q] * t[q]).sum()
    });
    let free = kernel(&springs, slot.scale, SAFE);
    let motion = free.first()?;
    let largest = motion.amax();
    let parts: Vec<&str> =
        (0..count).filter(|&i| motion[i].abs() > 1e-6 * largest).map(|i| slot.motions[i].name.as_str()).collect();
    Some(parts.join(" with "))
}
