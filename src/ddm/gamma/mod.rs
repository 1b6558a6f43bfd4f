//! Relaxation rules: gamma of (42), from the sweeps so far.

mod aitken;
mod barzilai;
mod search;
mod spectral;

pub use aitken::Aitken;
pub use barzilai::BarzilaiBorwein;
pub use search::LineSearch;
pub use spectral::Spectral;

use super::acceleration::Iterate;
use super::forecast::{best_factor, relaxed_factor};
use crate::model::line::Unbounded;
use crate::problem::Own;
use crate::robin::Ritz;

/// A rule that chooses gamma^k after the sweep of iteration k.
pub trait GammaRule {
    /// Return the relaxation for the update along the sweep's correction. `ritz` has observed all corrections, this one included.
    ///
    /// # Errors
    /// [`Unbounded`] if F1 falls for ever along the correction.
    fn gamma(&mut self, here: &mut Iterate, ritz: &mut Ritz) -> Result<f64, Unbounded>;

    /// Return the factor by which an iteration reduces the slowest mode, if the rule has one. The spectrum of G^-1 F1'' lies in (low, high).
    fn factor(&self, _spectrum: (f64, f64)) -> Option<f64> {
        None
    }

    /// Whether gamma does not depend on the iterates. Then the slowest mode follows from the decrease of the corrections; otherwise the Ritz values
    /// of `ritz` are computed anew before each gamma.
    fn is_fixed(&self) -> bool {
        false
    }

    /// Forget the earlier iterations, because the problem changes.
    fn restart(&mut self) {}
}

/// Rules that a Rust program adds, by name. Each function makes the rule of a run.
pub type OwnRules = Own<dyn Fn() -> Box<dyn GammaRule>>;

/// gamma^k = gamma, as in the paper.
#[derive(Debug, Clone, Copy)]
pub struct Stationary(pub f64);

impl GammaRule for Stationary {
    fn gamma(&mut self, _here: &mut Iterate, _ritz: &mut Ritz) -> Result<f64, Unbounded> {
        Ok(self.0)
    }

    fn factor(&self, spectrum: (f64, f64)) -> Option<f64> {
        Some(relaxed_factor(self.0, spectrum))
    }

    fn is_fixed(&self) -> bool {
        true
    }
}

/// gamma^k from a list; the last value stays.
#[derive(Debug, Clone)]
pub struct Schedule(pub Vec<f64>);

impl GammaRule for Schedule {
    fn gamma(&mut self, here: &mut Iterate, _ritz: &mut Ritz) -> Result<f64, Unbounded> {
        Ok(self.0[here.k.min(self.0.len() - 1)])
    }

    fn factor(&self, spectrum: (f64, f64)) -> Option<f64> {
        Some(relaxed_factor(self.0[self.0.len() - 1], spectrum))
    }

    fn is_fixed(&self) -> bool {
        true
    }
}
