//! Exact line search.

use super::{GammaRule, Iterate, Ritz, Unbounded, best_factor};
use crate::model::line::Line;

/// gamma^k minimises F1 along the correction. F1 is convex, so it falls in every step.
#[derive(Debug, Default, Clone, Copy)]
pub struct LineSearch;

impl GammaRule for LineSearch {
    fn gamma(&mut self, here: &mut Iterate, _ritz: &mut Ritz) -> Result<f64, Unbounded> {
        Line::new(here.model, here.layer, &here.sweep.residual, &here.sweep.correction).minimize(1e-6)
    }

    fn factor(&self, spectrum: (f64, f64)) -> Option<f64> {
        Some(best_factor(spectrum))
    }
}
