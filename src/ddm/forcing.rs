//! How far inexact linear steps of Newton's method are solved.

use super::bound::{Gap, Reached};

/// How far inexact linear steps are solved.
#[derive(Debug, Clone)]
pub(super) struct Forcing(f64);

/// Error of the first linear step of an inexact solver, as a share of it: its places are a guess of the start.
const FIRST: f64 = 1e-2;

/// Share of what the places missed last that an inexact step may miss, too.
pub(super) const SHARE: f64 = 0.1;

impl Default for Forcing {
    fn default() -> Self {
        Self(FIRST)
    }
}

impl Forcing {
    /// How far the next step has to reduce the energy norm of its error.
    pub fn reduction(&self) -> f64 {
        self.0
    }

    /// The error of a step in the energy norm that leaves the pressures of a contact with this energy a digit: else stiff layers answer
    /// errors of compressions with any pressure.
    pub fn most(&self, contact: f64) -> f64 {
        if contact > 0.0 { SHARE * contact.sqrt() } else { f64::INFINITY }
    }

    /// After a step with this gap: the next may miss a share of what this one did, and need not do better than what the run asks for.
    pub fn learn(&mut self, gap: &Gap, reached: &Reached, target: Option<f64>) {
        let enough = SHARE * target.unwrap_or(0.0) / reached.error.max(reached.pressure);
        self.0 = (SHARE * gap.share).max(enough).clamp(f64::EPSILON.sqrt(), FIRST);
    }
}
