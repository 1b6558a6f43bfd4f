//! What both loops share: the history of a run, its scales, the checks that end it, and its observer.

use super::bound::{ROUNDING, Reached, Scale, compression_roundoff};
use super::progress::Progress;
use super::stop::{BalanceRule, Cycle, Stagnation, Status, Steady, relative_increment};
use crate::error::Result;
use crate::exchange::{self, ASKS, asks};
use crate::model::Model;
use crate::model::body::Energy;
use crate::model::field::Field;
use crate::model::layer::Layer;
use crate::model::linear::LinearStep;
use crate::model::rigid::DisplacementOrigin;
use crate::problem::method::StopRule;
use crate::robin::{Sweep, Sweeper};
use serde::{Deserialize, Serialize};
use std::time::Instant;

/// A run under way.
pub(super) struct Run<'a> {
    pub model: &'a mut Model,
    pub stop: &'a StopRule,
    pub balance: Option<BalanceRule>,
    pub observer: &'a mut dyn Observer,
    pub began: Instant,
    /// Seconds that the run took before a pause.
    pub earlier: f64,
    pub origin: Option<DisplacementOrigin>,
    pub scale: Scale,
    /// Energy of bodies and layers at the last iterate, u'Ku + sum omega p c.
    pub energy: f64,
    /// Energy of the bodies alone, u'Ku.
    pub strain: f64,
    pub memory: Memory,
    /// History from the first iterate on, also that before a pause.
    pub rows: Vec<Row>,
}

/// Numbers in the message of a step, besides requests from outside.
const SUMS: usize = 6;

/// How a loop ended.
pub(super) struct LoopEnd {
    pub status: Status,
    /// The last iterate.
    pub iterate: Field,
    /// Its layers.
    pub layer: Layer,
    /// The Robin term that the model carries, omega psi kappa of each contact row (2n); empty for none.
    pub weight: Vec<f64>,
    pub sweeps: usize,
    /// Solves of a body that were not needed.
    pub skipped: usize,
}

/// An iterate of Newton's method that a run can go back to.
pub(super) struct FallbackIterate {
    pub row: Row,
    pub u: Field,
    pub layer: Layer,
}

/// Sums over all ranks at an iterate.
#[derive(Debug, Clone, Copy)]
pub(super) struct Measured {
    /// u'Ku over all bodies.
    pub strain: f64,
    /// F1.
    pub f1: f64,
    pub factorizations: usize,
    pub inner_iterations: usize,
    /// Length of f - K u - B' omega p relative to that of the forces in it.
    pub unbalanced: f64,
    /// Requests from outside, of all ranks.
    pub asked: u8,
}

impl Run<'_> {
    /// Sum the numbers of an iterate over the ranks. `energy` is that of the bodies that live on this rank, `layer` has the layers at the
    /// compressions of the bodies. Collective.
    pub fn measure(&self, energy: Energy, layer: &Layer, linear: &dyn LinearStep) -> Measured {
        let mut sums = [0.0; SUMS + ASKS];
        sums[..2].copy_from_slice(&[energy.strain, energy.potential]);
        sums[4..SUMS].copy_from_slice(&[energy.rest, energy.forces]);
        sums[SUMS..].copy_from_slice(&asks(self.observer.asked()));
        for body in self.model.bodies.iter().filter_map(|slot| slot.local.as_ref()).filter(|body| body.states().leads())
        {
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
            unbalanced: if sums[4] == 0.0 { 0.0 } else { (sums[4] / sums[5]).sqrt() },
            asked: exchange::asked(&sums[SUMS..]),
        }
    }

    /// Return the end of Newton's method at an iterate with its layers.
    pub fn end(&self, status: Status, iterate: Field, layer: Layer, linear: &dyn LinearStep) -> LoopEnd {
        LoopEnd { status, iterate, layer, weight: Vec::new(), sweeps: self.sweeps(linear), skipped: 0 }
    }

    /// Count the sweeps that the linear steps of this run have made.
    fn sweeps(&self, linear: &dyn LinearStep) -> usize {
        self.memory.earlier + linear.sweeps() - self.memory.foreign
    }

    /// Whether these errors are within the tolerance.
    pub fn is_enough(&self, reached: &Reached) -> bool {
        self.stop.residual.is_some_and(|tolerance| reached.worst() <= tolerance)
    }

    /// Whether the error of an iterate of Newton's method, in bodies with u'Ku = `strain`, may be at the roundoff level: the iterate has three
    /// quarters of all digits, or it is no progress and misses no more than rounding explains.
    pub fn is_at_roundoff(&self, reached: &Reached, u: &Field, places: &Layer, strain: f64) -> bool {
        if reached.worst() <= f64::EPSILON.powf(0.75) {
            return true;
        }
        let missed = reached.error.powi(2) * self.scale.energy(strain + places.work);
        self.memory.stagnation.is_stuck(reached.worst()) && missed <= rounding(self.model, u, places)
    }

    /// Show the row of an iterate and keep it. Return the status if the run ends there.
    pub fn check_termination(&mut self, at: &MeasuredIterate, linear: &mut dyn LinearStep) -> Result<Option<Status>> {
        let row = self.row(at);
        let increment = row.increment;
        self.observer.row(&row);
        self.rows.push(row);
        let is_broken = |body: &usize| self.model.trace_ranges(*body).flatten().any(|i| !at.step.trace[i].is_finite());
        let broken = (0..self.model.bodies.len()).find(is_broken);
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
        if self.memory.stagnation.is_reached(at.residual)
            && (self.memory.stagnation.is_fixed(increment) || at.missed <= rounding(self.model, at.u, at.layer))
        {
            return Ok(Some(Status::RoundoffLimited));
        }
        Ok((at.k >= self.stop.iterations).then_some(Status::IterationLimit))
    }

    /// Go back to an iterate. Unless it is the last one, the history gets one more row, of a step of length zero.
    pub fn go_back(&mut self, FallbackIterate { row, u, layer }: FallbackIterate) -> (Field, Layer) {
        if let Some(last) = self.rows.last().filter(|last| last.iteration != row.iteration) {
            let Row { iteration, factorizations, inner_iterations, sweeps, seconds, .. } = *last;
            let row = Row { iteration, gamma: 0.0, factorizations, inner_iterations, sweeps, seconds, ..row };
            self.observer.row(&row);
            self.rows.push(row);
        }
        (u, layer)
    }

    /// Return the row of an iterate. Traces and energies in it refer to the undeformed bodies, not to the origin.
    fn row(&self, at: &MeasuredIterate) -> Row {
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

    /// Describe the iterate u of Newton's method; the step that led to it was this part, of some `length`, of a linear step.
    pub fn after_step<'a>(
        &mut self,
        (u, step, length): (&'a Field, &'a Field, f64),
        measured: Measured,
        reached: &Reached,
        places: &'a Layer,
        linear: &dyn LinearStep,
    ) -> MeasuredIterate<'a> {
        let residual = reached.worst();
        (self.energy, self.strain) = (measured.strain + places.work, measured.strain);
        let closed = places.compression.iter().map(|&c| c > 0.0);
        // no F1: it goes up and down in Newton's method
        let period = self.memory.cycle.period(&u.trace, closed, residual, 0.0);
        MeasuredIterate {
            k: self.rows.len() + 1,
            u,
            layer: places,
            step,
            moved: Some(&step.trace),
            length,
            measured,
            residual,
            error: reached.error,
            is_bound: reached.is_bound,
            missed: reached.error.powi(2) * self.scale.energy(self.energy),
            sweeps: self.sweeps(linear),
            // pressures of far compressions may be beyond the range of numbers; those of the layer states are not
            is_finite: !residual.is_nan(),
            is_still: true,
            period,
        }
    }

    /// Describe the iterate u of a sweep. The step that led to it moved the traces by `moved` and had some `length`. The error is estimated as the
    /// residual times `amplification`, which is NaN while it is not known.
    pub fn after_sweep<'a>(
        &mut self,
        u: &'a Field,
        layer: &'a Layer,
        sweep: &'a Sweep,
        (moved, length): (Option<&'a [f64]>, f64),
        amplification: f64,
    ) -> MeasuredIterate<'a> {
        let strain: f64 = sweep.energy.iter().map(|energy| energy.strain).sum();
        let potential: f64 = sweep.energy.iter().map(|energy| energy.potential).sum();
        let missed = sweep.decrement.iter().sum();
        let f1 = potential + layer.energy.iter().sum::<f64>();
        (self.energy, self.strain) = (strain + layer.work, strain);
        let residual = self.scale.relative(missed, self.energy);
        let is_still = self.is_still(layer, residual);
        self.memory.steady.note(residual, &layer.pressure);
        let closed = layer.compression.iter().map(|&c| c > 0.0);
        MeasuredIterate {
            k: self.rows.len(),
            u,
            layer,
            step: &sweep.correction,
            moved,
            length,
            measured: Measured {
                strain,
                f1,
                factorizations: sweep.factorizations,
                inner_iterations: sweep.inner_iterations,
                unbalanced: 0.0,
                asked: sweep.asked,
            },
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

    /// Whether the pressures of a sweep's iterate have settled and its forces balance, to the tolerance that is asked for. The residual alone
    /// is not enough: a slow mode has a small residual and a large error.
    fn is_still(&self, layer: &Layer, residual: f64) -> bool {
        let peak = self.scale.peak(&layer.pressure, self.strain);
        let missing = self.memory.steady.missing(residual, &layer.pressure, peak);
        let is_balanced = |tolerance: f64| self.scale.imbalance(self.model, &layer.force, self.strain) <= tolerance;
        self.stop.residual.is_none_or(|tolerance| missing <= tolerance * peak && is_balanced(tolerance))
            && self.stop.increment.is_none_or(is_balanced)
    }
}

/// An iterate of either loop.
pub(super) struct MeasuredIterate<'a> {
    /// Its number.
    pub k: usize,
    pub u: &'a Field,
    pub layer: &'a Layer,
    /// The last step, or the correction of the sweep: where a number that is not finite appears.
    pub step: &'a Field,
    /// Change of the traces that led to this iterate; none for a start.
    pub moved: Option<&'a [f64]>,
    /// Length of that step.
    pub length: f64,
    pub measured: Measured,
    /// See [`Row::residual`].
    pub residual: f64,
    /// See [`Row::error`].
    pub error: f64,
    /// See [`Row::is_bound`].
    pub is_bound: bool,
    /// Error as a squared energy norm, to be compared with rounding.
    pub missed: f64,
    /// Sweeps so far.
    pub sweeps: usize,
    pub is_finite: bool,
    /// Whether a small residual is a small error.
    pub is_still: bool,
    /// Period of a cycle, if there is one.
    pub period: Option<usize>,
}

/// Return what rounding alone can make of an iterate, a squared energy norm: rounding of K u, of forces, and of compressions, to which a stiff
/// layer answers with forces of its own. Collective.
pub(super) fn rounding(model: &Model, u: &Field, layer: &Layer) -> f64 {
    let mut sum = [0.0];
    for (index, slot) in model.bodies.iter().enumerate() {
        if let Some(body) = slot.local.as_ref() {
            sum[0] += body.rounding(&u.states[index], &model.at_rows(index, &layer.force));
        }
    }
    model.exchange.sum(&mut sum);
    // an error e of a compression makes the force omega kappa e, which springs omega kappa at least resist
    for (q, error) in compression_roundoff(model, &u.trace).into_iter().enumerate() {
        sum[0] += model.weight[q] * layer.tangent[q] * error.powi(2);
    }
    ROUNDING * sum[0]
}

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
    /// Return the requests from outside, as `exchange::ASKS` bits whose meaning is the caller's own; called once an iterate. The
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

/// The step that led to an iterate of sweeps.
#[derive(Debug, Clone)]
pub(super) struct LastSweep {
    /// The sweep before the step.
    pub sweep: Sweep,
    /// gamma, if the step was taken along the sweep's correction.
    pub relaxed: Option<f64>,
    /// Length of the step along its direction.
    pub length: f64,
    /// Change of the traces, 2n.
    pub moved: Vec<f64>,
}

/// The memory of a run.
///
/// It is of iterates besides the last one, and decides when the run ends and how its next steps are taken, not what the
/// solution is. So a run that goes on from a file begins without it.
#[derive(Debug, Clone)]
pub struct Memory {
    pub(super) cycle: Cycle,
    pub(super) stagnation: Stagnation,
    /// Pressures of earlier sweeps.
    pub(super) steady: Steady,
    /// Steps of Newton's method.
    pub(super) progress: Progress,
    /// Layer states of the next step of Newton's method, if the run paused.
    pub(super) states: Option<Layer>,
    /// Counters of sweeps.
    pub(super) sweeper: Sweeper,
    /// The last step of sweeps.
    pub(super) last: Option<LastSweep>,
    /// The sweep at the last iterate, if the run paused.
    pub(super) sweep: Option<Sweep>,
    /// Sweeps of this run that another process made.
    pub(super) earlier: usize,
    /// Sweeps that the solver of linear steps had made before this run began.
    pub(super) foreign: usize,
}

impl Memory {
    /// Return the memory of a run that begins with this watch for stagnation, by a solver that had made `foreign` sweeps before.
    pub(super) fn new(stagnation: Stagnation, foreign: usize) -> Self {
        Self {
            cycle: Cycle::default(),
            stagnation,
            steady: Steady::default(),
            progress: Progress::default(),
            states: None,
            sweeper: Sweeper::default(),
            last: None,
            sweep: None,
            earlier: 0,
            foreign,
        }
    }
}
