//! The inner solver of each body: what was asked for, or the program's choice and its reason.

use super::method;
use crate::ddm::{Body, BodySlot};
use crate::discretize::{Assembled, Maker, Outline};
use crate::error::Result;
use crate::petsc::Session;
use crate::problem::method::MethodName;
use crate::problem::solver::Preset;
use crate::scene::Scene;
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
    dimension: usize,
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

    /// Lets the bodies agree where the method can join them and nobody said otherwise.
    fn agree(&mut self) -> Result<()> {
        if self.asked.is_some() || !self.measures {
            return Ok(());
        }
        for plan in &self.plans {
            if options::asks_for_ksp(self.session, &plan.name)? {
                return Ok(());
            }
        }
        agree(&mut self.plans);
        Ok(())
    }
}

/// Gives all bodies multigrid if one of them needs it, or if together they have too much contact for one dense matrix: Newton's
/// method joins them then, and is left with sweeps otherwise.
fn agree(plans: &mut [Plan]) {
    let on_contact = |plan: &Plan| plan.retained.as_ref().map_or(0, |retained| retained.dofs.len());
    let dense: usize = plans.iter().filter(|plan| plan.preset == Preset::Condensed).map(on_contact).sum();
    let needs = plans.iter().find(|plan| plan.preset == Preset::Hypre).map(|plan| plan.name.clone());
    let why = match needs {
        Some(first) => format!("`{first}` has it, and Newton's method joins the bodies"),
        None if plans.iter().all(|plan| plan.dimension == 3) && dense > method::DENSE => {
            format!("{dense} of all bodies are on the contact: too many to join by dense algebra")
        }
        None => return,
    };
    for plan in plans.iter_mut().filter(|plan| plan.preset != Preset::Hypre) {
        plan.preset = Preset::Hypre;
        plan.reason = format!("{} dofs; {why}", plan.dofs);
    }
}

impl Maker for Inner<'_> {
    fn plan(&mut self, outlines: &[Outline]) -> Result<()> {
        for &Outline { name, dimension, rows, prescribed, motions } in outlines {
            let retained = Retained::new(dimension, rows, prescribed, motions);
            // a body that is kept has its memory already
            let memory = if self.kept.iter().any(|slot| slot.name == name) { usize::MAX } else { self.memory };
            let size = Size { dimension, dofs: rows.columns, retained: retained.dofs.len(), memory };
            let (preset, reason) = self.choose(name, &size)?;
            if matches!(preset, Preset::Mumps | Preset::Condensed) && memory == self.memory {
                self.memory = self.memory.saturating_sub(size.bytes(preset));
            }
            let (name, dofs, retained) = (name.to_owned(), size.dofs, Some(retained));
            self.plans.push(Plan { name, preset, reason, dimension, dofs, retained });
        }
        self.agree()?;
        for plan in &mut self.plans {
            if plan.preset == Preset::Hypre && self.measures {
                preset::made_often(self.session, &plan.name)?;
            }
            preset::apply(self.session, &plan.name, plan.preset)?;
            plan.retained = plan.retained.take().filter(|_| plan.preset == Preset::Condensed);
        }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::Csr;

    /// A body in space whose contact rows are `contact` dofs.
    fn plan(name: &str, preset: Preset, contact: usize) -> Plan {
        let mut rows = Csr::new(30_000);
        (0..contact).for_each(|i| rows.push_row([(3 * i, 1.0)]));
        let prescribed: Vec<(usize, f64)> = (29_000..30_000).map(|dof| (dof, 0.0)).collect();
        let retained = Some(Retained::new(3, &rows, &prescribed, &[]));
        Plan { name: name.to_owned(), preset, reason: "its own".to_owned(), dimension: 3, dofs: 30_000, retained }
    }

    fn presets(plans: &[Plan]) -> Vec<Preset> {
        plans.iter().map(|plan| plan.preset).collect()
    }

    #[test]
    fn bodies_agree_on_multigrid_alone() {
        let mut direct = [plan("a", Preset::Condensed, 10), plan("b", Preset::Mumps, 10)];
        agree(&mut direct);
        assert_eq!(presets(&direct), [Preset::Condensed, Preset::Mumps]);
        let mut mixed = [plan("a", Preset::Condensed, 10), plan("b", Preset::Hypre, 10), plan("c", Preset::Mumps, 10)];
        agree(&mut mixed);
        assert_eq!(presets(&mixed), [Preset::Hypre; 3]);
        assert_eq!(mixed[1].reason, "its own");
        assert!(mixed[2].reason.contains("30000 dofs; `b` has it"), "{}", mixed[2].reason);
    }

    /// Two contacts of 1500 dofs are joined by dense algebra, with one dof more they are not; in the plane they stay.
    #[test]
    fn wide_contacts_are_joined_by_multigrid() {
        let pair = |more: usize| [plan("a", Preset::Condensed, 1500), plan("b", Preset::Condensed, 1500 + more)];
        let mut narrow = pair(0);
        agree(&mut narrow);
        assert_eq!(presets(&narrow), [Preset::Condensed; 2]);
        let mut flat = pair(1);
        flat.iter_mut().for_each(|plan| plan.dimension = 2);
        agree(&mut flat);
        assert_eq!(presets(&flat), [Preset::Condensed; 2]);
        let mut wide = pair(1);
        agree(&mut wide);
        assert_eq!(presets(&wide), [Preset::Hypre; 2]);
        assert!(wide[0].reason.contains("3001 of all bodies"), "{}", wide[0].reason);
    }
}
