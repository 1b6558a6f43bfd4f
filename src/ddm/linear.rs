//! The linear step: (K + B' diag(omega kappa) B) x = r over all bodies (35).
//!
//! How it is solved is a choice of inner solver, not a method of its own: one dense matrix of condensed bodies, one sparse
//! factorisation, conjugate gradients with multigrid of all bodies, or with the Robin sweep ([`super::sweeps`]). A new way is a new
//! file with the trait [`LinearStep`].

use super::body::BodyCounts;
use super::field::Field;
use super::layer_state::Layer;
use super::model::Model;
use super::rigid::{Motions, TOLERANCE};
use super::start::surface_slopes;
use crate::error::Result;

/// A system to be solved.
pub struct System<'a> {
    /// Bodies with K and B.
    pub model: &'a mut Model,
    /// Places of the layers.
    pub places: &'a Layer,
    /// omega kappa at the points, n.
    pub springs: &'a [f64],
    /// r, a state of each body that lives here.
    pub residual: &'a [Vec<f64>],
    /// How far an iterative solver has to reduce the energy norm of the error.
    pub reduction: f64,
}

/// A solution of a [`System`].
pub struct Solution {
    /// x, with its traces.
    pub field: Field,
    /// x'r, the squared energy norm of x.
    pub energy: f64,
    /// Estimated energy norm of the error of x; zero for a direct solver.
    pub error: f64,
}

/// A solver that gave up, in its own words.
#[derive(Debug, Clone, PartialEq)]
pub struct Failure {
    /// The body whose solver it was; none for one of all bodies together.
    pub body: Option<usize>,
    /// Its reason.
    pub reason: String,
}

/// What a solver made of a system.
pub type Solved = std::result::Result<Solution, Failure>;

/// A solver of the linear step.
pub trait LinearStep {
    /// Name in the table and the report.
    fn name(&self) -> &'static str;

    /// Sets its solver up for the first step, with these springs omega kappa at the points, so that a refusal of the solver or of an
    /// option comes before it.
    ///
    /// # Errors
    /// Failures of the solver library.
    fn set_up(&mut self, _springs: &[f64]) -> Result<()> {
        Ok(())
    }

    /// Solves a system. Collective.
    ///
    /// # Errors
    /// Failures of the solver library; a solver that does not reach its tolerance is told in [`Solved`].
    fn solve(&mut self, system: System) -> Result<Solved>;

    /// What was done so far with all bodies together, besides what bodies count themselves.
    fn counts(&self) -> BodyCounts {
        BodyCounts::default()
    }

    /// Sweeps made so far.
    fn sweeps(&self) -> usize {
        0
    }

    /// One line about the solver of all bodies together; empty if each has its own.
    fn describe(&self) -> String {
        String::new()
    }

    /// Estimated bounds of the spectrum of the preconditioned matrix, if it has seen enough.
    fn spectrum(&self) -> Option<(f64, f64)> {
        None
    }
}

/// The response w of the bodies and their layers to small loads: (K + B' diag(omega kappa) B) w = r, with its squared energy norm.
/// `loads` is r, one entry a dof of each body that lives here.
///
/// # Errors
/// Failures of the solver library.
pub fn respond(
    model: &mut Model,
    step: &mut dyn LinearStep,
    places: &Layer,
    loads: &[Vec<f64>],
    reduction: f64,
) -> Result<std::result::Result<(Field, f64), Failure>> {
    let mut residual = Vec::new();
    for (slot, load) in model.bodies.iter_mut().zip(loads) {
        residual.push(match &mut slot.local {
            Some(body) => body.reduce(load)?,
            None => Vec::new(),
        });
    }
    let springs = resisting(model, places.springs(model));
    let system = System { model, places, springs: &springs, residual: &residual, reduction };
    Ok(step.solve(system)?.map(|solution| (solution.field, solution.energy)))
}

/// Share of the springs of whole surfaces that resists motions which no closed contact resists: they then go far, but not without end.
const PROXIMAL: f64 = 1e-3;

/// The springs omega kappa of a linear step, n, with one more for every rigid motion of the bodies together that would else meet no
/// resistance: a contact that is open now may be what stops it.
///
/// It is at the point that the motion closes most, and nowhere else. If forces are in balance on the motion, as where bodies rest
/// and could turn about the points that are closed, a single spring carries nothing, and the step is exact; several would.
pub fn resisting(model: &Model, mut springs: Vec<f64>) -> Vec<f64> {
    let motions = Motions::of(model);
    if motions.count() == 0 {
        return springs;
    }
    let mut free = motions.springs(&springs).factor(TOLERANCE).kernel();
    if free.is_empty() {
        return springs;
    }
    let surfaces: Vec<f64> =
        surface_slopes(model).iter().zip(&model.weight).map(|(slope, weight)| slope * weight).collect();
    while let Some(motion) = free.pop() {
        let closing = motions.closing(&motion);
        let Some(most) = (0..closing.len()).max_by(|&p, &q| closing[p].abs().total_cmp(&closing[q].abs())) else {
            break;
        };
        let shares = closing.iter().map(|s| (s / closing[most]).powi(2));
        springs[most] += PROXIMAL * shares.zip(&surfaces).map(|(share, surface)| share * surface).sum::<f64>();
        // what the others close at that point is this one's
        for other in &mut free {
            let share = motions.closing(other)[most] / closing[most];
            other.axpy(-share, &motion, 1.0);
        }
    }
    springs
}
