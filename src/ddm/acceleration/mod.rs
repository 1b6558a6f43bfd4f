//! Accelerations: how the next iterate is made from the sweep at this one. All minimise the same F1 over the same sweep.
//!
//! A new one is a new file with the trait [`Acceleration`].

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

/// An iterate with everything that is known of it.
pub struct Here<'a> {
    /// The problem; its bodies carry the Robin term of this iterate.
    pub model: &'a mut Model,
    /// Number of the iterate.
    pub k: usize,
    /// The layers at the iterate.
    pub layer: &'a Layer,
    /// omega psi kappa of the Robin term.
    pub weight: &'a [f64],
    /// The sweep at the iterate: r, z = G^-1 r.
    pub sweep: &'a Sweep,
    /// Relative residual.
    pub residual: f64,
}

impl Here<'_> {
    /// r'z over all bodies.
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
    /// F1 falls for ever along the direction found: a body is not held.
    Unbounded,
}

/// A way to make the next iterate.
pub trait Acceleration {
    /// Name, as in the scene and the table.
    fn name(&self) -> &'static str;

    /// The step that leads on.
    ///
    /// # Errors
    /// Failures of the solver library.
    fn step(&mut self, here: &mut Here) -> Result<Step>;

    /// What its directions tell of the spectrum of G^-1 F1''.
    fn ritz(&mut self) -> &mut Ritz;

    /// Estimate of 1/(smallest eigenvalue of G^-1 F1''): the squared energy error is at most about this times r'G^-1 r.
    /// NaN while nothing is known.
    fn amplification(&mut self) -> f64 {
        self.ritz().known().map_or(f64::NAN, |(low, _)| low.recip().max(1.0))
    }

    /// Estimated bounds of the spectrum of G^-1 F1'', if it has seen enough.
    fn spectrum(&mut self) -> Option<(f64, f64)> {
        self.ritz().known()
    }

    /// Factor by which an iteration reduces the residual in the long run, if it has one of its own.
    fn factor(&mut self) -> Option<f64> {
        None
    }

    /// Last look at the iterate with which a run ends, with the Robin term `weight` that the model carries. Collective.
    fn conclude(&mut self, model: &Model, layer: &Layer, weight: &[f64]) {
        self.ritz().bounds(model, layer, weight);
    }

    /// Forgets what earlier iterations told: the problem changes.
    fn restart(&mut self);
}
