//! The stages of a run, each made from the one before: [`Scene`], [`Built`], [`Ready`], [`Done`].

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

/// A scene with its discrete problem. Bodies have their inner solvers, nothing is factored.
pub struct Built {
    /// What was asked for.
    pub scene: Rc<Scene>,
    /// The discrete problem.
    pub discrete: Discrete,
    /// SHA-256 of the file of its mesh, on the rank that has read it; none elsewhere.
    pub mesh: Option<String>,
    /// How linear steps are solved.
    pub linear: Linear,
    /// PETSc options of the matrix of all bodies.
    pub whole: Chosen,
    /// Interpolation of all bodies from linear displacements, until multigrid has it.
    pub interpolation: Option<Interpolation>,
    /// Why the inner solver is what it is where no PETSc option was typed.
    pub choice: String,
    /// Names of the condensed bodies, with which another run can go on.
    pub condensed: Vec<String>,
    /// The options of all its solvers of PETSc.
    pub options: Vec<Chosen>,
    /// What the user should know of it.
    pub warnings: Vec<String>,
    /// The way to the other legs of a history; none if this problem serves all its steps.
    pub again: Option<Again>,
}

/// Makes a problem with the loads of another leg of a history: first step of the leg, where it begins, the condensed bodies of the leg
/// before. Collective.
pub type Again = Rc<dyn Fn(usize, Begin, Vec<BodySlot>, &mut Clock) -> Result<Ready>>;

/// What another mesh or another process gives a run.
#[derive(Default)]
pub struct Begin {
    /// The start; none for that of the scene.
    pub start: Option<Start>,
    /// Load steps before.
    pub steps: Vec<StepReport>,
    /// Their rows.
    pub earlier: Vec<Row>,
}

/// A problem with its method set up and a start: the next is the first step.
pub struct Ready {
    /// The problem.
    pub built: Built,
    /// The method, whose solvers are set up.
    pub method: Method,
    /// Where it begins; with load steps each finds its own, but for one that another process has begun.
    pub start: Start,
    /// Load steps before.
    pub steps: Vec<StepReport>,
    /// Their rows.
    pub earlier: Vec<Row>,
    /// What the user should know of the set-up.
    pub warnings: Vec<String>,
}

/// A run that has ended, well or not, or has paused.
pub struct Done {
    /// The problem.
    pub built: Built,
    /// The method as the run has left it.
    pub method: Method,
    /// How it ended; of a load step that has paused, in the units of the step.
    pub outcome: Outcome,
    /// Share of the loads and prescribed displacements that the outcome is the answer to.
    pub share: f64,
    /// Its load steps so far.
    pub steps: Vec<StepReport>,
    /// Rows of the load steps before one that has paused.
    pub earlier: Vec<Row>,
    /// What the user should know of the set-up.
    pub warnings: Vec<String>,
    /// Displacements of its bodies, once it has ended.
    pub recovered: Option<Rc<All>>,
    /// What the last look found, at a result that may be a solution.
    pub look: Option<Look>,
}

impl Built {
    /// Who knows the error of the discretisation, if the scene lets the run end by it.
    pub fn balance(&self) -> Option<Box<dyn Discretisation>> {
        let meshes = self.discrete.meshes.clone().filter(|_| self.scene.method.stop.balanced);
        meshes.map(|meshes| Box::new(Nodal(meshes)) as _)
    }

    /// Whether PETSc has no solver in it: all bodies are condensed, and what joins them is dense.
    pub fn is_without_petsc(&self) -> bool {
        self.linear == Linear::Dense || self.condensed.len() == self.discrete.bodies.len()
    }

    /// The condensed bodies, their counts begun anew, for other loads, layers or gaps.
    pub fn into_condensed(self) -> Vec<BodySlot> {
        let mut slots = self.discrete.model.bodies;
        slots.retain(|slot| self.condensed.contains(&slot.name));
        slots.iter_mut().filter_map(|slot| slot.local.as_mut()).for_each(|body| body.begin_anew());
        slots
    }
}

impl Done {
    /// The next run of the same problem and method, from what this one has found.
    pub fn go_on(self, start: impl FnOnce(Outcome) -> Start) -> Ready {
        let Self { built, method, outcome, steps, earlier, warnings, .. } = self;
        Ready { built, method, start: start(outcome), steps, earlier, warnings }
    }

    /// The discrete problem.
    pub fn model(&self) -> &Model {
        &self.built.discrete.model
    }
}
