//! Relaxation rules of the paper's iteration u <- u + gamma z: gamma of (42), from the sweeps so far.

use crate::error::Result;
use crate::linalg::dot;
use crate::model::Model;
use crate::model::field::{LineEnergy, Unbounded};
use crate::model::layer::Layer;
use crate::model::linear::LinearStep;
use crate::problem::Own;
use crate::problem::method::Gamma;
use crate::robin::Sweep;

/// The present iterate.
pub struct Iterate<'a> {
    /// The problem. For sweeps its bodies carry the Robin term of this iterate.
    pub model: &'a mut Model,
    /// The solver of all bodies, which can multiply by K.
    pub linear: &'a mut dyn LinearStep,
    /// Number of the iterate.
    pub k: usize,
    /// The layers at the iterate.
    pub layer: &'a Layer,
    /// r and z = G^-1 r at the iterate, by a sweep or with one matrix of all bodies.
    pub sweep: &'a Sweep,
    /// Relative residual.
    pub residual: f64,
}

/// A rule that chooses gamma^k after the sweep of iteration k. Iteration 0 begins a run.
pub trait GammaRule {
    /// Return the relaxation for the update along the sweep's correction.
    ///
    /// # Errors
    /// [`Unbounded`] if F1 falls for ever along the correction.
    fn gamma(&mut self, here: &mut Iterate) -> Result<f64, Unbounded>;
}

/// Rules that a Rust program adds, by name. Each function makes the rule of a run.
pub type OwnRules = Own<dyn Fn() -> Box<dyn GammaRule>>;

/// Make the rule that a scene names. `own` are the rules that the program brings.
///
/// # Errors
/// A name that no rule of the program has.
pub fn rule(gamma: &Gamma, own: &OwnRules) -> Result<Box<dyn GammaRule>> {
    Ok(match gamma.clone() {
        Gamma::Stationary(gamma) => Box::new(OfIteration(move |_| gamma)),
        Gamma::Schedule(list) => Box::new(OfIteration(move |k: usize| list[k.min(list.len() - 1)])),
        Gamma::Expression(gamma) => Box::new(OfIteration(move |k| gamma.in_iteration(k))),
        Gamma::LineSearch => Box::new(LineSearch),
        Gamma::Aitken => Box::new(Aitken::default()),
        Gamma::Own(name) => own.get("rule for gamma", &name)?(),
    })
}

/// gamma^k that depends on k alone: always the same, as in the paper, from a list whose last value stays, or from an
/// expression.
struct OfIteration<F>(F);

impl<F: Fn(usize) -> f64> GammaRule for OfIteration<F> {
    fn gamma(&mut self, here: &mut Iterate) -> Result<f64, Unbounded> {
        Ok((self.0)(here.k))
    }
}

/// gamma^k minimises F1 along the correction, to six digits of its slope. F1 is convex, so it falls in every step.
#[derive(Debug, Default, Clone, Copy)]
pub struct LineSearch;

impl GammaRule for LineSearch {
    fn gamma(&mut self, here: &mut Iterate) -> Result<f64, Unbounded> {
        let z = &here.sweep.correction;
        let products = here.linear.multiply(here.model, &z.displacements);
        LineEnergy::new(here.model, here.layer, &here.sweep.residual, z, &products).minimize(1e-6)
    }
}

/// gamma^k = -gamma^{k-1} z^{k-1}.(z^k - z^{k-1}) / |z^k - z^{k-1}|^2 on the traces: the secant of the fixed point map.
///
/// A value outside of (0, 10), as where contact changes the most, is replaced by the exact line search: a secant that
/// goes farther than ten steps extrapolates.
#[derive(Debug, Default)]
pub struct Aitken {
    last: Option<(f64, Vec<f64>)>,
}

impl GammaRule for Aitken {
    fn gamma(&mut self, here: &mut Iterate) -> Result<f64, Unbounded> {
        let trace = here.sweep.correction.trace.clone();
        let secant = self.last.take().filter(|_| here.k > 0).map(|(gamma, before)| {
            let change: Vec<f64> = trace.iter().zip(&before).map(|(z, before)| z - before).collect();
            -gamma * dot(&before, &change) / dot(&change, &change)
        });
        let gamma = match secant {
            Some(gamma) if gamma > 0.0 && gamma < 10.0 => gamma,
            _ => LineSearch.gamma(here)?,
        };
        self.last = Some((gamma, trace));
        Ok(gamma)
    }
}
