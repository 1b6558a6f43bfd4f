//! A run from its start to its end, by either loop.

use super::acceleration::Acceleration;
use super::balance::{Balance, Discretisation};
use super::bound::{OffLaws, Reached};
use super::digits::ROUNDING;
use super::forecast::Forecast;
use super::history::{Observer, Row};
use super::linear::resisting;
use super::memory::Memory;
use super::origin::Origin;
use super::run::{End, Run, rounding};
use super::scale::Scale;
use super::start::{self, RigidStart};
use super::stop::{Floor, Status};
use super::{digits, newton, robin};
use crate::error::Result;
use crate::model::Model;
use crate::model::body::BodyCounts;
use crate::model::field::Field;
use crate::model::layer::Layer;
use crate::model::linear::LinearStep;
use crate::model::surface::{meeting_slopes, surface_slopes};
use crate::problem::stop::StopRule;
use crate::robin::coefficient::{Coefficient, underconstrained};
use crate::robin::extend::extend;
use crate::robin::interval::{Interval, interval};
use std::time::Instant;

/// How iterates are made.
pub enum Method {
    /// Newton's method, with a way to solve its linear steps.
    Newton(Box<dyn LinearStep>),
    /// Sweeps: the paper's iteration, or a faster one over the same sweep.
    Sweeps {
        /// How the next iterate is made from a sweep.
        acceleration: Box<dyn Acceleration>,
        /// The Robin term.
        coefficient: Coefficient,
        /// Solves for the response of the bodies, for estimates of the mesh's error.
        linear: Box<dyn LinearStep>,
    },
}

impl Method {
    /// Name, as in the scene and the table.
    pub fn name(&self) -> &'static str {
        match self {
            Method::Newton(linear) => linear.name(),
            Method::Sweeps { acceleration, .. } => acceleration.name(),
        }
    }

    /// What solves linear steps.
    pub fn linear(&mut self) -> &mut dyn LinearStep {
        match self {
            Method::Newton(linear) | Method::Sweeps { linear, .. } => &mut **linear,
        }
    }
}

/// Where a run begins.
#[derive(Debug, Clone, Default)]
pub enum Start {
    /// Rigid bodies on their own surfaces.
    #[default]
    Automatic,
    /// The same, already found for these loads.
    Found(Box<RigidStart>),
    /// Outer normal displacement of all contact rows (2n, layout of a trace vector).
    Trace(Vec<f64>),
    /// Contact pressures (n), from another mesh say, for Newton's method; sweeps begin automatically.
    Pressure(Vec<f64>),
    /// A displacement as it is.
    Resume(Field),
    /// Where another run paused.
    Continue(Box<State>),
}

/// What a run goes on from.
#[derive(Debug, Clone)]
pub struct State {
    /// Displacements. If the states of a body are not those that its solver works with, its traces count.
    pub field: Field,
    /// Compressions of the layers' states, n.
    pub compression: Vec<f64>,
    /// Energy per area by which their laws are smoothed, n; empty for the laws themselves.
    pub smoothing: Vec<f64>,
    /// History up to there.
    pub rows: Vec<Row>,
    /// What the run remembers; none if it comes from a file.
    pub memory: Option<Memory>,
}

impl From<Option<Vec<f64>>> for Start {
    /// A trace, or none.
    fn from(trace: Option<Vec<f64>>) -> Self {
        trace.map_or(Start::Automatic, Start::Trace)
    }
}

/// What a run needs to know besides the model and the method.
pub struct Settings {
    /// When to stop.
    pub stop: StopRule,
    /// Whether to find the interval (33) of gamma at the end, which takes some sweeps.
    pub interval: bool,
    /// Who knows the error of the discretisation, if the run is to stop where more would change nothing.
    pub balance: Option<Box<dyn Discretisation>>,
    /// Where to begin.
    pub start: Start,
}

/// Result of a run: the last iterate that made sense, and how it came about.
#[derive(Clone)]
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
    /// How far these are from the laws at its compressions.
    off: OffLaws,
    scale: Scale,
    /// What rounding can make of it, a squared energy norm.
    floor: f64,
    /// History, one row an iterate.
    pub rows: Vec<Row>,
    /// What it remembers besides.
    pub memory: Option<Memory>,
    /// Name of the method.
    pub method: &'static str,
    /// What was done with all bodies together, besides what bodies count themselves.
    pub joint: BodyCounts,
    /// What solved it for all bodies together; empty if each had its own solver.
    pub linear_step: String,
    /// Estimated bounds of the spectrum of G^-1 F1'', if the method saw enough.
    pub spectrum: Option<(f64, f64)>,
    /// What rounding of gaps and displacements can make of a pressure, as a share of what errors of pressures are measured by.
    pub rounding: f64,
    /// What it would still need to the residual that is asked for, where that can be told.
    pub forecast: Option<Forecast>,
    /// The interval (33) of gamma, if it was asked for and can be told.
    pub interval: Option<Interval>,
}

/// Runs a method on a model from its start until a rule ends it.
///
/// # Errors
/// Failures of the solver library. Not converging is a [`Status`].
pub fn solve(
    model: &mut Model,
    method: &mut Method,
    settings: &mut Settings,
    observer: &mut dyn Observer,
) -> Result<Outcome> {
    let began = Instant::now();
    let found = match &settings.start {
        Start::Found(rigid) => Ok((**rigid).clone()),
        _ => infeasible(model),
    };
    let (begin, balance) = (std::mem::take(&mut settings.start), settings.balance.take());
    let floor = if let Method::Newton(_) = method { Floor::of_steps() } else { Floor::of_sweeps() };
    let foreign = method.linear().sweeps();
    let mut run = Run {
        model,
        stop: &settings.stop,
        balance: balance.map(Balance::new),
        observer,
        began,
        earlier: 0.0,
        origin: None,
        scale: Scale::default(),
        energy: 0.0,
        strain: 0.0,
        memory: Memory::new(floor, foreign),
        rows: Vec::new(),
    };
    let end = match found {
        Ok(rigid) => run.begin(method, begin, rigid)?,
        Err(status) => {
            let rest = Field::rest(run.model);
            let layer = Layer::at(run.model, &rest.trace);
            run.end(status, rest, layer, method.linear())
        }
    };
    run.conclude(end, method, settings.interval)
}

impl Run<'_> {
    /// Runs from a start.
    fn begin(&mut self, method: &mut Method, begin: Start, rigid: RigidStart) -> Result<End> {
        let mut trace = match &begin {
            Start::Trace(given) => given.clone(),
            _ => rigid.trace.clone(),
        };
        self.scale = Scale::new(self.model, &[&vec![0.0; 2 * self.model.points()], &rigid.trace]);
        let places = places(self.model, &begin, &rigid);
        let floats = self.model.bodies.iter().any(|slot| !slot.motions.is_empty());
        // an estimate of the discretisation's error needs the iterates whole
        if floats && self.balance.is_none() {
            self.origin = Origin::take(self.model, &rigid.amounts);
        }
        let resumed = match begin {
            Start::Resume(field) => Some(field),
            Start::Continue(state) => {
                self.earlier = state.rows.last().map_or(0.0, |row| row.seconds);
                trace.clone_from(&state.field.trace);
                let whole = state.memory.is_some() || fits(self.model, &state.field);
                match state.memory {
                    Some(memory) => self.memory = Memory { states: None, ..memory },
                    None => {
                        self.memory.earlier = state.rows.last().map_or(0, |row| row.sweeps);
                        self.memory.sweeper.sweeps = self.memory.earlier;
                    }
                }
                self.rows = state.rows;
                whole.then_some(state.field)
            }
            _ => None,
        };
        let resumed = resumed.map(|mut field| {
            self.origin.iter().for_each(|origin| origin.take_from(self.model, &mut field));
            field
        });
        match method {
            Method::Newton(linear) => {
                let start = |origin: &mut Origin| std::mem::take(&mut origin.rest);
                let u = resumed.or_else(|| self.origin.as_mut().map(start)).unwrap_or_else(|| Field::rest(self.model));
                newton::iterate(self, &mut **linear, u, places)
            }
            Method::Sweeps { acceleration, coefficient, linear } => {
                if let Some(origin) = &self.origin {
                    crate::linalg::axpy(-1.0, origin.trace(), &mut trace);
                }
                match resumed.map_or_else(|| extend(self.model, &trace), |field| Ok(Ok(field)))? {
                    Ok(u) => robin::iterate(self, &mut **acceleration, coefficient, &mut **linear, u),
                    Err(failure) => {
                        Ok(self.end(Status::InnerSolver(failure), Field::rest(self.model), places, &**linear))
                    }
                }
            }
        }
    }
}

/// Whether a field has the states that the bodies work with: as long, and with its traces to half the digits. Collective.
fn fits(model: &Model, field: &Field) -> bool {
    let local =
        || model.bodies.iter().zip(&field.states).filter_map(|(slot, state)| Some((slot.local.as_ref()?, state)));
    let mut odd = [local().filter(|(body, state)| body.len() != state.len()).count() as f64];
    model.exchange.sum(&mut odd);
    if odd[0] > 0.0 {
        return false;
    }
    let mut traced = field.clone();
    traced.retrace(model);
    let apart = traced.trace.iter().zip(&field.trace).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
    apart <= f64::EPSILON * crate::linalg::dot(&field.trace, &field.trace)
}

/// Springs omega kappa of the first linear step of Newton's method; none if there is no solution. An automatic start becomes the one
/// found.
pub fn first_springs(model: &Model, begin: &mut Start) -> Option<Vec<f64>> {
    let rigid = infeasible(model).ok()?;
    let springs = resisting(model, places(model, begin, &rigid).springs(model));
    if let Start::Automatic = begin {
        *begin = Start::Found(Box::new(rigid));
    }
    Some(springs)
}

/// Why no method can find a solution: a motion that nothing can hold, or loads that push a body off for ever; else the start.
fn infeasible(model: &Model) -> std::result::Result<RigidStart, Status> {
    if let Some(moved) = underconstrained(model, &model.row_stiffness()) {
        return Err(Status::Underconstrained(moved));
    }
    if let Some(mechanism) = &model.mechanism {
        return Err(Status::Mechanism(mechanism.clone()));
    }
    start::find(model, None).map_err(|moving| Status::Unbounded { moving })
}

/// The places from which Newton's method begins.
fn places(model: &Model, begin: &Start, rigid: &RigidStart) -> Layer {
    match begin {
        Start::Automatic | Start::Found(_) => rigid.places.clone(),
        Start::Trace(trace) => match start::find(model, Some(trace)) {
            Ok(rigid) => rigid.places,
            Err(_) => start::at(model, trace),
        },
        Start::Resume(field) => Layer::at(model, &field.trace),
        Start::Continue(state) => {
            let paused = state.memory.as_ref().and_then(|memory| memory.states.clone());
            paused.unwrap_or_else(|| Layer::smoothed(model, state.compression.clone(), &state.smoothing))
        }
        Start::Pressure(pressure) => {
            let mut compression = Vec::with_capacity(pressure.len());
            for (i, pair) in model.pairs.iter().enumerate() {
                compression.extend(model.range(i).map(|q| pair.law.compression(q - model.offset[i], pressure[q])));
            }
            Layer::new(model, compression)
        }
    }
}

/// What rounding can make of a solution, a squared energy norm: as of any iterate, and what contact forces that change by the `digits` of the compressions, n,
/// make of the bodies. Where both bodies of a stiff layer move together, they alone resist.
fn floor(model: &Model, u: &Field, layer: &Layer, digits: &[f64]) -> f64 {
    let (rows, springs) = (model.row_stiffness(), layer.springs(model));
    let forces = rows.iter().enumerate().filter(|(_, stiffness)| **stiffness > 0.0);
    let made = |(row, stiffness): (usize, &f64)| {
        let q = row % digits.len();
        (springs[q] * digits[q]).powi(2) / stiffness
    };
    rounding(model, u, layer) + ROUNDING * forces.map(made).sum::<f64>()
}

impl Outcome {
    /// Whether rounding can make a lack of balance that is worth `unbalanced` in the energy norm, if that is what ended the run.
    pub fn is_rounding(&self, unbalanced: f64) -> bool {
        self.status != Status::RoundoffLimited || unbalanced * unbalanced <= self.floor
    }

    /// Return the relative errors of the result, with u'Ku = `strain`, if its forces lack a balance that is worth `unbalanced` in the energy norm,
    /// and the pair whose pressures are off their law by the largest of them, if they are. The model is that of the run.
    pub fn reached(&self, model: &Model, strain: f64, unbalanced: f64) -> (Reached, Option<usize>) {
        let of_steps = self.method.starts_with("newton");
        Reached::of_result((model, &self.scale), strain, unbalanced, &self.off, &self.layer, of_steps)
    }

    /// What a run can go on from.
    pub fn into_state(self) -> Box<State> {
        let Layer { compression, smoothing, .. } = self.next_states().clone();
        let Self { iterate: field, rows, memory, .. } = self;
        Box::new(State { field, compression, smoothing, rows, memory })
    }

    /// Return the layer states that a further step would be taken from.
    pub fn next_states(&self) -> &Layer {
        self.memory.as_ref().and_then(|memory| memory.states.as_ref()).unwrap_or(&self.layer)
    }
}

impl Run<'_> {
    /// The result of a loop's end.
    fn conclude(self, end: End, method: &mut Method, wants_interval: bool) -> Result<Outcome> {
        let Run { model, stop, rows, origin, memory, scale, energy, strain, .. } = self;
        let End { mut status, mut iterate, layer, weight, sweeps, skipped } = end;
        if status.is_solved() && scale.is_out_of_range(energy, layer.peak()) {
            status = Status::OutOfRange { energy };
        }
        let mut found = None;
        let (spectrum, factor, updates) = match method {
            Method::Newton(linear) => (linear.spectrum(), None, rows.last().map_or(0, |row| row.iteration)),
            Method::Sweeps { acceleration, .. } => {
                acceleration.conclude(model, &layer, &weight);
                if let ([first, .., last], true) = (&rows[..], wants_interval && status.is_solved()) {
                    found = interval(model, &layer, first.energy - last.energy)?;
                }
                (acceleration.spectrum(), acceleration.factor(), rows.len().saturating_sub(1))
            }
        };
        let mut traced = iterate.clone();
        // sweeps add to states and traces on their own
        if matches!(method, Method::Sweeps { .. }) {
            traced.retrace(model);
        }
        let (compression, digits) = (model.compression(&traced.trace), digits::of_compressions(model, &traced.trace));
        let floor = if status == Status::RoundoffLimited { floor(model, &iterate, &layer, &digits) } else { 0.0 };
        if let Some(origin) = origin {
            origin.give(model, &mut iterate);
        }
        // displacements are given with the digits that they have as a whole
        let off = OffLaws::new(model, &layer, &compression, &digits::of_compressions(model, &iterate.trace));
        let answer: Vec<f64> = match method {
            Method::Newton(_) => {
                let lines = memory.progress.slopes(model, &meeting_slopes(model));
                lines.iter().zip(surface_slopes(model)).map(|(line, surface)| surface.max(*line)).collect()
            }
            Method::Sweeps { .. } => vec![f64::INFINITY; model.points()],
        };
        let times = digits::lacking(matches!(method, Method::Sweeps { .. }), &status);
        let peak = scale.peak(&layer.pressure, strain);
        let mut rounding = times * digits::lost(model, &iterate.trace, &layer, &answer, peak);
        if let (Method::Sweeps { .. }, Status::RoundoffLimited) = (&*method, &status) {
            // pressures of compressions are not in balance to more than their digits
            rounding = rounding.max(scale.imbalance(model, &layer.force, strain));
        }
        Ok(Outcome {
            status,
            iterations: updates,
            sweeps,
            solves_skipped: skipped,
            iterate,
            off,
            rounding,
            forecast: stop.residual.and_then(|target| Forecast::new(&rows, target, factor)),
            layer,
            scale,
            floor,
            rows,
            memory: Some(memory),
            method: method.name(),
            joint: method.linear().counts(),
            linear_step: method.linear().describe(),
            spectrum,
            interval: found,
        })
    }
}
