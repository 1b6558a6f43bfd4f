//! The plan of a run's linear algebra: from facts of the bodies and from what is asked for to the inner solvers.
//!
//! Newton's method joins the bodies in one matrix if all are condensed, factored, or solved by multigrid. They then need no solver of their own.
//! Otherwise every body has one, and sweeps solve the linear steps. The first rank makes the plan, and the other ranks follow it.

use crate::parallel::owners;
use crate::problem::{Linear, MethodName, Preset};
use crate::solver::cost::{BodySize, Comparison};
use crate::solver::preset::{self, Size};
use serde::{Deserialize, Serialize};

/// The facts of a body on which its solver depends.
#[derive(Debug, Clone)]
pub struct Facts {
    /// Name in the scene.
    pub name: String,
    /// Space dimension.
    pub dimension: usize,
    /// Dofs, contact and shape, as they matter for costs.
    pub size: BodySize,
    /// Number of dofs that a condensed body keeps. It can be condensed if this is neither zero nor the number of all dofs.
    pub interface: usize,
    /// Whether a condensed body of an earlier scene serves, so that its memory is allocated already.
    pub is_kept: bool,
    /// Options that the user wrote for its solver.
    pub typed: Typed,
}

/// What the plan asks of the options that the user wrote for a solver.
#[derive(Debug, Clone, Default)]
pub struct Typed {
    /// Whether they choose or steer a KSP of PETSc.
    pub asks_for_ksp: bool,
    /// Whether some are for this solver alone.
    pub has_own: bool,
    /// The preconditioner.
    pub pc: Option<String>,
    /// Whether all preconditioners, also nested ones, work with rows on several ranks.
    pub is_for_one_rank: bool,
}

/// What the user asks for, and what the machine has.
#[derive(Debug, Clone)]
pub struct Asked {
    /// Preset that the scene names.
    pub preset: Option<Preset>,
    /// Solver of linear steps that the scene names.
    pub linear: Option<Linear>,
    /// The method.
    pub method: MethodName,
    /// Options that the user wrote for the matrix of all bodies.
    pub whole: Typed,
    /// Bytes that are free, on the rank that has least.
    pub memory: usize,
    /// Number of ranks.
    pub ranks: usize,
}

/// The plan.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Plan {
    /// Solver of linear steps.
    pub linear: Linear,
    /// The solver of each body.
    pub bodies: Vec<BodyPlan>,
    /// Estimated seconds of set-up and iteration; `None` if nothing was estimated.
    #[serde(skip)]
    pub seconds: Option<f64>,
}

/// The solver of a body.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct BodyPlan {
    /// Its preset.
    pub preset: Preset,
    /// Whether its dofs are distributed over the ranks in a matrix of its own.
    pub is_distributed: bool,
    /// Reason for the preset, in words; other ranks do not get it.
    #[serde(skip)]
    pub reason: String,
}

/// Largest number of dofs of all condensed bodies together for which their dense matrix is factored. It takes 0.2 s and 250 MB.
const DENSE: usize = 3000;

/// Return the plan for bodies with these facts.
pub fn plan(facts: &[Facts], asked: &Asked) -> Plan {
    let mut seconds = None;
    let mut chosen: Vec<Option<BodyPlan>> = facts.iter().map(|body| asked.for_body(body)).collect();
    let open: Vec<usize> = (0..facts.len()).filter(|&body| chosen[body].is_none()).collect();
    let mut memory = asked.memory;
    match facts.first().map(|body| body.dimension) {
        Some(2) => {
            for &body in &open {
                chosen[body] = Some(in_plane(&facts[body], asked, &mut memory));
            }
        }
        _ => {
            let together = if asked.may_join() { open.len().max(1) } else { 1 };
            for group in open.chunks(together) {
                let bodies: Vec<&Facts> = group.iter().map(|&body| &facts[body]).collect();
                let (plan, cost) = in_space(&bodies, asked, &mut memory);
                *seconds.get_or_insert(0.0) += cost;
                group.iter().zip(plan).for_each(|(&body, plan)| chosen[body] = Some(plan));
            }
        }
    }
    let mut bodies: Vec<BodyPlan> = chosen.into_iter().flatten().collect();
    let linear = linear_step(facts, asked, &mut bodies);
    if linear == Linear::Sweeps {
        distribute(facts, asked.ranks, &mut bodies);
    }
    Plan { linear, bodies, seconds }
}

impl BodyPlan {
    fn new(preset: Preset, reason: impl Into<String>) -> Self {
        Self { preset, is_distributed: false, reason: reason.into() }
    }
}

impl Asked {
    /// Return whether Newton's method may use one matrix of all bodies.
    pub fn may_join(&self) -> bool {
        let newton = matches!(self.method, MethodName::Auto | MethodName::Newton);
        newton && self.linear != Some(Linear::Sweeps)
    }

    /// Return whether the user wants a KSP of PETSc for a body; a KSP for all bodies together needs them uncondensed.
    fn wants_ksp(&self, body: &Facts) -> bool {
        body.typed.asks_for_ksp || (self.may_join() && self.whole.asks_for_ksp)
    }

    /// Return whether a body may be condensed.
    fn may_condense(&self, body: &Facts) -> bool {
        (1..body.size.dofs).contains(&body.interface) && !self.wants_ksp(body)
    }

    /// Return the solver of a body that the user asks for, or `None` for the program's choice.
    fn for_body(&self, body: &Facts) -> Option<BodyPlan> {
        let may_condense = self.may_condense(body);
        let (preset, why) = match (self.preset, self.linear) {
            (Some(Preset::Condensed), _) if !may_condense => (
                Preset::Mumps,
                if self.wants_ksp(body) { "PETSc options were typed" } else { "there is nothing to condense" },
            ),
            (Some(preset), _) => (preset, "the scene asks for it"),
            (None, Some(Linear::Dense)) if may_condense => (Preset::Condensed, "the scene asks for dense linear steps"),
            (None, Some(Linear::Direct)) => (Preset::Mumps, "the scene asks for direct linear steps"),
            (None, Some(Linear::Multigrid)) => (Preset::Hypre, "the scene asks for linear steps by multigrid"),
            _ => return None,
        };
        Some(BodyPlan::new(preset, why))
    }
}

/// Choose the solver of a body in the plane, and take its memory.
fn in_plane(body: &Facts, asked: &Asked, memory: &mut usize) -> BodyPlan {
    let free = if body.is_kept { usize::MAX } else { *memory };
    let size = Size { dofs: body.size.dofs, interface: body.interface, memory: free };
    let (mut preset, reason) = preset::in_plane(&size);
    if preset == Preset::Condensed && !asked.may_condense(body) {
        preset = Preset::Mumps;
    }
    if !body.is_kept && preset != Preset::Hypre {
        *memory = memory.saturating_sub(size.bytes(preset));
    }
    BodyPlan::new(preset, reason)
}

/// Choose the solvers of bodies in space, which are solved together or are one body, and take their memory. Return the estimated seconds, too.
fn in_space(bodies: &[&Facts], asked: &Asked, memory: &mut usize) -> (Vec<BodyPlan>, f64) {
    let sizes = bodies
        .iter()
        .map(|body| BodySize { interface: asked.may_condense(body).then_some(body.interface), ..body.size });
    let is_kept = bodies.iter().all(|body| body.is_kept);
    let comparison = Comparison::new(&sizes.collect::<Vec<_>>(), asked.method, asked.may_join());
    let is_direct = comparison.is_direct(if is_kept { usize::MAX } else { *memory });
    if is_direct && !is_kept {
        *memory = memory.saturating_sub(comparison.direct.bytes as usize);
    }
    let (dofs, interface): (usize, usize) =
        (bodies.iter().map(|body| body.size.dofs).sum(), bodies.iter().map(|body| body.interface).sum());
    let Comparison { direct, multigrid } = comparison;
    let (factored, iterated) = (direct.words(), multigrid.words());
    let reason = format!(
        "{dofs} dofs in space, {interface} of them on the contact; estimates: factored {factored}, multigrid {iterated}"
    );
    let of_body = |body: &&Facts| match is_direct {
        true if asked.may_condense(body) => Preset::Condensed,
        true => Preset::Mumps,
        false => Preset::Hypre,
    };
    let plans = bodies.iter().map(|body| BodyPlan::new(of_body(body), reason.clone())).collect();
    (plans, if is_direct { direct.seconds } else { multigrid.seconds })
}

/// Return the solver of linear steps for bodies with these presets. Where the program chose them, bodies first get presets that one matrix can have.
fn linear_step(facts: &[Facts], asked: &Asked, bodies: &mut [BodyPlan]) -> Linear {
    let is_auto = asked.method == MethodName::Auto;
    // options typed for one body apply to that body alone, so the bodies are not joined
    let is_apart = |body: &Facts| is_auto && body.typed.has_own && body.typed.asks_for_ksp;
    if !asked.may_join() || facts.iter().any(is_apart) {
        return Linear::Sweeps;
    }
    let is_typed = facts.iter().any(|body| body.typed.asks_for_ksp);
    if asked.preset.is_none() && asked.linear.is_none() && !is_typed {
        agree(facts, bodies);
    }
    let all = |preset: Preset| bodies.iter().all(|body| body.preset == preset);
    let fits_dense =
        asked.linear.is_some() || facts.iter().all(|body| body.dimension == 3) || on_contact(facts, bodies) <= DENSE;
    let is_quadratic = facts.iter().any(|body| body.size.is_quadratic);
    match asked.whole.pc.as_deref() {
        Some("hypre") => Linear::Multigrid,
        Some("mg") if is_quadratic => Linear::Multigrid,
        Some("cholesky" | "lu") => Linear::Direct,
        Some(_) if is_auto && !asked.whole.has_own => Linear::Sweeps,
        None if all(Preset::Condensed) && !asked.whole.asks_for_ksp && fits_dense => Linear::Dense,
        None if all(Preset::Hypre) => Linear::Multigrid,
        None if is_auto && bodies.iter().any(|body| matches!(body.preset, Preset::Gamg | Preset::Icc)) => {
            Linear::Sweeps
        }
        _ => Linear::Direct,
    }
}

/// Return the number of dofs of all condensed bodies together.
fn on_contact(facts: &[Facts], bodies: &[BodyPlan]) -> usize {
    let condensed = facts.iter().zip(bodies).filter(|(_, plan)| plan.preset == Preset::Condensed);
    condensed.map(|(body, _)| body.interface).sum()
}

/// Give all bodies presets that Newton's method can join. They get multigrid if one of them needs it. In the plane they get one
/// factorisation if together they have too many dofs on the contact for one dense matrix.
fn agree(facts: &[Facts], bodies: &mut [BodyPlan]) {
    let dense = on_contact(facts, bodies);
    let needs = facts.iter().zip(&*bodies).find(|(_, plan)| plan.preset == Preset::Hypre);
    let (preset, why) = match needs {
        Some((first, _)) => (Preset::Hypre, format!("`{}` has it, and Newton's method joins the bodies", first.name)),
        None if dense > DENSE && facts.iter().any(|body| body.dimension == 2) => {
            (Preset::Mumps, format!("{dense} of all bodies are on the contact: too many to join by dense algebra"))
        }
        None => return,
    };
    for (body, plan) in facts.iter().zip(bodies).filter(|(_, plan)| plan.preset != preset) {
        *plan = BodyPlan::new(preset, format!("{} dofs; {why}", body.size.dofs));
    }
}

/// Dofs for which a rank could solve in the time of the messages of a distributed body. An iteration of conjugate gradients with
/// multigrid takes 0.5 us per dof (docs/parallel.md, 48^3: 42 s, 116 iterations, 705 894 dofs). It has some 50 messages of 10 us:
/// four exchanges with neighbours on each of eight levels, and a few sums.
///
/// Measurements on two ranks of one machine (`patch-3d`, nu = 2, `ncg`, hypre) had 3993, 10 125 and 27 783 dofs. An iteration
/// takes -28, 80 and 339 us more than half of that of one rank, which is the work of 0, 540 and 1900 dofs.
const MESSAGES: usize = 1000;

/// Distribute the largest bodies over all ranks, as many as make a sweep shortest. Each other body stays whole on one rank. If there are as many
/// bodies as ranks and they are about equally large, all stay whole.
fn distribute(facts: &[Facts], ranks: usize, bodies: &mut [BodyPlan]) {
    let may = |(body, plan): (&Facts, &BodyPlan)| {
        plan.preset != Preset::Condensed
            && !body.typed.is_for_one_rank
            && (body.typed.pc.is_some() || plan.preset != Preset::Icc)
    };
    let loads: Vec<usize> = facts.iter().map(|body| body.size.dofs).collect();
    let may: Vec<bool> = facts.iter().zip(&*bodies).map(may).collect();
    let distributed = largest(&loads, &may, ranks);
    bodies.iter_mut().zip(distributed).for_each(|(plan, distributed)| plan.is_distributed = distributed);
}

/// Return whether each body is distributed, from the dofs of each (`loads`) and from whether it `may` be distributed.
fn largest(loads: &[usize], may: &[bool], ranks: usize) -> Vec<bool> {
    let mut order: Vec<usize> = (0..loads.len()).filter(|&body| may[body]).collect();
    order.sort_by_key(|&body| (std::cmp::Reverse(loads[body]), body));
    // one rank gains nothing
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
    // if times are equal, the fewest bodies are distributed
    among((0..=order.len()).min_by_key(time).unwrap_or(0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::cost::compactness;

    const GIGABYTES: usize = 8_000_000_000;

    /// Return a body of n x n x m boxes with linear elements in space, or with n x m boxes in the plane, whose lower surface is the contact.
    fn body(dimension: usize, n: usize, m: usize) -> Facts {
        let nodes = (n + 1).pow(dimension as u32 - 1) * (m + 1);
        let dofs = dimension * nodes;
        let compactness = compactness(6 * n * n * m, 4 * n * n + 8 * n * m);
        let size = BodySize { dofs, interface: None, is_quadratic: false, compactness };
        let interface = (n + 1).pow(dimension as u32 - 1);
        Facts { name: format!("{n}x{m}"), dimension, size, interface, is_kept: false, typed: Typed::default() }
    }

    fn asked(method: MethodName) -> Asked {
        Asked { preset: None, linear: None, method, whole: Typed::default(), memory: GIGABYTES, ranks: 1 }
    }

    fn of(facts: &[Facts], asked: &Asked) -> (Linear, Vec<Preset>) {
        let plan = plan(facts, asked);
        (plan.linear, plan.bodies.iter().map(|body| body.preset).collect())
    }

    /// What the program chooses where nothing is asked for.
    #[test]
    fn bodies_get_the_cheaper_solver() {
        use Preset::{Condensed, Hypre, Mumps};
        let cubes = |n: usize| vec![body(3, n, n), body(3, n, n)];
        let of_auto = |facts: &[Facts]| of(facts, &asked(MethodName::Auto));
        assert_eq!(of_auto(&cubes(8)), (Linear::Dense, vec![Condensed; 2]));
        assert_eq!(of_auto(&cubes(40)), (Linear::Multigrid, vec![Hypre; 2]));
        // a plate lies on its neighbour with a third of its nodes, which a dense matrix would join
        assert_eq!(of_auto(&[body(3, 56, 2), body(3, 56, 2)]), (Linear::Multigrid, vec![Hypre; 2]));
        // in the plane everything is condensed that pays and fits
        let sheets = |n: usize| vec![body(2, n, 100), body(2, n, 100)];
        assert_eq!(of_auto(&sheets(100)), (Linear::Dense, vec![Condensed; 2]));
        assert_eq!(of_auto(&sheets(1499)), (Linear::Dense, vec![Condensed; 2]));
        assert_eq!(of_auto(&sheets(1500)), (Linear::Direct, vec![Mumps; 2]));
        let short = Asked { memory: 50_000_000, ..asked(MethodName::Auto) };
        assert_eq!(of(&sheets(300), &short), (Linear::Multigrid, vec![Hypre; 2]));
        // bodies get multigrid if one of them needs it
        assert_eq!(of(&[body(2, 10, 10), body(2, 300, 100)], &short), (Linear::Multigrid, vec![Hypre; 2]));
        assert!(plan(&[body(2, 10, 10), body(2, 300, 100)], &short).bodies[0].reason.contains("`300x100` has it"));
        // each for itself
        let apart = [body(3, 8, 8), body(3, 60, 60)];
        assert_eq!(of(&apart, &asked(MethodName::NewtonRobin)), (Linear::Sweeps, vec![Condensed, Hypre]));
    }

    /// What the user asks for.
    #[test]
    fn requests_are_followed() {
        use Preset::{Condensed, Hypre, Icc, Mumps};
        let cubes = [body(3, 8, 8), body(3, 8, 8)];
        let auto = asked(MethodName::Auto);
        let linear = |linear: Linear| of(&cubes, &Asked { linear: Some(linear), ..auto.clone() });
        assert_eq!(linear(Linear::Dense), (Linear::Dense, vec![Condensed; 2]));
        assert_eq!(linear(Linear::Direct), (Linear::Direct, vec![Mumps; 2]));
        assert_eq!(linear(Linear::Multigrid), (Linear::Multigrid, vec![Hypre; 2]));
        assert_eq!(linear(Linear::Sweeps), (Linear::Sweeps, vec![Condensed; 2]));
        let preset = |preset: Preset, method: MethodName| of(&cubes, &Asked { preset: Some(preset), ..asked(method) });
        assert_eq!(preset(Mumps, MethodName::Auto), (Linear::Direct, vec![Mumps; 2]));
        assert_eq!(preset(Icc, MethodName::Auto), (Linear::Sweeps, vec![Icc; 2]));
        assert_eq!(preset(Icc, MethodName::Newton), (Linear::Direct, vec![Icc; 2]));
        assert_eq!(preset(Hypre, MethodName::Robin), (Linear::Sweeps, vec![Hypre; 2]));
        // options for one body apply to that body alone
        let mut own = cubes.clone();
        own[1].typed = Typed { asks_for_ksp: true, has_own: true, ..Typed::default() };
        assert_eq!(of(&own, &auto).0, Linear::Sweeps);
        assert_eq!(of(&own, &asked(MethodName::Newton)), (Linear::Multigrid, vec![Hypre; 2]));
        let of_pc = |pc: &str, has_own: bool| {
            let whole = Typed { asks_for_ksp: true, has_own, pc: Some(pc.to_owned()), ..Typed::default() };
            of(&cubes, &Asked { whole, ..auto.clone() }).0
        };
        assert_eq!(
            ["hypre", "cholesky", "jacobi", "mg"].map(|pc| of_pc(pc, false)),
            [Linear::Multigrid, Linear::Direct, Linear::Sweeps, Linear::Sweeps]
        );
        assert_eq!(of_pc("jacobi", true), Linear::Direct);
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
        // the messages take longer than the gain
        assert_eq!(distributed(&[600, 600], 3), [false, false]);
        assert_eq!(largest(&[80_000, 10_000], &[false, true], 4), [false, false]);
    }
}
