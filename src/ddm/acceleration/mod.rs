//! Accelerations: rules that make the next iterate from the sweep at the present one. All minimise the same F1 with the same sweep.
//!
//! A new acceleration is a new file that implements the trait [`Acceleration`].

mod anderson;
mod ncg;
mod relaxation;

pub use anderson::Anderson;
pub use ncg::Conjugate;
pub use relaxation::Relaxed;

use crate::error::Result;
use crate::model::Model;
use crate::model::field::Field;
use crate::model::layer::Layer;
use crate::robin::{Ritz, Sweep};

/// The present iterate.
pub struct Iterate<'a> {
    /// The problem. Its bodies carry the Robin term of this iterate.
    pub model: &'a mut Model,
    /// Number of the iterate.
    pub k: usize,
    /// The layers at the iterate.
    pub layer: &'a Layer,
    /// The Robin term, omega psi kappa of each contact row (2n).
    pub weight: &'a [f64],
    /// The sweep at the iterate: r and z = G^-1 r.
    pub sweep: &'a Sweep,
    /// Relative residual.
    pub residual: f64,
}

impl Iterate<'_> {
    /// Return r'z over all bodies.
    pub fn decrement(&self) -> f64 {
        self.sweep.decrement.iter().sum()
    }
}

/// A step from an iterate.
pub enum Step {
    /// Along the correction z of the sweep, by this gamma (42).
    Sweep(f64),
    /// Along another direction, by this length.
    Along(Field, f64),
    /// F1 falls for ever along the direction: a body is unconstrained.
    Unbounded,
}

/// A rule that makes the next iterate.
pub trait Acceleration {
    /// Return the name, as in the scene and the table.
    fn name(&self) -> &'static str;

    /// Return the next step.
    ///
    /// # Errors
    /// Failures of the solver library.
    fn step(&mut self, here: &mut Iterate) -> Result<Step>;

    /// Return the Ritz values on the span of its directions, which estimate the spectrum of G^-1 F1''.
    fn ritz(&mut self) -> &mut Ritz;

    /// Estimate 1/(smallest eigenvalue of G^-1 F1''); NaN while nothing is known. The squared energy error is at most about this times r'G^-1 r.
    fn amplification(&mut self) -> f64 {
        self.ritz().known().map_or(f64::NAN, |(low, _)| low.recip().max(1.0))
    }

    /// Return the estimated bounds of the spectrum of G^-1 F1'', if there were enough directions.
    fn spectrum(&mut self) -> Option<(f64, f64)> {
        self.ritz().known()
    }

    /// Return the factor by which an iteration reduces the residual in the long run, if the method has one of its own.
    fn factor(&mut self) -> Option<f64> {
        None
    }

    /// Update the estimates at the iterate with which a run ends. `weight` is the Robin term that the model carries (2n). Collective.
    fn conclude(&mut self, model: &Model, layer: &Layer, weight: &[f64]) {
        self.ritz().bounds(model, layer, weight);
    }

    /// Forget the earlier iterations, because the problem changes.
    fn restart(&mut self);
}
