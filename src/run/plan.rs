//! The plan of a run's linear algebra: from facts of the bodies and from what is asked for to the inner solvers.
//!
//! Newton's method joins the bodies in one matrix, or in one Schur complement if all are condensed. They then need no
//! solver of their own. If options are typed for one body, or the method asks for it, every body has one, and sweeps
//! solve the linear steps. The first rank makes the plan, and the other ranks follow it.

use crate::parallel::owners;
use crate::problem::{Linear, MethodName, Preset};
use crate::solver::cost::{self, BodyFacts};
use crate::solver::options::Chosen;
use crate::solver::preset;
use serde::{Deserialize, Serialize};

/// What the user asks for, and what the machine has.
#[derive(Debug, Clone)]
pub struct SolverRequest {
    /// Preset that the scene names.
    pub preset: Option<Preset>,
    /// Solver of linear steps that the scene names.
    pub linear: Option<Linear>,
    /// The method.
    pub method: MethodName,
    /// Options of the solver of the matrix of all bodies, at first those that the user wrote.
    pub whole: Chosen,
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

/// A body with its solver.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct BodyPlan {
    pub facts: BodyFacts,
    /// The preset of its solver.
    pub preset: Preset,
    /// Whether its dofs are distributed over the ranks in a matrix of its own.
    pub is_distributed: bool,
    /// Interface dofs of a condensed body, until it is made.
    pub interface: Option<Vec<usize>>,
    /// Reason for the preset, in words; other ranks do not get it.
    #[serde(skip)]
    pub reason: String,
}

/// Largest number of dofs of all condensed bodies together for which their dense matrix is factored. It takes 0.2 s and
/// 250 MB.
const DENSE: usize = 3000;

/// Return the plan for these bodies, without the interface dofs of condensed ones.
pub fn plan(facts: Vec<BodyFacts>, asked: &SolverRequest) -> Plan {
    let mut seconds = None;
    let mut chosen: Vec<Option<(Preset, String)>> = facts.iter().map(|body| asked.for_body(body)).collect();
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
                let bodies: Vec<BodyFacts> = group.iter().map(|&body| facts[body].clone()).collect();
                let (choices, cost) = in_space(&bodies, asked, &mut memory);
                *seconds.get_or_insert(0.0) += cost;
                group.iter().zip(choices).for_each(|(&body, choice)| chosen[body] = Some(choice));
            }
        }
    }
    let of_body = |(facts, (preset, reason)): (BodyFacts, (Preset, String))| BodyPlan {
        facts,
        preset,
        is_distributed: false,
        interface: None,
        reason,
    };
    let mut bodies: Vec<BodyPlan> = facts.into_iter().zip(chosen.into_iter().flatten()).map(of_body).collect();
    let linear = linear_step(asked, &mut bodies);
    if linear == Linear::Sweeps {
        distribute(asked.ranks, &mut bodies);
    }
    Plan { linear, bodies, seconds }
}

impl SolverRequest {
    /// Return whether another request is the same but for the memory, which changes from moment to moment.
    pub fn is_like(&self, other: &Self) -> bool {
        let of = |asked: &Self| (asked.preset, asked.linear, asked.method, asked.ranks);
        of(self) == of(other)
    }

    /// Return whether the method may use one matrix of all bodies.
    pub fn may_join(&self) -> bool {
        let joins = matches!(self.method, MethodName::Auto | MethodName::Newton | MethodName::Semismooth);
        joins && self.linear != Some(Linear::Sweeps)
    }

    /// Return whether the user wants a KSP of PETSc for a body; a KSP for all bodies together needs them uncondensed.
    fn wants_ksp(&self, body: &BodyFacts) -> bool {
        body.options.asks_for_ksp() || (self.may_join() && self.whole.asks_for_ksp())
    }

    /// Return whether a body may be condensed.
    fn may_condense(&self, body: &BodyFacts) -> bool {
        (1..body.dofs).contains(&body.interface) && !self.wants_ksp(body)
    }

    /// Return the solver of a body that the user asks for, with its reason, or `None` for the program's choice.
    fn for_body(&self, body: &BodyFacts) -> Option<(Preset, String)> {
        let may_condense = self.may_condense(body);
        let (preset, why) = match (self.preset, self.linear) {
            (Some(Preset::Condensed), _) if !may_condense => (
                Preset::Mumps,
                if self.wants_ksp(body) { "PETSc options were typed" } else { "there is nothing to condense" },
            ),
            (Some(preset), _) => (preset, "the scene asks for it"),
            (None, Some(Linear::Dense)) if may_condense => (Preset::Condensed, "the scene asks for dense linear steps"),
            (None, Some(Linear::Dense)) if self.wants_ksp(body) => (Preset::Mumps, "PETSc options were typed"),
            (None, Some(Linear::Direct)) => (Preset::Mumps, "the scene asks for direct linear steps"),
            (None, Some(Linear::Multigrid)) => (Preset::Hypre, "the scene asks for linear steps by multigrid"),
            _ => return None,
        };
        Some((preset, why.to_owned()))
    }
}

/// Choose the solver of a body in the plane with its reason, and take its memory.
fn in_plane(body: &BodyFacts, asked: &SolverRequest, memory: &mut usize) -> (Preset, String) {
    let (mut preset, reason) = preset::in_plane(body, if body.is_kept { usize::MAX } else { *memory });
    if preset == Preset::Condensed && !asked.may_condense(body) {
        preset = Preset::Mumps;
    }
    if !body.is_kept && preset != Preset::Hypre {
        *memory = memory.saturating_sub(body.bytes_in_plane(preset));
    }
    (preset, reason)
}

/// Choose the solvers of bodies in space with their reasons, which are solved together or are one body, and take their
/// memory. Return the estimated seconds, too.
fn in_space(bodies: &[BodyFacts], asked: &SolverRequest, memory: &mut usize) -> (Vec<(Preset, String)>, f64) {
    let is_kept = bodies.iter().all(|body| body.is_kept);
    let estimates = cost::of_each(bodies, |body| asked.may_condense(body), asked.method, asked.may_join());
    let [.., mut best] = estimates;
    let may_factor = !bodies.iter().any(|body| asked.wants_ksp(body));
    for (preset, cost) in estimates {
        if may_factor && cost.seconds < best.1.seconds && (is_kept || cost.bytes <= *memory as f64) {
            best = (preset, cost);
        }
    }
    let (best, cost) = best;
    if best != Preset::Hypre && !is_kept {
        *memory = memory.saturating_sub(cost.bytes as usize);
    }
    let (dofs, interface): (usize, usize) =
        (bodies.iter().map(|body| body.dofs).sum(), bodies.iter().map(|body| body.interface).sum());
    let words = estimates.map(|(preset, cost)| format!("{} {}", preset.name(), cost.words())).join(", ");
    let reason = format!("{dofs} dofs in space, {interface} of them on the contact; estimates: {words}");
    let of_body = |body: &BodyFacts| match best {
        Preset::Condensed if !asked.may_condense(body) => Preset::Mumps,
        best => best,
    };
    let choices = bodies.iter().map(|body| (of_body(body), reason.clone())).collect();
    (choices, cost.seconds)
}

/// Return the solver of linear steps for bodies with these presets. Where the program chose them, bodies first get
/// presets that one matrix can have.
fn linear_step(asked: &SolverRequest, bodies: &mut [BodyPlan]) -> Linear {
    let is_auto = asked.method == MethodName::Auto;
    let is_typed = |body: &BodyPlan| body.facts.options.asks_for_ksp();
    // options typed for one body apply to that body alone, so the bodies are not joined
    let is_apart = |body: &BodyPlan| is_auto && body.facts.options.has_own() && is_typed(body);
    if !asked.may_join() || bodies.iter().any(is_apart) {
        return Linear::Sweeps;
    }
    if asked.preset.is_none() && asked.linear.is_none() && !bodies.iter().any(is_typed) {
        agree(bodies);
    }
    let all = |preset: Preset| bodies.iter().all(|body| body.preset == preset);
    let is_in_space = bodies.iter().all(|body| body.facts.dimension == 3);
    let fits_dense = asked.linear.is_some() || is_in_space || on_contact(bodies) <= DENSE;
    let is_quadratic = bodies.iter().any(|body| body.facts.is_quadratic);
    let whole = &asked.whole;
    match whole.typed("pc_type") {
        Some("hypre") => Linear::Multigrid,
        Some("mg") if is_quadratic => Linear::Multigrid,
        Some("cholesky" | "lu") => Linear::Direct,
        None if all(Preset::Condensed) && !whole.asks_for_ksp() && fits_dense => Linear::Dense,
        None if all(Preset::Hypre) => Linear::Multigrid,
        _ => Linear::Direct,
    }
}

/// Return the number of dofs of all condensed bodies together.
fn on_contact(bodies: &[BodyPlan]) -> usize {
    bodies.iter().filter(|body| body.preset == Preset::Condensed).map(|body| body.facts.interface).sum()
}

/// Give all bodies presets that Newton's method can join. They get multigrid if one of them needs it. In the plane they
/// get one factorisation if together they have too many dofs on the contact for one dense matrix.
fn agree(bodies: &mut [BodyPlan]) {
    let dense = on_contact(bodies);
    let (preset, why) = match bodies.iter().find(|body| body.preset == Preset::Hypre) {
        Some(first) => (Preset::Hypre, format!("`{}` has it, and Newton's method joins the bodies", first.facts.name)),
        None if dense > DENSE && bodies.iter().any(|body| body.facts.dimension == 2) => {
            (Preset::Mumps, format!("{dense} of all bodies are on the contact: too many to join by dense algebra"))
        }
        None => return,
    };
    for body in bodies.iter_mut().filter(|body| body.preset != preset) {
        (body.preset, body.reason) = (preset, format!("{} dofs; {why}", body.facts.dofs));
    }
}

/// Dofs for which a rank could solve in the time of the messages of a distributed body. An iteration of conjugate
/// gradients with multigrid takes 0.5 us per dof (docs/parallel.md), and some 50 messages of 10 us: four exchanges with
/// neighbours on each of eight levels, and a few sums. A smaller number distributes bodies that one rank solves faster.
const MESSAGES: usize = 1000;

/// Distribute the largest bodies over all ranks, as many as make a sweep shortest. Each other body stays whole on one
/// rank. If there are as many bodies as ranks and they are about equally large, all stay whole.
fn distribute(ranks: usize, bodies: &mut [BodyPlan]) {
    let may = |body: &BodyPlan| {
        let options = &body.facts.options;
        body.preset != Preset::Condensed
            && !options.is_for_one_rank()
            && (options.typed("pc_type").is_some() || body.preset != Preset::Icc)
    };
    let loads: Vec<usize> = bodies.iter().map(|body| body.facts.dofs).collect();
    let may: Vec<bool> = bodies.iter().map(may).collect();
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
    use crate::solver::cost::slenderness;
    use crate::solver::options::UserOptions;

    const GIGABYTES: usize = 8_000_000_000;

    /// Return a body of n x n x m boxes with linear elements in space, or with n x m boxes in the plane, whose lower
    /// surface is the contact.
    fn body(dimension: usize, n: usize, m: usize) -> BodyFacts {
        let interface = (n + 1).pow(dimension as u32 - 1);
        BodyFacts {
            name: format!("{n}x{m}"),
            dimension,
            dofs: dimension * interface * (m + 1),
            interface,
            slenderness: slenderness(n.max(m) as f64, (2 * n * n + 4 * n * m) as f64, (n * n * m) as f64),
            ..BodyFacts::default()
        }
    }

    fn asked(method: MethodName) -> SolverRequest {
        SolverRequest { preset: None, linear: None, method, whole: Chosen::default(), memory: GIGABYTES, ranks: 1 }
    }

    fn of(facts: &[BodyFacts], asked: &SolverRequest) -> (Linear, Vec<Preset>) {
        let plan = plan(facts.to_vec(), asked);
        (plan.linear, plan.bodies.iter().map(|body| body.preset).collect())
    }

    /// What the program chooses where nothing is asked for.
    #[test]
    fn bodies_get_the_cheaper_solver() {
        use Preset::{Condensed, Hypre, Mumps};
        let cubes = |n: usize| vec![body(3, n, n), body(3, n, n)];
        let of_auto = |facts: &[BodyFacts]| of(facts, &asked(MethodName::Auto));
        assert_eq!(of_auto(&cubes(8)), (Linear::Dense, vec![Condensed; 2]));
        assert_eq!(of_auto(&cubes(40)), (Linear::Multigrid, vec![Hypre; 2]));
        // a plate lies on its neighbour with a third of its nodes; multigrid is slow
        assert_eq!(of_auto(&[body(3, 56, 2), body(3, 56, 2)]), (Linear::Dense, vec![Condensed; 2]));
        // in the plane everything is condensed that pays and fits
        let sheets = |n: usize| vec![body(2, n, 100), body(2, n, 100)];
        assert_eq!(of_auto(&sheets(100)), (Linear::Dense, vec![Condensed; 2]));
        assert_eq!(of_auto(&sheets(1499)), (Linear::Dense, vec![Condensed; 2]));
        assert_eq!(of_auto(&sheets(1500)), (Linear::Direct, vec![Mumps; 2]));
        let short = SolverRequest { memory: 50_000_000, ..asked(MethodName::Auto) };
        assert_eq!(of(&sheets(300), &short), (Linear::Multigrid, vec![Hypre; 2]));
        // bodies get multigrid if one of them needs it
        assert_eq!(of(&[body(2, 10, 10), body(2, 300, 100)], &short), (Linear::Multigrid, vec![Hypre; 2]));
        assert!(plan(vec![body(2, 10, 10), body(2, 300, 100)], &short).bodies[0].reason.contains("`300x100` has it"));
        // each for itself
        let apart = [body(3, 8, 8), body(3, 60, 60)];
        assert_eq!(of(&apart, &asked(MethodName::NewtonRobin)), (Linear::Sweeps, vec![Condensed, Hypre]));
    }

    /// The measurements of docs/solvers.md: the choice takes at most 1.3 times as long as the fastest solver.
    #[test]
    fn the_choice_is_near_the_fastest() {
        // dofs, interface dofs and slenderness of each body; CPU seconds of condensed, mumps, hypre
        type Measurement = (&'static str, usize, (usize, usize, f64), [f64; 3]);
        let rows: [Measurement; 24] = [
            ("obstacle, adapted", 1, (58_185, 1633, 1.0), [4.82, 17.40, 2.11]),
            ("plate, 40 x 20 x 0.5", 1, (35_793, 2952, 27.7), [3.92, 2.81, 20.78]),
            ("plate, n = 0.7", 1, (20_097, 1653, 27.7), [1.23, 1.25, 9.86]),
            ("plate, 40 x 20 x 2", 1, (35_793, 2952, 7.67), [3.23, 1.51, 7.25]),
            ("hertz-sphere, n = 2", 2, (7608, 263, 1.04), [0.56, 0.99, 0.84]),
            ("hertz-sphere, n = 4", 2, (13_020, 648, 1.04), [1.04, 3.02, 1.92]),
            ("hertz-sphere, n = 6", 2, (20_225, 1095, 1.04), [2.27, 5.39, 3.07]),
            ("hertz-sphere P1, n = 6", 2, (3047, 243, 1.04), [0.27, 0.56, 0.57]),
            ("hertz-sphere P1, n = 14", 2, (11_982, 880, 1.04), [1.42, 3.99, 1.91]),
            ("groove3d, n = 4", 2, (4455, 112, 4.33), [0.30, 0.85, 0.65]),
            ("groove3d, n = 8", 2, (29_835, 416, 4.33), [2.07, 13.32, 4.98]),
            ("groove3d P1, n = 16", 2, (29_835, 576, 4.33), [2.30, 11.76, 3.90]),
            ("groove3d, n = 12, 0.125 thick", 2, (36_375, 336, 12.3), [1.99, 10.39, 6.61]),
            ("flange, n = 2", 2, (10_586, 618, 3.74), [0.71, 1.79, 2.10]),
            ("flange, n = 3", 2, (18_879, 1178, 3.74), [1.60, 6.14, 4.51]),
            ("flange, n = 4", 2, (32_502, 1947, 3.74), [3.98, 15.04, 6.27]),
            ("flange P1, n = 4", 2, (5126, 615, 3.74), [0.49, 0.87, 0.84]),
            ("flange P1, n = 8", 2, (18_791, 2242, 3.74), [3.94, 8.09, 3.60]),
            ("paraboloid", 2, (6906, 413, 1.0), [0.46, 0.93, 0.57]),
            ("rough", 2, (42_471, 800, 1.33), [4.59, 20.06, 4.38]),
            ("blocks, k = 6", 216, (81, 45, 1.0), [18.23, 2.05, 1.65]),
            ("two plates P1, 40 x 40 x 4", 2, (25_215, 1681, 4.0), [2.65, 3.16, 4.06]),
            ("two plates P1, 56 x 56 x 2", 2, (29_241, 3249, 10.0), [7.59, 15.18, 13.75]),
            ("blocks P2, k = 5", 125, (375, 77, 1.0), [8.66, 3.27, 3.42]),
        ];
        for (name, count, (dofs, interface, slenderness), seconds) in rows {
            let one = BodyFacts { dimension: 3, dofs, interface, slenderness, ..BodyFacts::default() };
            let (_, chosen) = of(&vec![one; count], &asked(MethodName::Auto));
            let known = [Preset::Condensed, Preset::Mumps, Preset::Hypre].into_iter().zip(seconds);
            let least = seconds.into_iter().fold(f64::INFINITY, f64::min);
            let own = known.into_iter().find(|(preset, _)| *preset == chosen[0]).expect("a solver of the table").1;
            assert!(own <= 1.3 * least, "{name}: {:?} takes {own} s, {least} s are possible", chosen[0]);
        }
    }

    /// What the user asks for.
    #[test]
    fn requests_are_followed() {
        use Preset::{Condensed, Hypre, Icc, Mumps};
        let cubes = [body(3, 8, 8), body(3, 8, 8)];
        let auto = asked(MethodName::Auto);
        let linear = |linear: Linear| of(&cubes, &SolverRequest { linear: Some(linear), ..auto.clone() });
        assert_eq!(linear(Linear::Dense), (Linear::Dense, vec![Condensed; 2]));
        assert_eq!(linear(Linear::Direct), (Linear::Direct, vec![Mumps; 2]));
        assert_eq!(linear(Linear::Multigrid), (Linear::Multigrid, vec![Hypre; 2]));
        assert_eq!(linear(Linear::Sweeps), (Linear::Sweeps, vec![Condensed; 2]));
        let preset =
            |preset: Preset, method: MethodName| of(&cubes, &SolverRequest { preset: Some(preset), ..asked(method) });
        assert_eq!(preset(Mumps, MethodName::Auto), (Linear::Direct, vec![Mumps; 2]));
        assert_eq!(preset(Icc, MethodName::Auto), (Linear::Direct, vec![Icc; 2]));
        assert_eq!(preset(Icc, MethodName::Newton), (Linear::Direct, vec![Icc; 2]));
        assert_eq!(preset(Hypre, MethodName::Robin), (Linear::Sweeps, vec![Hypre; 2]));
        // options for one body apply to that body alone
        let mut own = cubes.clone();
        own[1].options = UserOptions::of_test(&[("-upper_ksp_rtol", "1e-3")]).of("upper");
        assert_eq!(of(&own, &auto).0, Linear::Sweeps);
        assert_eq!(of(&own, &asked(MethodName::Newton)), (Linear::Multigrid, vec![Hypre; 2]));
        let of_pc = |pc: &str, has_own: bool| {
            let name = if has_own { "-newton_pc_type" } else { "-pc_type" };
            let whole = UserOptions::of_test(&[(name, pc)]).of("newton");
            of(&cubes, &SolverRequest { whole, ..auto.clone() }).0
        };
        assert_eq!(
            ["hypre", "cholesky", "jacobi", "mg"].map(|pc| of_pc(pc, false)),
            [Linear::Multigrid, Linear::Direct, Linear::Direct, Linear::Direct]
        );
        assert_eq!(of_pc("jacobi", true), Linear::Direct);
    }

    /// A single body is distributed. If bodies are unequal, the large one is distributed, and the other one if that
    /// gains more than its messages take. If there are as many equal bodies as ranks, none is distributed. With one
    /// body too many, one is.
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
