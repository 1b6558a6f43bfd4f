//! A run from its start to its result, by either loop. The start is given by the scene, found by itself, or left by another run.

use super::bound::{OffLaws, ROUNDING, Reached, Scale, compression_roundoff, pressure_roundoff, roundoff_safety};
use super::newton::resisting;
use super::robin::{Acceleration, Forecast};
use super::run::{LoopEnd, Memory, Observer, Row, Run, rounding};
use super::start::{self, RigidStart};
use super::stop::{BalanceRule, Discretisation, Stagnation, Status};
use super::{newton, robin};
use crate::error::Result;
use crate::model::Model;
use crate::model::body::{Body, BodyCounts};
use crate::model::field::Field;
use crate::model::layer::{Layer, meeting_slopes, surface_slopes};
use crate::model::linear::LinearStep;
use crate::model::rigid::DisplacementOrigin;
use crate::problem::method::StopRule;
use crate::robin::spectrum::{Interval, interval};
use crate::robin::sweep::{Coefficient, extend, underconstrained};
use std::time::Instant;

/// The method of a run.
pub enum Method {
    /// Newton's method, with the solver of its linear steps.
    Newton(Box<dyn LinearStep>),
    /// Sweeps: the iteration of the paper, or a faster one over the same sweep.
    Sweeps {
        /// The rule that makes the next iterate from a sweep.
        acceleration: Box<dyn Acceleration>,
        /// The Robin term.
        coefficient: Coefficient,
        /// The solver for the response of the bodies, which estimates of the mesh's error need.
        linear: Box<dyn LinearStep>,
    },
}

impl Method {
    /// Return the name, as in the scene and the table.
    pub fn name(&self) -> &'static str {
        match self {
            Method::Newton(linear) => linear.name(),
            Method::Sweeps { acceleration, .. } => acceleration.name(),
        }
    }

    /// Return the solver of linear steps.
    pub fn linear(&mut self) -> &mut dyn LinearStep {
        match self {
            Method::Newton(linear) | Method::Sweeps { linear, .. } => &mut **linear,
        }
    }

    fn is_sweeps(&self) -> bool {
        matches!(self, Method::Sweeps { .. })
    }
}

/// Settings of a run besides the model and the method.
pub struct Settings {
    /// The rule that ends the run.
    pub stop: StopRule,
    /// Whether to find the interval (33) of gamma at the end, which takes some sweeps.
    pub interval: bool,
    /// The estimator of the discretisation error, if the run is to stop where more iterations would change nothing.
    pub balance: Option<Box<dyn Discretisation>>,
    /// The start.
    pub start: InitialGuess,
}

/// The result of a run: its last valid iterate, with its errors and history.
#[derive(Clone)]
pub struct Outcome {
    /// How the run ended.
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
    /// Distance of these layers from the laws at the compressions of the iterate.
    off: OffLaws,
    scale: Scale,
    /// Roundoff of the iterate, a squared energy norm; zero unless roundoff ended the run.
    roundoff_level: f64,
    /// History, one row per iterate.
    pub rows: Vec<Row>,
    /// Memory of the run.
    pub memory: Option<Memory>,
    /// Name of the method.
    pub method: &'static str,
    /// Counters of what was done for all bodies together, besides the counters of the bodies.
    pub joint: BodyCounts,
    /// The solver of all bodies together; empty if each body had its own.
    pub linear_step: String,
    /// Estimated bounds of the spectrum of G^-1 F1'', if the method saw enough.
    pub spectrum: Option<(f64, f64)>,
    /// Largest error of a pressure by rounding of gaps and displacements, relative to the scale of errors of pressures.
    pub rounding: f64,
    /// Iterations still needed for the residual that is asked for, where they can be estimated.
    pub forecast: Option<Forecast>,
    /// The interval (33) of gamma, if it was asked for and can be found.
    pub interval: Option<Interval>,
}

/// Run a method on a model from its start until a rule ends it.
pub fn solve(
    model: &mut Model,
    method: &mut Method,
    settings: &mut Settings,
    observer: &mut dyn Observer,
) -> Result<Outcome> {
    let began = Instant::now();
    let found = match &settings.start {
        InitialGuess::Found(rigid) => Ok((**rigid).clone()),
        _ => find_start(model),
    };
    let (begin, balance) = (std::mem::take(&mut settings.start), settings.balance.take());
    let stagnation = if method.is_sweeps() { Stagnation::of_sweeps() } else { Stagnation::of_steps() };
    let foreign = method.linear().sweeps();
    let mut run = Run {
        model,
        stop: &settings.stop,
        balance: balance.map(BalanceRule::new),
        observer,
        began,
        earlier: 0.0,
        origin: None,
        scale: Scale::default(),
        energy: 0.0,
        strain: 0.0,
        memory: Memory::new(stagnation, foreign),
        rows: Vec::new(),
    };
    let end = match found {
        Ok(rigid) => run.iterate(method, begin, rigid)?,
        Err(status) => {
            let rest = Field::rest(run.model);
            let layer = Layer::at(run.model, &rest.trace);
            run.end(status, rest, layer, method.linear())
        }
    };
    run.conclude(end, method, settings.interval)
}

impl Run<'_> {
    /// Iterate from a start.
    fn iterate(&mut self, method: &mut Method, begin: InitialGuess, rigid: RigidStart) -> Result<LoopEnd> {
        let mut trace = match &begin {
            InitialGuess::Trace(given) => given.clone(),
            InitialGuess::Continue(state) => state.field.trace.clone(),
            _ => rigid.trace.clone(),
        };
        self.scale = Scale::new(self.model, &[&vec![0.0; 2 * self.model.points()], &rigid.trace]);
        let states = first_states(self.model, &begin, &rigid);
        let has_states = matches!(begin, InitialGuess::Pressure(_) | InitialGuess::Continue(_));
        let is_free = self.model.bodies.iter().any(|slot| !slot.motions.is_empty());
        // an estimate of the discretisation's error needs whole displacements, not their difference from an origin
        if is_free && self.balance.is_none() {
            self.origin = DisplacementOrigin::take(self.model, &rigid.amounts);
        }
        let resumed = self.resume(begin);
        let is_near = has_states && resumed.is_none();
        match method {
            Method::Newton(linear) => {
                let start = |origin: &mut DisplacementOrigin| std::mem::take(&mut origin.rest);
                let u = resumed.or_else(|| self.origin.as_mut().map(start)).unwrap_or_else(|| Field::rest(self.model));
                newton::iterate(self, &mut **linear, u, states, is_near)
            }
            Method::Sweeps { acceleration, coefficient, linear } => {
                if let Some(origin) = &self.origin {
                    crate::linalg::axpy(-1.0, origin.trace(), &mut trace);
                }
                match resumed.map_or_else(|| extend(self.model, &trace), |field| Ok(Ok(field)))? {
                    Ok(u) => robin::iterate(self, &mut **acceleration, coefficient, &mut **linear, u),
                    Err(failure) => {
                        Ok(self.end(Status::InnerSolver(failure), Field::rest(self.model), states, &**linear))
                    }
                }
            }
        }
    }

    /// Take over what a run left that is to go on: its history, its memory, and its displacements, which are returned relative to the origin.
    /// Return none if the start has no displacements, or others than those that the bodies work with.
    fn resume(&mut self, begin: InitialGuess) -> Option<Field> {
        let mut field = match begin {
            InitialGuess::Resume(field) => field,
            InitialGuess::Continue(state) => {
                let State { field, rows, memory, .. } = *state;
                let is_whole = memory.is_some() || fits(self.model, &field);
                let (seconds, sweeps) = rows.last().map_or((0.0, 0), |row| (row.seconds, row.sweeps));
                self.earlier = seconds;
                self.rows = rows;
                match memory {
                    Some(memory) => self.memory = Memory { states: None, ..memory },
                    None => (self.memory.earlier, self.memory.sweeper.sweeps) = (sweeps, sweeps),
                }
                is_whole.then_some(field)?
            }
            _ => return None,
        };
        if let Some(origin) = &self.origin {
            origin.take_from(self.model, &mut field);
        }
        Some(field)
    }
}

/// Return what roundoff can make of a solution, a squared energy norm. It is that of any iterate, and the response of the bodies to contact forces
/// that change with the `roundoff` of the compressions, n. Where both bodies of a stiff layer move together, the bodies alone resist.
fn roundoff_level(model: &Model, u: &Field, layer: &Layer, roundoff: &[f64]) -> f64 {
    let (rows, springs) = (model.row_stiffness(), layer.springs(model));
    let resisted = rows.iter().enumerate().filter(|(_, stiffness)| **stiffness > 0.0);
    let response = |(row, stiffness): (usize, &f64)| {
        let q = row % roundoff.len();
        (springs[q] * roundoff[q]).powi(2) / stiffness
    };
    rounding(model, u, layer) + ROUNDING * resisted.map(response).sum::<f64>()
}

impl Outcome {
    /// Whether roundoff explains forces out of balance of this energy norm. Only a run that roundoff ended can have such forces.
    pub fn is_rounding(&self, unbalanced: f64) -> bool {
        self.status != Status::RoundoffLimited || unbalanced * unbalanced <= self.roundoff_level
    }

    /// Return the relative errors of the result, with u'Ku = `strain`, if its forces out of balance have the energy norm `unbalanced`. The second
    /// value is the pair whose pressures differ from their law by the largest of the errors, if one does. The model is that of the run.
    pub fn reached(&self, model: &Model, strain: f64, unbalanced: f64) -> (Reached, Option<usize>) {
        let of_steps = self.method.starts_with("newton");
        Reached::of_result(model, &self.scale, strain, unbalanced, &self.off, &self.layer, of_steps)
    }

    /// Return the state from which a run can go on.
    pub fn into_state(self) -> Box<State> {
        let Layer { compression, smoothing, .. } = self.next_states().clone();
        let Self { iterate: field, rows, memory, .. } = self;
        Box::new(State { field, compression, smoothing, rows, memory })
    }

    /// Return the layer states from which a further step would be taken.
    pub fn next_states(&self) -> &Layer {
        self.memory.as_ref().and_then(|memory| memory.states.as_ref()).unwrap_or(&self.layer)
    }
}

/// What a method knows at the end of a run.
struct Findings {
    /// Updates of the iterate.
    updates: usize,
    /// Estimated bounds of the spectrum of G^-1 F1''.
    spectrum: Option<(f64, f64)>,
    /// The method's own factor by which an iteration reduces the residual.
    factor: Option<f64>,
    interval: Option<Interval>,
}

impl Run<'_> {
    /// Return the result of a run whose loop has ended.
    fn conclude(mut self, mut end: LoopEnd, method: &mut Method, wants_interval: bool) -> Result<Outcome> {
        if end.status.is_solved() && self.scale.is_out_of_range(self.energy, end.layer.peak()) {
            end.status = Status::OutOfRange { energy: self.energy };
        }
        let findings = self.findings(&end, method, wants_interval)?;
        let mut traced = end.iterate.clone();
        // sweeps update states and traces separately
        if method.is_sweeps() {
            traced.retrace(self.model);
        }
        let compression = self.model.compression(&traced.trace);
        let roundoff_level = match end.status {
            Status::RoundoffLimited => {
                let roundoff = compression_roundoff(self.model, &traced.trace);
                roundoff_level(self.model, &end.iterate, &end.layer, &roundoff)
            }
            _ => 0.0,
        };
        if let Some(origin) = self.origin.take() {
            origin.give(self.model, &mut end.iterate);
        }
        // the displacements of the result have the digits of whole ones, not of those relative to the origin
        let roundoff = compression_roundoff(self.model, &end.iterate.trace);
        let off = OffLaws::new(self.model, &end.layer, &compression, &roundoff);
        Ok(Outcome {
            iterations: findings.updates,
            sweeps: end.sweeps,
            solves_skipped: end.skipped,
            off,
            rounding: self.roundoff_of_pressures(&end, method.is_sweeps()),
            forecast: self.stop.residual.and_then(|target| Forecast::new(&self.rows, target, findings.factor)),
            status: end.status,
            iterate: end.iterate,
            layer: end.layer,
            scale: self.scale,
            roundoff_level,
            rows: self.rows,
            memory: Some(self.memory),
            method: method.name(),
            joint: method.linear().counts(),
            linear_step: method.linear().describe(),
            spectrum: findings.spectrum,
            interval: findings.interval,
        })
    }

    /// Ask the method what it knows at the end of a run. Collective.
    fn findings(&mut self, end: &LoopEnd, method: &mut Method, wants_interval: bool) -> Result<Findings> {
        let (model, rows) = (&mut *self.model, &self.rows[..]);
        let acceleration = match method {
            Method::Newton(linear) => {
                let updates = rows.last().map_or(0, |row| row.iteration);
                return Ok(Findings { updates, spectrum: linear.spectrum(), factor: None, interval: None });
            }
            Method::Sweeps { acceleration, .. } => acceleration,
        };
        acceleration.conclude(model, &end.layer, &end.weight);
        let interval = match rows {
            [first, .., last] if wants_interval && end.status.is_solved() => {
                interval(model, &end.layer, first.energy - last.energy)?
            }
            _ => None,
        };
        let (updates, spectrum) = (rows.len().saturating_sub(1), acceleration.spectrum());
        Ok(Findings { updates, spectrum, factor: acceleration.factor(), interval })
    }

    /// Return the largest error of a pressure of the result by rounding of gaps and displacements, relative to the scale of pressures.
    fn roundoff_of_pressures(&self, end: &LoopEnd, is_sweeps: bool) -> f64 {
        let (model, layer) = (&*self.model, &end.layer);
        let answer = match is_sweeps {
            true => vec![f64::INFINITY; model.points()],
            false => {
                let rho = self.memory.progress.answers(model, &meeting_slopes(model));
                rho.iter().zip(surface_slopes(model)).map(|(rho, surface)| surface.max(*rho)).collect()
            }
        };
        let peak = self.scale.peak(&layer.pressure, self.strain);
        let times = roundoff_safety(is_sweeps, &end.status);
        let error = times * pressure_roundoff(model, &end.iterate.trace, layer, &answer, peak);
        if is_sweeps && end.status == Status::RoundoffLimited {
            // pressures that are taken from compressions balance the loads only to the digits of the compressions
            return error.max(self.scale.imbalance(model, &layer.force, self.strain));
        }
        error
    }
}

/// The start of a run.
#[derive(Debug, Clone, Default)]
pub enum InitialGuess {
    /// Rigid bodies on their own surfaces.
    #[default]
    Automatic,
    /// The automatic start, already found for these loads.
    Found(Box<RigidStart>),
    /// Outer normal displacement of all contact rows (2n, layout of a trace vector).
    Trace(Vec<f64>),
    /// Contact pressures (n) for Newton's method, for example from another mesh; sweeps begin automatically.
    Pressure(Vec<f64>),
    /// A displacement, used as it is.
    Resume(Field),
    /// The state in which another run paused.
    Continue(Box<State>),
}

/// The state from which a run goes on.
#[derive(Debug, Clone)]
pub struct State {
    /// Displacements. If the states are not those that the solvers of the bodies work with, only the traces are used.
    pub field: Field,
    /// Compressions of the layers' states, n.
    pub compression: Vec<f64>,
    /// Energy per area by which the laws are smoothed, n; empty for the laws themselves.
    pub smoothing: Vec<f64>,
    /// History so far.
    pub rows: Vec<Row>,
    /// Memory of the run; none if the state comes from a file.
    pub memory: Option<Memory>,
}

impl From<Option<Vec<f64>>> for InitialGuess {
    /// Start from a trace, or automatically.
    fn from(trace: Option<Vec<f64>>) -> Self {
        trace.map_or(InitialGuess::Automatic, InitialGuess::Trace)
    }
}

/// Return the springs omega kappa (n) of the first linear step of Newton's method; none if there is no solution. An automatic start is replaced by
/// the one that is found.
pub fn first_springs(model: &Model, begin: &mut InitialGuess) -> Option<Vec<f64>> {
    let rigid = find_start(model).ok()?;
    let springs = resisting(model, first_states(model, begin, &rigid).springs(model));
    if let InitialGuess::Automatic = begin {
        *begin = InitialGuess::Found(Box::new(rigid));
    }
    Some(springs)
}

/// Return the automatic start. If no method can find a solution, return the reason: a motion that nothing resists, or loads that push a body off
/// for ever.
fn find_start(model: &Model) -> std::result::Result<RigidStart, Status> {
    if let Some(mechanism) = &model.mechanism {
        return Err(Status::Mechanism(mechanism.clone()));
    }
    if let Some(moved) = underconstrained(model, &model.row_stiffness()) {
        return Err(Status::Underconstrained(moved));
    }
    start::find(model, None).map_err(|moving| Status::Unbounded { moving })
}

/// Return the layer states from which Newton's method begins.
fn first_states(model: &Model, begin: &InitialGuess, rigid: &RigidStart) -> Layer {
    match begin {
        InitialGuess::Automatic | InitialGuess::Found(_) => rigid.places.clone(),
        InitialGuess::Trace(trace) => match start::find(model, Some(trace)) {
            Ok(rigid) => rigid.places,
            Err(_) => start::at(model, trace),
        },
        InitialGuess::Resume(field) => Layer::at(model, &field.trace),
        InitialGuess::Continue(state) => {
            let paused = state.memory.as_ref().and_then(|memory| memory.states.clone());
            paused.unwrap_or_else(|| Layer::smoothed(model, state.compression.clone(), &state.smoothing))
        }
        InitialGuess::Pressure(pressure) => {
            let mut compression = Vec::with_capacity(pressure.len());
            for (i, pair) in model.pairs.iter().enumerate() {
                compression.extend(model.range(i).map(|q| pair.law.compression(q - model.offset[i], pressure[q])));
            }
            Layer::new(model, compression)
        }
    }
}

/// Whether a field has the states that the bodies work with: vectors of the same length, whose traces agree with those of the field to half the
/// digits. Collective.
pub(super) fn fits(model: &Model, field: &Field) -> bool {
    let bodies = model.bodies.iter().map(|slot| slot.local.as_ref());
    let is_odd =
        |(body, state): (Option<&dyn Body>, &Vec<f64>)| body.is_some_and(|body| body.states().size() != state.len());
    let mut odd = [bodies.zip(&field.states).filter(|pair| is_odd(*pair)).count() as f64];
    model.exchange.sum(&mut odd);
    if odd[0] > 0.0 {
        return false;
    }
    let mut traced = field.clone();
    traced.retrace(model);
    let difference = traced.trace.iter().zip(&field.trace).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
    difference <= f64::EPSILON * crate::linalg::dot(&field.trace, &field.trace)
}
