//! The stages of a run, each made from the one before: [`Scene`], [`Built`], [`Ready`], [`Done`].

use crate::ddm::{Method, Outcome, Start};
use crate::discretize::Discrete;
use crate::model::{BodySlot, Model};
use crate::output::StepReport;
use crate::problem::method::Linear;
use crate::scene::Scene;
use std::rc::Rc;

/// A scene with its discrete problem. Bodies have their inner solvers, nothing is factored.
pub struct Built {
    /// What was asked for.
    pub scene: Rc<Scene>,
    /// The discrete problem.
    pub discrete: Discrete,
    /// How linear steps are solved.
    pub linear: Linear,
    /// Why the inner solver is what it is where no PETSc option was typed.
    pub choice: String,
    /// Names of the condensed bodies, with which another run can go on.
    pub condensed: Vec<String>,
    /// What the user should know of it.
    pub warnings: Vec<String>,
}

/// A problem with its method set up and a start: the next is the first step.
pub struct Ready {
    /// The problem.
    pub built: Built,
    /// The method, whose solvers are set up.
    pub method: Method,
    /// Where it begins; with load steps each step finds its own.
    pub start: Start,
    /// What the user should know of the set-up.
    pub warnings: Vec<String>,
}

/// A run that has ended, well or not.
pub struct Done {
    /// The problem.
    pub built: Built,
    /// The method as the run has left it.
    pub method: Method,
    /// How it ended.
    pub outcome: Outcome,
    /// Its load steps.
    pub steps: Vec<StepReport>,
    /// What the user should know of the set-up.
    pub warnings: Vec<String>,
}

impl Built {
    /// The condensed bodies, their counts begun anew, for another scene with the same bodies.
    pub fn into_condensed(self) -> Vec<BodySlot> {
        let mut slots = self.discrete.model.bodies;
        slots.retain(|slot| self.condensed.contains(&slot.name));
        slots.iter_mut().filter_map(|slot| slot.local.as_mut()).for_each(|body| body.begin_anew());
        slots
    }
}

impl Done {
    /// The discrete problem.
    pub fn model(&self) -> &Model {
        &self.built.discrete.model
    }
}
