//! What counts as nothing: energies, pressures and forces of rest, of the automatic start and of the bodies, by which a contact that vanishes is
//! measured.
//!
//! Bodies that nothing presses together but an initial overlap, and that nothing holds, move apart until no pressure is left: all
//! that a relative tolerance could refer to vanishes with the error. What remains then is rest, or the start. Its layers may answer
//! an overlap with any pressure, so the surfaces give way first ([`start::at`]). A contact may vanish while bodies are loaded otherwise. Then what remains
//! is the energy of their strains: that of a pressure on all surfaces. A solution below [`PART`] of these is measured by that share: with a tolerance of
//! 1e-8 that is 1e-14 of what the bodies carry, which rounding of their forces leaves unknown.
//!
//! A start that the scene gives is no measure: it may be any.

use super::start;
use crate::linalg::dot;
use crate::model::Model;
use crate::model::rigid::PART;
use crate::model::surface::surface_slopes;

/// Least scales of a run.
#[derive(Debug, Clone, Default)]
pub struct Scale {
    /// Energy: u'Ku + sum omega p c.
    energy: f64,
    /// Pressure.
    pressure: f64,
    /// Sum of contact forces.
    force: f64,
    /// All contact surfaces, sum omega, and what they give way under a unit of pressure times its force, sum omega/rho0.
    area: f64,
    compliance: f64,
}

impl Scale {
    /// From traces that a run may begin with.
    pub fn new(model: &Model, traces: &[&[f64]]) -> Self {
        let slopes = surface_slopes(model);
        let compliance = slopes.iter().zip(&model.weight).map(|(slope, weight)| weight / slope).sum();
        let mut scale = Self { area: model.weight.iter().sum(), compliance, ..Self::default() };
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

    /// Whether energies of this size cannot be told from zero or infinity to their rounding, eps^2 of them, where layers carry pressures up to `peak`.
    pub fn is_out_of_range(&self, energy: f64, peak: f64) -> bool {
        const LEAST: f64 = f64::MIN_POSITIVE / (f64::EPSILON * f64::EPSILON);
        let energy = self.energy(energy);
        if energy == 0.0 { peak > 0.0 } else { !(LEAST..f64::INFINITY).contains(&energy) }
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

    /// [`PART`] of the pressure that gives all contact surfaces the energy u'Ku of the bodies. That of soft layers between stiff bodies is no measure of
    /// what the bodies carry.
    fn stress(&self, strain: f64) -> f64 {
        if self.compliance > 0.0 { PART * (strain.max(0.0) / self.compliance).sqrt() } else { 0.0 }
    }

    /// The largest pressure, by which errors of pressures are measured, in bodies with u'Ku = `strain`.
    pub fn peak(&self, pressure: &[f64], strain: f64) -> f64 {
        pressure.iter().copied().fold(self.pressure.max(self.stress(strain)), f64::max)
    }

    /// What the forces on a body lack in balance under the contact forces `force` (n), with u'Ku = `strain` over all bodies, as a share of them, the
    /// most over all rigid motions that supports leave free. For such a motion m, K m = 0: only loads and contact forces work on it.
    ///
    /// The residual sees too little of this where a Robin term much stiffer than the layer holds the body.
    pub fn imbalance(&self, model: &Model, force: &[f64], strain: f64) -> f64 {
        let mut most = 0.0f64;
        let least = self.force.max(self.area * self.stress(strain));
        for (body, slot) in model.bodies.iter().enumerate().filter(|(_, slot)| !slot.motions.is_empty()) {
            let force = model.at_rows(body, force);
            let total = least.max(force.iter().map(|force| force.abs()).sum());
            for motion in &slot.motions {
                let arm = motion.trace.iter().fold(0.0f64, |max, m| max.max(m.abs()));
                let lacking = (motion.work - dot(&force, &motion.trace)).abs();
                if lacking > 0.0 {
                    most = most.max(lacking / (arm * total));
                }
            }
        }
        most
    }
}
