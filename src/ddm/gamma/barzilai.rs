//! The rule of Barzilai and Borwein.

use super::{GammaRule, Here, LineSearch, Ritz, Unbounded};
use crate::ddm::field::local_dot;

/// gamma^k = s'G s / s'y with s the last step and y the change of the residual: the inverse of a Rayleigh quotient of
/// G^-1 F1''. The first step is an exact line search.
///
/// The rule is not monotone; every tenth step is an exact line search, so that F1 falls in the end whatever the laws do.
#[derive(Debug, Default)]
pub struct BarzilaiBorwein {
    last: Option<Last>,
}

#[derive(Debug)]
struct Last {
    gamma: f64,
    /// r'z of the last iterate.
    decrement: f64,
    z: Vec<Vec<f64>>,
}

impl GammaRule for BarzilaiBorwein {
    fn gamma(&mut self, here: &mut Here, ritz: &mut Ritz) -> Result<f64, Unbounded> {
        let quotient = self.last.as_ref().map(|last| {
            // s = gamma z0, G s = gamma r0, y = r0 - r: s'Gs / s'y = gamma r0'z0 / (r0'z0 - r'z0)
            let mut product = [local_dot(&here.sweep.residual, &last.z)];
            here.model.exchange.sum(&mut product);
            last.gamma * last.decrement / (last.decrement - product[0])
        });
        let gamma = match quotient {
            Some(gamma) if gamma > 0.0 && gamma.is_finite() && !here.k.is_multiple_of(10) => gamma,
            _ => LineSearch.gamma(here, ritz)?,
        };
        let z = here.sweep.correction.states.clone();
        self.last = Some(Last { gamma, decrement: here.decrement(), z });
        Ok(gamma)
    }

    fn restart(&mut self) {
        *self = Self::default();
    }
}
