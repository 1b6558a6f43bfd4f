//! The inner solvers: those requested, or the program's choice with its reason ([`plan`](super::plan)), and how they are made.

use super::in_words;
use super::plan::{Asked, BodyPlan, Facts, Plan, Typed, plan};
use crate::discretize::{Assembled, Factory, Outline};
use crate::error::{Error, Kind, Result};
use crate::fem::Prolongation;
use crate::file::available_memory;
use crate::linalg::Csr;
use crate::model::{Body, BodySlot};
use crate::petsc::{HAS_HYPRE, Rows, Session};
use crate::problem::{Linear, MethodName, Order, Preset};
use crate::scene::Scene;
use crate::solver::cost::{BodySize, compactness};
use crate::solver::names::WHOLE;
use crate::solver::options::{Chosen, UserOptions};
use crate::solver::preset::{self, Smoother};
use crate::solver::{InterfaceDofs, Krylov, MakeSolver};
use mpi::collective::SystemOperation;
use mpi::traits::CommunicatorCollectives;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, HashMap};

/// A factory that makes the inner solvers of a scene's bodies by its plan.
pub struct SolverFactory<'a> {
    session: &'a Session,
    asked: Asked,
    /// Options that the user wrote for the solvers.
    typed: UserOptions,
    /// Options of the matrix of all bodies.
    whole: Chosen,
    /// Interpolation of the displacements of all bodies from linear ones, if bodies have quadratic elements and multigrid.
    pub interpolation: Option<Prolongation>,
    /// The plan, once it is made.
    pub plan: Plan,
    bodies: Vec<Planned>,
    /// Condensed bodies that an earlier scene has left. `local` exists on the rank that owns the body.
    kept: HashMap<String, BodySlot>,
}

/// A body of the plan.
struct Planned {
    outline: BodyOutline,
    /// PETSc options of its solver.
    chosen: Chosen,
}

/// What all ranks have of a body of the plan.
#[derive(Clone, Serialize, Deserialize)]
pub struct BodyOutline {
    name: String,
    order: Order,
    dofs: usize,
    /// Interface dofs of a condensed body, until it is made.
    interface: Option<InterfaceDofs>,
}

impl<'a> SolverFactory<'a> {
    /// Start from the free memory and the options that the user wrote. This scene can reuse the bodies `kept` of an earlier one. Collective.
    pub fn new(session: &'a Session, scene: &Scene, kept: Vec<BodySlot>) -> Result<Self> {
        let mine = available_memory() as u64;
        let mut least = mine;
        if session.size() > 1 {
            session.world().all_reduce_into(&mine, &mut least, SystemOperation::min());
        }
        let typed = UserOptions::read(session);
        let whole = typed.of(WHOLE);
        let asked = Asked {
            preset: scene.solver.preset,
            linear: scene.method.linear,
            method: scene.method.name,
            whole: typed_of(&whole),
            memory: least as usize,
            ranks: session.size(),
        };
        Ok(Self {
            session,
            asked,
            typed,
            whole,
            interpolation: None,
            plan: Plan { linear: Linear::Sweeps, bodies: Vec::new(), seconds: None },
            bodies: Vec::new(),
            kept: kept.into_iter().map(|slot| (slot.name.clone(), slot)).collect(),
        })
    }

    /// Return the bodies with their plans.
    fn planned(&self) -> impl Iterator<Item = (&Planned, &BodyPlan)> {
        self.bodies.iter().zip(&self.plan.bodies)
    }

    /// Return the reason for the solvers in words. Each kind of solver is named once, with the reason of its largest body.
    pub fn reason(&self) -> String {
        let is_typed = self.bodies.iter().any(|body| body.chosen.asks_for_ksp());
        let is_apart = self.asked.may_join() && self.plan.linear == Linear::Sweeps && is_typed;
        if self.asked.method == MethodName::Auto && is_apart {
            return "as typed for each body, so that linear steps are sweeps; `--method newton` joins the bodies in one matrix"
                .to_owned();
        }
        let mut kinds: Vec<Vec<(&Planned, &BodyPlan)>> = Vec::new();
        for body in self.planned() {
            match kinds.iter_mut().find(|kind| kind[0].1.preset == body.1.preset) {
                Some(kind) => kind.push(body),
                None => kinds.push(vec![body]),
            }
        }
        let is_one = kinds.len() == 1;
        let of_kind = |kind: Vec<(&Planned, &BodyPlan)>| {
            let (body, plan) = kind.iter().max_by_key(|(body, _)| body.outline.dofs)?;
            let (name, reason) = (&body.outline.name, &plan.reason);
            Some(match kind.len() {
                _ if is_one => reason.clone(),
                1 => format!("{name}: {reason}"),
                count => format!("{count} bodies, the largest {name}: {reason}"),
            })
        };
        kinds.into_iter().filter_map(of_kind).collect::<Vec<_>>().join("; ")
    }

    /// Return the options of all PETSc solvers of a run: of bodies that sweeps solve by one, or of the matrix of all bodies.
    pub fn into_options(self) -> Vec<Chosen> {
        match self.plan.linear {
            Linear::Dense => Vec::new(),
            Linear::Direct | Linear::Multigrid => vec![self.whole],
            Linear::Sweeps => {
                let solved = self.bodies.into_iter().zip(self.plan.bodies);
                solved.filter(|(_, plan)| plan.preset != Preset::Condensed).map(|(body, _)| body.chosen).collect()
            }
        }
    }

    fn is_quadratic(&self) -> bool {
        self.bodies.iter().any(|body| body.outline.order > Order::P1)
    }

    /// Return the warnings of solvers that apply a preconditioner once instead of solving, one for each kind.
    pub fn applied_once(&self) -> Vec<String> {
        let chosen: Vec<&Chosen> = match self.plan.linear {
            Linear::Sweeps => self.bodies.iter().map(|body| &body.chosen).collect(),
            _ => vec![&self.whole],
        };
        let mut kinds: BTreeMap<&str, Vec<String>> = BTreeMap::new();
        for chosen in chosen.into_iter().filter(|chosen| chosen.get("ksp_type") == Some("preonly")) {
            let pc = chosen.get("pc_type").unwrap_or_default();
            if !matches!(pc, "cholesky" | "lu") {
                kinds.entry(pc).or_default().push(chosen.prefix().to_owned());
            }
        }
        let warning = |(pc, names): (&str, Vec<String>)| {
            let bodies = if names.len() == 1 { "body" } else { "bodies" };
            let names = in_words(names.iter());
            format!("{bodies} {names}: preonly applies {pc} once instead of solving; the residual is measured by it")
        };
        kinds.into_iter().map(warning).collect()
    }

    /// Return the names of the condensed bodies.
    pub fn condensed(&self) -> Vec<String> {
        let condensed = self.planned().filter(|(_, plan)| plan.preset == Preset::Condensed);
        condensed.map(|(body, _)| body.outline.name.clone()).collect()
    }

    /// Return whether the program's choice of solvers factors a matrix.
    pub fn factors(&self) -> bool {
        let is_direct = |plan: &BodyPlan| matches!(plan.preset, Preset::Condensed | Preset::Mumps);
        self.plan.linear != Linear::Multigrid && self.plan.bodies.iter().any(is_direct)
    }

    /// Follow a plan: set the PETSc options of the solvers.
    fn follow(&mut self, plan: Plan, bodies: Vec<BodyOutline>) {
        let is_parallel = self.session.size() > 1;
        let planned = |outline: BodyOutline| Planned { chosen: self.typed.of(&outline.name), outline };
        self.bodies = bodies.into_iter().map(planned).collect();
        let is_quadratic = self.is_quadratic();
        let smoother = |is_distributed: bool, is_quadratic: bool| {
            is_quadratic.then_some(if is_distributed { Smoother::Chebyshev } else { Smoother::GaussSeidel })
        };
        match plan.linear {
            Linear::Dense => {}
            Linear::Direct => preset::apply(&mut self.whole, Preset::Mumps, None),
            Linear::Multigrid => {
                preset::made_often(&mut self.whole);
                preset::apply(&mut self.whole, Preset::Hypre, smoother(is_parallel, is_quadratic));
            }
            Linear::Sweeps => {
                for (body, plan) in self.bodies.iter_mut().zip(&plan.bodies) {
                    let smoother = smoother(plan.is_distributed, body.outline.order > Order::P1);
                    preset::apply(&mut body.chosen, plan.preset, smoother);
                }
            }
        }
        self.plan = plan;
    }

    /// Return the number of a body.
    fn number(&self, name: &str) -> Result<usize> {
        let missing = || Error::new(Kind::Solver, format!("no solver is planned for body `{name}`"));
        self.bodies.iter().position(|body| body.outline.name == name).ok_or_else(missing)
    }
}

/// Return what the plan asks of the options of a solver.
fn typed_of(chosen: &Chosen) -> Typed {
    let works = |name: &str, value: &str| match value {
        "hypre" | "gamg" | "jacobi" | "pbjacobi" | "none" | "mg" => true,
        "cholesky" | "lu" => {
            let package = name.replace("pc_type", "pc_factor_mat_solver_type");
            chosen.typed(&package).is_none_or(|package| package == "mumps")
        }
        _ => false,
    };
    Typed {
        asks_for_ksp: chosen.asks_for_ksp(),
        has_own: chosen.has_own(),
        pc: chosen.typed("pc_type").map(str::to_owned),
        is_for_one_rank: chosen.all_typed().any(|(name, value)| name.ends_with("pc_type") && !works(name, value)),
    }
}

impl Factory for SolverFactory<'_> {
    type SolverPlan = (Plan, Vec<BodyOutline>);

    fn plan(&mut self, outlines: &[Outline]) -> Result<Self::SolverPlan> {
        preset::check(self.asked.preset, HAS_HYPRE)?;
        let (mut facts, mut bodies) = (Vec::new(), Vec::new());
        for &Outline { name, dimension, order, cells, facets, rows, prescribed, motions } in outlines {
            let interface = InterfaceDofs::new(dimension, rows, prescribed, motions);
            let size = BodySize {
                dofs: rows.columns,
                interface: None,
                is_quadratic: order > Order::P1,
                compactness: compactness(cells, facets),
            };
            let (name, is_kept) = (name.to_owned(), self.kept.contains_key(name));
            let typed = typed_of(&self.typed.of(&name));
            facts.push(Facts { name: name.clone(), dimension, size, interface: interface.dofs.len(), is_kept, typed });
            bodies.push(BodyOutline { name, order, dofs: rows.columns, interface: Some(interface) });
        }
        let plan = plan(&facts, &self.asked);
        for (body, plan) in bodies.iter_mut().zip(&plan.bodies) {
            body.interface = body.interface.take().filter(|_| plan.preset == Preset::Condensed);
        }
        self.follow(plan.clone(), bodies.clone());
        Ok((plan, bodies))
    }

    fn adopt(&mut self, (plan, bodies): Self::SolverPlan) -> Result<()> {
        self.follow(plan, bodies);
        Ok(())
    }

    fn distributed(&self) -> Vec<Vec<usize>> {
        let plans = &self.plan.bodies;
        // a condensed body stays on one rank, and all ranks can have its Schur complement
        let is_whole = plans.iter().any(|plan| plan.preset == Preset::Condensed);
        match self.plan.linear {
            Linear::Sweeps => {
                (0..plans.len()).filter(|&body| plans[body].is_distributed).map(|body| vec![body]).collect()
            }
            Linear::Direct | Linear::Multigrid if self.session.size() > 1 && !is_whole => {
                vec![(0..plans.len()).collect()]
            }
            _ => Vec::new(),
        }
    }

    fn wants_interpolation(&self, name: &str) -> bool {
        let has_levels = |chosen: &Chosen| chosen.get("pc_type") == Some("mg");
        match self.plan.linear {
            Linear::Multigrid => self.is_quadratic() && has_levels(&self.whole),
            Linear::Sweeps => self.planned().any(|(body, plan)| {
                let Planned { outline, chosen } = body;
                let is_it = outline.name == name && plan.preset != Preset::Condensed;
                is_it && outline.order > Order::P1 && has_levels(chosen)
            }),
            _ => false,
        }
    }

    fn make(&mut self, assembled: Assembled) -> Result<Body> {
        let Assembled { name, dimension, body, distribution, rows, motions, left, interpolation } = assembled;
        let number = self.number(&name)?;
        let Planned { outline, chosen } = &mut self.bodies[number];
        let (session, chosen) = (self.session.clone(), chosen.clone());
        if let Some(interface) = outline.interface.take() {
            return Ok(Body::to_condense(session, chosen, dimension, body, &left, interface));
        }
        let is_swept = self.plan.linear == Linear::Sweeps;
        let words = preset::in_words(if is_swept { &chosen } else { &self.whole });
        let mut levels = interpolation;
        if self.plan.linear == Linear::Multigrid
            && let Some(next) = levels.take()
        {
            let empty = || Prolongation { rows: Csr::new(0), own: 0 };
            let whole = self.interpolation.get_or_insert_with(empty);
            // if dofs are distributed, the columns are those of all bodies
            let first = if distribution.is_some() { 0 } else { whole.rows.columns };
            whole.append(&next, first);
        }
        let mut modes: Vec<Vec<f64>> = if is_swept { motions() } else { Vec::new() };
        if let Some(distribution) = &distribution {
            modes.iter_mut().for_each(|mode| *mode = distribution.of_known(mode));
        }
        let make: MakeSolver = Box::new(move |stiffness: Rows| {
            Ok(Box::new(Krylov::new(&session, chosen, dimension, stiffness, &modes, levels)?))
        });
        Ok(Body::new(body, rows, left, distribution, make, words))
    }

    fn kept(&mut self, name: &str) -> Option<BodySlot> {
        self.kept.remove(name).filter(|slot| slot.local.is_some())
    }
}
