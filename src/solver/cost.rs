//! What inner solvers cost, in CPU seconds: the choice among condensed bodies, a factorisation of all bodies in each
//! step, and multigrid for bodies in space.
//!
//! docs/solvers.md has the formulas and the scenes on which they were measured, of 6000 to 85 000 dofs.

use super::options::Chosen;
use crate::linalg::portable::{log2, pow};
use crate::problem::{MethodName, Preset};
use serde::{Deserialize, Serialize};

/// Dense operations a second of a core: Newton's matrices of two flanges with 3893 and 4483 interface dofs.
const RATE: f64 = 2.8e10;

/// Seconds of a product of K with a vector, for each dof: 42 entries in a row of linear elements, 1e9 entries a second.
/// Rows of quadratic elements have twice as many, but multigrid has a level of their vertices, and takes as long for a
/// dof.
const PRODUCT: f64 = 42.0 / 1e9;

/// Time of a factorisation besides the operations of large fronts, in products with K: finding an order, assembly of
/// fronts, small fronts. Plates and slices, which have no large front, took 240 to 400.
const FACTORED: f64 = 320.0;

/// Time of multigrid over 1 + s in products with K, from its set-up to the last step of Newton's method, where s is the
/// slenderness of a body. With it each scene of docs/solvers.md gets a solver that takes at most 1.1 times as long as
/// the fastest. Multigrid itself took 0.5 to 1.5 times as long, and 0.2 to 0.5 times on slices that cannot bend.
const MULTIGRID: f64 = 720.0;

/// Steps of Newton's method in a scene; those measured take 2 to 8, on the average 4.6.
const NEWTON_STEPS: f64 = 5.0;

/// Bytes of multigrid for a dof: 12 for each entry of G, which is stored in place of K, 12 for hypre's copy, and half a
/// copy for its levels. With quadratic elements the levels are those of the vertices. For two cubes of 48^3 this gives
/// 890 MB. The run took 1153 MB, with 50 for the process and 180 for mesh, spaces and vectors.
const LEVELS: f64 = 42.0 * 30.0;

/// A body before it is assembled, in the numbers on which its solver depends.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct BodyFacts {
    /// Name in the scene.
    pub name: String,
    /// Space dimension, which is the number of dofs of a node.
    pub dimension: usize,
    /// Number of its dofs.
    pub dofs: usize,
    /// Number of dofs that it keeps if it is condensed.
    pub interface: usize,
    /// Whether its elements are of second or higher order.
    pub is_quadratic: bool,
    /// See [`slenderness`].
    pub slenderness: f64,
    /// Whether a condensed body of an earlier scene serves, so that its memory is allocated already.
    pub is_kept: bool,
    /// Options of its solver, at first those that the user wrote.
    #[serde(skip)]
    pub options: Chosen,
}

/// Return the slenderness of a body, the largest side of its box times its surface over six times its volume. It is 1
/// for a cube or a ball, and a/(3 t) for a thin plate of a x a x t.
pub fn slenderness(length: f64, surface: f64, volume: f64) -> f64 {
    length * surface / (6.0 * volume)
}

/// Estimated time and memory of a solver.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Cost {
    /// Seconds. They serve to compare solvers rather than to predict a run, since machines differ.
    pub seconds: f64,
    /// Bytes at the peak.
    pub bytes: f64,
}

/// Seconds below which these formulas say little of the time. Set-up and iteration of factored bodies took 0.017 of 0.1
/// s (`groove3d`), 0.08 of 0.2 s (`sphere-layer`), 0.23 of 0.5 s (`shells`), and 3.1 of 4.5 s (`rough`).
const BRIEF: f64 = 0.5;

impl Cost {
    /// Return the cost as text. A time below `BRIEF` is not worth a number.
    pub fn words(&self) -> String {
        let megabytes = self.bytes / 1e6;
        let digits = |value: f64| if value < 10.0 { format!("{value:.1}") } else { format!("{value:.0}") };
        match self.seconds {
            seconds if seconds < BRIEF => format!("less than {BRIEF} s and {} MB", digits(megabytes)),
            seconds => format!("some {} s and {} MB", digits(seconds), digits(megabytes)),
        }
    }

    fn and(self, other: Cost) -> Cost {
        Cost { seconds: self.seconds + other.seconds, bytes: self.bytes + other.bytes }
    }

    /// Return the cost of the same work `count` times, one after another.
    fn times(self, count: f64) -> Cost {
        Cost { seconds: count * self.seconds, ..self }
    }
}

/// Return the costs of the ways to solve for some bodies in space by a method, which may join them in one matrix:
/// condensed bodies, a factorisation in each step, and conjugate gradients with multigrid. `may_condense` says of each
/// body whether it can be condensed; another one is factored in each step.
pub fn of_each(
    bodies: &[BodyFacts],
    may_condense: impl Fn(&BodyFacts) -> bool,
    method: MethodName,
    are_joined: bool,
) -> [(Preset, Cost); 3] {
    // `newton-robin` took 1.0 to 1.9 times as long as with one matrix of all bodies, and `robin` 5.4 to 12 times
    let times = match method {
        _ if are_joined => 1.0,
        MethodName::Auto | MethodName::Newton | MethodName::NewtonRobin => 1.2,
        _ => 7.0,
    };
    let interfaces: Vec<usize> = bodies.iter().filter(|body| may_condense(body)).map(|body| body.interface).collect();
    let dense = if are_joined && interfaces.len() > 1 {
        of_compliance(&interfaces)
    } else {
        of_dense_steps(interfaces.iter().copied().max().unwrap_or(0))
    };
    let sum = |of_body: &dyn Fn(&BodyFacts) -> Cost| bodies.iter().map(of_body).fold(Cost::default(), Cost::and);
    let in_each_step = |body: &BodyFacts| body.factored(0).times(NEWTON_STEPS * times);
    let factored = if are_joined { joined(bodies) } else { sum(&in_each_step) };
    let condensed =
        |body: &BodyFacts| if may_condense(body) { body.factored(body.interface) } else { in_each_step(body) };
    [
        (Preset::Condensed, dense.and(sum(&condensed))),
        (Preset::Mumps, factored),
        (Preset::Hypre, sum(&|body| body.multigrid().times(times))),
    ]
}

/// Return the cost of a factorisation of all bodies as one in each step, with their mean slenderness. The springs of
/// the contact couple them, so that the points between bodies are in the last front.
fn joined(bodies: &[BodyFacts]) -> Cost {
    let dofs: usize = bodies.iter().map(|body| body.dofs).sum();
    let slenderness = bodies.iter().map(|body| body.dofs as f64 * body.slenderness).sum::<f64>() / dofs as f64;
    let between: usize = if bodies.len() > 1 { bodies.iter().map(|body| body.interface).sum() } else { 0 };
    BodyFacts { dofs, slenderness, ..BodyFacts::default() }.factored(between / 2).times(NEWTON_STEPS)
}

/// Return the cost of the compliance at n contact points of several bodies with these interface dofs R, and of a
/// factorisation of the points in each step. The inverse of each body takes R^3 operations. Both sides of a pair have
/// about as many dofs along the normal as the pair has points.
fn of_compliance(interfaces: &[usize]) -> Cost {
    let each = || interfaces.iter().map(|&interface| interface as f64);
    let points = 0.5 * each().sum::<f64>();
    let inverses: f64 = each().map(|r| r.powi(3)).sum();
    Cost {
        seconds: (inverses + NEWTON_STEPS * points.powi(3) / 3.0) / RATE,
        // S with its pattern and its inverse; the compliance and the factor of the points
        bytes: 20.0 * each().map(|r| r * r).sum::<f64>() + 16.0 * points * points,
    }
}

/// Return the cost of a dense factorisation of so many interface dofs in each step.
fn of_dense_steps(interface: usize) -> Cost {
    let r = interface as f64;
    Cost { seconds: NEWTON_STEPS * r.powi(3) / 3.0 / RATE, bytes: 36.0 * r * r }
}

impl BodyFacts {
    /// Return the estimated bytes of a solver that factors, for a plane body.
    pub fn bytes_in_plane(&self, preset: Preset) -> usize {
        let dense = if preset == Preset::Condensed { condensed_bytes(self.interface) } else { 0 };
        plane_factor_bytes(self.dofs) + dense
    }

    /// Return the cost of multigrid for a matrix of all bodies. The number of iterations grows with the slenderness,
    /// since a slender body is soft in bending beside its elements: cubes and balls took 25 to 51 for all steps,
    /// flanges, with s = 3.7, 109 to 172, and a plate with s = 28 took 855.
    fn multigrid(&self) -> Cost {
        let n = self.dofs as f64;
        Cost { seconds: MULTIGRID * (1.0 + self.slenderness) * PRODUCT * n, bytes: LEVELS * n }
    }

    /// Return the cost of a factorisation by nested dissection that leaves some `interface` dofs.
    ///
    /// The first separator of a cube with n dofs has S = 3 (n/3)^(2/3) of them, S^3 = 3 n^2, and all fronts together
    /// take 19 n^2 operations, measured on blocks of 32 000 to 500 000 dofs, about 6 S^3. A plate of m x m columns of k
    /// nodes has S = 3 m k, and a beam of m^2 columns of k nodes has k/m separators of S = 3 m^2: both have S^3 = 3 n^2
    /// over m/k or k/m, about s, in all. The fronts run at half the rate of a dense matrix, except the last one, which
    /// also has the interface.
    fn factored(&self, interface: usize) -> Cost {
        let n = self.dofs as f64;
        let cubed = 3.0 * n * n / self.slenderness;
        let last = pow(cubed, 1.0 / 3.0) + interface as f64;
        Cost {
            seconds: (12.0 * cubed + last.powi(3)) / RATE + FACTORED * PRODUCT * n,
            bytes: 220.0 * pow(n, 4.0 / 3.0),
        }
    }
}

/// Return the estimated bytes of the sparse Cholesky factor of a plane body by nested dissection. They grow as n log n;
/// the constant was measured on blocks of 32 000 to 500 000 dofs.
fn plane_factor_bytes(dofs: usize) -> usize {
    let n = dofs as f64;
    (60.0 * n * log2(n + 2.0)) as usize
}

/// Return the bytes of a condensed body besides its sparse factor: S with its pattern, G, and the factor of G.
fn condensed_bytes(interface: usize) -> usize {
    36 * interface * interface
}

/// Return the estimated operations of a sparse Cholesky factorisation of a plane body by nested dissection, measured on
/// the same blocks as [`plane_factor_bytes`].
pub fn plane_factor_work(dofs: usize) -> f64 {
    56.0 * pow(dofs as f64, 1.5)
}
