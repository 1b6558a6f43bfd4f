//! What counts as nothing: energies, pressures and forces of the start and of rest, by which a solution that vanishes is measured.
//!
//! Bodies that nothing presses together but an initial overlap, and that nothing holds, move apart until no pressure is left: all
//! that a relative tolerance could refer to vanishes with the error. What remains then is the start, or rest. Its layers may answer
//! an overlap with any pressure, so each point counts for no more than the surfaces under it could answer elastically.

use super::layer::Layer;
use super::model::Model;
use crate::linalg::dot;

/// A solution this much smaller than the start is measured by the start.
const NOTHING: f64 = 1e-6;

/// Forces on a body that do less than this share of what work they could on a motion are measured by that share: they may go through
/// the point about which it turns, and their work be rounding.
const LITTLE: f64 = 1e-3;

/// Least scales of a run, from rest and its start.
#[derive(Debug, Default)]
pub struct Scale {
    known: bool,
    /// Energy: u'Ku + sum omega p c.
    energy: f64,
    /// Pressure.
    pressure: f64,
    /// Sum of contact forces.
    force: f64,
}

impl Scale {
    /// Takes the scales of the start in, if that was not done; `strain` is u'Ku over all bodies.
    pub fn learn(&mut self, model: &Model, layer: &Layer, strain: f64) {
        if std::mem::replace(&mut self.known, true) {
            return;
        }
        self.raise(model, layer, strain);
    }

    /// The scales of bodies at rest: an overlap of the scene, which a start may have opened.
    pub fn at_rest(model: &Model) -> Self {
        let mut scale = Self::default();
        scale.raise(model, &Layer::at(model, &vec![0.0; 2 * model.points()]), 0.0);
        scale
    }

    fn raise(&mut self, model: &Model, layer: &Layer, strain: f64) {
        let force = elastic(model, layer);
        let finite = |value: f64| if value.is_finite() { value } else { 0.0 };
        let work = force.iter().zip(&layer.compression).map(|(f, c)| f * c.max(0.0)).sum::<f64>();
        self.energy = self.energy.max(NOTHING * NOTHING * finite(strain.abs() + work));
        let pressure = force.iter().zip(&model.weight).map(|(f, w)| f / w).fold(0.0, f64::max);
        self.pressure = self.pressure.max(NOTHING * finite(pressure));
        self.force = self.force.max(NOTHING * finite(force.iter().sum()));
    }

    /// The relative residual: root of `numerator` = r'G^-1 r over `reference` = u'Ku + sum omega p c. A zero reference asks for
    /// an absolute zero.
    pub fn relative(&self, numerator: f64, reference: f64) -> f64 {
        if numerator.is_nan() || reference.is_nan() {
            return f64::NAN;
        }
        // rounding can make a tiny numerator negative
        if numerator <= 0.0 { 0.0 } else { (numerator / reference.max(self.energy)).sqrt() }
    }

    /// The largest pressure, by which errors of pressures are measured.
    pub fn peak(&self, pressure: &[f64]) -> f64 {
        pressure.iter().copied().fold(self.pressure, f64::max)
    }

    /// What the forces on a body lack in balance, as a share of those of its contacts, the most over all rigid motions that
    /// supports leave free. For such a motion m, K m = 0: only loads and contact forces work on it.
    ///
    /// The residual sees too little of this where a Robin term much stiffer than the layer holds the body.
    pub fn imbalance(&self, model: &Model, layer: &Layer) -> f64 {
        let mut most = 0.0f64;
        for (body, slot) in model.bodies.iter().enumerate() {
            let force = model.at_rows(body, &layer.force);
            let total: f64 = force.iter().map(|force| force.abs()).sum();
            for motion in &slot.motions {
                let arm = motion.trace.iter().fold(0.0f64, |max, m| max.max(m.abs()));
                let acting: f64 = force.iter().zip(&motion.trace).map(|(force, m)| (force * m).abs()).sum();
                let lacking = (motion.work - dot(&force, &motion.trace)).abs();
                if lacking > 0.0 {
                    most = most.max(lacking / acting.max(arm * self.force.max(LITTLE * total)));
                }
            }
        }
        most
    }
}

/// Force at every point, no more than the surfaces of the two bodies answer to its compression.
fn elastic(model: &Model, layer: &Layer) -> Vec<f64> {
    let points = model.points();
    let mut stiffness = vec![0.0; 2 * points];
    for body in 0..model.bodies.len() {
        model.put(body, &super::held::natural_springs(model, body), &mut stiffness);
    }
    (0..points)
        .map(|q| {
            let softer = stiffness[q].min(stiffness[points + q]);
            (softer * layer.compression[q]).min(layer.force[q]).max(0.0)
        })
        .collect()
}
