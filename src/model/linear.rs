//! The linear step: (K + B' diag(omega kappa) B) x = r over all bodies (35).
//!
//! How it is solved is a choice of the inner solver, not a method of its own. There may be one dense matrix of
//! condensed bodies, one sparse factorisation, or conjugate gradients with a multigrid of all bodies or with the Robin
//! sweep (`robin::SweepCg`). A new way is a new file with an implementation of [`LinearStep`].

use super::Model;
use super::field::DisplacementField;
use super::layer::Layer;
use crate::error::Result;
use crate::solver::BodyCounts;

/// A linear system to be solved.
pub struct System<'a> {
    /// Bodies with K and B.
    pub model: &'a mut Model,
    /// The state of the layers.
    pub layer: &'a Layer,
    /// omega kappa at the points, n.
    pub springs: &'a [f64],
    /// r, one state for each local body.
    pub residual: &'a [Vec<f64>],
    /// The stopping test of an iterative solver.
    pub enough: &'a mut StoppingTest<'a>,
}

/// A stopping test of iterative solvers: it is called after each iteration, with the same numbers on all ranks, and
/// returns whether the solver may stop.
pub type StoppingTest<'a> = dyn FnMut(&Model, &Trial) -> bool + 'a;

/// The iterate x of an iterative solver.
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
    /// Return whether the error is at most this share of x, both in the energy norm.
    pub fn is_within(&self, share: f64) -> bool {
        self.error <= share * self.energy.max(0.0).sqrt()
    }
}

/// A solution of a [`System`].
pub struct LinearSolution {
    /// x, with its traces.
    pub field: DisplacementField,
    /// x'r, the squared energy norm of x.
    pub energy: f64,
    /// Estimated energy norm of the error of x; zero for a direct solver.
    pub error: f64,
    /// Whether x is exact to rounding, as that of a direct solver.
    pub is_exact: bool,
}

/// The failure of a solver that gave up.
#[derive(Debug, Clone, PartialEq)]
pub struct Failure {
    /// The body whose solver it was; `None` for a solver of all bodies together.
    pub body: Option<usize>,
    /// The solver's own message.
    pub reason: String,
}

/// What a solver found, or why it gave up. Failures of the solver library itself are errors of the program.
pub type Solved<T> = Result<T, Failure>;

/// A solver of the linear step.
pub trait LinearStep {
    /// Return the name in the table and the report.
    fn name(&self) -> &'static str;

    /// Set up the solver for the first step with these springs omega kappa at the points, n. A refusal of the solver or
    /// of an option then comes before that step.
    ///
    /// # Errors
    /// Failures of the solver library.
    fn set_up(&mut self, _springs: &[f64]) -> Result<()> {
        Ok(())
    }

    /// Go on with a model of the same bodies, whose loads, gaps, laws and rigid parts may differ.
    fn renew(&mut self, _model: &Model) {}

    /// Count on from these counters.
    fn count_on(&mut self, _earlier: BodyCounts) {}

    /// Set the counters to zero for another run.
    fn begin_anew(&mut self) {}

    /// Return K v for the displacements v of every local body. Collective.
    fn multiply(&mut self, model: &mut Model, v: &[Vec<f64>]) -> Vec<Vec<f64>> {
        model.multiply(v)
    }

    /// Solve a system. Collective.
    ///
    /// # Errors
    /// Failures of the solver library. A solver that does not reach its tolerance is reported in [`Solved`].
    fn solve(&mut self, system: System) -> Result<Solved<LinearSolution>>;

    /// Return the largest relative error with which a step is taken. Newton's method converges with any relative error
    /// below one, but more slowly the larger it is (Dembo, Eisenstat, Steihaug, Inexact Newton methods, 1982).
    fn roughest(&self) -> f64 {
        0.5
    }

    /// Return the counters of the work with all bodies together so far, without those that bodies count themselves.
    fn counts(&self) -> BodyCounts {
        BodyCounts::default()
    }

    /// Return the number of Robin sweeps made so far.
    fn sweeps(&self) -> usize {
        0
    }

    /// Return one line about the solver of all bodies together; empty if each body has its own.
    fn describe(&self) -> String {
        String::new()
    }
}
