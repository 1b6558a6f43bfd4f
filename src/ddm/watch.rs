//! Watches an iteration: measures each iterate, and decides whether it is good enough, hopeless, or to be improved.

use super::field::Field;
use super::iterate::Status;
use super::layer::Layer;
use super::model::Model;
use super::progress::Row;
use super::scale::Scale;
use super::steady::{Steady, most_apart};
use super::stop::{Cycle, Floor, relative_increment};
use super::sweep::Sweep;
use crate::problem::stop::StopRule;

/// The step that led to an iterate.
pub(super) struct Last {
    /// The sweep before it.
    pub sweep: Sweep,
    /// Whether it went along the sweep's correction.
    pub relaxed: bool,
    /// How far it went along its direction.
    pub length: f64,
    /// Share of the error that it left, as far as the method can tell.
    pub left: f64,
    /// Change of the traces.
    pub moved: Vec<f64>,
    /// Pressures before it.
    pub pressure: Vec<f64>,
}

/// An iterate and all that is known of it.
pub(super) struct Seen<'a> {
    pub model: &'a Model,
    pub iterate: &'a Field,
    /// Traces that the iterate's are relative to; empty for none.
    pub origin: &'a [f64],
    pub layer: &'a Layer,
    pub sweep: &'a Sweep,
    /// The step that led here.
    pub last: Option<&'a Last>,
}

/// What is to be done after an iterate was measured.
pub(super) enum Verdict {
    /// The run ends.
    End(Status),
    /// It goes on, but another method may do better.
    Stalled,
    /// It goes on.
    Go,
}

/// Measures each iterate and decides whether to go on.
#[derive(Default)]
pub(super) struct Watch {
    scale: Scale,
    floor: Floor,
    cycle: Cycle,
    steady: Steady,
}

impl Watch {
    /// With the scales of rest.
    pub fn new(scale: Scale) -> Self {
        Self { scale, ..Self::default() }
    }

    /// The row of an iterate: residual and F1 from the sweep at it, increments from the `step` that led to it.
    pub fn measure(&mut self, seen: &Seen) -> Row {
        let Seen { model, iterate, origin, layer, sweep, last } = *seen;
        let strain: f64 = sweep.energy.iter().map(|e| e.strain).sum();
        let potential: f64 = sweep.energy.iter().map(|e| e.potential).sum();
        let decrement: f64 = sweep.decrement.iter().sum();
        self.scale.learn(model, layer, strain);
        let mut trace = iterate.trace.clone();
        trace.iter_mut().zip(origin).for_each(|(trace, origin)| *trace += origin);
        let increments: Vec<f64> = (0..model.bodies.len())
            .map(|body| match last {
                None => f64::NAN,
                Some(last) => relative_increment(&model.of_body(body, &last.moved), &model.of_body(body, &trace)),
            })
            .collect();
        Row {
            residual: self.scale.relative(decrement, strain + layer.work),
            increment: increments.iter().copied().fold(f64::NAN, f64::max),
            increments,
            gamma: last.map_or(f64::NAN, |last| last.length),
            energy: potential + layer.energy.iter().sum::<f64>(),
            closed: layer.closed,
            points: model.points(),
            factorizations: sweep.factorizations,
            inner_iterations: sweep.inner_iterations,
            ..Row::default()
        }
    }

    /// Whether the run ends at this iterate, and how.
    pub fn judge(&mut self, seen: &Seen, stop: &StopRule, row: &Row) -> Verdict {
        let Seen { model, iterate, layer, sweep, last, .. } = *seen;
        let broken = |body: &usize| {
            let finite = |value: f64| value.is_finite();
            let trace_is_finite = model.trace_ranges(*body).flatten().all(|i| finite(sweep.correction.trace[i]));
            !(finite(sweep.decrement[*body]) && finite(sweep.energy[*body].potential) && trace_is_finite)
        };
        if let Some(body) = (0..model.bodies.len()).find(broken) {
            return Verdict::End(Status::NotFinite { body });
        }
        if let Some((body, reason)) = &sweep.failed {
            return Verdict::End(Status::InnerSolver { body: *body, reason: reason.clone() });
        }
        let met = stop.is_met(row.residual, row.increment);
        let steady = stop.residual.is_none_or(|tolerance| {
            let moved = last.map_or(0.0, |last| last.left * most_apart(&last.pressure, &layer.pressure));
            let peak = self.scale.peak(&layer.pressure);
            let missing = self.steady.missing(row.residual, &layer.pressure, peak);
            moved <= MOVED * tolerance * peak && missing <= tolerance * peak
        });
        let imbalance = self.scale.imbalance(model, layer);
        let balanced = stop.residual.is_none_or(|tolerance| imbalance <= 10.0 * tolerance);
        if met && steady && balanced {
            return Verdict::End(Status::Converged);
        }
        self.steady.note(row.residual, &layer.pressure);
        let closed = layer.compression.iter().map(|&c| c > 0.0);
        if let Some(period) = self.cycle.period(&iterate.trace, closed, row.residual, row.energy) {
            return Verdict::End(Status::Cycle { period });
        }
        let stalled = self.floor.is_suspected(row.residual);
        if stalled && imbalance <= UNBALANCED && row.residual <= BELIEVABLE && is_rounding(seen) {
            return Verdict::End(Status::Attainable);
        }
        if row.iteration >= stop.iterations {
            return Verdict::End(Status::IterationLimit);
        }
        if stalled { Verdict::Stalled } else { Verdict::Go }
    }
}

/// How far the last step may have moved a pressure, relative to the largest, in units of the residual that is asked for.
const MOVED: f64 = 3.0;

/// Largest share of its contact forces that a body may lack in balance where rounding allows no less.
const UNBALANCED: f64 = 1e-3;

/// Largest residual that can be called rounding: iterates that are far from any solution can have large rounding errors, too.
const BELIEVABLE: f64 = 1e-4;

/// Whether the residual is no larger than what rounding alone can make: of K u, of forces, and of compressions, which a stiff
/// layer answers with forces of its own.
fn is_rounding(seen: &Seen) -> bool {
    let Seen { model, iterate, layer, sweep, .. } = *seen;
    let mut floor = [0.0];
    let points = model.points();
    for (index, slot) in model.bodies.iter().enumerate() {
        if let Some(body) = &slot.local {
            floor[0] += body.rounding(&iterate.states[index], &model.at_rows(index, &layer.force));
        }
    }
    model.exchange.sum(&mut floor);
    // a force omega kappa e at a point is resisted by springs omega kappa at least
    for q in 0..points {
        let terms = iterate.trace[q].abs() + iterate.trace[points + q].abs() + model.gap[q].abs();
        floor[0] += model.weight[q] * layer.tangent[q] * (f64::EPSILON * terms).powi(2);
    }
    // the estimate counts each row's worst case once; smooth errors weigh more in G^-1
    sweep.decrement.iter().sum::<f64>() <= 1e3 * floor[0]
}
