//! A problem that is ready to be solved.

use crate::ddm::{Discretisation, Method, Row, Start};
use crate::discretize::Problem;
use crate::estimate::Nodal;
use crate::model::BodySlot;
use crate::output::StepReport;
use crate::problem::method::Linear;
use crate::scene::Scene;

/// A problem that is ready to be solved, with what the user should know of its making.
pub struct Prepared {
    /// The discrete problem.
    pub problem: Problem,
    /// Start of the iteration, if it does not come from the scene.
    pub start: Option<Start>,
    /// How linear steps are solved.
    pub linear: Linear,
    /// The method, made by [`set_up`](super::run::set_up).
    pub method: Option<Method>,
    /// Why the inner solver is what it is where no PETSc option was typed.
    pub choice: String,
    /// Load steps so far.
    pub steps: Vec<StepReport>,
    /// Rows of load steps that another process made.
    pub earlier: Vec<Row>,
    /// Warnings.
    pub warnings: Vec<String>,
    /// Names of the condensed bodies, with which another run can go on.
    pub condensed: Vec<String>,
}

impl Prepared {
    /// Who knows the error of the discretisation, if the scene lets the run end by it.
    pub fn balance(&self, scene: &Scene) -> Option<Box<dyn Discretisation>> {
        self.problem.meshes.clone().filter(|_| scene.method.stop.balanced).map(|meshes| Box::new(Nodal(meshes)) as _)
    }

    /// Takes the condensed bodies out, their counts begun anew, for another scene with the same bodies.
    pub fn take_condensed(&mut self) -> Vec<BodySlot> {
        let mut slots = std::mem::take(&mut self.problem.model.bodies);
        slots.retain(|slot| self.condensed.contains(&slot.name));
        slots.iter_mut().filter_map(|slot| slot.local.as_mut()).for_each(|body| body.begin_anew());
        slots
    }
}

/// Sides of pair `i` in the order of the scene.
pub fn sides(prepared: &Prepared, i: usize) -> [usize; 2] {
    if prepared.problem.contacts[i].swapped { [1, 0] } else { [0, 1] }
}
