//! The start of a run: given by the scene, found by itself, or left by another run.

use super::history::Row;
use super::linear::resisting;
use super::memory::Memory;
use super::start::{self, RigidStart};
use super::stop::Status;
use crate::model::Model;
use crate::model::body::Body;
use crate::model::field::Field;
use crate::model::layer::Layer;
use crate::robin::coefficient::underconstrained;

/// The start of a run.
#[derive(Debug, Clone, Default)]
pub enum Start {
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

impl From<Option<Vec<f64>>> for Start {
    /// Start from a trace, or automatically.
    fn from(trace: Option<Vec<f64>>) -> Self {
        trace.map_or(Start::Automatic, Start::Trace)
    }
}

/// Return the springs omega kappa (n) of the first linear step of Newton's method; none if there is no solution. An automatic start is replaced by
/// the one that is found.
pub fn first_springs(model: &Model, begin: &mut Start) -> Option<Vec<f64>> {
    let rigid = find_start(model).ok()?;
    let springs = resisting(model, first_states(model, begin, &rigid).springs(model));
    if let Start::Automatic = begin {
        *begin = Start::Found(Box::new(rigid));
    }
    Some(springs)
}

/// Return the automatic start. If no method can find a solution, return the reason: a motion that nothing resists, or loads that push a body off
/// for ever.
pub(super) fn find_start(model: &Model) -> std::result::Result<RigidStart, Status> {
    if let Some(moved) = underconstrained(model, &model.row_stiffness()) {
        return Err(Status::Underconstrained(moved));
    }
    if let Some(mechanism) = &model.mechanism {
        return Err(Status::Mechanism(mechanism.clone()));
    }
    start::find(model, None).map_err(|moving| Status::Unbounded { moving })
}

/// Return the layer states from which Newton's method begins.
pub(super) fn first_states(model: &Model, begin: &Start, rigid: &RigidStart) -> Layer {
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

/// Whether a field has the states that the bodies work with: vectors of the same length, whose traces agree with those of the field to half the
/// digits. Collective.
pub(super) fn fits(model: &Model, field: &Field) -> bool {
    let bodies = model.bodies.iter().map(|slot| slot.local.as_ref());
    let is_odd =
        |(body, state): (Option<&Box<dyn Body>>, &Vec<f64>)| body.is_some_and(|body| body.len() != state.len());
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
