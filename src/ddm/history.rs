//! The history of a run: one row per iteration, shown to an observer while it runs.

use serde::{Deserialize, Serialize};

/// One row of the iteration history: iterate u^k and the step that leads on from it.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Load step, from 1 on; 0 where there are none.
    pub step: usize,
    /// k: updates made so far.
    pub iteration: usize,
    /// The number by which the run ends (docs/theory.md): of sweeps the relative residual of the iterate, of Newton's method its
    /// relative error.
    pub residual: f64,
    /// Largest of `increments`; NaN in row 0, before the first update.
    pub increment: f64,
    /// Relative error of the iterate in the energy norm; NaN while nothing is known of it.
    pub error: f64,
    /// Whether `error` is a bound; else it is an estimate.
    pub is_bound: bool,
    /// The paper's rho of each body, in the order of the scene: relative increment of the normal displacements
    /// that led to this iterate.
    pub increments: Vec<f64>,
    /// Relaxation that led to this iterate; NaN in row 0.
    pub gamma: f64,
    /// Functional F1 (25).
    pub energy: f64,
    /// Contact points with c > 0, and all.
    pub closed: usize,
    /// All contact points.
    pub points: usize,
    /// Sweeps done so far: times that every body was solved.
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

/// Who watches an iteration: the table on the terminal, a progress line, nobody.
pub trait Observer {
    /// A row is complete.
    fn row(&mut self, row: &Row);
    /// What is asked of the run meanwhile, as bits whose meaning is the caller's own, [`ASKS`](crate::exchange::ASKS) of them; called once an
    /// iterate. What one rank asks all ranks learn of, and the run ends with [`Status::Paused`](super::Status::Paused), from where
    /// it can go on.
    fn asked(&self) -> u8 {
        0
    }
}

/// Nobody watches.
pub struct Silent;

impl Observer for Silent {
    fn row(&mut self, _row: &Row) {}
}
