//! The best stationary gamma, from bounds of the spectrum of G^-1 F1'' that are estimated during the run.

use super::{GammaRule, Here, LineSearch, Ritz, Unbounded, best_factor};
use crate::ddm::forecast::best_gamma;

/// gamma = 2 / (lambda_min + lambda_max) of the estimated bounds; exact line searches until there are some.
#[derive(Debug, Default)]
pub struct Spectral {
    last: Option<(f64, usize)>,
}

impl GammaRule for Spectral {
    fn gamma(&mut self, here: &mut Here, ritz: &mut Ritz) -> Result<f64, Unbounded> {
        // a residual that grows, or contact that moves, makes the estimate one of the past
        let steady =
            self.last.is_some_and(|(residual, closed)| here.residual < residual && here.layer.closed == closed);
        self.last = Some((here.residual, here.layer.closed));
        match ritz.known() {
            Some(spectrum) if steady && here.k > 5 => Ok(best_gamma(spectrum)),
            _ => LineSearch.gamma(here, ritz),
        }
    }

    fn factor(&self, spectrum: (f64, f64)) -> Option<f64> {
        Some(best_factor(spectrum))
    }

    fn restart(&mut self) {
        *self = Self::default();
    }
}
