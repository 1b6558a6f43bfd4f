//! The inner solvers: those requested, or the program's choice with its reason ([`plan`](super::plan)), and how they
//! are made.

use super::in_words;
use super::plan::{BodyPlan, Plan, SolverRequest, plan};
use crate::discretize::{Assembled, Factory};
use crate::error::{Error, Kind, Result};
use crate::fem::Prolongation;
use crate::file::available_memory;
use crate::linalg::Csr;
use crate::model::{Body, BodyCounts, Dofs, LinearStep};
use crate::parallel::least;
use crate::petsc::{HAS_HYPRE, Rows, Session};
use crate::problem::{Linear, MethodName, Preset};
use crate::scene::Scene;
use crate::solver::cost::BodyFacts;
use crate::solver::names::WHOLE;
use crate::solver::options::{Chosen, UserOptions};
use crate::solver::preset::{self, Smoother};
use crate::solver::{Krylov, MakeSolver};
use std::collections::{BTreeMap, BTreeSet};

/// A factory that makes the inner solvers of a scene's bodies by its plan.
pub struct SolverFactory<'a> {
    session: &'a Session,
    asked: SolverRequest,
    /// Options that the user wrote for the solvers.
    typed: UserOptions,
    /// What the matrix of all bodies is to be made of.
    pub joint: JointParts,
    /// The plan, once it is made.
    pub plan: Plan,
    /// What was asked for and planned for the problem before.
    before: Option<Solvers>,
    /// The solver of the linear steps of the problem before, if it may serve again.
    step: Option<Box<dyn LinearStep>>,
    /// Its counters.
    counts: BodyCounts,
}

/// What the matrix of all bodies is made of, on the rows of this rank.
#[derive(Default)]
pub struct JointParts {
    /// K of each body that is assembled here and not condensed, by its number.
    pub stiffness: BTreeMap<usize, Csr>,
    /// Interpolation of the displacements of all bodies from linear ones, if bodies have quadratic elements and
    /// multigrid.
    pub interpolation: Option<Prolongation>,
    /// Rigid motions of all bodies, if the multigrid is GAMG.
    pub near_null_space: Vec<Vec<f64>>,
}

/// What was asked for, and the plan that was made.
pub struct Solvers {
    asked: SolverRequest,
    pub plan: Plan,
}

impl<'a> SolverFactory<'a> {
    /// Start from the free memory and the options that the user wrote. The problem before had the solvers `before`.
    /// Collective.
    pub fn new(session: &'a Session, scene: &Scene, before: Option<(Solvers, Box<dyn LinearStep>)>) -> Result<Self> {
        session.clear_defaults();
        let typed = UserOptions::read(session);
        let asked = SolverRequest {
            preset: scene.solver.preset,
            linear: scene.method.linear,
            method: scene.method.name,
            whole: typed.of(WHOLE),
            memory: least(session, available_memory() as u64) as usize,
            ranks: session.size(),
        };
        let (before, step) = before.unzip();
        let counts = step.as_ref().map_or(BodyCounts::default(), |step| step.counts());
        Ok(Self {
            session,
            asked,
            typed,
            joint: JointParts::default(),
            plan: Plan { linear: Linear::Sweeps, bodies: Vec::new(), seconds: None },
            before,
            step,
            counts,
        })
    }

    /// Return the reason for the solvers in words. Each kind of solver is named once, with the reason of its largest
    /// body.
    pub fn reason(&self) -> String {
        let is_typed = self.plan.bodies.iter().any(|body| body.facts.options.asks_for_ksp());
        let is_apart = self.asked.may_join() && self.plan.linear == Linear::Sweeps && is_typed;
        if self.asked.method == MethodName::Auto && is_apart {
            return "as typed for each body, so that linear steps are sweeps; `--method newton` joins the bodies in one matrix"
                .to_owned();
        }
        let mut kinds: Vec<Vec<&BodyPlan>> = Vec::new();
        for body in &self.plan.bodies {
            match kinds.iter_mut().find(|kind| kind[0].preset == body.preset) {
                Some(kind) => kind.push(body),
                None => kinds.push(vec![body]),
            }
        }
        let is_one = kinds.len() == 1;
        let of_kind = |kind: Vec<&BodyPlan>| {
            let BodyPlan { facts: BodyFacts { name, .. }, reason, .. } =
                kind.iter().max_by_key(|body| body.facts.dofs)?;
            Some(match kind.len() {
                _ if is_one => reason.clone(),
                1 => format!("{name}: {reason}"),
                count => format!("{count} bodies, the largest {name}: {reason}"),
            })
        };
        kinds.into_iter().filter_map(of_kind).collect::<Vec<_>>().join("; ")
    }

    /// Return the options of all PETSc solvers of a run: of bodies that sweeps solve by one, or of the matrix of all
    /// bodies.
    pub fn options(&self) -> Vec<Chosen> {
        match self.plan.linear {
            Linear::Dense => Vec::new(),
            Linear::Direct | Linear::Multigrid => vec![self.asked.whole.clone()],
            Linear::Sweeps => {
                let solved = self.plan.bodies.iter().filter(|body| body.preset != Preset::Condensed);
                solved.map(|body| body.facts.options.clone()).collect()
            }
        }
    }

    /// Return the solver of linear steps of the problem before, if it may serve again, and its counters.
    pub fn linear_step(&mut self) -> (Option<Box<dyn LinearStep>>, BodyCounts) {
        (self.step.take(), self.counts)
    }

    /// Return what was asked for, and the plan.
    pub fn into_solvers(self) -> Solvers {
        Solvers { asked: self.asked, plan: self.plan }
    }

    /// Return whether linear steps are solved as in the problem before.
    fn has_same_steps(&self) -> bool {
        let is_robin = |asked: &SolverRequest| asked.method == MethodName::Robin;
        let is_same = |before: &Solvers| {
            before.plan.linear == self.plan.linear && is_robin(&before.asked) == is_robin(&self.asked)
        };
        self.before.as_ref().is_some_and(is_same)
    }

    /// Clear the marks of bodies whose solver is another than in the problem before. Bodies whose K is in one matrix
    /// serve together or not at all.
    fn keep_solvers(&self, is_kept: &mut [bool]) {
        let Some(Solvers { plan: before, asked }) = &self.before else { return };
        let is_linear_same = self.has_same_steps();
        for (index, is_kept) in is_kept.iter_mut().enumerate().take(before.bodies.len()) {
            let of = |plan: &Plan| (plan.bodies[index].preset, plan.bodies[index].is_distributed);
            // the axes of contact nodes depend on that
            let has_same_dofs = self.eliminates(index) == eliminates(before, asked, index);
            let is_same = of(&self.plan) == of(before) && has_same_dofs;
            *is_kept &= is_same && (is_linear_same || self.plan.bodies[index].preset == Preset::Condensed);
        }
        if matches!(self.plan.linear, Linear::Direct | Linear::Multigrid) && is_kept.contains(&false) {
            let is_condensed = self.plan.bodies.iter().map(|body| body.preset == Preset::Condensed);
            is_kept.iter_mut().zip(is_condensed).for_each(|(is_kept, is_condensed)| *is_kept &= is_condensed);
        }
    }

    fn is_quadratic(&self) -> bool {
        self.plan.bodies.iter().any(|body| body.facts.is_quadratic)
    }

    /// Return the warnings of solvers that apply a preconditioner once instead of solving, one for each kind.
    pub fn applied_once(&self) -> Vec<String> {
        let chosen: Vec<&Chosen> = match self.plan.linear {
            Linear::Sweeps => self.plan.bodies.iter().map(|body| &body.facts.options).collect(),
            _ => vec![&self.asked.whole],
        };
        let mut kinds: BTreeMap<&str, Vec<String>> = BTreeMap::new();
        for chosen in chosen.into_iter().filter(|chosen| chosen.get("ksp_type") == Some("preonly")) {
            let pc = chosen.get("pc_type").unwrap_or_default();
            if !matches!(pc, "cholesky" | "lu") {
                kinds.entry(pc).or_default().push(chosen.name().to_owned());
            }
        }
        let warning = |(pc, names): (&str, Vec<String>)| {
            let bodies = if names.len() == 1 { "body" } else { "bodies" };
            let names = in_words(names.iter());
            format!("{bodies} {names}: preonly applies {pc} once instead of solving; the residual is measured by it")
        };
        kinds.into_iter().map(warning).collect()
    }

    /// Return the warning of options that would show the solves of bodies, where sweeps apply multigrid instead.
    pub fn idle_options(&self) -> Option<String> {
        if self.plan.linear != Linear::Sweeps || self.asked.method == MethodName::Robin {
            return None;
        }
        let solved = self.plan.bodies.iter().filter(|body| body.preset != Preset::Condensed);
        let applied = solved.map(|body| &body.facts.options).filter(|chosen| chosen.is_applied_once());
        let shown = |chosen: &'_ Chosen| chosen.all_looking("ksp_").collect::<Vec<String>>();
        let options: BTreeSet<String> = applied.flat_map(shown).collect();
        let options = options.into_iter().collect::<Vec<_>>().join(" ");
        (!options.is_empty()).then(|| {
            format!(
                "nothing to show for {options}: each sweep applies multigrid once instead of solving; with \
                 -ksp_rtol 1e-2 it solves"
            )
        })
    }

    /// Return the names of the condensed bodies.
    pub fn condensed(&self) -> Vec<String> {
        let condensed = self.plan.bodies.iter().filter(|body| body.preset == Preset::Condensed);
        condensed.map(|body| body.facts.name.clone()).collect()
    }

    /// Return whether the program's choice of solvers factors a matrix.
    pub fn factors(&self) -> bool {
        let is_direct = |plan: &BodyPlan| matches!(plan.preset, Preset::Condensed | Preset::Mumps);
        self.plan.linear != Linear::Multigrid && self.plan.bodies.iter().any(is_direct)
    }

    /// Follow a plan: set the PETSc options of the solvers.
    fn follow(&mut self, plan: Plan) {
        self.plan = plan;
        let is_parallel = self.session.size() > 1;
        let smoother = |is_distributed: bool, is_quadratic: bool| {
            is_quadratic.then_some(if is_distributed { Smoother::Chebyshev } else { Smoother::GaussSeidel })
        };
        let is_quadratic = self.is_quadratic();
        match self.plan.linear {
            Linear::Dense => {}
            Linear::Direct => {
                let is_iterative = |preset: &Preset| matches!(preset, Preset::Gamg | Preset::Icc);
                let preset = self.asked.preset.filter(is_iterative).unwrap_or(Preset::Mumps);
                if preset == Preset::Icc && is_parallel {
                    // each rank factors its own rows
                    let of_blocks = [("pc_type", "bjacobi"), ("sub_pc_type", "icc"), ("sub_pc_factor_levels", "1")];
                    of_blocks.iter().for_each(|(name, value)| self.asked.whole.set_default(name, value));
                }
                preset::apply(&mut self.asked.whole, preset, None);
            }
            Linear::Multigrid => {
                preset::made_often(&mut self.asked.whole);
                preset::apply(&mut self.asked.whole, Preset::Hypre, smoother(is_parallel, is_quadratic));
            }
            Linear::Sweeps => {
                for BodyPlan { facts, preset, is_distributed, .. } in &mut self.plan.bodies {
                    let smoother = smoother(*is_distributed, facts.is_quadratic);
                    preset::apply(&mut facts.options, *preset, smoother);
                }
            }
        }
    }
}

impl JointParts {
    /// Add a body with this number. If its dofs are distributed, the columns of its `interpolation` are those of all
    /// bodies. `modes` are its rigid motions.
    fn add(
        &mut self,
        body: usize,
        stiffness: Csr,
        interpolation: Option<Prolongation>,
        modes: Vec<Vec<f64>>,
        is_distributed: bool,
    ) {
        self.stiffness.insert(body, stiffness);
        if let Some(next) = interpolation {
            let whole = self.interpolation.get_or_insert_with(|| Prolongation { rows: Csr::new(0), own: 0 });
            let first = if is_distributed { 0 } else { whole.rows.columns };
            whole.append(&next, first);
        }
        // each motion moves all bodies at once: few cells do not see the difference
        self.near_null_space.resize(modes.len(), Vec::new());
        self.near_null_space.iter_mut().zip(modes).for_each(|(whole, mode)| whole.extend(mode));
    }
}

/// Return whether the matrix of all bodies would be factored.
fn factors(asked: &SolverRequest) -> bool {
    matches!(asked.whole.get("pc_type"), Some("cholesky" | "lu"))
}

/// Return whether a plan condenses a body or factors the matrix of all bodies.
fn eliminates(plan: &Plan, asked: &SolverRequest, body: usize) -> bool {
    plan.bodies[body].preset == Preset::Condensed || (plan.linear == Linear::Direct && factors(asked))
}

impl Factory for SolverFactory<'_> {
    type SolverPlan = Plan;

    fn plan(&mut self, bodies: Vec<(BodyFacts, Vec<usize>)>, is_kept: &mut [bool]) -> Result<Plan> {
        preset::check(self.asked.preset, HAS_HYPRE)?;
        let (mut facts, interfaces): (Vec<BodyFacts>, Vec<Vec<usize>>) = bodies.into_iter().unzip();
        let before = self.before.as_ref().map(|before| &before.plan.bodies);
        for (index, body) in facts.iter_mut().enumerate() {
            let was_condensed =
                before.and_then(|before| before.get(index)).is_some_and(|body| body.preset == Preset::Condensed);
            (body.is_kept, body.options) = (is_kept[index] && was_condensed, self.typed.of(&body.name));
        }
        // the free memory, which changes from moment to moment, does not change the solvers of the same bodies
        let is_same = |before: &&Solvers| before.asked.is_like(&self.asked) && !is_kept.contains(&false);
        let before = self.before.as_ref().filter(is_same).map(|before| before.plan.clone());
        self.follow(before.unwrap_or_else(|| plan(facts, &self.asked)));
        self.keep_solvers(is_kept);
        for (index, (body, interface)) in self.plan.bodies.iter_mut().zip(interfaces).enumerate() {
            body.interface = Some(interface).filter(|_| body.preset == Preset::Condensed && !is_kept[index]);
        }
        Ok(self.plan.clone())
    }

    fn adopt(&mut self, mut plan: Plan) {
        plan.bodies.iter_mut().for_each(|body| body.facts.options = self.typed.of(&body.facts.name));
        self.follow(plan);
    }

    fn settle(&mut self, is_renewed: bool) {
        self.step = self.step.take().filter(|_| is_renewed && self.has_same_steps());
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

    fn eliminates(&self, body: usize) -> bool {
        eliminates(&self.plan, &self.asked, body)
    }

    fn wants_interpolation(&self, name: &str) -> bool {
        let has_levels = |chosen: &Chosen| chosen.get("pc_type") == Some("mg");
        match self.plan.linear {
            Linear::Multigrid => self.is_quadratic() && has_levels(&self.asked.whole),
            Linear::Sweeps => self.plan.bodies.iter().any(|BodyPlan { facts, preset, .. }| {
                let is_it = facts.name == name && *preset != Preset::Condensed;
                is_it && facts.is_quadratic && has_levels(&facts.options)
            }),
            _ => false,
        }
    }

    fn make(&mut self, assembled: Assembled) -> Result<Body> {
        let Assembled {
            name,
            dimension,
            stiffness,
            loads,
            distribution,
            rows,
            near_null_space,
            unconstrained_modes,
            interpolation,
        } = assembled;
        let missing = || Error::new(Kind::Solver, format!("no solver is planned for body `{name}`"));
        let index = self.plan.bodies.iter().position(|body| body.facts.name == name).ok_or_else(missing)?;
        let planned = &mut self.plan.bodies[index];
        let (session, chosen) = (self.session.clone(), planned.facts.options.clone());
        if let Some(interface) = planned.interface.take() {
            let dofs = Dofs::on_interface(&interface, &rows, &unconstrained_modes);
            return Ok(Body::to_condense(session, chosen, dimension, stiffness, loads, dofs, interface));
        }
        let is_swept = self.plan.linear == Linear::Sweeps;
        let words = preset::in_words(if is_swept { &chosen } else { &self.asked.whole });
        let is_gamg = self.asked.whole.get("pc_type") == Some("gamg");
        let mut modes: Vec<Vec<f64>> = if is_swept || is_gamg { near_null_space() } else { Vec::new() };
        if let Some(distribution) = &distribution {
            modes.iter_mut().for_each(|mode| *mode = distribution.of_known(mode));
        }
        let is_distributed = distribution.is_some();
        let body = Body::new(&stiffness, loads, rows, unconstrained_modes, distribution, words);
        if is_swept {
            let make: MakeSolver = Box::new(move |stiffness: Rows| {
                Ok(Box::new(Krylov::new(&session, chosen, dimension, stiffness, &modes, interpolation)?))
            });
            return Ok(body.with_solver(stiffness, make));
        }
        self.joint.add(index, stiffness, interpolation, modes, is_distributed);
        Ok(body)
    }
}
