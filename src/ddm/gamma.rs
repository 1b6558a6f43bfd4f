//! The paper's iteration u <- u + gamma z, and its relaxation rules: gamma of (42), from the sweeps so far.

use super::robin::{Acceleration, Iterate, RobinStep, best_factor, best_gamma, relaxed_factor};
use crate::error::Result;
use crate::linalg::dot;
use crate::model::field::{LineEnergy, Unbounded};
use crate::problem::Own;
use crate::problem::method::Gamma;
use crate::robin::Ritz;
use std::collections::VecDeque;

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

/// Make the rule that a scene names. `own` are the rules that the program brings.
///
/// # Errors
/// A name that no rule of the program has.
pub fn rule(gamma: &Gamma, own: &OwnRules) -> Result<Box<dyn GammaRule>> {
    Ok(match gamma {
        Gamma::Stationary(gamma) => Box::new(Schedule(vec![*gamma])),
        Gamma::Schedule(list) => Box::new(Schedule(list.clone())),
        Gamma::LineSearch => Box::new(LineSearch),
        Gamma::Aitken => Box::new(Aitken::default()),
        Gamma::BarzilaiBorwein => Box::new(BarzilaiBorwein::default()),
        Gamma::Spectral => Box::new(Spectral::default()),
        Gamma::Own(name) => own.get("rule for gamma", name)?(),
    })
}

/// gamma^k from a list; the last value stays. With one value it is gamma^k = gamma, as in the paper.
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

    fn step(&mut self, here: &mut Iterate) -> Result<RobinStep> {
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
                RobinStep::Sweep(gamma)
            }
            Err(_) => RobinStep::Unbounded,
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

/// gamma^k minimises F1 along the correction. F1 is convex, so it falls in every step.
#[derive(Debug, Default, Clone, Copy)]
pub struct LineSearch;

impl GammaRule for LineSearch {
    fn gamma(&mut self, here: &mut Iterate, _ritz: &mut Ritz) -> Result<f64, Unbounded> {
        LineEnergy::new(here.model, here.layer, &here.sweep.residual, &here.sweep.correction).minimize(1e-6)
    }

    fn factor(&self, spectrum: (f64, f64)) -> Option<f64> {
        Some(best_factor(spectrum))
    }
}

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

/// Number of recent iterates whose largest F1 no step may exceed.
const WINDOW: usize = 10;

/// gamma^k = s'G s / s'y, the inverse of a Rayleigh quotient of G^-1 F1''. Here s is the last step and y the change of the residual. The first step is
/// an exact line search.
///
/// The rule is not monotone. F1 may rise, but not above the largest of the last `WINDOW` iterates (the nonmonotone line search of Grippo,
/// Lampariello and Lucidi, 1986, as Raydan uses it, 1997). A step that goes further is replaced by the exact line search.
#[derive(Debug, Default)]
pub struct BarzilaiBorwein {
    last: Option<LastIterate>,
    /// F1 of the last iterates minus F1 of the present one.
    recent: VecDeque<f64>,
}

/// The last iterate.
#[derive(Debug)]
struct LastIterate {
    gamma: f64,
    /// r'z.
    decrement: f64,
    /// z'K z.
    curvature: f64,
    /// B_a z_a + B_b z_b, n.
    closing: Vec<f64>,
    /// Contact forces, n.
    force: Vec<f64>,
}

impl GammaRule for BarzilaiBorwein {
    fn gamma(&mut self, here: &mut Iterate, _ritz: &mut Ritz) -> Result<f64, Unbounded> {
        let quotient = self.last.as_ref().map(|last| {
            // s = gamma z, G s = gamma r, y = K s + B' (change of force)
            let stiffer: Vec<f64> = here.layer.force.iter().zip(&last.force).map(|(now, then)| now - then).collect();
            last.gamma * last.decrement / (last.gamma * last.curvature + dot(&stiffer, &last.closing))
        });
        let decrement = here.decrement();
        let line = LineEnergy::new(here.model, here.layer, &here.sweep.residual, &here.sweep.correction);
        let worst = self.recent.iter().copied().fold(0.0, f64::max);
        let gamma = match quotient {
            Some(gamma) if gamma > 0.0 && gamma.is_finite() && line.change(gamma) <= worst => gamma,
            _ => line.minimize(1e-6)?,
        };
        let change = line.change(gamma);
        if self.recent.len() == WINDOW - 1 {
            self.recent.pop_front();
        }
        self.recent.push_back(0.0);
        self.recent.iter_mut().for_each(|above| *above -= change);
        let (curvature, closing) = (line.curvature(), here.sweep.correction.closing());
        self.last = Some(LastIterate { gamma, decrement, curvature, closing, force: here.layer.force.clone() });
        Ok(gamma)
    }

    fn restart(&mut self) {
        *self = Self::default();
    }
}

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
