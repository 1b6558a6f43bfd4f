//! The best stationary gamma, from estimates of the bounds of the spectrum of G^-1 F1'' during the run.

use super::{GammaRule, Iterate, LineSearch, Ritz, Unbounded, best_factor};
use crate::ddm::forecast::best_gamma;

/// gamma = 2 / (lambda_min + lambda_max) with the estimated bounds; exact line search until there are estimates.
#[derive(Debug, Default)]
pub struct Spectral {
    /// Residual and number of closed points of the last iterate.
    last: Option<(f64, usize)>,
}

impl GammaRule for Spectral {
    fn gamma(&mut self, here: &mut Iterate, ritz: &mut Ritz) -> Result<f64, Unbounded> {
        // the estimate is out of date if the residual grows or the contact changes
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
