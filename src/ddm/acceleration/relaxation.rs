//! The paper's iteration: u <- u + gamma z.

use super::{Acceleration, Iterate, Step};
use crate::ddm::gamma::GammaRule;
use crate::error::Result;
use crate::robin::Ritz;

/// The relaxed Robin-Robin iteration (41)-(42) with any rule for gamma.
pub struct Relaxed {
    rule: Box<dyn GammaRule>,
    /// Norm of the last correction, and the gamma that was used with it.
    last: Option<(f64, f64)>,
    /// Estimate from the decrease of the corrections (see [`Acceleration::amplification`]).
    amplification: f64,
    ritz: Ritz,
}

impl Relaxed {
    /// Return the iteration with this rule.
    pub fn new(rule: Box<dyn GammaRule>) -> Self {
        Self { rule, last: None, amplification: f64::NAN, ritz: Ritz::default() }
    }
}

impl Acceleration for Relaxed {
    fn name(&self) -> &'static str {
        "robin"
    }

    fn step(&mut self, here: &mut Iterate) -> Result<Step> {
        let size = here.decrement().sqrt();
        // with a fixed gamma the slowest mode remains, and the corrections decrease by its factor 1 - gamma lambda_min
        if let Some((before, gamma)) = self.last {
            let factor = size / before;
            self.amplification = if factor < 1.0 { (gamma / (1.0 - factor)).max(1.0) } else { f64::NAN };
        }
        self.ritz.observe(here.model, &here.sweep.correction);
        if !self.rule.is_fixed() {
            self.ritz.bounds(here.model, here.layer, here.weight);
        }
        Ok(match self.rule.gamma(here, &mut self.ritz) {
            Ok(gamma) => {
                self.last = Some((size, gamma));
                Step::Sweep(gamma)
            }
            Err(_) => Step::Unbounded,
        })
    }

    fn ritz(&mut self) -> &mut Ritz {
        &mut self.ritz
    }

    fn amplification(&mut self) -> f64 {
        self.ritz.known().map_or(self.amplification, |(low, _)| low.recip().max(1.0))
    }

    fn factor(&mut self) -> Option<f64> {
        self.rule.factor(self.ritz.known()?)
    }

    fn restart(&mut self) {
        self.rule.restart();
        (self.last, self.amplification) = (None, f64::NAN);
    }
}
