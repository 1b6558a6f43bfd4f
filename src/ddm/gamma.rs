//! Relaxation rules: gamma of (42).

use super::sweep::Sweep;

/// Chooses gamma^k after the sweep of iteration k.
pub trait GammaRule {
    /// The relaxation for the update that follows `sweep`.
    fn gamma(&mut self, k: usize, sweep: &Sweep) -> f64;
}

/// gamma^k = gamma, as in the paper.
#[derive(Debug, Clone, Copy)]
pub struct Stationary(pub f64);

impl GammaRule for Stationary {
    fn gamma(&mut self, _k: usize, _sweep: &Sweep) -> f64 {
        self.0
    }
}
