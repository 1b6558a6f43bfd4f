//! What counts as nothing: energies, pressures and forces of rest and of the start, by which a solution that vanishes is measured.
//!
//! Bodies that nothing presses together but an initial overlap, and that nothing holds, move apart until no pressure is left: all
//! that a relative tolerance could refer to vanishes with the error. What remains then is rest, or the start. Its layers may answer
//! an overlap with any pressure, so the surfaces give way first ([`start::at`]). A solution below [`PART`] of these is measured by that share.

use super::start;
use crate::linalg::dot;
use crate::model::Model;
use crate::model::rigid::PART;

/// Forces on a body that do less than this share of what work they could on a motion are measured by that share: they may go through
/// the point about which it turns, and their work be rounding. A tolerance of 1e-8 then asks for 1e-11 of what the forces could do, which is
/// above the rounding of their sum.
const LEAST_WORK: f64 = 1e-3;

/// Least scales of a run.
#[derive(Debug, Default)]
pub struct Scale {
    /// Energy: u'Ku + sum omega p c.
    energy: f64,
    /// Pressure.
    pressure: f64,
    /// Sum of contact forces.
    force: f64,
}

impl Scale {
    /// From traces that a run may begin with.
    pub fn new(model: &Model, traces: &[&[f64]]) -> Self {
        let mut scale = Self::default();
        for trace in traces {
            let layer = start::at(model, trace);
            let approach = model.compression(trace);
            scale.energy = scale.energy.max(PART * PART * dot(&layer.force, &approach));
            scale.pressure = scale.pressure.max(PART * layer.peak());
            scale.force = scale.force.max(PART * layer.force.iter().sum::<f64>());
        }
        scale
    }

    /// The energy by which one of this size is measured.
    pub fn energy(&self, energy: f64) -> f64 {
        energy.max(self.energy)
    }

    /// The relative residual: root of `numerator` = r'G^-1 r over `reference` = u'Ku + sum omega p c. A zero reference asks for
    /// an absolute zero.
    pub fn relative(&self, numerator: f64, reference: f64) -> f64 {
        if numerator.is_nan() || reference.is_nan() {
            return f64::NAN;
        }
        // rounding can make a tiny numerator negative
        if numerator <= 0.0 { 0.0 } else { (numerator / self.energy(reference)).sqrt() }
    }

    /// The largest pressure, by which errors of pressures are measured.
    pub fn peak(&self, pressure: &[f64]) -> f64 {
        pressure.iter().copied().fold(self.pressure, f64::max)
    }

    /// What the forces on a body lack in balance under the contact forces `force` (n), as a share of them, the most over all rigid
    /// motions that supports leave free. For such a motion m, K m = 0: only loads and contact forces work on it.
    ///
    /// The residual sees too little of this where a Robin term much stiffer than the layer holds the body.
    pub fn imbalance(&self, model: &Model, force: &[f64]) -> f64 {
        let mut most = 0.0f64;
        for (body, slot) in model.bodies.iter().enumerate().filter(|(_, slot)| !slot.motions.is_empty()) {
            let force = model.at_rows(body, force);
            let total: f64 = force.iter().map(|force| force.abs()).sum();
            for motion in &slot.motions {
                let arm = motion.trace.iter().fold(0.0f64, |max, m| max.max(m.abs()));
                let acting: f64 = force.iter().zip(&motion.trace).map(|(force, m)| (force * m).abs()).sum();
                let lacking = (motion.work - dot(&force, &motion.trace)).abs();
                if lacking > 0.0 {
                    most = most.max(lacking / acting.max(arm * self.force.max(LEAST_WORK * total)));
                }
            }
        }
        most
    }
}
