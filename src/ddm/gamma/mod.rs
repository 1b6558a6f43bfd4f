//! Relaxation rules: gamma of (42), from what the sweeps tell.

mod aitken;
mod barzilai;
mod search;
mod spectral;

pub use aitken::Aitken;
pub use barzilai::BarzilaiBorwein;
pub use search::LineSearch;
pub use spectral::{Lanczos, Spectral};

use super::line::Unbounded;
use super::method::Here;

/// Chooses gamma^k after the sweep of iteration k.
pub trait GammaRule {
    /// The relaxation for the update along the sweep's correction.
    ///
    /// # Errors
    /// [`Unbounded`] if F1 falls for ever along it.
    fn gamma(&mut self, here: &mut Here) -> Result<f64, Unbounded>;

    /// Estimated bounds of the spectrum of G^-1 F1'', if the rule makes them.
    fn spectrum(&self) -> Option<(f64, f64)> {
        None
    }
}

/// gamma^k = gamma, as in the paper.
#[derive(Debug, Clone, Copy)]
pub struct Stationary(pub f64);

impl GammaRule for Stationary {
    fn gamma(&mut self, _here: &mut Here) -> Result<f64, Unbounded> {
        Ok(self.0)
    }
}

/// gamma^k from a list; the last value stays.
#[derive(Debug, Clone)]
pub struct Schedule(pub Vec<f64>);

impl GammaRule for Schedule {
    fn gamma(&mut self, here: &mut Here) -> Result<f64, Unbounded> {
        Ok(self.0[here.k.min(self.0.len() - 1)])
    }
}
