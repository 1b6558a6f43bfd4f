//! The outer loop (41)-(42).

use super::field::Field;
use super::held;
use super::layer::Layer;
use super::lift::lift;
use super::method::{Here, Method, Step};
use super::model::Model;
use super::progress::{Observer, Row};
use super::robin::{Robin, RobinRule};
use super::stop::{Cycle, Floor, Reference, StopRule, relative_increment};
use super::sweep::{Sweep, Sweeper};
use super::zone::RobinZone;
use crate::error::Result;
use std::time::Instant;

/// What the method needs to know besides the model.
pub struct Settings {
    /// Robin zone psi.
    pub zone: RobinZone,
    /// Robin coefficient on it.
    pub robin: RobinRule,
    /// How steps are made: the first method, and those to change to when progress stops.
    pub methods: Vec<Box<dyn Method>>,
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
    /// F1 falls for ever: loads push a body where neither a support nor a contact stops it.
    Unbounded,
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
    pub iterate: Field,
    /// The layers at that iterate.
    pub layer: Layer,
    /// History, one row an iterate.
    pub rows: Vec<Row>,
    /// Name of the method that made the last step.
    pub method: &'static str,
    /// Factorisations beyond those of the sweeps (a Newton matrix of all bodies).
    pub coupled_factorizations: usize,
    /// Estimated bounds of the spectrum of G^-1 F1'', if the method saw enough.
    pub spectrum: Option<(f64, f64)>,
}

/// Runs the iteration: residual, stop, step and update of equations (41)-(42), until a rule ends it.
///
/// # Errors
/// Failures of the solver library. Not converging is a [`Status`].
pub fn solve(model: &mut Model, settings: &mut Settings, observer: &mut dyn Observer) -> Result<Outcome> {
    let clock = Instant::now();
    let (mut iterate, failed) = lift(model, &settings.start)?;
    let mut early = failed.map(|(body, reason)| Status::InnerSolver { body, reason });
    let mut robin = Robin::new(settings.robin.clone());
    let mut watch = Watch::default();
    let mut sweeper = Sweeper::default();
    let mut last: Option<Last> = None;
    let mut rows: Vec<Row> = Vec::new();
    let mut active = 0;
    let (status, layer) = loop {
        let k = rows.len();
        let layer = Layer::at(model, &iterate.trace);
        let weight = robin.weight(model, &settings.zone, &layer, k);
        if early.is_none() {
            early = held::unheld(model, &weight).map(|free| Status::Unheld { body: free.body, motion: free.name });
        }
        if let Some(status) = early {
            break (status, layer);
        }
        model.robin(&weight)?;
        let relaxed = last.as_ref().and_then(|last| Some((&last.sweep, last.gamma?)));
        let sweep = sweeper.sweep(model, &iterate, &layer, &weight, relaxed)?;
        let method = &mut settings.methods[active];
        let mut row = watch.measure(model, &iterate, &layer, &sweep, last.as_ref());
        (row.iteration, row.sweeps, row.seconds) = (k, sweeper.sweeps, clock.elapsed().as_secs_f64());
        row.factorizations += method.factorizations();
        row.error = row.residual * method.amplification().sqrt();
        let steady = last.as_ref().is_none_or(|last| is_steady(&last.pressure, &layer.pressure, &settings.stop));
        let judged = watch.judge(
            model,
            &settings.stop,
            &row,
            &iterate,
            &layer,
            &sweep,
            steady,
            imbalance(model, &iterate, &layer, &weight, &sweep),
        );
        observer.row(&row);
        let residual = row.residual;
        rows.push(row);
        match judged {
            Verdict::End(status) => break (status, layer),
            Verdict::Stalled if active + 1 < settings.methods.len() => {
                active += 1;
                observer.note(&format!("iteration {k}: no progress, {} takes over", settings.methods[active].name()));
            }
            Verdict::Stalled | Verdict::Go => {}
        }
        let target = settings.stop.residual.unwrap_or(0.0);
        let mut here =
            Here { model, sweeper: &mut sweeper, k, layer: &layer, weight: &weight, sweep: &sweep, residual, target };
        let step = settings.methods[active].step(&mut here)?;
        last = match step {
            Step::Unbounded => break (Status::Unbounded, layer),
            Step::Sweep(gamma) => {
                iterate.add(gamma, &sweep.correction);
                let moved = sweep.correction.trace.iter().map(|t| gamma * t).collect();
                Some(Last { sweep, gamma: Some(gamma), length: gamma, moved, pressure: layer.pressure.clone() })
            }
            Step::Along(direction, length) => {
                iterate.add(length, &direction);
                let moved = direction.trace.iter().map(|t| length * t).collect();
                Some(Last { sweep, gamma: None, length, moved, pressure: layer.pressure.clone() })
            }
        };
    };
    let method = &settings.methods[active];
    Ok(Outcome {
        status,
        iterations: last.map_or(0, |_| rows.len().saturating_sub(1)),
        sweeps: sweeper.sweeps,
        solves_skipped: sweeper.solves_skipped,
        iterate,
        layer,
        rows,
        method: method.name(),
        coupled_factorizations: settings.methods.iter().map(|method| method.factorizations()).sum(),
        spectrum: method.spectrum(),
    })
}

/// The step that led to an iterate.
struct Last {
    sweep: Sweep,
    /// gamma, if it went along the sweep's correction.
    gamma: Option<f64>,
    length: f64,
    /// Change of the traces.
    moved: Vec<f64>,
    /// Pressures before it.
    pressure: Vec<f64>,
}

/// What is to be done after an iterate was measured.
enum Verdict {
    End(Status),
    Stalled,
    Go,
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
    fn measure(&mut self, model: &Model, iterate: &Field, layer: &Layer, sweep: &Sweep, last: Option<&Last>) -> Row {
        let strain: f64 = sweep.energy.iter().map(|e| e.strain).sum();
        let potential: f64 = sweep.energy.iter().map(|e| e.potential).sum();
        let decrement: f64 = sweep.decrement.iter().sum();
        let increments: Vec<f64> = (0..model.bodies.len())
            .map(|body| match last {
                None => f64::NAN,
                Some(last) => {
                    relative_increment(&model.of_body(body, &last.moved), &model.of_body(body, &iterate.trace))
                }
            })
            .collect();
        Row {
            residual: self.reference.relative(decrement, strain + layer.work, strain),
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
    fn judge(
        &mut self,
        model: &Model,
        stop: &StopRule,
        row: &Row,
        iterate: &Field,
        layer: &Layer,
        sweep: &Sweep,
        steady: bool,
        imbalance: f64,
    ) -> Verdict {
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
        let balanced = stop.residual.is_none_or(|tolerance| imbalance <= 10.0 * tolerance);
        if met && steady && balanced {
            return Verdict::End(Status::Converged);
        }
        let closed = layer.compression.iter().map(|&c| c > 0.0);
        if let Some(period) = self.cycle.period(&iterate.trace, closed, row.residual) {
            return Verdict::End(Status::Cycle { period });
        }
        let stalled = self.floor.is_suspected(row.residual);
        if stalled && met && imbalance <= UNBALANCED {
            return Verdict::End(Status::Attainable);
        }
        if stalled && imbalance <= UNBALANCED && row.residual <= BELIEVABLE && is_rounding(model, iterate, layer, sweep)
        {
            return Verdict::End(Status::Attainable);
        }
        if row.iteration >= stop.iterations {
            return Verdict::End(Status::IterationLimit);
        }
        if stalled { Verdict::Stalled } else { Verdict::Go }
    }
}

/// Whether the last step changed no pressure by more than ten times the residual that is asked for, relative to the largest.
/// The residual is one of energies: where a layer is stiff, or hardly holds a body, it sees too little of the pressure.
fn is_steady(before: &[f64], now: &[f64], stop: &StopRule) -> bool {
    let Some(tolerance) = stop.residual else { return true };
    let peak = now.iter().copied().fold(0.0, f64::max);
    before.iter().zip(now).all(|(before, now)| (now - before).abs() <= 10.0 * tolerance * peak)
}

/// Largest share of its contact forces that a body may lack in balance where rounding allows no less.
const UNBALANCED: f64 = 1e-3;

/// What the forces on a body lack in balance, as a share of those of its contacts, the most over all rigid motions that
/// supports leave free.
///
/// For such a motion m, K m = 0, so that m'r = m'G z = sum weight m z on the contact rows. The residual sees too little of
/// this where a Robin term much stiffer than the layer holds the body.
fn imbalance(model: &Model, iterate: &Field, layer: &Layer, weight: &[f64], sweep: &Sweep) -> f64 {
    let mut most = 0.0f64;
    for (index, slot) in model.bodies.iter().enumerate() {
        let (weight, z) = (model.of_body(index, weight), model.of_body(index, &sweep.correction.trace));
        let (force, u) = (model.at_rows(index, &layer.force), model.of_body(index, &iterate.trace));
        let size = u.iter().fold(0.0f64, |max, u| max.max(u.abs()));
        // K u is rounded entry by entry, and a motion sums over all of them
        let rounding = 10.0 * f64::EPSILON * slot.scale * size;
        for motion in &slot.motions {
            let lacking: f64 = (0..z.len()).map(|q| weight[q] * motion.trace[q] * z[q]).sum();
            let acting: f64 = (0..z.len()).map(|q| force[q] * motion.trace[q].abs()).sum();
            if lacking.abs() > rounding {
                most = most.max(lacking.abs() / acting);
            }
        }
    }
    most
}

/// Largest residual that can be called rounding: iterates that are far from any solution can have large rounding errors, too.
const BELIEVABLE: f64 = 1e-4;

/// Whether the residual is no larger than what rounding alone can make.
fn is_rounding(model: &Model, iterate: &Field, layer: &Layer, sweep: &Sweep) -> bool {
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
