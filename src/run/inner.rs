//! The inner solvers: those requested, or the program's choice with its reason. Newton's method joins the bodies in one matrix if all are condensed,
//! factored, or solved by multigrid; they then need no solver of their own. Otherwise every body has one, and sweeps solve the linear steps.
//! The first rank makes the choice, and the other ranks follow its plan.

use super::in_words;
use crate::discretize::{Assembled, Factory, Outline};
use crate::error::{Error, Kind, Result};
use crate::fem::Prolongation;
use crate::file::available_memory;
use crate::linalg::Csr;
use crate::model::{BodySlot, Local};
use crate::parallel::owners;
use crate::petsc::{HAS_HYPRE, Rows, Session};
use crate::problem::{Linear, MethodName, Order, Preset};
use crate::scene::Scene;
use crate::solver::cost::{self, BodySize, Comparison, StepSolver};
use crate::solver::names::WHOLE;
use crate::solver::options::{Chosen, UserOptions};
use crate::solver::preset::{self, Size, Smoother};
use crate::solver::{InterfaceDofs, Krylov, SparseBody, Uncondensed};
use mpi::collective::SystemOperation;
use mpi::traits::CommunicatorCollectives;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, HashMap};

/// A factory that chooses and makes the inner solvers of a scene's bodies.
pub struct SolverFactory<'a> {
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
    typed: UserOptions,
    /// Options of the matrix of all bodies.
    pub whole: Chosen,
    /// Interpolation of the displacements of all bodies from linear ones, if bodies have quadratic elements and multigrid.
    pub interpolation: Option<Prolongation>,
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

impl<'a> SolverFactory<'a> {
    /// Start from the free memory and the options that the user wrote. This scene can reuse the bodies `kept` of an earlier one. Collective.
    pub fn new(session: &'a Session, scene: &Scene, kept: Vec<BodySlot>) -> Result<Self> {
        let mine = available_memory() as u64;
        let mut least = mine;
        if session.size() > 1 {
            session.world().all_reduce_into(&mine, &mut least, SystemOperation::min());
        }
        let typed = UserOptions::read(session);
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
        let is_typed = self.plans.iter().any(|plan| plan.chosen.asks_for_ksp());
        if self.method == MethodName::Auto && self.may_join() && self.linear == Linear::Sweeps && is_typed {
            return "as typed for each body, so that linear steps are sweeps; `--method newton` joins the bodies in one matrix"
                .to_owned();
        }
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
        let size = Size { dofs: plan.dofs, interface: plan.on_contact(), memory };
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
                _ if joined => StepSolver::Joined,
                MethodName::Auto | MethodName::Newton | MethodName::NewtonRobin => StepSolver::Swept,
                MethodName::Robin => StepSolver::Sweeps,
            };
            let graphs: Vec<_> = outlines.iter().map(|outline| (outline.graph)()).collect();
            let candidates = plans.iter().zip(&graphs).map(|(plan, graph)| {
                let interface = plan.interface.as_ref().filter(|_| plan.condensable);
                BodySize { dofs: plan.dofs, order: plan.order, interface, couplings: graph.col.len() }
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

impl SolverFactory<'_> {
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

impl Factory for SolverFactory<'_> {
    type SolverPlan = Decisions;

    fn plan(&mut self, outlines: &[Outline]) -> Result<Decisions> {
        preset::check(self.asked, HAS_HYPRE)?;
        let mut plans = Vec::new();
        // This marks the bodies for which the program is to choose.
        let mut open = Vec::new();
        for (index, &Outline { name, dimension, order, rows, prescribed, motions, .. }) in outlines.iter().enumerate() {
            let (dofs, interface) = (rows.columns, InterfaceDofs::new(dimension, rows, prescribed, motions));
            let chosen = self.typed.of(name);
            // A KSP for all bodies together needs them uncondensed.
            let typed = chosen.asks_for_ksp() || (self.may_join() && self.whole.asks_for_ksp());
            let condensable = (1..dofs).contains(&interface.dofs.len()) && !typed;
            let asked = self.asked_for(typed, condensable);
            open.push(asked.is_none());
            let (preset, reason) =
                asked.map_or((Preset::Mumps, String::new()), |(preset, why)| (preset, why.to_owned()));
            let (name, interface) = (name.to_owned(), Some(interface));
            self.places.insert(name.clone(), index);
            plans.push(Plan { name, chosen, preset, reason, dimension, order, dofs, condensable, interface });
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
            plan.interface = plan.interface.take().filter(|_| plan.preset == Preset::Condensed);
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
            Linear::Direct | Linear::Multigrid if self.session.size() > 1 && !is_whole => {
                vec![bodies.collect()]
            }
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

    fn make(&mut self, assembled: Assembled) -> Result<Local> {
        let Assembled { name, dimension, body, distribution, rows, motions, left, interpolation } = assembled;
        let Some(plan) = self.places.get(&name).map(|&place| &mut self.plans[place]) else {
            return Err(Error::new(Kind::Solver, format!("no solver is planned for body `{name}`")));
        };
        let (session, chosen) = (self.session.clone(), plan.chosen.clone());
        if let Some(interface) = plan.interface.take() {
            let words = interface.in_words();
            let whole = Uncondensed { session, chosen, dimension, body, free: left, interface };
            return Ok(Local::Uncondensed { words, condense: Box::new(|| Ok(Box::new(whole.condense()?))) });
        }
        let words = match self.linear {
            Linear::Sweeps => preset::in_words(&chosen),
            _ => preset::in_words(&self.whole),
        };
        let mut levels = interpolation;
        if self.linear == Linear::Multigrid
            && let Some(next) = levels.take()
        {
            let empty = || Prolongation { rows: Csr::new(0), own: 0 };
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
        Ok(Local::Ready(Box::new(SparseBody::new(body, rows, &left, distribution, make, words))))
    }

    fn kept(&mut self, name: &str) -> Option<BodySlot> {
        self.kept.remove(name).filter(|slot| slot.local.as_ref().is_some())
    }
}

/// Largest number of dofs of all condensed bodies together for which their dense matrix is factored. It takes 0.2 s and 250 MB.
const DENSE: usize = 3000;

/// The choice of a solver for a body, made by the first rank. Other ranks do not get what is skipped here.
#[derive(Clone, Serialize, Deserialize)]
pub struct Plan {
    /// Name of the body.
    pub name: String,
    /// PETSc options of the body, which each rank reads.
    #[serde(skip)]
    pub chosen: Chosen,
    /// Preset of its solver.
    pub preset: Preset,
    /// Reason for the preset, in words.
    #[serde(skip)]
    pub reason: String,
    /// Number of dofs of a node.
    pub dimension: usize,
    /// Order of the elements.
    pub order: Order,
    /// Number of dofs of the body.
    pub dofs: usize,
    /// Whether the body could be condensed.
    #[serde(skip)]
    pub condensable: bool,
    /// Interface dofs of a condensed body, until it is made.
    pub interface: Option<InterfaceDofs>,
}

impl Plan {
    /// Return the number of dofs that a condensed body would keep.
    fn on_contact(&self) -> usize {
        self.interface.as_ref().map_or(0, |interface| interface.dofs.len())
    }
}

/// Give all bodies presets that Newton's method can join. They get multigrid if one of them needs it. In the plane they get one
/// factorisation if together they have too many dofs on the contact for one dense matrix.
pub fn agree(plans: &mut [Plan]) {
    let dense: usize = plans.iter().filter(|plan| plan.preset == Preset::Condensed).map(Plan::on_contact).sum();
    let needs = plans.iter().find(|plan| plan.preset == Preset::Hypre).map(|plan| plan.name.clone());
    let (preset, why) = match needs {
        Some(first) => (Preset::Hypre, format!("`{first}` has it, and Newton's method joins the bodies")),
        None if dense > DENSE && plans.iter().any(|plan| plan.dimension == 2) => {
            (Preset::Mumps, format!("{dense} of all bodies are on the contact: too many to join by dense algebra"))
        }
        None => return,
    };
    for plan in plans.iter_mut().filter(|plan| plan.preset != preset) {
        plan.preset = preset;
        plan.reason = format!("{} dofs; {why}", plan.dofs);
    }
}

/// Dofs for which a rank could solve in the time of the messages of a distributed body. An iteration of conjugate gradients with
/// multigrid takes 0.5 us per dof (docs/scaling.md, 48^3: 42 s, 116 iterations, 705 894 dofs). It has some 50 messages of 10 us:
/// four exchanges with neighbours on each of eight levels, and a few sums.
///
/// Measurements on two ranks of one machine (`patch-3d`, nu = 2, `ncg`, hypre) had 3993, 10 125 and 27 783 dofs. An iteration
/// takes -28, 80 and 339 us more than half of that of one rank, which is the work of 0, 540 and 1900 dofs.
const MESSAGES: usize = 1000;

/// Return whether each body is distributed over all ranks. The largest ones are, as many as make the sweep shortest. Each other
/// body stays whole on one rank. If there are as many bodies as ranks and they are about equally large, all stay whole.
fn distributed_bodies(plans: &[Plan], ranks: usize) -> Vec<bool> {
    let loads: Vec<usize> = plans.iter().map(|plan| plan.dofs).collect();
    let may: Vec<bool> = plans.iter().map(|plan| plan.preset != Preset::Condensed && is_for_several(plan)).collect();
    largest(&loads, &may, ranks)
}

/// Return whether each body is distributed, from the dofs of each (`loads`) and from whether it `may` be distributed.
fn largest(loads: &[usize], may: &[bool], ranks: usize) -> Vec<bool> {
    let mut order: Vec<usize> = (0..loads.len()).filter(|&body| may[body]).collect();
    order.sort_by_key(|&body| (std::cmp::Reverse(loads[body]), body));
    // One rank gains nothing.
    order.truncate(if ranks > 1 { order.len() } else { 0 });
    let among = |count: usize| {
        let mut distributed = vec![false; loads.len()];
        order[..count].iter().for_each(|&body| distributed[body] = true);
        distributed
    };
    let time = |count: &usize| {
        let distributed = among(*count);
        let whole: Vec<usize> =
            loads.iter().zip(&distributed).map(|(load, distributed)| if *distributed { 0 } else { *load }).collect();
        let mut busy = vec![0; ranks];
        owners(&whole, ranks).into_iter().zip(&whole).for_each(|(rank, load)| busy[rank] += load);
        let together: usize = order[..*count].iter().map(|&body| loads[body] / ranks + MESSAGES).sum();
        together + busy.into_iter().max().unwrap_or(0)
    };
    // If times are equal, the fewest bodies are distributed.
    among((0..=order.len()).min_by_key(time).unwrap_or(0))
}

/// Return whether the solver of a body, and all solvers that the user nests in it, work with rows on several ranks.
fn is_for_several(plan: &Plan) -> bool {
    let chosen = &plan.chosen;
    if chosen.typed("pc_type").is_none() && plan.preset == Preset::Icc {
        return false;
    }
    let works = |name: &str, value: &str| match value {
        "hypre" | "gamg" | "jacobi" | "pbjacobi" | "none" | "mg" => true,
        "cholesky" | "lu" => {
            let package = name.replace("pc_type", "pc_factor_mat_solver_type");
            chosen.typed(&package).is_none_or(|package| package == "mumps")
        }
        _ => false,
    };
    chosen.all_typed().filter(|(name, _)| name.ends_with("pc_type")).all(|(name, value)| works(name, value))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::rigid::AtDofs;

    /// Return the plan of a body in space whose contact rows have `contact` dofs.
    fn plan(name: &str, preset: Preset, contact: usize) -> Plan {
        let mut rows = Csr::new(30_000);
        (0..contact).for_each(|i| rows.push_row([(3 * i, 1.0)]));
        let prescribed: Vec<(usize, f64)> = (29_000..30_000).map(|dof| (dof, 0.0)).collect();
        let interface = Some(InterfaceDofs::new(3, &rows, &prescribed, AtDofs::NONE));
        let chosen = UserOptions::default().of(name);
        Plan {
            name: name.to_owned(),
            chosen,
            preset,
            reason: "its own".to_owned(),
            dimension: 3,
            order: Order::P1,
            dofs: 30_000,
            condensable: true,
            interface,
        }
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

    /// In the plane, two contacts of 1500 dofs are joined by dense algebra. With one dof more they are joined by one
    /// factorisation.
    #[test]
    fn wide_contacts_in_the_plane_are_joined_by_a_factorisation() {
        let pair = |more: usize| {
            let mut pair = [plan("a", Preset::Condensed, 1500), plan("b", Preset::Condensed, 1500 + more)];
            pair.iter_mut().for_each(|plan| plan.dimension = 2);
            pair
        };
        let mut narrow = pair(0);
        agree(&mut narrow);
        assert_eq!(presets(&narrow), [Preset::Condensed; 2]);
        let mut flat = pair(1);
        agree(&mut flat);
        assert_eq!(presets(&flat), [Preset::Mumps; 2]);
    }

    /// A single body is distributed. If bodies are unequal, the large one is distributed, and the other one if that gains more
    /// than its messages take. If there are as many equal bodies as ranks, none is distributed. With one body too many, one is.
    #[test]
    fn large_bodies_are_distributed() {
        let distributed = |loads: &[usize], ranks| largest(loads, &vec![true; loads.len()], ranks);
        assert_eq!(distributed(&[100_000], 2), [true]);
        assert_eq!(distributed(&[100_000], 1), [false]);
        assert_eq!(distributed(&[1_500, 80_000], 2), [false, true]);
        assert_eq!(distributed(&[10_000, 80_000], 2), [true, true]);
        assert_eq!(distributed(&[50_000, 50_000], 2), [false, false]);
        assert_eq!(distributed(&[50_000, 50_000], 3), [true, true]);
        assert_eq!(distributed(&[50_000; 3], 2), [true, false, false]);
        assert_eq!(distributed(&[50_000; 64], 8), [false; 64]);
        // The messages take longer than the gain.
        assert_eq!(distributed(&[600, 600], 3), [false, false]);
        assert_eq!(largest(&[80_000, 10_000], &[false, true], 4), [false, false]);
    }
}
