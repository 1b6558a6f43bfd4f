//! The linear step: (K + B' diag(omega kappa) B) x = r over all bodies (35).
//!
//! How it is solved is a choice of inner solver, not a method of its own: one dense matrix of condensed bodies, one sparse
//! factorisation, conjugate gradients with multigrid of all bodies, or with the Robin sweep (`robin::Sweeps`). A new way is a new
//! file with the trait [`LinearStep`].

use super::Model;
use super::body::BodyCounts;
use super::field::Field;
use super::layer::Layer;
use crate::error::Result;

/// A system to be solved.
pub struct System<'a> {
    /// Bodies with K and B.
    pub model: &'a mut Model,
    /// Places of the layers.
    pub places: &'a Layer,
    /// omega kappa at the points, n.
    pub springs: &'a [f64],
    /// r, a state of each body that lives here.
    pub residual: &'a [Vec<f64>],
    /// When an iterative solver may end.
    pub enough: &'a mut Enough<'a>,
}

/// When an iterative solver may end: asked after each iteration, with the same numbers on all ranks.
pub type Enough<'a> = dyn FnMut(&Model, &Trial) -> bool + 'a;

/// What an iterative solver has so far.
#[derive(Debug)]
pub struct Trial<'a> {
    /// B x, the change of compression at the points, n.
    pub closing: &'a [f64],
    /// x'r, the squared energy norm of x.
    pub energy: f64,
    /// Estimated energy norm of the error of x.
    pub error: f64,
}

impl Trial<'_> {
    /// Whether the error is this share of x.
    pub fn is_within(&self, share: f64) -> bool {
        self.error <= share * self.energy.max(0.0).sqrt()
    }
}

/// A solution of a [`System`].
pub struct Solution {
    /// x, with its traces.
    pub field: Field,
    /// x'r, the squared energy norm of x.
    pub energy: f64,
    /// Estimated energy norm of the error of x; zero for a direct solver.
    pub error: f64,
    /// Whether it is exact to rounding, as that of a direct solver.
    pub is_exact: bool,
}

/// A solver that gave up, in its own words.
#[derive(Debug, Clone, PartialEq)]
pub struct Failure {
    /// The body whose solver it was; none for one of all bodies together.
    pub body: Option<usize>,
    /// Its reason.
    pub reason: String,
}

/// What a solver made of a system.
pub type Solved = std::result::Result<Solution, Failure>;

/// A solver of the linear step.
pub trait LinearStep {
    /// Name in the table and the report.
    fn name(&self) -> &'static str;

    /// Sets its solver up for the first step, with these springs omega kappa at the points, so that a refusal of the solver or of an
    /// option comes before it.
    ///
    /// # Errors
    /// Failures of the solver library.
    fn set_up(&mut self, _springs: &[f64]) -> Result<()> {
        Ok(())
    }

    /// Solves a system. Collective.
    ///
    /// # Errors
    /// Failures of the solver library; a solver that does not reach its tolerance is told in [`Solved`].
    fn solve(&mut self, system: System) -> Result<Solved>;

    /// Error of a step, as a share of it, above which it is not taken. Newton's method converges with any share below one, and the worse the
    /// larger it is (Dembo, Eisenstat, Steihaug, Inexact Newton methods, 1982).
    fn roughest(&self) -> f64 {
        0.5
    }

    /// What was done so far with all bodies together, besides what bodies count themselves.
    fn counts(&self) -> BodyCounts {
        BodyCounts::default()
    }

    /// Sweeps made so far.
    fn sweeps(&self) -> usize {
        0
    }

    /// One line about the solver of all bodies together; empty if each has its own.
    fn describe(&self) -> String {
        String::new()
    }

    /// Estimated bounds of the spectrum of the preconditioned matrix, if it has seen enough.
    fn spectrum(&self) -> Option<(f64, f64)> {
        None
    }
}
