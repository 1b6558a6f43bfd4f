//! Methods: how the next iterate is made from the sweep at this one. All minimise the same F1 over the same sweep.
//!
//! A new method is a new file with the trait [`Method`].

mod anderson;
pub(super) mod cg;
mod conjugate;
mod newton;
mod predicted;
mod relaxed;

pub use anderson::Anderson;
pub use conjugate::Conjugate;
pub use newton::{Coupled, Inner, Newton};
pub use relaxed::Relaxed;

use super::body::BodyCounts;
use super::field::Field;
use super::layer::Layer;
use super::line::{Line, Unbounded};
use super::model::Model;
use super::sweep::{Sweep, Sweeper};
use crate::error::Result;

/// An iterate with everything that is known of it.
pub struct Here<'a> {
    /// The problem; its bodies carry the Robin term of this iterate.
    pub model: &'a mut Model,
    /// Counts sweeps.
    pub sweeper: &'a mut Sweeper,
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
    /// Relative residual that ends the run.
    pub target: f64,
}

impl Here<'_> {
    /// Exact line search on F1 along a direction; the step is `length` of one when that is nearly the minimum.
    ///
    /// # Errors
    /// [`Unbounded`] if F1 falls for ever.
    pub fn search(&mut self, direction: &Field) -> std::result::Result<f64, Unbounded> {
        let line = Line::new(self.model, self.layer, &self.sweep.residual, direction);
        let (start, full) = (line.derivative(0.0), line.derivative(1.0));
        if start < 0.0 && full.abs() <= 0.1 * start.abs() {
            return Ok(1.0);
        }
        line.minimize(1e-2)
    }

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

/// Precision of solves whose result is a step.
pub(super) const FINE: f64 = 1e-6;

/// Precision of solves that measure: of the residual, two digits more than this are right.
pub(super) const ROUGH: f64 = 1e-2;

/// Precision of solves that measure an iterate on the way: of the residual, one digit is right.
pub(super) const COARSE: f64 = 0.3;

/// A way to make the next iterate.
pub trait Method {
    /// Name, as in the scene and the table.
    fn name(&self) -> &'static str;

    /// Whether its steps come from all bodies together. Then sweeps only measure, and need not follow the tangents; and steps
    /// may move bodies far in ways that contact does not feel, which no trace shows.
    fn is_joint(&self) -> bool {
        false
    }

    /// How far it wants inexact solves of the bodies to reduce their residuals.
    fn precision(&self) -> f64 {
        FINE
    }

    /// Contact pressures at the points, about those of the solution, for the first step. Most methods have no use for them.
    fn predict(&mut self, _pressure: Vec<f64>) {}

    /// The step that leads on.
    ///
    /// # Errors
    /// Failures of the solver library.
    fn step(&mut self, here: &mut Here) -> Result<Step>;

    /// Estimate of 1/(smallest eigenvalue of G^-1 F1''): the squared energy error is at most about this times r'G^-1 r.
    /// NaN while nothing is known.
    fn amplification(&self) -> f64 {
        f64::NAN
    }

    /// Share of an iterate's error that the last step left, if the method can tell; one if not.
    fn left(&self) -> f64 {
        1.0
    }

    /// What was done with all bodies together, besides the sweeps.
    fn coupled(&self) -> BodyCounts {
        BodyCounts::default()
    }

    /// Estimated bounds of the spectrum of G^-1 F1'', if the method has seen enough.
    fn spectrum(&self) -> Option<(f64, f64)> {
        None
    }

    /// Factor by which an iteration reduces the residual in the long run, if the method has one of its own.
    fn factor(&self) -> Option<f64> {
        None
    }

    /// Last look at the iterate with which a run ends, with the Robin term `weight` that the model carries. Collective.
    fn conclude(&mut self, _model: &Model, _layer: &Layer, _weight: &[f64]) {}

    /// Forgets what earlier iterations told: the problem changes.
    fn restart(&mut self) {}
}
