//! The history of a run: one row per iterate, shown to an observer during the run.

use serde::{Deserialize, Serialize};

/// One row of the iteration history: iterate u^k and the step that leads on from it.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Load step, from 1 on; 0 where there are none.
    pub step: usize,
    /// k: updates made so far.
    pub iteration: usize,
    /// The number that ends the run (docs/theory.md): for sweeps the relative residual of the iterate, for Newton's method its relative error.
    pub residual: f64,
    /// Largest of `increments`; NaN in row 0, before the first update.
    pub increment: f64,
    /// Relative error of the iterate in the energy norm; NaN while it is not known.
    pub error: f64,
    /// Whether `error` is a bound; otherwise it is an estimate.
    pub is_bound: bool,
    /// The paper's rho of each body, in the order of the scene: relative increment of the normal displacements in the step that led to this
    /// iterate.
    pub increments: Vec<f64>,
    /// Relaxation, or length of the step, that led to this iterate; NaN in row 0.
    pub gamma: f64,
    /// Functional F1 (25).
    pub energy: f64,
    /// Contact points with c > 0.
    pub closed: usize,
    /// All contact points.
    pub points: usize,
    /// Sweeps so far; each solves in every body once.
    pub sweeps: usize,
    /// Numeric factorisations (or preconditioner set-ups) so far, all bodies.
    pub factorizations: usize,
    /// Inner Krylov iterations so far, all bodies (0 with a direct solver).
    pub inner_iterations: usize,
    /// Steps of Newton's method so far that were taken with smoothed laws.
    pub smoothed: usize,
    /// Seconds since the iteration began.
    pub seconds: f64,
}

/// An observer of an iteration, such as the table on the terminal or a progress line.
pub trait Observer {
    /// Take a complete row.
    fn row(&mut self, row: &Row);
    /// Return the requests from outside, as [`ASKS`](crate::exchange::ASKS) bits whose meaning is the caller's own; called once an iterate. The
    /// requests of one rank reach all ranks, and the run ends with [`Status::Paused`](super::Status::Paused), from where it can go on.
    fn asked(&self) -> u8 {
        0
    }
}

/// An observer that does nothing.
pub struct Silent;

impl Observer for Silent {
    fn row(&mut self, _row: &Row) {}
}
