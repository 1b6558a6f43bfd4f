//! The stages of a run, each made from the previous one: [`Scene`], [`Built`], [`Prepared`], [`Done`].

use super::clock::Clock;
use super::ended::{All, Look};
use crate::ddm::{Discretisation, Method, Outcome, Row, Start};
use crate::discretize::Discrete;
use crate::error::Result;
use crate::estimate::Nodal;
use crate::fem::Interpolation;
use crate::model::{BodySlot, Model};
use crate::output::StepReport;
use crate::problem::method::Linear;
use crate::scene::Scene;
use crate::solver::options::Chosen;
use std::rc::Rc;

/// A scene with its discrete problem. Bodies have their inner solvers, but nothing is factorised yet.
pub struct Built {
    /// The scene.
    pub scene: Rc<Scene>,
    /// The discrete problem.
    pub discrete: Discrete,
    /// A line for each group of the mesh that is split into bodies.
    pub splits: Vec<String>,
    /// SHA-256 of the file of its mesh, on the rank that has read the file; none on other ranks.
    pub mesh: Option<String>,
    /// The solver of linear steps.
    pub linear: Linear,
    /// Interpolation of all bodies from linear displacements, until multigrid takes it.
    pub interpolation: Option<Interpolation>,
    /// Reason for the choice of the inner solver, if no PETSc option was typed.
    pub choice: String,
    /// Names of the condensed bodies, which another run can reuse.
    pub condensed: Vec<String>,
    /// Options of all PETSc solvers of the problem: of bodies, or of the joint matrix of all bodies.
    pub options: Vec<Chosen>,
    /// Warnings on the problem.
    pub warnings: Vec<String>,
    /// The legs of the load history; none if this problem serves all load steps. On a leg, all loads are proportional.
    pub legs: Option<Rc<dyn Legs>>,
}

/// A scene with its mesh, from which the problem of each leg of its load history is prepared.
pub trait Legs {
    /// Prepare the problem of the leg that begins with a step. Condensed bodies of the leg before are reused. Collective.
    ///
    /// # Errors
    /// Loads that a body cannot have, and failures of the solver library.
    fn prepare(&self, step: usize, begin: Begin, condensed: Vec<BodySlot>, clock: &mut Clock) -> Result<Prepared>;
}

/// The start of a run that continues one on another mesh or in another process.
#[derive(Default)]
pub struct Begin {
    /// The start; none for the start of the scene.
    pub start: Option<Start>,
    /// Earlier load steps.
    pub steps: Vec<StepReport>,
    /// Iteration rows of the earlier load steps.
    pub earlier: Vec<Row>,
}

/// A problem that is prepared for its first iteration, with the method set up and a start.
pub struct Prepared {
    /// The problem.
    pub built: Built,
    /// The method with its solvers, all set up.
    pub method: Method,
    /// The start. Each load step determines its own, except for one that another process has begun.
    pub start: Start,
    /// Earlier load steps.
    pub steps: Vec<StepReport>,
    /// Iteration rows of the earlier load steps.
    pub earlier: Vec<Row>,
    /// Warnings on the set-up.
    pub warnings: Vec<String>,
}

/// A run that has ended, with or without a solution, or has paused.
pub struct Done {
    /// The problem.
    pub built: Built,
    /// The method in its last state.
    pub method: Method,
    /// The outcome. That of a paused load step is in the units of the step.
    pub outcome: Outcome,
    /// Factor of the loads and prescribed displacements to which the outcome belongs.
    pub share: f64,
    /// Load steps so far.
    pub steps: Vec<StepReport>,
    /// Iteration rows of the load steps before a paused one.
    pub earlier: Vec<Row>,
    /// Warnings on the set-up.
    pub warnings: Vec<String>,
    /// Displacements of its bodies, once the run has ended.
    pub recovered: Option<Rc<All>>,
    /// Errors that the last look found, for a result that may be a solution.
    pub look: Option<Look>,
}

impl Built {
    /// Return the estimator of the discretisation error, if the scene lets the run end by it.
    pub fn balance(&self) -> Option<Box<dyn Discretisation>> {
        let meshes = self.discrete.meshes.clone().filter(|_| self.scene.method.stop.balanced);
        meshes.map(|meshes| Box::new(Nodal(meshes)) as _)
    }

    /// Return the condensed bodies with their counters reset, for other loads, layers or gaps.
    pub fn into_condensed(self) -> Vec<BodySlot> {
        let mut slots = self.discrete.model.bodies;
        slots.retain(|slot| self.condensed.contains(&slot.name));
        slots.iter_mut().filter_map(|slot| slot.local.as_mut()).for_each(|body| body.begin_anew());
        slots
    }
}

impl Done {
    /// Return the same problem and method, prepared for another run that starts from this outcome.
    pub fn go_on(self, start: impl FnOnce(Outcome) -> Start) -> Prepared {
        let Self { built, method, outcome, steps, earlier, warnings, .. } = self;
        Prepared { built, method, start: start(outcome), steps, earlier, warnings }
    }

    /// Return the model of the discrete problem.
    pub fn model(&self) -> &Model {
        &self.built.discrete.model
    }
}
