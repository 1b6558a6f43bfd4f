//! The outer loop (41)-(42).

use super::gamma::GammaRule;
use super::held;
use super::layer::Layer;
use super::lift::lift;
use super::model::Model;
use super::progress::{Observer, Row};
use super::stop::{Cycle, Floor, Reference, StopRule, relative_increment};
use super::sweep::{Iterate, Sweep, Sweeper};
use super::zone::RobinZone;
use crate::error::Result;
use std::time::Instant;

/// What the method needs to know besides the model.
pub struct Settings {
    /// Robin zone psi.
    pub zone: RobinZone,
    /// Relaxation.
    pub gamma: Box<dyn GammaRule>,
    /// When to stop.
    pub stop: StopRule,
    /// Start: outer normal displacement of all contact rows (layout of a trace vector).
    pub start: Vec<f64>,
}

/// How a run ended.
#[derive(Debug, Clone, PartialEq)]
pub enum Status {
    /// A stopping rule was met.
    Converged,
    /// The residual cannot fall further in this arithmetic.
    Attainable,
    /// The limit of iterations was reached.
    IterationLimit,
    /// A number that is not finite came up in a body.
    NotFinite {
        /// The first such body.
        body: usize,
    },
    /// The iterates repeat.
    Cycle {
        /// Updates after which they come back.
        period: usize,
    },
    /// Neither supports nor the Robin term hold a body.
    Unheld {
        /// The body.
        body: usize,
        /// Name of its free rigid motion.
        motion: String,
    },
    /// A body's inner solver failed.
    InnerSolver {
        /// The body.
        body: usize,
        /// The solver's own words; empty if another rank has them.
        reason: String,
    },
}

/// Result of a run: the last iterate that made sense, and how it came about.
pub struct Outcome {
    /// How it ended.
    pub status: Status,
    /// Updates made.
    pub iterations: usize,
    /// Sweeps made.
    pub sweeps: usize,
    /// Solves of a body that were not needed.
    pub solves_skipped: usize,
    /// The last iterate.
    pub iterate: Iterate,
    /// The layers at that iterate.
    pub layer: Layer,
    /// History, one row an iterate.
    pub rows: Vec<Row>,
}

/// Runs the iteration: residual, stop, relaxation and update of equations (41)-(42), until a rule ends it.
///
/// # Errors
/// Failures of the solver library. Not converging is a [`Status`].
pub fn solve(model: &mut Model, settings: &mut Settings, observer: &mut dyn Observer) -> Result<Outcome> {
    let clock = Instant::now();
    let (mut iterate, failed) = lift(model, &settings.start)?;
    let mut early = failed.map(|(body, reason)| Status::InnerSolver { body, reason });
    let mut watch = Watch::default();
    let mut sweeper = Sweeper::default();
    let mut last: Option<(Sweep, f64)> = None;
    let mut rows: Vec<Row> = Vec::new();
    for k in 0.. {
        let layer = Layer::at(model, &iterate.trace);
        let weight = settings.zone.robin_weight(model, &layer, k);
        if early.is_none() {
            early = held::unheld(model, &weight).map(|(body, motion)| Status::Unheld { body, motion });
        }
        if let Some(status) = early {
            return Ok(end(status, k, &sweeper, iterate, layer, rows));
        }
        model.robin(&weight)?;
        let step = last.as_ref().map(|(sweep, gamma)| (sweep, *gamma));
        let sweep = sweeper.sweep(model, &iterate, &layer, &weight, step)?;
        let mut row = watch.measure(model, &iterate, &layer, &sweep, step);
        (row.iteration, row.sweeps, row.seconds) = (k, sweeper.sweeps, clock.elapsed().as_secs_f64());
        let status = watch.judge(model, &settings.stop, &row, &iterate, &layer, &sweep);
        observer.row(&row);
        rows.push(row);
        if let Some(status) = status {
            return Ok(end(status, k, &sweeper, iterate, layer, rows));
        }
        let gamma = settings.gamma.gamma(k, &sweep);
        iterate.advance(gamma, &sweep);
        last = Some((sweep, gamma));
    }
    unreachable!("the loop ends by a status")
}

fn end(
    status: Status,
    iterations: usize,
    sweeper: &Sweeper,
    iterate: Iterate,
    layer: Layer,
    rows: Vec<Row>,
) -> Outcome {
    let (sweeps, solves_skipped) = (sweeper.sweeps, sweeper.solves_skipped);
    Outcome { status, iterations, sweeps, solves_skipped, iterate, layer, rows }
}

/// Measures each iterate and decides whether to go on.
#[derive(Default)]
struct Watch {
    reference: Reference,
    floor: Floor,
    cycle: Cycle,
}

impl Watch {
    /// The row of an iterate: residual and F1 from the sweep at it, increments from the `step` that led to it.
    fn measure(
        &mut self,
        model: &Model,
        iterate: &Iterate,
        layer: &Layer,
        sweep: &Sweep,
        step: Option<(&Sweep, f64)>,
    ) -> Row {
        let strain: f64 = sweep.energy.iter().map(|e| e.strain).sum();
        let potential: f64 = sweep.energy.iter().map(|e| e.potential).sum();
        let decrement: f64 = sweep.decrement.iter().sum();
        let increments: Vec<f64> = (0..model.bodies.len())
            .map(|body| match step {
                None => f64::NAN,
                Some((last, gamma)) => {
                    let step: Vec<f64> = model.of_body(body, &last.trace).iter().map(|t| gamma * t).collect();
                    relative_increment(&step, &model.of_body(body, &iterate.trace))
                }
            })
            .collect();
        Row {
            residual: self.reference.relative(decrement, strain + layer.work),
            increment: increments.iter().copied().fold(f64::NAN, f64::max),
            increments,
            gamma: step.map_or(f64::NAN, |(_, gamma)| gamma),
            energy: potential + layer.energy.iter().sum::<f64>(),
            closed: layer.closed,
            points: model.points(),
            factorizations: sweep.factorizations,
            inner_iterations: sweep.inner_iterations,
            ..Row::default()
        }
    }

    /// The status that ends the run at this iterate, if one does.
    fn judge(
        &mut self,
        model: &Model,
        stop: &StopRule,
        row: &Row,
        iterate: &Iterate,
        layer: &Layer,
        sweep: &Sweep,
    ) -> Option<Status> {
        let broken = |body: &usize| {
            let finite = |value: f64| value.is_finite();
            let trace_is_finite = model.trace_ranges(*body).flatten().all(|i| finite(sweep.trace[i]));
            !(finite(sweep.decrement[*body]) && finite(sweep.energy[*body].potential) && trace_is_finite)
        };
        if let Some(body) = (0..model.bodies.len()).find(broken) {
            return Some(Status::NotFinite { body });
        }
        if let Some((body, reason)) = &sweep.failed {
            return Some(Status::InnerSolver { body: *body, reason: reason.clone() });
        }
        if stop.is_met(row.residual, row.increment) {
            return Some(Status::Converged);
        }
        if let Some(period) = self.cycle.period(&iterate.trace) {
            return Some(Status::Cycle { period });
        }
        if self.floor.is_suspected(row.residual) && is_rounding(model, iterate, layer, sweep) {
            return Some(Status::Attainable);
        }
        (row.iteration >= stop.iterations).then_some(Status::IterationLimit)
    }
}

/// Whether the residual is no larger than what rounding alone can make.
fn is_rounding(model: &Model, iterate: &Iterate, layer: &Layer, sweep: &Sweep) -> bool {
    let mut floor = [0.0];
    for (index, slot) in model.bodies.iter().enumerate() {
        if let Some(body) = &slot.local {
            floor[0] += body.rounding(&iterate.states[index], &model.at_rows(index, &layer.force));
        }
    }
    model.exchange.sum(&mut floor);
    // the estimate counts each row's worst case once; smooth errors weigh more in G^-1
    sweep.decrement.iter().sum::<f64>() <= 1e4 * floor[0]
}
