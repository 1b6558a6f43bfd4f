//! Least scales of a run: energies, pressures and forces by which a contact that vanishes is measured.
//!
//! Unconstrained bodies that only an initial overlap presses together move apart until no pressure is left. Then everything that a relative
//! tolerance could refer to vanishes with the error, and rest or the automatic start is the reference. Its layers may answer an overlap with any
//! pressure, so the surfaces deflect first ([`start::at`]). A contact may also vanish while bodies carry other loads. Then the reference is the energy
//! of their strains, as a pressure on all surfaces.
//!
//! A solution below [`PART`] of a reference is measured by that share of it. With a tolerance of 1e-8 this is 1e-14 of what the bodies carry, which
//! is lost in the rounding of their forces. A start that the scene gives is no reference, because it may be any displacement.

use super::start;
use crate::linalg::dot;
use crate::model::Model;
use crate::model::rigid::PART;
use crate::model::surface::surface_slopes;

/// The least scales of a run.
#[derive(Debug, Clone, Default)]
pub struct Scale {
    /// Energy: u'Ku + sum omega p c.
    energy: f64,
    /// Pressure.
    pressure: f64,
    /// Sum of contact forces.
    force: f64,
    /// Area of all contact surfaces, sum omega.
    area: f64,
    /// Energy that a unit pressure gives all surfaces, sum omega/rho0.
    compliance: f64,
}

impl Scale {
    /// Return the scales of a model, from traces (2n each) that a run may begin with.
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

    /// Return the energy by which an error is measured where the iterate has this `energy`.
    pub fn energy(&self, energy: f64) -> f64 {
        energy.max(self.energy)
    }

    /// Whether an energy is infinite, or so small that its rounding, eps^2 of it, is below the range of numbers. A zero energy is out of range if the
    /// layers carry pressures, up to `peak`.
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

    /// Return [`PART`] of the pressure that gives all contact surfaces the energy u'Ku of the bodies. The pressure of soft layers between stiff bodies
    /// is no measure of what the bodies carry.
    fn stress(&self, strain: f64) -> f64 {
        if self.compliance > 0.0 { PART * (strain.max(0.0) / self.compliance).sqrt() } else { 0.0 }
    }

    /// Return the pressure by which errors of pressures are measured in bodies with u'Ku = `strain`: the largest one (n), or the least scale.
    pub fn peak(&self, pressure: &[f64], strain: f64) -> f64 {
        pressure.iter().copied().fold(self.pressure.max(self.stress(strain)), f64::max)
    }

    /// Return the forces out of balance on a body under the contact forces `force` (n), relative to these forces: the largest over all rigid motions
    /// that supports leave free. `strain` is u'Ku over all bodies. For such a motion m, K m = 0, so that only loads and contact forces work on it.
    ///
    /// The residual shows too little of an imbalance where the Robin term that holds the body is much stiffer than the layer.
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
