//! The inner solvers: what was asked for, or the program's choice and its reason.
//!
//! Newton's method on one rank joins the bodies in one matrix where all of them are condensed, factored, or solved by multigrid; the
//! bodies then need no solver of their own. Else every body has one, and sweeps solve the linear steps.

use crate::discretize::{Assembled, Factory, Outline};
use crate::error::{Error, Kind, Result};
use crate::model::{Body, BodySlot};
use crate::petsc::Session;
use crate::problem::method::{Linear, MethodName};
use crate::problem::solver::Preset;
use crate::scene::Scene;
use crate::solver::preset::{self, Size};
use crate::solver::{CondensedBody, Krylov, Retained, SparseBody, memory, options};
use mpi::collective::SystemOperation;
use mpi::traits::CommunicatorCollectives;

/// Prefix of the PETSc options of the matrix of all bodies.
pub const WHOLE: &str = "newton";

/// Dofs of all condensed bodies up to which their dense matrix is factored: 0.2 s and 250 MB.
const DENSE: usize = 3000;

/// Chooses and makes the inner solvers of a scene's bodies.
pub struct Inner<'a> {
    session: &'a Session,
    /// What the scene names.
    asked: Option<Preset>,
    /// Bytes that the solvers so far leave, on the rank that has least.
    memory: usize,
    method: MethodName,
    /// How the scene wants linear steps to be solved.
    wanted: Option<Linear>,
    /// How linear steps are solved, from the plan on.
    linear: Linear,
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

impl Plan {
    /// Dofs that a condensed body would keep.
    fn on_contact(&self) -> usize {
        self.retained.as_ref().map_or(0, |retained| retained.dofs.len())
    }
}

impl<'a> Inner<'a> {
    /// Starts from the memory that is free now; collective. `kept` are bodies of an earlier scene that serve this one, too.
    pub fn new(session: &'a Session, scene: &Scene, kept: Vec<BodySlot>) -> Self {
        let mine = memory::available() as u64;
        let mut least = mine;
        if session.size() > 1 {
            session.world().all_reduce_into(&mine, &mut least, SystemOperation::min());
        }
        Self {
            session,
            asked: scene.solver.preset,
            memory: least as usize,
            method: scene.method.name,
            wanted: scene.method.linear,
            linear: Linear::Sweeps,
            plans: Vec::new(),
            kept,
        }
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

    /// How linear steps are solved.
    pub fn linear(&self) -> Linear {
        self.linear
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
            None if self.wanted == Some(Linear::Dense) && condensable => {
                (Preset::Condensed, "the scene asks for dense linear steps".to_owned())
            }
            None if self.wanted == Some(Linear::Direct) => {
                (Preset::Mumps, "the scene asks for direct linear steps".to_owned())
            }
            None if self.wanted == Some(Linear::Multigrid) => {
                (Preset::Hypre, "the scene asks for linear steps by multigrid".to_owned())
            }
            None => match preset::choose(size) {
                (Preset::Condensed, why) if !condensable => (Preset::Mumps, why),
                chosen => chosen,
            },
        })
    }

    /// How linear steps are solved, once bodies have their presets.
    fn join(&mut self) -> Result<Linear> {
        let newton = matches!(self.method, MethodName::Auto | MethodName::Newton);
        if newton && self.method == MethodName::Newton && self.session.size() > 1 {
            return Err(Error::new(Kind::Usage, "method `newton` solves for all bodies together and runs on one rank")
                .help("choose newton-robin, or start without mpiexec"));
        }
        if !newton || self.session.size() > 1 || self.wanted == Some(Linear::Sweeps) {
            return Ok(Linear::Sweeps);
        }
        let asks = |prefix: &str| options::asks_for_ksp(self.session, prefix);
        let mut typed = false;
        for plan in &self.plans {
            typed |= asks(&plan.name)?;
            // what is typed for one body reaches that body
            if self.method == MethodName::Auto && options::names_body(self.session, &plan.name)? && asks(&plan.name)? {
                return Ok(Linear::Sweeps);
            }
        }
        if self.asked.is_none() && self.wanted.is_none() && !typed {
            agree(&mut self.plans);
        }
        let names: Vec<&str> = self.plans.iter().map(|plan| plan.name.as_str()).chain([WHOLE]).collect();
        options::distribute(self.session, &names)?;
        let all = |preset: Preset| self.plans.iter().all(|plan| plan.preset == preset);
        let dense: usize = self.plans.iter().map(Plan::on_contact).sum();
        let pc = options::typed(self.session, WHOLE, "pc_type");
        Ok(match pc.as_deref() {
            Some("hypre") => Linear::Multigrid,
            Some("cholesky" | "lu") => Linear::Direct,
            Some(_) if self.method == MethodName::Auto => Linear::Sweeps,
            None if all(Preset::Condensed) && (dense <= DENSE || self.wanted.is_some()) && !asks(WHOLE)? => {
                Linear::Dense
            }
            None if all(Preset::Hypre) => Linear::Multigrid,
            None if self.plans.iter().any(|plan| matches!(plan.preset, Preset::Gamg | Preset::Icc))
                && self.method == MethodName::Auto =>
            {
                Linear::Sweeps
            }
            _ => Linear::Direct,
        })
    }
}

/// Gives all bodies what Newton's method can join: multigrid if one of them needs it, or if together they have too much contact in
/// space for one dense matrix; in the plane one factorisation then.
fn agree(plans: &mut [Plan]) {
    let dense: usize = plans.iter().filter(|plan| plan.preset == Preset::Condensed).map(Plan::on_contact).sum();
    let needs = plans.iter().find(|plan| plan.preset == Preset::Hypre).map(|plan| plan.name.clone());
    let (preset, why) = match needs {
        Some(first) => (Preset::Hypre, format!("`{first}` has it, and Newton's method joins the bodies")),
        None if dense > DENSE => {
            let preset = if plans.iter().all(|plan| plan.dimension == 3) { Preset::Hypre } else { Preset::Mumps };
            (preset, format!("{dense} of all bodies are on the contact: too many to join by dense algebra"))
        }
        None => return,
    };
    for plan in plans.iter_mut().filter(|plan| plan.preset != preset) {
        plan.preset = preset;
        plan.reason = format!("{} dofs; {why}", plan.dofs);
    }
}

impl Factory for Inner<'_> {
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
        self.linear = self.join()?;
        for plan in &mut self.plans {
            plan.retained = plan.retained.take().filter(|_| plan.preset == Preset::Condensed);
        }
        match self.linear {
            Linear::Dense => {}
            Linear::Direct => preset::apply(self.session, WHOLE, Preset::Mumps)?,
            Linear::Multigrid => {
                preset::made_often(self.session, WHOLE)?;
                preset::apply(self.session, WHOLE, Preset::Hypre)?;
            }
            Linear::Sweeps => {
                self.plans.iter().try_for_each(|plan| preset::apply(self.session, &plan.name, plan.preset))?;
            }
        }
        Ok(())
    }

    fn make(&mut self, assembled: Assembled) -> Result<Box<dyn Body>> {
        let Assembled { name, dimension, body, rows, motions, left } = assembled;
        let plan = self.plans.iter_mut().find(|plan| plan.name == name);
        if let Some(retained) = plan.and_then(|plan| plan.retained.take()) {
            return Ok(Box::new(CondensedBody::new(self.session, &name, dimension, body, left, retained)));
        }
        let session = self.session.clone();
        let words = match self.linear {
            Linear::Sweeps => preset::in_words(&session, &name),
            _ => preset::in_words(&session, WHOLE),
        };
        let modes: Vec<Vec<f64>> = match self.linear {
            Linear::Sweeps => motions.into_iter().map(|motion| motion.displacement).collect(),
            _ => Vec::new(),
        };
        let make = move |stiffness: crate::linalg::Csr| Krylov::new(&session, &name, dimension, stiffness, &modes);
        Ok(Box::new(SparseBody::new(body, rows, &left, make, words)))
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

    /// Two contacts of 1500 dofs are joined by dense algebra, with one dof more they are not; in the plane one factorisation
    /// joins them then.
    #[test]
    fn wide_contacts_are_joined_by_multigrid() {
        let pair = |more: usize| [plan("a", Preset::Condensed, 1500), plan("b", Preset::Condensed, 1500 + more)];
        let mut narrow = pair(0);
        agree(&mut narrow);
        assert_eq!(presets(&narrow), [Preset::Condensed; 2]);
        let mut flat = pair(1);
        flat.iter_mut().for_each(|plan| plan.dimension = 2);
        agree(&mut flat);
        assert_eq!(presets(&flat), [Preset::Mumps; 2]);
        let mut wide = pair(1);
        agree(&mut wide);
        assert_eq!(presets(&wide), [Preset::Hypre; 2]);
        assert!(wide[0].reason.contains("3001 of all bodies"), "{}", wide[0].reason);
    }
}
