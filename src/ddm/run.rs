//! What both loops share: the history of a run, its scales, when it ends, and who is told of it.

use super::balance::Balance;
use super::bound::Reached;
use super::digits;
use super::history::{Observer, Row};
use super::memory::Memory;
use super::origin::Origin;
use super::scale::Scale;
use super::stop::{Status, relative_increment};
use crate::error::Result;
use crate::exchange::{self, ASKS, asks};
use crate::model::Model;
use crate::model::body::Energy;
use crate::model::field::Field;
use crate::model::layer::Layer;
use crate::model::linear::LinearStep;
use crate::problem::stop::StopRule;
use crate::robin::Sweep;
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
    /// That of bodies and layers at the last iterate, u'Ku + sum omega p c.
    pub energy: f64,
    /// That of the bodies alone, u'Ku.
    pub strain: f64,
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
        sums[SUMS..].copy_from_slice(&asks(self.observer.asked()));
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
            asked: exchange::asked(&sums[SUMS..]),
        }
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

    /// Whether the error of an iterate of Newton's method, in bodies with u'Ku = `strain`, may be nothing beside rounding: it has three quarters of all
    /// digits, or it is no progress and misses no more than rounding makes of it.
    pub fn is_at_floor(&self, reached: &Reached, u: &Field, places: &Layer, strain: f64) -> bool {
        if reached.worst() <= f64::EPSILON.powf(0.75) {
            return true;
        }
        let missed = reached.error.powi(2) * self.scale.energy(strain + places.work);
        self.memory.floor.is_stuck(reached.worst()) && missed <= rounding(self.model, u, places)
    }

    /// Shows and keeps the row of an iterate; the status if the run ends there.
    ///
    /// # Errors
    /// Failures of the solver library.
    pub fn end_at(&mut self, at: &Iterate, linear: &mut dyn LinearStep) -> Result<Option<Status>> {
        let row = self.row(at);
        let increment = row.increment;
        self.observer.row(&row);
        self.rows.push(row);
        let broken = |body: &usize| self.model.trace_ranges(*body).flatten().any(|i| !at.step.trace[i].is_finite());
        let broken = (0..self.model.bodies.len()).find(broken);
        if let Some(body) = broken.or((!at.is_finite).then_some(0)) {
            return Ok(Some(Status::NotFinite { body }));
        }
        if at.is_still && self.stop.is_met(at.residual, increment) {
            return Ok(Some(Status::Converged));
        }
        if let Some(balance) = &mut self.balance
            && balance.is_met(self.model, linear, at.u, at.layer, at.error.max(at.residual))?
        {
            return Ok(Some(Status::Converged));
        }
        if let Some(period) = at.period {
            return Ok(Some(Status::Cycle { period }));
        }
        if self.memory.floor.is_reached(at.residual)
            && (self.memory.floor.is_fixed(increment) || at.missed <= rounding(self.model, at.u, at.layer))
        {
            return Ok(Some(Status::RoundoffLimited));
        }
        Ok((at.k >= self.stop.iterations).then_some(Status::IterationLimit))
    }

    /// Goes back to an iterate, unless it is the last one: one more row, of no update.
    pub fn go_back(&mut self, (row, u, layer): (Row, Field, Layer)) -> (Field, Layer) {
        if let Some(last) = self.rows.last().filter(|last| last.iteration != row.iteration) {
            let Row { iteration, factorizations, inner_iterations, sweeps, seconds, .. } = *last;
            let row = Row { iteration, gamma: 0.0, factorizations, inner_iterations, sweeps, seconds, ..row };
            self.observer.row(&row);
            self.rows.push(row);
        }
        (u, layer)
    }

    fn row(&self, at: &Iterate) -> Row {
        let mut trace = at.u.trace.clone();
        if let Some(origin) = &self.origin {
            crate::linalg::axpy(1.0, origin.trace(), &mut trace);
        }
        let of = |body: usize| match at.moved {
            None => f64::NAN,
            Some(moved) => relative_increment(&self.model.of_body(body, moved), &self.model.of_body(body, &trace)),
        };
        let increments: Vec<f64> = (0..self.model.bodies.len()).map(of).collect();
        Row {
            step: 0,
            iteration: at.k,
            residual: at.residual,
            increment: increments.iter().copied().fold(f64::NAN, f64::max),
            error: at.error,
            is_bound: at.is_bound,
            increments,
            gamma: at.length,
            energy: at.measured.f1 + self.origin.as_ref().map_or(0.0, |origin| origin.energy),
            closed: at.layer.closed,
            points: self.model.points(),
            sweeps: at.sweeps,
            factorizations: at.measured.factorizations,
            inner_iterations: at.measured.inner_iterations,
            smoothed: self.memory.progress.path.steps,
            seconds: self.earlier + self.began.elapsed().as_secs_f64(),
        }
    }

    /// What is known of an iterate of Newton's method after a step x, a share of a whole one, to u.
    pub fn after_step<'a>(
        &mut self,
        (u, x, share): (&'a Field, &'a Field, f64),
        measured: Measured,
        reached: &Reached,
        places: &'a Layer,
        linear: &dyn LinearStep,
    ) -> Iterate<'a> {
        let residual = reached.worst();
        (self.energy, self.strain) = (measured.strain + places.work, measured.strain);
        let closed = places.compression.iter().map(|&c| c > 0.0);
        // F1 of iterates of Newton's method goes up and down
        let period = self.memory.cycle.period(&u.trace, closed, residual, 0.0);
        Iterate {
            k: self.rows.len() + 1,
            u,
            layer: places,
            step: x,
            moved: Some(&x.trace),
            length: share,
            measured,
            residual,
            error: reached.error,
            is_bound: reached.is_bound,
            missed: reached.error.powi(2) * self.scale.energy(self.energy),
            sweeps: self.sweeps(linear),
            // pressures of compressions that are far away may be beyond the range of numbers: the places are not
            is_finite: !residual.is_nan(),
            is_still: true,
            period,
        }
    }

    /// What is known of an iterate u at which the bodies were swept, reached by moving its traces by `moved` in a step of some length; the error
    /// is the residual times `amplification`, as far as that is known.
    pub fn after_sweep<'a>(
        &mut self,
        u: &'a Field,
        layer: &'a Layer,
        sweep: &'a Sweep,
        (moved, length): (Option<&'a [f64]>, f64),
        amplification: f64,
    ) -> Iterate<'a> {
        let strain: f64 = sweep.energy.iter().map(|energy| energy.strain).sum();
        let potential: f64 = sweep.energy.iter().map(|energy| energy.potential).sum();
        let missed = sweep.decrement.iter().sum();
        let (factorizations, inner_iterations, asked) = (sweep.factorizations, sweep.inner_iterations, sweep.asked);
        let f1 = potential + layer.energy.iter().sum::<f64>();
        let all = strain + layer.work;
        (self.energy, self.strain) = (all, strain);
        let residual = self.scale.relative(missed, all);
        // a small residual of a slow mode is no small error: the pressures stand still, too
        let is_balanced = |tolerance: f64| self.scale.imbalance(self.model, &layer.force, strain) <= tolerance;
        let peak = self.scale.peak(&layer.pressure, strain);
        let missing = self.memory.steady.missing(residual, &layer.pressure, peak);
        let is_still = |tolerance| missing <= tolerance * peak && is_balanced(tolerance);
        let is_still = self.stop.residual.is_none_or(is_still) && self.stop.increment.is_none_or(is_balanced);
        self.memory.steady.note(residual, &layer.pressure);
        let closed = layer.compression.iter().map(|&c| c > 0.0);
        Iterate {
            k: self.rows.len(),
            u,
            layer,
            step: &sweep.correction,
            moved,
            length,
            measured: Measured { strain, f1, factorizations, inner_iterations, asked },
            residual,
            error: residual * amplification,
            is_bound: false,
            missed,
            sweeps: self.memory.sweeper.sweeps,
            is_finite: residual.is_finite(),
            is_still,
            period: self.memory.cycle.period(&u.trace, closed, residual, f1),
        }
    }
}

/// An iterate, and what a loop knows of it.
pub(super) struct Iterate<'a> {
    /// Its number.
    pub k: usize,
    pub u: &'a Field,
    pub layer: &'a Layer,
    /// Where a number that is not finite shows: the last step, or the correction of the sweep.
    pub step: &'a Field,
    /// Change of the traces that led to it, none for a start, and the length of the step.
    pub moved: Option<&'a [f64]>,
    pub length: f64,
    pub measured: Measured,
    /// See [`Row::residual`], [`Row::error`], [`Row::is_bound`].
    pub residual: f64,
    pub error: f64,
    pub is_bound: bool,
    /// What it misses, a squared energy norm, to be compared with rounding.
    pub missed: f64,
    /// Sweeps so far.
    pub sweeps: usize,
    pub is_finite: bool,
    /// Whether a small residual is a small error.
    pub is_still: bool,
    /// That of a cycle.
    pub period: Option<usize>,
}

/// What rounding alone can make of an iterate, squared energy norm: of K u, of forces, and of compressions, which a stiff layer
/// answers with forces of its own.
pub(super) fn rounding(model: &Model, u: &Field, layer: &Layer) -> f64 {
    let mut floor = [0.0];
    for (index, slot) in model.bodies.iter().enumerate() {
        if let Some(body) = &slot.local {
            floor[0] += body.rounding(&u.states[index], &model.at_rows(index, &layer.force));
        }
    }
    model.exchange.sum(&mut floor);
    // a force omega kappa e at a point is resisted by springs omega kappa at least
    for (q, digits) in digits::of_compressions(model, &u.trace).into_iter().enumerate() {
        floor[0] += model.weight[q] * layer.tangent[q] * digits.powi(2);
    }
    digits::ROUNDING * floor[0]
}
