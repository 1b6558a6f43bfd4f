//! What both loops share: the history of a run, its scales, and its observer.

use super::bound::Scale;
use super::stop::{Status, relative_increment};
use crate::exchange::asks;
use crate::linalg::axpy;
use crate::model::body::Energy;
use crate::model::field::DisplacementField;
use crate::model::layer::Layer;
use crate::model::motions;
use crate::model::{BodyCounts, Model};
use crate::problem::method::StopRule;
use crate::robin::spectrum::Interval;
use serde::{Deserialize, Serialize};
use std::time::Instant;

/// A run under way.
pub(super) struct Run<'a> {
    pub model: &'a mut Model,
    pub stop: &'a StopRule,
    pub observer: &'a mut dyn Observer,
    pub began: Instant,
    /// The gaps of the undeformed bodies, n. Those of the model are relative to the rigid motions of the iterate.
    pub gap: Vec<f64>,
    pub scale: Scale,
    pub rows: Vec<Row>,
}

/// The result of a run: its last iterate, with its errors and history.
#[derive(Clone)]
pub struct Outcome {
    /// How the run ended.
    pub status: Status,
    /// Updates made.
    pub iterations: usize,
    /// Sweeps made.
    pub sweeps: usize,
    /// The last iterate.
    pub iterate: DisplacementField,
    /// The layers at that iterate.
    pub layer: Layer,
    /// History, one row per iterate.
    pub rows: Vec<Row>,
    /// Name of the method.
    pub method: &'static str,
    /// Counters of what was done for all bodies together, besides the counters of the bodies.
    pub joint: BodyCounts,
    /// The solver of all bodies together; empty if each body had its own.
    pub linear_step: String,
    /// Largest error of a pressure by rounding of gaps and displacements, relative to the scale of errors of pressures.
    pub rounding: f64,
    /// Energy norm of the forces f - K u - B' omega p of each node alone, relative to the energy of bodies and layers.
    /// It is computed with K itself, and is about a lower bound of the error that the forces cause.
    pub unbalanced: f64,
    /// The interval (33) of gamma, if it was asked for and can be found.
    pub interval: Option<Interval>,
    /// u'Ku.
    pub strain: f64,
    /// Stiffness per area with which the bodies answer an error of a compression, n.
    pub answer: Vec<f64>,
}

impl Outcome {
    /// Return the outcome of a run that has made no step. What a loop does not know is empty, until the run ends.
    pub(super) fn at_start(status: Status, iterate: DisplacementField, layer: Layer) -> Self {
        Self {
            status,
            iterations: 0,
            sweeps: 0,
            iterate,
            answer: vec![f64::INFINITY; layer.pressure.len()],
            layer,
            rows: Vec::new(),
            method: "",
            joint: BodyCounts::default(),
            linear_step: String::new(),
            rounding: 0.0,
            unbalanced: 0.0,
            interval: None,
            strain: 0.0,
        }
    }
}

impl Run<'_> {
    /// Sum the numbers of an iterate over the ranks: u'Ku, u'Ku/2 - f'u, `more`, factorisations and inner iterations of
    /// the bodies' solvers, and requests from outside.
    pub fn sum(&self, energy: Energy, more: f64) -> Vec<f64> {
        let mut sums = vec![energy.strain, energy.potential, more, 0.0, 0.0];
        for (_, body) in self.model.locals().filter(|(_, body)| body.dofs().leads()) {
            let counts = body.counts();
            sums[3] += counts.factorizations as f64;
            sums[4] += counts.inner_iterations as f64;
        }
        sums.extend(asks(self.observer.asked()));
        self.model.exchange.sum(&mut sums);
        sums
    }

    /// Complete the row of an iterate u, show it and keep it. `moved` is the step of the traces that led to u (2n),
    /// none for a start. Return the first body with a trace that is not finite.
    pub fn record(&mut self, u: &DisplacementField, moved: Option<&[f64]>, row: Row) -> Option<usize> {
        let mut trace = motions::trace(self.model, &u.rigid);
        axpy(1.0, &u.trace, &mut trace);
        let of = |body: usize| match moved {
            None => f64::NAN,
            Some(moved) => relative_increment(&self.model.of_body(body, moved), &self.model.of_body(body, &trace)),
        };
        let increments: Vec<f64> = (0..self.model.bodies.len()).map(of).collect();
        let row = Row {
            increment: increments.iter().copied().fold(f64::NAN, f64::max),
            increments,
            points: self.model.points(),
            seconds: self.began.elapsed().as_secs_f64(),
            ..row
        };
        self.observer.row(&row);
        self.rows.push(row);
        let is_broken = |body: &usize| self.model.trace_ranges(*body).flatten().any(|i| !trace[i].is_finite());
        (0..self.model.bodies.len()).find(is_broken)
    }
}

/// One row of the iteration history: iterate u^k and the step that leads on from it.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Load step, from 1 on; 0 where there are none.
    pub step: usize,
    /// k: updates made so far.
    pub iteration: usize,
    /// The number that ends the run (docs/theory.md): for sweeps the relative residual of the iterate, for Newton's
    /// method its relative error.
    pub residual: f64,
    /// Largest of `increments`; NaN in row 0, before the first update.
    pub increment: f64,
    /// Relative error of the iterate in the energy norm; NaN while it is not known.
    pub error: f64,
    /// Whether `error` is a bound; otherwise it is an estimate.
    pub is_bound: bool,
    /// The paper's rho of each body, in the order of the scene: relative increment of the normal displacements in the
    /// step that led to this iterate.
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
    /// Return the signals that ask the run to end, as `exchange::ASKS` bits whose meaning is the caller's own; called
    /// once an iterate. Those of one rank reach all ranks, and the run ends with
    /// [`Status::Interrupted`](super::Status::Interrupted).
    fn asked(&self) -> u8 {
        0
    }
}

/// An observer that does nothing.
pub struct Silent;

impl Observer for Silent {
    fn row(&mut self, _row: &Row) {}
}
