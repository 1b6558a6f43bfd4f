//! The inner solver of each body: what was asked for, or the program's choice and its reason.

use crate::ddm::{Body, BodySlot};
use crate::discretize::{Assembled, Maker, Outline};
use crate::error::Result;
use crate::petsc::Session;
use crate::scene::{MethodName, Preset, Scene};
use crate::solver::preset::{self, Size};
use crate::solver::{CondensedBody, Krylov, Retained, SparseBody, memory, options};
use mpi::collective::SystemOperation;
use mpi::traits::CommunicatorCollectives;

/// Chooses and makes the inner solvers of a scene's bodies.
pub struct Inner<'a> {
    session: &'a Session,
    /// What the scene names.
    asked: Option<Preset>,
    /// Bytes that the solvers so far leave, on the rank that has least.
    memory: usize,
    /// Whether the method joins bodies that multigrid solves: their own solvers then only measure.
    measures: bool,
    plans: Vec<Plan>,
    /// Condensed bodies that an earlier scene has left; `local` is there on the rank that owns it.
    kept: Vec<BodySlot>,
}

/// The choice for a body.
struct Plan {
    name: String,
    preset: Preset,
    reason: String,
    dofs: usize,
    /// For a condensed body, until it is made.
    retained: Option<Retained>,
}

impl<'a> Inner<'a> {
    /// Starts from the memory that is free now; collective. `kept` are bodies of an earlier scene that serve this one, too.
    pub fn new(session: &'a Session, scene: &Scene, kept: Vec<BodySlot>) -> Self {
        let mine = memory::available() as u64;
        let mut least = mine;
        if session.size() > 1 {
            session.world().all_reduce_into(&mine, &mut least, SystemOperation::min());
        }
        let joins = matches!(scene.method.name, MethodName::Auto | MethodName::Newton);
        let measures = joins && session.size() == 1;
        Self { session, asked: scene.solver.preset, memory: least as usize, measures, plans: Vec::new(), kept }
    }

    /// Why the solvers are what they are, in words: once if all bodies have the same.
    pub fn reason(&self) -> String {
        let Some(largest) = self.plans.iter().max_by_key(|plan| plan.dofs) else { return String::new() };
        if self.plans.iter().all(|plan| plan.preset == largest.preset) {
            return largest.reason.clone();
        }
        let all = self.plans.iter().map(|plan| format!("{}: {}", plan.name, plan.reason));
        all.collect::<Vec<_>>().join("; ")
    }

    /// Names of the condensed bodies.
    pub fn condensed(&self) -> Vec<String> {
        let condensed = self.plans.iter().filter(|plan| plan.preset == Preset::Condensed);
        condensed.map(|plan| plan.name.clone()).collect()
    }

    fn choose(&self, name: &str, size: &Size) -> Result<(Preset, String)> {
        let typed = options::asks_for_ksp(self.session, name)?;
        let condensable = size.can_condense() && !typed;
        Ok(match self.asked {
            Some(Preset::Condensed) if !condensable => {
                let why = if typed { "PETSc options were typed" } else { "there is nothing to condense" };
                (Preset::Mumps, why.to_owned())
            }
            Some(preset) => (preset, "the scene asks for it".to_owned()),
            None => match preset::choose(size) {
                (Preset::Condensed, why) if !condensable || self.session.options().has("-help") => (Preset::Mumps, why),
                chosen => chosen,
            },
        })
    }
}

impl Maker for Inner<'_> {
    fn plan(&mut self, outline: &Outline) -> Result<()> {
        let &Outline { name, dimension, rows, prescribed, motions } = outline;
        let retained = Retained::new(dimension, rows, prescribed, motions);
        // a body that is kept has its memory already
        let memory = if self.kept.iter().any(|slot| slot.name == name) { usize::MAX } else { self.memory };
        let size = Size { dimension, dofs: rows.columns, retained: retained.dofs.len(), memory };
        let (preset, reason) = self.choose(name, &size)?;
        if matches!(preset, Preset::Mumps | Preset::Condensed) && memory == self.memory {
            self.memory = self.memory.saturating_sub(size.bytes(preset));
        }
        if preset == Preset::Hypre && self.measures {
            preset::made_often(self.session, name)?;
        }
        preset::apply(self.session, name, preset)?;
        let retained = (preset == Preset::Condensed).then_some(retained);
        self.plans.push(Plan { name: name.to_owned(), preset, reason, dofs: size.dofs, retained });
        Ok(())
    }

    fn make(&mut self, assembled: Assembled) -> Result<Box<dyn Body>> {
        let Assembled { name, dimension, body, rows, motions, left } = assembled;
        let plan = self.plans.iter_mut().find(|plan| plan.name == name);
        if let Some(retained) = plan.and_then(|plan| plan.retained.take()) {
            return Ok(Box::new(CondensedBody::new(self.session, &name, dimension, body, left, retained)));
        }
        let modes: Vec<Vec<f64>> = motions.into_iter().map(|motion| motion.displacement).collect();
        let krylov = Krylov::new(self.session, &name, dimension, &body.stiffness, &modes)?;
        Ok(Box::new(SparseBody::new(body, rows, &left, krylov)))
    }

    fn kept(&mut self, name: &str) -> Option<BodySlot> {
        let at = self.kept.iter().position(|slot| slot.name == name && slot.local.is_some())?;
        Some(self.kept.swap_remove(at))
    }
}
