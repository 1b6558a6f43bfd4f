//! The inner solvers: those requested, or the program's choice with its reason. Newton's method joins the bodies in one matrix if all are condensed,
//! factored, or solved by multigrid; they then need no solver of their own. Otherwise every body has one, and sweeps solve the linear steps.

mod factory;

pub use factory::Decisions;

use super::plan::{DENSE, Plan, agree};
use super::words::in_words;
use crate::discretize::Outline;
use crate::error::Result;
use crate::fem::Interpolation;
use crate::file::available_memory;
use crate::model::BodySlot;
use crate::petsc::Session;
use crate::problem::{Linear, MethodName, Order, Preset};
use crate::scene::Scene;
use crate::solver::cost::{self, Candidate, Comparison, Step};
use crate::solver::names::WHOLE;
use crate::solver::options::{Chosen, Typed};
use crate::solver::preset::{self, Size};
use mpi::collective::SystemOperation;
use mpi::traits::CommunicatorCollectives;
use std::collections::{BTreeMap, HashMap};

/// A factory that chooses and makes the inner solvers of a scene's bodies.
pub struct Inner<'a> {
    session: &'a Session,
    /// Preset that the scene names.
    asked: Option<Preset>,
    /// Bytes that the solvers planned so far leave free, on the rank that has least.
    memory: usize,
    method: MethodName,
    /// Solver of linear steps that the scene requests.
    wanted: Option<Linear>,
    /// Solver of linear steps, from the plan on.
    pub linear: Linear,
    /// Options that the user wrote for the solvers.
    typed: Typed,
    /// Options of the matrix of all bodies.
    pub whole: Chosen,
    /// Interpolation of the displacements of all bodies from linear ones, if bodies have quadratic elements and multigrid.
    pub interpolation: Option<Interpolation>,
    /// Estimated seconds of set-up and iteration, from the choice of solvers of bodies in space; `None` if nothing was estimated.
    pub seconds: Option<f64>,
    plans: Vec<Plan>,
    /// Whether each body is distributed over the ranks, if sweeps solve linear steps.
    distributed: Vec<bool>,
    /// Index of each body in `plans`.
    places: HashMap<String, usize>,
    /// Condensed bodies that an earlier scene has left. `local` exists on the rank that owns the body.
    kept: HashMap<String, BodySlot>,
}

impl<'a> Inner<'a> {
    /// Start from the free memory and the options that the user wrote. This scene can reuse the bodies `kept` of an earlier one. Collective.
    pub fn new(session: &'a Session, scene: &Scene, kept: Vec<BodySlot>) -> Result<Self> {
        let mine = available_memory() as u64;
        let mut least = mine;
        if session.size() > 1 {
            session.world().all_reduce_into(&mine, &mut least, SystemOperation::min());
        }
        let typed = Typed::read(session)?;
        Ok(Self {
            session,
            asked: scene.solver.preset,
            memory: least as usize,
            method: scene.method.name,
            wanted: scene.method.linear,
            linear: Linear::Sweeps,
            whole: typed.of(WHOLE),
            interpolation: None,
            typed,
            seconds: None,
            plans: Vec::new(),
            distributed: Vec::new(),
            places: HashMap::new(),
            kept: kept.into_iter().map(|slot| (slot.name.clone(), slot)).collect(),
        })
    }

    /// Return the reason for the solvers in words. Each kind of solver is named once, with the reason of its largest body.
    pub fn reason(&self) -> String {
        let mut kinds: Vec<Vec<&Plan>> = Vec::new();
        for plan in &self.plans {
            match kinds.iter_mut().find(|kind| kind[0].preset == plan.preset) {
                Some(kind) => kind.push(plan),
                None => kinds.push(vec![plan]),
            }
        }
        let is_one = kinds.len() == 1;
        let of_kind = |kind: Vec<&Plan>| {
            let largest = kind.iter().max_by_key(|plan| plan.dofs)?;
            Some(match kind.len() {
                _ if is_one => largest.reason.clone(),
                1 => format!("{}: {}", largest.name, largest.reason),
                count => format!("{count} bodies, the largest {}: {}", largest.name, largest.reason),
            })
        };
        kinds.into_iter().filter_map(of_kind).collect::<Vec<_>>().join("; ")
    }

    /// Return the options of all PETSc solvers of a run: of bodies that sweeps solve by one, or of the matrix of all bodies.
    pub fn into_options(self) -> Vec<Chosen> {
        match self.linear {
            Linear::Dense => Vec::new(),
            Linear::Direct | Linear::Multigrid => vec![self.whole],
            Linear::Sweeps => {
                let solved = self.plans.into_iter().filter(|plan| plan.preset != Preset::Condensed);
                solved.map(|plan| plan.chosen).collect()
            }
        }
    }

    /// Return whether a body has quadratic elements.
    fn is_quadratic(&self) -> bool {
        self.plans.iter().any(|plan| plan.order == Order::P2)
    }

    /// Return the warnings of solvers that apply a preconditioner once instead of solving, one for each kind.
    pub fn applied_once(&self) -> Vec<String> {
        let chosen: Vec<&Chosen> = match self.linear {
            Linear::Sweeps => self.plans.iter().map(|plan| &plan.chosen).collect(),
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
        let condensed = self.plans.iter().filter(|plan| plan.preset == Preset::Condensed);
        condensed.map(|plan| plan.name.clone()).collect()
    }

    /// Return whether the program's choice of solvers factors a matrix.
    pub fn factors(&self) -> bool {
        let direct = |plan: &Plan| matches!(plan.preset, Preset::Condensed | Preset::Mumps);
        self.linear != Linear::Multigrid && self.plans.iter().any(direct)
    }

    /// Return the requested solver of a body with the reason, or `None` for the program's choice. `condensable` is whether it can be condensed.
    fn asked_for(&self, typed: bool, condensable: bool) -> Option<(Preset, &'static str)> {
        match (self.asked, self.wanted) {
            (Some(Preset::Condensed), _) if !condensable => {
                Some((Preset::Mumps, if typed { "PETSc options were typed" } else { "there is nothing to condense" }))
            }
            (Some(preset), _) => Some((preset, "the scene asks for it")),
            (None, Some(Linear::Dense)) if condensable => {
                Some((Preset::Condensed, "the scene asks for dense linear steps"))
            }
            (None, Some(Linear::Direct)) => Some((Preset::Mumps, "the scene asks for direct linear steps")),
            (None, Some(Linear::Multigrid)) => Some((Preset::Hypre, "the scene asks for linear steps by multigrid")),
            _ => None,
        }
    }

    /// Return whether Newton's method may use one matrix of all bodies.
    fn may_join(&self) -> bool {
        let newton = matches!(self.method, MethodName::Auto | MethodName::Newton);
        newton && self.wanted != Some(Linear::Sweeps)
    }

    /// Choose the solver of a body in the plane.
    fn choose_in_plane(&mut self, plan: &mut Plan) {
        // The memory of a reused body is allocated already.
        let is_kept = self.kept.contains_key(&plan.name);
        let memory = if is_kept { usize::MAX } else { self.memory };
        let size = Size { dofs: plan.dofs, retained: plan.on_contact(), memory };
        (plan.preset, plan.reason) = preset::in_plane(&size);
        if plan.preset == Preset::Condensed && !plan.condensable {
            plan.preset = Preset::Mumps;
        }
        if !is_kept && plan.preset != Preset::Hypre {
            self.memory = self.memory.saturating_sub(size.bytes(plan.preset));
        }
    }

    /// Choose the solvers of bodies in space, for all together if Newton's method may join them.
    fn choose_in_space(&mut self, plans: &mut [&mut Plan], outlines: &[&Outline]) {
        let joined = self.may_join();
        let size = if joined { plans.len().max(1) } else { 1 };
        for (plans, outlines) in plans.chunks_mut(size).zip(outlines.chunks(size)) {
            let step = match self.method {
                _ if joined => Step::Joined,
                MethodName::Auto | MethodName::Newton | MethodName::NewtonRobin => Step::Swept,
                MethodName::Robin | MethodName::Ncg | MethodName::Anderson => Step::Sweeps,
            };
            let graphs: Vec<_> = outlines.iter().map(|outline| (outline.graph)()).collect();
            let candidates = plans.iter().zip(&graphs).map(|(plan, graph)| {
                let retained = plan.retained.as_ref().filter(|_| plan.condensable);
                Candidate { dofs: plan.dofs, order: plan.order, retained, couplings: graph.col.len() }
            });
            let candidates: Vec<_> = candidates.collect();
            // The memory of reused bodies is allocated already.
            let are_kept = plans.iter().all(|plan| self.kept.contains_key(&plan.name));
            let memory = if are_kept { usize::MAX } else { self.memory };
            let mut comparison = Comparison::of_cubes(&candidates, step, cost::REFERENCE);
            if comparison.is_worth_a_look() {
                comparison = Comparison::of_cubes(&candidates, step, cost::products());
            }
            if !comparison.is_known(&candidates, memory) {
                let graphs: Vec<_> = graphs.iter().map(|graph| (&graph.ptr[..], &graph.col[..])).collect();
                comparison = comparison.analysed(&candidates, &graphs);
            }
            let is_direct = comparison.is_direct(memory);
            let Comparison { direct, multigrid, .. } = comparison;
            *self.seconds.get_or_insert(0.0) += if is_direct { direct.seconds } else { multigrid.seconds };
            if is_direct && !are_kept {
                self.memory = self.memory.saturating_sub(direct.bytes as usize);
            }
            let dofs: usize = plans.iter().map(|plan| plan.dofs).sum();
            let on_contact: usize = plans.iter().map(|plan| plan.on_contact()).sum();
            let (direct, multigrid) = (direct.words(), multigrid.words());
            let reason = format!(
                "{dofs} dofs in space, {on_contact} of them on the contact; estimates: factored {direct}, multigrid {multigrid}"
            );
            for plan in plans {
                plan.preset = match is_direct {
                    true if plan.condensable => Preset::Condensed,
                    true => Preset::Mumps,
                    false => Preset::Hypre,
                };
                plan.reason.clone_from(&reason);
            }
        }
    }

    /// Return the solver of linear steps, once bodies have their presets.
    fn join(&mut self) -> Result<Linear> {
        if !self.may_join() {
            return Ok(Linear::Sweeps);
        }
        let mut typed = false;
        for Plan { chosen, .. } in &self.plans {
            typed |= chosen.asks_for_ksp();
            // Options typed for one body apply to that body alone, so the bodies are not joined.
            if self.method == MethodName::Auto && chosen.has_own() && chosen.asks_for_ksp() {
                return Ok(Linear::Sweeps);
            }
        }
        if self.asked.is_none() && self.wanted.is_none() && !typed {
            agree(&mut self.plans);
        }
        let all = |preset: Preset| self.plans.iter().all(|plan| plan.preset == preset);
        let dense: usize = self.plans.iter().map(Plan::on_contact).sum();
        let in_space = self.plans.iter().all(|plan| plan.dimension == 3);
        Ok(match self.whole.typed("pc_type") {
            Some("hypre") => Linear::Multigrid,
            Some("mg") if self.is_quadratic() => Linear::Multigrid,
            Some("cholesky" | "lu") => Linear::Direct,
            Some(_) if self.method == MethodName::Auto && !self.whole.has_own() => Linear::Sweeps,
            None if all(Preset::Condensed)
                && !self.whole.asks_for_ksp()
                && (in_space || dense <= DENSE || self.wanted.is_some()) =>
            {
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
