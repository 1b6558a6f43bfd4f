//! The factory of inner solvers: the plan of the first rank, which the other ranks follow, and the solvers that are made by it.

use super::super::distributed::distributed_bodies;
use super::super::plan::Plan;
use super::Inner;
use crate::discretize::{Assembled, Factory, Outline};
use crate::error::{Error, Kind, Result};
use crate::fem::Interpolation;
use crate::linalg::Csr;
use crate::model::{Body, BodySlot};
use crate::petsc::{HAS_HYPRE, Rows};
use crate::problem::{Linear, Order, Preset};
use crate::solver::options::Chosen;
use crate::solver::preset::{self, Smoother};
use crate::solver::{CondensedBody, Krylov, Retained, SparseBody};
use serde::{Deserialize, Serialize};

impl Inner<'_> {
    /// Set the PETSc options of the plan.
    fn apply(&mut self) {
        let is_quadratic = self.is_quadratic();
        match self.linear {
            Linear::Dense => {}
            Linear::Direct => preset::apply(&mut self.whole, Preset::Mumps, None),
            Linear::Multigrid => {
                preset::made_often(&mut self.whole);
                let smoother = if self.session.size() > 1 { Smoother::Chebyshev } else { Smoother::GaussSeidel };
                preset::apply(&mut self.whole, Preset::Hypre, Some(smoother).filter(|_| is_quadratic));
            }
            Linear::Sweeps => {
                for (plan, distributed) in self.plans.iter_mut().zip(&self.distributed) {
                    let smoother = if *distributed { Smoother::Chebyshev } else { Smoother::GaussSeidel };
                    preset::apply(&mut plan.chosen, plan.preset, Some(smoother).filter(|_| plan.order == Order::P2));
                }
            }
        }
    }
}

/// The choice of solvers of all bodies, made by the first rank.
#[derive(Serialize, Deserialize)]
pub struct Decisions {
    linear: Linear,
    /// Whether each body is distributed over the ranks, if sweeps solve linear steps.
    distributed: Vec<bool>,
    bodies: Vec<Plan>,
}

impl Factory for Inner<'_> {
    type Plan = Decisions;

    fn plan(&mut self, outlines: &[Outline]) -> Result<Decisions> {
        preset::check(self.asked, HAS_HYPRE)?;
        let mut plans = Vec::new();
        // This marks the bodies for which the program is to choose.
        let mut open = Vec::new();
        for (index, &Outline { name, dimension, order, rows, prescribed, motions, .. }) in outlines.iter().enumerate() {
            let (dofs, retained) = (rows.columns, Retained::new(dimension, rows, prescribed, motions));
            let chosen = self.typed.of(name);
            // A KSP for all bodies together needs them uncondensed.
            let typed = chosen.asks_for_ksp() || (self.may_join() && self.whole.asks_for_ksp());
            let condensable = (1..dofs).contains(&retained.dofs.len()) && !typed;
            let asked = self.asked_for(typed, condensable);
            open.push(asked.is_none());
            let (preset, reason) =
                asked.map_or((Preset::Mumps, String::new()), |(preset, why)| (preset, why.to_owned()));
            let (name, retained) = (name.to_owned(), Some(retained));
            self.places.insert(name.clone(), index);
            plans.push(Plan { name, chosen, preset, reason, dimension, order, dofs, condensable, retained });
        }
        let (mut plans_open, outlines_open): (Vec<&mut Plan>, Vec<&Outline>) =
            plans.iter_mut().zip(outlines).zip(open).filter_map(|(both, open)| open.then_some(both)).unzip();
        match outlines.first().map(|outline| outline.dimension) {
            Some(2) => plans_open.into_iter().for_each(|plan| self.choose_in_plane(plan)),
            _ => self.choose_in_space(&mut plans_open, &outlines_open),
        }
        self.plans = plans;
        self.linear = self.join()?;
        for plan in &mut self.plans {
            plan.retained = plan.retained.take().filter(|_| plan.preset == Preset::Condensed);
        }
        if self.linear == Linear::Sweeps {
            self.distributed = distributed_bodies(&self.plans, self.session.size());
        }
        let (distributed, bodies) = (self.distributed.clone(), self.plans.clone());
        self.apply();
        Ok(Decisions { linear: self.linear, distributed, bodies })
    }

    fn adopt(&mut self, decisions: Decisions) -> Result<()> {
        (self.linear, self.distributed, self.plans) = (decisions.linear, decisions.distributed, decisions.bodies);
        for (index, plan) in self.plans.iter_mut().enumerate() {
            plan.chosen = self.typed.of(&plan.name);
            self.places.insert(plan.name.clone(), index);
        }
        self.apply();
        Ok(())
    }

    fn distributed(&self) -> Vec<Vec<usize>> {
        let bodies = 0..self.plans.len();
        // A condensed body stays on one rank, and all ranks can have its Schur complement.
        let is_whole = self.plans.iter().any(|plan| plan.preset == Preset::Condensed);
        match self.linear {
            Linear::Sweeps => bodies.filter(|&body| self.distributed[body]).map(|body| vec![body]).collect(),
            Linear::Direct | Linear::Multigrid if self.session.size() > 1 && !is_whole => vec![bodies.collect()],
            _ => Vec::new(),
        }
    }

    fn wants_interpolation(&self, name: &str) -> bool {
        let has_levels = |chosen: &Chosen| chosen.get("pc_type") == Some("mg");
        match self.linear {
            Linear::Multigrid => self.is_quadratic() && has_levels(&self.whole),
            Linear::Sweeps => self.places.get(name).is_some_and(|&place| {
                let Plan { preset, order, chosen, .. } = &self.plans[place];
                *preset != Preset::Condensed && *order == Order::P2 && has_levels(chosen)
            }),
            _ => false,
        }
    }

    fn make(&mut self, assembled: Assembled) -> Result<Box<dyn Body>> {
        let Assembled { name, dimension, body, distribution, rows, motions, left, interpolation } = assembled;
        let Some(plan) = self.places.get(&name).map(|&place| &mut self.plans[place]) else {
            return Err(Error::new(Kind::Solver, format!("no solver is planned for body `{name}`")));
        };
        let (session, chosen) = (self.session.clone(), plan.chosen.clone());
        if let Some(retained) = plan.retained.take() {
            return Ok(Box::new(CondensedBody::new(&session, chosen, dimension, body, left, retained)));
        }
        let words = match self.linear {
            Linear::Sweeps => preset::in_words(&chosen),
            _ => preset::in_words(&self.whole),
        };
        let mut levels = interpolation;
        if self.linear == Linear::Multigrid
            && let Some(next) = levels.take()
        {
            let empty = || Interpolation { rows: Csr::new(0), own: 0 };
            let whole = self.interpolation.get_or_insert_with(empty);
            // If dofs are distributed, the columns are those of all bodies.
            let first = if distribution.is_some() { 0 } else { whole.rows.columns };
            whole.append(&next, first);
        }
        let mut modes: Vec<Vec<f64>> = match self.linear {
            Linear::Sweeps => motions(),
            _ => Vec::new(),
        };
        if let Some(distribution) = &distribution {
            modes.iter_mut().for_each(|mode| *mode = distribution.of_known(mode));
        }
        let make = move |stiffness: Rows| Krylov::new(&session, chosen, dimension, stiffness, &modes, levels);
        Ok(Box::new(SparseBody::new(body, rows, &left, distribution, make, words)))
    }

    fn kept(&mut self, name: &str) -> Option<BodySlot> {
        self.kept.remove(name).filter(|slot| slot.local.is_some())
    }
}
