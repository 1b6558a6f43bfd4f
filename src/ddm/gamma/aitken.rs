//! Aitken's rule.

use super::{GammaRule, Iterate, LineSearch, Ritz, Unbounded};
use crate::linalg::dot;

/// gamma^k = -gamma^{k-1} z^{k-1}.(z^k - z^{k-1}) / |z^k - z^{k-1}|^2 on the traces: the secant of the fixed point map.
///
/// A value outside of (0, 10), as where contact changes the most, is replaced by the exact line search.
#[derive(Debug, Default)]
pub struct Aitken {
    last: Option<(f64, Vec<f64>)>,
}

impl GammaRule for Aitken {
    fn gamma(&mut self, here: &mut Iterate, ritz: &mut Ritz) -> Result<f64, Unbounded> {
        let z = &here.sweep.correction.trace;
        let secant = self.last.as_ref().map(|(gamma, before)| {
            let change: Vec<f64> = z.iter().zip(before).map(|(z, before)| z - before).collect();
            -gamma * dot(before, &change) / dot(&change, &change)
        });
        let trace = z.clone();
        let gamma = match secant {
            Some(gamma) if gamma > 0.0 && gamma < 10.0 => gamma,
            _ => LineSearch.gamma(here, ritz)?,
        };
        self.last = Some((gamma, trace));
        Ok(gamma)
    }

    fn restart(&mut self) {
        *self = Self::default();
    }
}
