//! The outer loop (41)-(42).

use super::balance::{Balance, Discretisation};
use super::body::BodyCounts;
use super::closing::rigid_closing;
use super::field::Field;
use super::forecast::Forecast;
use super::held::{self, FreeMotion};
use super::interval::{Interval, interval};
use super::layer::Layer;
use super::lift::{lift, move_rigidly};
use super::measure::{At, Measuring};
use super::method::{FINE, Here, Method, Step};
use super::model::{Adrift, Model};
use super::origin::Origin;
use super::progress::{Observer, Row};
use super::robin::Robin;
use super::scale::Scale;
use super::watch::{Last, Verdict};
use crate::error::Result;
use crate::problem::robin::{RobinRule, Zone};
use crate::problem::stop::StopRule;
use std::time::Instant;

/// What the method needs to know besides the model.
pub struct Settings {
    /// Robin zone psi.
    pub zone: Zone,
    /// Robin coefficient on it.
    pub robin: RobinRule,
    /// How steps are made: the first method, and those to change to when progress stops.
    pub methods: Vec<Box<dyn Method>>,
    /// When to stop.
    pub stop: StopRule,
    /// Whether to find the interval (33) of gamma at the end, which takes some sweeps.
    pub interval: bool,
    /// Who knows the error of the discretisation, if the run is to stop where more would be in vain.
    pub balance: Option<Box<dyn Discretisation>>,
    /// A displacement to start from as it is, once, in place of a start.
    pub resume: Option<Field>,
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
    /// Loads move several bodies together in a way that changes no gap and that nothing holds.
    Adrift(Adrift),
    /// F1 falls for ever: loads push bodies where neither a support nor a contact stops them.
    Unbounded {
        /// The bodies and their motions, where they are known.
        moving: Vec<FreeMotion>,
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
    pub iterate: Field,
    /// The layers at that iterate.
    pub layer: Layer,
    /// The Robin term omega psi kappa that the model carries, for each contact row.
    pub weight: Vec<f64>,
    /// History, one row an iterate.
    pub rows: Vec<Row>,
    /// Name of the method that made the last step.
    pub method: &'static str,
    /// What was done with all bodies together (their Newton matrix), for each method.
    pub coupled: Vec<BodyCounts>,
    /// Estimated bounds of the spectrum of G^-1 F1'', if the method saw enough.
    pub spectrum: Option<(f64, f64)>,
    /// What it would still need to the residual that is asked for, where that can be told.
    pub forecast: Option<Forecast>,
    /// The interval (33) of gamma, if it was asked for and can be told.
    pub interval: Option<Interval>,
}

/// Why no method can find a solution: a motion that nothing can hold, or loads that push a body off for ever.
fn hopeless(model: &Model) -> Option<Status> {
    let all: Vec<Vec<f64>> = model.bodies.iter().map(|slot| slot.row_stiffness.clone()).collect();
    let mut springs = vec![0.0; 2 * model.points()];
    all.iter().enumerate().for_each(|(body, rows)| model.put(body, rows, &mut springs));
    if let Some(free) = held::unheld(model, &springs) {
        return Some(Status::Unheld { body: free.body, motion: free.name });
    }
    if let Some(adrift) = &model.adrift {
        return Some(Status::Adrift(adrift.clone()));
    }
    rigid_closing(model).err().map(|moving| Status::Unbounded { moving })
}

/// Residual at which bodies are about where they will stay: the origin of displacements is taken anew there, so that what is
/// rounded with it does not depend on the start.
const SETTLED: f64 = 1e-4;

/// Runs the iteration: residual, stop, step and update of equations (41)-(42), until a rule ends it.
///
/// # Errors
/// Failures of the solver library. Not converging is a [`Status`].
pub fn solve(model: &mut Model, settings: &mut Settings, observer: &mut dyn Observer) -> Result<Outcome> {
    let clock = Instant::now();
    let mut early = hopeless(model);
    let scale = Scale::at_rest(model);
    let mut iterate = Field::rest(model);
    if let Some(field) = settings.resume.take() {
        iterate = field;
    } else if early.is_none() {
        let start = if settings.methods[0].is_joint() { move_rigidly } else { lift };
        let (lifted, failed) = start(model, &settings.start)?;
        iterate = lifted;
        early = failed.map(|(body, reason)| Status::InnerSolver { body, reason });
    }
    // an estimate of the discretisation's error needs the iterates whole
    let floats = model.bodies.iter().any(|slot| !slot.motions.is_empty());
    let mut origin = (floats && settings.balance.is_none()).then(|| Origin::take(model, &mut iterate));
    let mut measuring = Measuring::new(clock, Robin::new(settings.robin), scale);
    let mut last: Option<Last> = None;
    let mut rows: Vec<Row> = Vec::new();
    let mut balance = settings.balance.take().map(Balance::new);
    let (mut active, mut updates, mut settled) = (0, 0, false);
    let mut before: Option<Vec<f64>> = None;
    let (status, layer, weight) = loop {
        let k = updates;
        let layer = Layer::at(model, &iterate.trace);
        let old = before.take().filter(|_| settings.methods[active].is_joint());
        let mut weight = measuring.weight(model, settings, &layer, k, old);
        if early.is_none() {
            early = held::unheld(model, &weight).map(|free| Status::Unheld { body: free.body, motion: free.name });
        }
        if let Some(status) = early {
            break (status, layer, weight);
        }
        let at = At { k, iterate: &iterate, layer: &layer, origin: origin.as_ref(), last: last.as_ref() };
        let method = &*settings.methods[active];
        let (sweep, row, verdict) = measuring.measure(model, settings, method, &at, &mut weight)?;
        observer.row(&row);
        let (residual, error) = (row.residual, row.error);
        rows.push(row);
        match verdict {
            Verdict::End(status) => break (status, layer, weight),
            Verdict::Stalled if settings.methods.len() > 1 => {
                active = (active + 1) % settings.methods.len();
                observer.note(&format!("iteration {k}: no progress, {} takes over", settings.methods[active].name()));
            }
            Verdict::Stalled | Verdict::Go => {}
        }
        if let Some(balance) = &mut balance
            && balance.is_met(model, &iterate, &layer, &weight, error)?
        {
            break (Status::Converged, layer, weight);
        }
        let target = settings.stop.residual.unwrap_or(0.0);
        let sweeper = &mut measuring.sweeper;
        let mut here = Here { model, sweeper, k, layer: &layer, weight: &weight, sweep: &sweep, residual, target };
        let step = settings.methods[active].step(&mut here)?;
        let (direction, length, relaxed) = match step {
            Step::Unbounded => break (Status::Unbounded { moving: Vec::new() }, layer, weight),
            Step::Sweep(gamma) => (None, gamma, true),
            Step::Along(direction, length) => (Some(direction), length, false),
        };
        let direction = direction.as_ref().unwrap_or(&sweep.correction);
        iterate.add(length, direction);
        updates += 1;
        let moved = direction.trace.iter().map(|t| length * t).collect();
        if settings.methods[active].is_joint() {
            iterate.retrace(model);
        }
        let settles = !settled && residual <= SETTLED;
        settled |= settles;
        if origin.as_ref().is_some_and(|origin| settles || origin.is_far_from(&iterate)) {
            origin = origin.map(|origin| {
                origin.give(model, &mut iterate);
                Origin::take(model, &mut iterate)
            });
        }
        before = Some(weight);
        let left = settings.methods[active].left();
        last = Some(Last { sweep, relaxed, length, left, moved, pressure: layer.pressure });
    };
    model.precision(FINE)?;
    settings.methods[active].conclude(model, &layer, &weight);
    let solved = matches!(status, Status::Converged | Status::Attainable);
    let interval = match (&rows[..], settings.interval && solved) {
        ([first, .., last], true) => interval(model, &layer, &weight, first.energy - last.energy)?,
        _ => None,
    };
    if let Some(origin) = origin {
        origin.give(model, &mut iterate);
    }
    let method = &settings.methods[active];
    let forecast = settings.stop.residual.and_then(|target| Forecast::new(&rows, target, method.factor()));
    Ok(Outcome {
        status,
        iterations: updates,
        sweeps: measuring.sweeper.sweeps,
        solves_skipped: measuring.sweeper.solves_skipped,
        iterate,
        layer,
        weight,
        rows,
        method: method.name(),
        coupled: settings.methods.iter().map(|method| method.coupled()).collect(),
        spectrum: method.spectrum(),
        forecast,
        interval,
    })
}
