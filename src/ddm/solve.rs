//! A run from its start to its result, by either loop. The start is given by the scene, found by itself, or left by
//! another run.

use super::bound::{EXACT, Scale, pressure_roundoff};
use super::forcing::resisting;
use super::gamma::GammaRule;
use super::history::{Observer, Outcome, Run};
use super::robin::Corrector;
use super::start::{self, RigidStart};
use super::stop::Status;
use super::{newton, robin};
use crate::error::Result;
use crate::linalg::{DIGIT, axpy};
use crate::model::field::{DisplacementField, residual};
use crate::model::layer::{Layer, surface_slopes};
use crate::model::linear::LinearStep;
use crate::model::motions::{self, Motions, NamedMotion};
use crate::model::{INNER_TOLERANCE, Model};
use crate::problem::method::StopRule;
use crate::robin::sweep::{Coefficient, Sweeper, underconstrained};
use nalgebra::DVector;
use std::time::Instant;

/// The method of a run.
pub enum Method {
    /// Newton's method, with the solver of its linear steps.
    Newton(Box<dyn LinearStep>),
    /// The paper's iteration.
    Robin {
        /// The rule for gamma.
        rule: Box<dyn GammaRule>,
        /// The Robin term of sweeps; without one, `linear` solves for all bodies together.
        coefficient: Option<Coefficient>,
        /// The solver of all bodies, which estimates of the mesh's error need, too.
        linear: Box<dyn LinearStep>,
    },
}

impl Method {
    /// Return the name, as in the scene and the table.
    pub fn name(&self) -> &'static str {
        match self {
            Method::Newton(linear) => linear.name(),
            Method::Robin { coefficient: Some(_), .. } => "robin",
            Method::Robin { coefficient: None, .. } => "semismooth",
        }
    }

    /// Return the solver of linear steps.
    pub fn linear(&mut self) -> &mut dyn LinearStep {
        match self {
            Method::Newton(linear) | Method::Robin { linear, .. } => &mut **linear,
        }
    }

    /// Return the solver of linear steps alone.
    pub fn into_linear(self) -> Box<dyn LinearStep> {
        match self {
            Method::Newton(linear) | Method::Robin { linear, .. } => linear,
        }
    }
}

/// Run a method on a model from its start until a rule ends it. With `wants_interval` the interval (33) of gamma is
/// found at the end, which takes some sweeps.
pub fn solve(
    model: &mut Model,
    method: &mut Method,
    stop: &StopRule,
    wants_interval: bool,
    start: InitialGuess,
    observer: &mut dyn Observer,
) -> Result<Outcome> {
    let (began, scale) = (Instant::now(), Scale::default());
    let found = match &start {
        InitialGuess::Found(rigid) => Ok((**rigid).clone()),
        _ => find_start(model),
    };
    let gap = model.gap.clone();
    let mut run = Run { model, stop, observer, began, gap, scale, rows: Vec::new() };
    let end = match found {
        Ok(rigid) => run.iterate(method, start, &rigid, wants_interval)?,
        Err(status) => {
            let rest = DisplacementField::rest(run.model);
            let layer = Layer::at(run.model, &rest.trace);
            Outcome::at_start(status, rest, layer)
        }
    };
    Ok(run.conclude(end, method))
}

impl Run<'_> {
    /// Iterate from a start.
    fn iterate(
        &mut self,
        method: &mut Method,
        start: InitialGuess,
        rigid: &RigidStart,
        wants_interval: bool,
    ) -> Result<Outcome> {
        let rest = vec![0.0; 2 * self.model.points()];
        // an overlap at rest says nothing of contacts that carry loads
        let references = if self.is_loaded() { vec![&rigid.trace[..]] } else { vec![&rest[..], &rigid.trace] };
        self.scale = Scale::new(self.model, &references);
        let RigidStart { layer: states, amounts, mut trace } = first_states(self.model, &start, rigid);
        let is_known = matches!(start, InitialGuess::Known(_));
        let known = match start {
            InitialGuess::Known(solution) if !solution.field.displacements.is_empty() => {
                Some(solution.field.supported(self.model))
            }
            _ => None,
        };
        let is_near = is_known && known.is_none();
        let has_displacements = known.is_some();
        let mut u = known.unwrap_or_else(|| DisplacementField {
            rigid: self.motions_of(&amounts),
            ..DisplacementField::rest(self.model)
        });
        let fallen = motions::trace(self.model, &u.rigid);
        self.model.close_gap(&fallen);
        match method {
            Method::Newton(linear) => {
                u.retrace(self.model);
                newton::iterate(self, &mut **linear, u, states, is_near)
            }
            Method::Robin { rule, coefficient, linear } => {
                let (coefficient, sweeper) = (coefficient.as_mut(), Sweeper::default());
                let mut corrector = Corrector { coefficient, sweeper, linear: &mut **linear };
                if has_displacements {
                    u.retrace(self.model);
                } else {
                    axpy(-1.0, &fallen, &mut trace);
                    if let Err(failure) = corrector.extend(self.model, &mut u, &trace)? {
                        return Ok(Outcome::at_start(Status::InnerSolver(failure), u, states));
                    }
                }
                robin::iterate(self, &mut **rule, corrector, u, wants_interval)
            }
        }
    }

    /// Whether a load or a prescribed displacement acts on a body. Collective.
    fn is_loaded(&self) -> bool {
        let rest = DisplacementField::zero(self.model);
        let (loads, _) = residual(self.model, rest.displacements.clone(), &rest, &vec![0.0; self.model.points()]);
        let mut loaded = [loads.iter().flatten().filter(|load| **load != 0.0).count() as f64];
        self.model.exchange.sum(&mut loaded);
        loaded[0] > 0.0
    }

    /// Return the amounts of the free motions of each body in a start. Bodies on springs begin at rest, since springs
    /// resist some of the motions of the start.
    fn motions_of(&self, amounts: &DVector<f64>) -> Vec<Vec<f64>> {
        let mut amounts = Motions::all(self.model).of_bodies(amounts);
        for (amounts, slot) in amounts.iter_mut().zip(&self.model.bodies).filter(|(_, slot)| slot.is_sprung()) {
            *amounts = vec![0.0; slot.free];
        }
        amounts
    }

    /// Return the result of a run whose loop has ended.
    fn conclude(mut self, mut end: Outcome, method: &mut Method) -> Outcome {
        axpy(1.0, &motions::trace(self.model, &end.iterate.rigid), &mut end.iterate.trace);
        self.model.gap = std::mem::take(&mut self.gap);
        let surfaces = surface_slopes(self.model);
        let answer: Vec<f64> = end.answer.iter().zip(surfaces).map(|(rho, surface)| surface.max(*rho)).collect();
        let peak = self.scale.peak(&end.layer.pressure, end.strain);
        let rounding = pressure_roundoff(self.model, &end.iterate.trace, &end.layer, &answer, peak);
        if end.status.is_solved() {
            end.status = self.judge(&end, rounding);
        }
        Outcome {
            iterations: self.rows.last().map_or(0, |row| row.iteration),
            rows: self.rows,
            method: method.name(),
            joint: method.linear().counts(),
            linear_step: method.linear().describe(),
            rounding,
            ..end
        }
    }

    /// Return the status of a run that ended as solved, from what is left of the forces, and what roundoff makes of the
    /// pressures.
    fn judge(&self, end: &Outcome, rounding: f64) -> Status {
        let energy = end.strain + end.layer.work;
        if self.scale.is_out_of_range(energy, end.layer.peak()) {
            return Status::OutOfRange { energy };
        }
        let reached = self.rows.last().map_or(0.0, |row| row.residual);
        let tolerance = self.stop.tolerance().max(EXACT);
        let is_balanced = end.unbalanced <= TIMES * tolerance.max(reached);
        // NaN is no balance
        if !is_balanced {
            return Status::Unbalanced(end.unbalanced);
        }
        let lost = if end.status == Status::RoundoffLimited { reached.max(rounding) } else { rounding };
        if lost > DIGIT {
            return Status::NoDigits(lost);
        }
        let tolerance = self.stop.increment.map_or(tolerance, |increment| increment.max(tolerance));
        if rounding > TIMES * tolerance.max(INNER_TOLERANCE) { Status::RoundoffLimited } else { end.status.clone() }
    }
}

/// A run reports unbalanced forces, or the roundoff of pressures, if they are larger than this number of tolerances.
/// The norms in which the two are measured differ by less than a factor of ten.
const TIMES: f64 = 10.0;

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
    /// Another solution: of a load step, of another mesh, or of another process.
    Known(Box<Solution>),
}

/// A solution from which another run starts.
#[derive(Debug, Clone, Default)]
pub struct Solution {
    /// Displacements. Without states of bodies, only traces are known.
    pub field: DisplacementField,
    /// Compressions of the layers' states, n.
    pub compression: Vec<f64>,
}

impl From<Option<Vec<f64>>> for InitialGuess {
    /// Start from a trace, or automatically.
    fn from(trace: Option<Vec<f64>>) -> Self {
        trace.map_or(InitialGuess::Automatic, InitialGuess::Trace)
    }
}

/// Return the springs omega kappa (n) of the first linear step of Newton's method; none if there is no solution. An
/// automatic start is replaced by the one that is found.
pub fn first_springs(model: &Model, begin: &mut InitialGuess) -> Option<Vec<f64>> {
    let rigid = find_start(model).ok()?;
    let springs = resisting(model, &first_states(model, begin, &rigid).layer).all;
    if let InitialGuess::Automatic = begin {
        *begin = InitialGuess::Found(Box::new(rigid));
    }
    Some(springs)
}

/// Return the automatic start. If no method can find a solution, return the reason: a motion that nothing resists, or
/// loads that push a body off for ever.
fn find_start(model: &Model) -> std::result::Result<RigidStart, Status> {
    if let Some(mechanism) = &model.mechanism {
        return Err(Status::Mechanism(mechanism.clone()));
    }
    if let Some(moved) = underconstrained(model, &model.holding_stiffness()).or_else(|| follows(model)) {
        return Err(Status::Underconstrained(moved));
    }
    start::find(model, None).map_err(|moving| Status::Unbounded { moving })
}

/// Return a motion of a body together with rigid parts that changes no gap, if there is one: the parts follow the body
/// wherever it goes.
fn follows(model: &Model) -> Option<NamedMotion> {
    if !model.bodies.iter().any(|slot| slot.is_rigid) {
        return None;
    }
    let motions = Motions::of(model);
    let has_rigid = |all: &Vec<NamedMotion>| all.iter().any(|moved| model.bodies[moved.body].is_rigid);
    let all = motions.springs(&model.area).factor().kernel();
    all.iter().map(|motion| motions.names(motion)).find(has_rigid)?.into_iter().next()
}

/// Return where a run begins: first states, the amounts of the free motions of all bodies that belong to them, and a
/// trace. `rigid` is the automatic start.
fn first_states(model: &Model, begin: &InitialGuess, rigid: &RigidStart) -> RigidStart {
    match begin {
        InitialGuess::Automatic | InitialGuess::Found(_) => rigid.clone(),
        InitialGuess::Trace(trace) => {
            let at_rest = |_| RigidStart { layer: start::at(model, trace), ..rigid.clone() };
            RigidStart { trace: trace.clone(), ..start::find(model, Some(trace)).unwrap_or_else(at_rest) }
        }
        InitialGuess::Known(solution) => {
            let trace = Some(&solution.field.trace).filter(|trace| !trace.is_empty()).unwrap_or(&rigid.trace);
            let layer = Layer::new(model, solution.compression.clone());
            RigidStart { layer, trace: trace.clone(), ..rigid.clone() }
        }
    }
}
