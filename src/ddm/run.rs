//! What both loops share: the history of a run, its scales, when it ends, and who is told of it.

use super::asks::{ASKS, joined, numbers};
use super::balance::Balance;
use super::bound::Reached;
use super::history::{Observer, Row};
use super::memory::Memory;
use super::origin::Origin;
use super::scale::Scale;
use super::steady::most_apart;
use super::stop::{Status, relative_increment};
use super::sweep::Sweep;
use crate::error::Result;
use crate::model::Model;
use crate::model::body::Energy;
use crate::model::field::Field;
use crate::model::layer::Layer;
use crate::model::linear::{Failure, LinearStep};
use crate::problem::stop::StopRule;
use std::time::Instant;

/// A run under way.
pub(super) struct Run<'a> {
    pub model: &'a mut Model,
    pub stop: &'a StopRule,
    pub balance: Option<Balance>,
    pub observer: &'a mut dyn Observer,
    pub began: Instant,
    /// Seconds that it had taken before.
    pub earlier: f64,
    pub origin: Option<Origin>,
    pub scale: Scale,
    pub memory: Memory,
    /// From its first iterate on, also where it goes on.
    pub rows: Vec<Row>,
}

/// Numbers in the message of a step, beside what is asked.
const SUMS: usize = 4;

/// How a loop ended.
pub(super) struct End {
    pub status: Status,
    /// The last iterate.
    pub iterate: Field,
    /// Its layers.
    pub layer: Layer,
    /// The Robin term that the model carries, for each contact row; empty for none.
    pub weight: Vec<f64>,
    pub sweeps: usize,
    /// Solves of a body that were not needed.
    pub skipped: usize,
}

/// What every rank knows of an iterate.
#[derive(Debug, Clone, Copy)]
pub(super) struct Measured {
    /// u'Ku over all bodies.
    pub strain: f64,
    /// F1.
    pub f1: f64,
    pub factorizations: usize,
    pub inner_iterations: usize,
    /// What ranks were asked for.
    pub asked: u8,
}

impl Run<'_> {
    /// Sums over the ranks what bodies know of an iterate; `energy` is that of the bodies that live here, `layer` the layers at
    /// their compressions.
    pub fn measure(&self, energy: Energy, layer: &Layer, linear: &dyn LinearStep) -> Measured {
        let mut sums = [0.0; SUMS + ASKS];
        (sums[0], sums[1]) = (energy.strain, energy.potential);
        sums[SUMS..].copy_from_slice(&numbers(self.observer.asked()));
        for body in self.model.bodies.iter().filter_map(|slot| slot.local.as_ref()).filter(|body| body.leads()) {
            let counts = body.counts();
            sums[2] += counts.factorizations as f64;
            sums[3] += counts.inner_iterations as f64;
        }
        self.model.exchange.sum(&mut sums);
        let joint = linear.counts();
        Measured {
            strain: sums[0],
            f1: sums[1] + layer.energy.iter().sum::<f64>(),
            factorizations: sums[2] as usize + joint.factorizations,
            inner_iterations: sums[3] as usize + joint.inner_iterations,
            asked: joined(&sums[SUMS..]),
        }
    }

    /// The row of iterate number `k`, reached by moving its traces by `moved` (none for a start), without its errors.
    pub fn row(&self, k: usize, u: &Field, moved: Option<&[f64]>, measured: &Measured, closed: usize) -> Row {
        let mut trace = u.trace.clone();
        if let Some(origin) = &self.origin {
            crate::linalg::axpy(1.0, origin.trace(), &mut trace);
        }
        let of = |body: usize| match moved {
            None => f64::NAN,
            Some(moved) => relative_increment(&self.model.of_body(body, moved), &self.model.of_body(body, &trace)),
        };
        let increments: Vec<f64> = (0..self.model.bodies.len()).map(of).collect();
        Row {
            iteration: k,
            increment: increments.iter().copied().fold(f64::NAN, f64::max),
            increments,
            energy: measured.f1 + self.origin.as_ref().map_or(0.0, |origin| origin.energy),
            closed,
            points: self.model.points(),
            factorizations: measured.factorizations,
            inner_iterations: measured.inner_iterations,
            seconds: self.earlier + self.began.elapsed().as_secs_f64(),
            ..Row::default()
        }
    }

    /// Shows a row and keeps it.
    pub fn push(&mut self, row: Row) {
        self.observer.row(&row);
        self.rows.push(row);
    }

    /// The end of Newton's method at an iterate with its layers.
    pub fn end(&self, status: Status, iterate: Field, layer: Layer, linear: &dyn LinearStep) -> End {
        End { status, iterate, layer, weight: Vec::new(), sweeps: self.sweeps(linear), skipped: 0 }
    }

    /// Sweeps that the linear steps of this run have made.
    fn sweeps(&self, linear: &dyn LinearStep) -> usize {
        self.memory.earlier + linear.sweeps() - self.memory.foreign
    }

    /// Whether these errors are as small as was asked for.
    pub fn is_enough(&self, reached: &Reached) -> bool {
        self.stop.residual.is_some_and(|tolerance| reached.worst() <= tolerance)
    }

    /// Ends a step of Newton's method along x to u: its row, and the status if the run ends there.
    ///
    /// # Errors
    /// Failures of the solver library.
    pub fn end_of_step(
        &mut self,
        u: &Field,
        x: &Field,
        measured: &Measured,
        reached: &Reached,
        places: &Layer,
        linear: &mut dyn LinearStep,
    ) -> Result<Option<Status>> {
        let k = self.rows.len() + 1;
        let mut row = self.row(k, u, Some(&x.trace), measured, places.closed);
        (row.residual, row.error, row.is_bound) = (reached.worst(), reached.error, reached.is_bound);
        (row.gamma, row.sweeps) = (1.0, self.sweeps(linear));
        let increment = row.increment;
        self.push(row);
        let worst = reached.worst();
        // pressures of compressions that are far away may be beyond the range of numbers: the places are not
        if let Some(body) = not_finite(self.model, x, if worst.is_nan() { worst } else { 0.0 }) {
            return Ok(Some(Status::NotFinite { body }));
        }
        if self.stop.is_met(worst, increment) {
            return Ok(Some(Status::Converged));
        }
        if let Some(balance) = &mut self.balance
            && balance.is_met(self.model, linear, u, places, reached.error)?
        {
            return Ok(Some(Status::Converged));
        }
        if self.memory.floor.is_reached(worst) {
            let floor = rounding(self.model, u, places).sqrt();
            let reference = self.scale.energy(measured.strain + places.work).sqrt();
            if reached.error * reference <= floor {
                return Ok(Some(Status::RoundoffLimited));
            }
        }
        Ok((k >= self.stop.iterations).then_some(Status::IterationLimit))
    }
}

/// A sweep at an iterate, and how the iterate was reached.
pub(super) struct Swept<'a> {
    /// Number of the iterate.
    pub k: usize,
    pub u: &'a Field,
    pub layer: &'a Layer,
    pub sweep: &'a Sweep,
    /// Change of the traces that led to it, and the length of the step.
    pub last: Option<(&'a [f64], f64)>,
    /// Error over residual, as far as it is known.
    pub amplification: f64,
    /// Sweeps so far.
    pub sweeps: usize,
}

impl Run<'_> {
    /// Ends a sweep: the row of its iterate, and the status if the run ends there.
    ///
    /// # Errors
    /// Failures of the solver library.
    pub fn end_of_sweep(&mut self, swept: &Swept, linear: &mut dyn LinearStep) -> Result<Option<Status>> {
        let Swept { k, u, layer, sweep, last, .. } = *swept;
        let strain: f64 = sweep.energy.iter().map(|energy| energy.strain).sum();
        let potential: f64 = sweep.energy.iter().map(|energy| energy.potential).sum();
        let decrement: f64 = sweep.decrement.iter().sum();
        let measured = Measured {
            strain,
            f1: potential + layer.energy.iter().sum::<f64>(),
            factorizations: sweep.factorizations,
            inner_iterations: sweep.inner_iterations,
            asked: sweep.asked,
        };
        let mut row = self.row(k, u, last.map(|last| last.0), &measured, layer.closed);
        row.residual = self.scale.relative(decrement, strain + layer.work);
        row.error = row.residual * swept.amplification;
        row.gamma = last.map_or(f64::NAN, |last| last.1);
        row.sweeps = swept.sweeps;
        let (residual, error, increment) = (row.residual, row.error, row.increment);
        self.push(row);
        if let Some((body, reason)) = &sweep.failed {
            let failure = Failure { body: Some(*body), reason: reason.clone() };
            return Ok(Some(Status::InnerSolver(failure)));
        }
        if let Some(body) = not_finite(self.model, &sweep.correction, residual) {
            return Ok(Some(Status::NotFinite { body }));
        }
        let imbalance = self.scale.imbalance(self.model, &layer.force);
        // a small residual of a slow mode is no small error: the pressures stand still, too
        let steady = self.stop.residual.is_none_or(|tolerance| {
            let before = self.memory.before.replace(layer.pressure.clone());
            let moved = before.map_or(0.0, |before| most_apart(&before, &layer.pressure));
            let peak = self.scale.peak(&layer.pressure);
            let missing = self.memory.steady.missing(residual, &layer.pressure, peak);
            moved <= MOVED * tolerance * peak && missing <= tolerance * peak && imbalance <= SPARE * tolerance
        });
        let steady = steady && self.stop.increment.is_none_or(|tolerance| imbalance <= SPARE * tolerance);
        if self.stop.is_met(residual, increment) && steady {
            return Ok(Some(Status::Converged));
        }
        self.memory.steady.note(residual, &layer.pressure);
        if let Some(balance) = &mut self.balance
            && balance.is_met(self.model, linear, u, layer, error)?
        {
            return Ok(Some(Status::Converged));
        }
        let closed = layer.compression.iter().map(|&c| c > 0.0);
        if let Some(period) = self.memory.cycle.period(&u.trace, closed, residual, measured.f1) {
            return Ok(Some(Status::Cycle { period }));
        }
        if self.memory.floor.is_reached(residual) && decrement <= rounding(self.model, u, layer) {
            return Ok(Some(Status::RoundoffLimited));
        }
        if k >= self.stop.iterations {
            return Ok(Some(Status::IterationLimit));
        }
        Ok((measured.asked != 0).then_some(Status::Paused { asked: measured.asked }))
    }
}

/// How far the last step may have moved a pressure, relative to the largest, in units of the residual that is asked for. If a sweep
/// leaves the share f of an error, its step is (1 - f)/f times what is left: at most 3 times, unless f is below a quarter.
const MOVED: f64 = 3.0;

/// Factor on the tolerance of the residual for the balance of forces, which is measured by motions and not by energy.
const SPARE: f64 = 10.0;

/// A body in which a number is not finite, if the error is none.
pub(super) fn not_finite(model: &Model, step: &Field, error: f64) -> Option<usize> {
    let broken = |body: &usize| model.trace_ranges(*body).flatten().any(|i| !step.trace[i].is_finite());
    let first = (0..model.bodies.len()).find(broken);
    if error.is_finite() { first } else { first.or(Some(0)) }
}

/// What rounding alone can make of an iterate, squared energy norm: of K u, of forces, and of compressions, which a stiff layer
/// answers with forces of its own.
pub(super) fn rounding(model: &Model, u: &Field, layer: &Layer) -> f64 {
    let mut floor = [0.0];
    let points = model.points();
    for (index, slot) in model.bodies.iter().enumerate() {
        if let Some(body) = &slot.local {
            floor[0] += body.rounding(&u.states[index], &model.at_rows(index, &layer.force));
        }
    }
    model.exchange.sum(&mut floor);
    // a force omega kappa e at a point is resisted by springs omega kappa at least
    for q in 0..points {
        let terms = u.trace[q].abs() + u.trace[points + q].abs() + model.gap[q].abs();
        floor[0] += model.weight[q] * layer.tangent[q] * (f64::EPSILON * terms).powi(2);
    }
    ROUNDING * floor[0]
}

/// Squared factor between rounding errors and their estimate, which counts each row's worst case once: smooth errors weigh more in
/// K^-1 than in the inverse of its diagonal.
const ROUNDING: f64 = 1e3;
