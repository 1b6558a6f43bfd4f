//! What inner solvers cost: the choice between a factorisation and multigrid for bodies in space.
//!
//! Nested dissection of a cube with n dofs takes 19 n^2 operations, a dense contact of R dofs takes R^3/3 in each step,
//! and multigrid takes some hundred products of K with a vector, whose time is that of reading the entries of K from
//! memory. "The table" below are 29 scenes of 3564 to 215 622 dofs, cubes, grooves, spheres, flanges and rough faces;
//! docs/solvers.md has some of them.

use super::options::Chosen;
use crate::linalg::portable::{log2, pow};
use crate::problem::{MethodName, Preset};
use serde::{Deserialize, Serialize};

/// Dense operations a second, of two cores with AVX2 or one with AVX-512.
const RATE: f64 = 2.8e10;

/// Seconds of a product of K with a vector, for each dof: 42 entries in a row of linear elements, 1e9 entries a second.
/// Rows of quadratic elements have twice as many, but multigrid has a level of their vertices, and takes as long for a
/// dof.
const PRODUCT: f64 = 42.0 / 1e9;

/// Time of a factorisation besides its dense operations, in products with K: finding an order, assembly of fronts,
/// small fronts. Most scenes of the table took 100 to 400, thin slices less.
const FACTORED: f64 = 320.0;

/// Time of multigrid from its set-up to the last step of Newton's method, in products with K. The scenes of the table
/// took 690 to 1290 with linear elements and 380 to 1260 with quadratic ones. Most of that range is the number of
/// iterations, which neither dofs nor shapes of cells predict.
const MULTIGRID: f64 = 900.0;

/// Steps of Newton's method in a scene; those of the table take 3 to 7. Each has a dense factorisation of all contacts
/// together.
const NEWTON_STEPS: f64 = 5.0;

/// Bytes of multigrid for a dof: 12 for each entry of G, which is stored in place of K, 12 for hypre's copy, and half a
/// copy for its levels. With quadratic elements the levels are those of the vertices. For two cubes of 48^3 this gives
/// 890 MB. The run took 1153 MB, with 50 for the process and 180 for mesh, spaces and vectors.
const LEVELS: f64 = 42.0 * 30.0;

/// Operations of a factorisation with quadratic elements, relative to linear elements with the same number of dofs. A
/// row of the matrix of quadratic elements has about twice as many entries. Cubes of 12^3 with quadratic elements took
/// 1.2 times as long as cubes of 24^3 with linear elements.
const FILL_P2: f64 = 1.2;

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
    /// See [`compactness`].
    pub compactness: f64,
    /// Whether a condensed body of an earlier scene serves, so that its memory is allocated already.
    pub is_kept: bool,
    /// Options of its solver, at first those that the user wrote.
    #[serde(skip)]
    pub options: Chosen,
}

/// Return the number of cells over that of a cube with as many facets on its boundary, at most one. A cube of n x n x n
/// boxes has 6 n^3 tetrahedra and 12 n^2 facets; a plate of 1:10 has a compactness of 0.4.
pub fn compactness(cells: usize, facets: usize) -> f64 {
    let cube = 6.0 * (facets as f64 / 12.0).powf(1.5);
    (cells as f64 / cube).min(1.0)
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
}

/// Return the costs of both ways to solve for some bodies in space by a method, which may join them in one matrix: of
/// condensed bodies, or of factored ones where nothing can be condensed, and of conjugate gradients with multigrid.
/// `may_condense` says of each body whether it can be condensed; every factorisation of another one is of the whole
/// body.
pub fn of_both(
    bodies: &[BodyFacts],
    may_condense: impl Fn(&BodyFacts) -> bool,
    method: MethodName,
    are_joined: bool,
) -> [Cost; 2] {
    // On the first scenes of the table `newton-robin` took 1.0 to 1.9 times as long as with one matrix of all bodies,
    // and `robin` 5.4 to 12 times.
    let times = match method {
        _ if are_joined => 1.0,
        MethodName::Auto | MethodName::Newton | MethodName::NewtonRobin => 1.2,
        _ => 7.0,
    };
    let interfaces = bodies.iter().filter(|body| may_condense(body)).map(|body| body.interface);
    let interface = if are_joined { interfaces.sum() } else { interfaces.max().unwrap_or(0) } as f64;
    let dense = Cost { seconds: NEWTON_STEPS * interface.powi(3) / 3.0 / RATE, bytes: 36.0 * interface * interface };
    let direct = bodies.iter().map(|body| body.factored(may_condense(body))).fold(dense, Cost::and);
    let multigrid = bodies.iter().map(|body| body.multigrid(times)).fold(Cost::default(), Cost::and);
    [direct, multigrid]
}

impl BodyFacts {
    /// Return the estimated bytes of a solver that factors, for a plane body.
    pub fn bytes_in_plane(&self, preset: Preset) -> usize {
        let dense = if preset == Preset::Condensed { condensed_bytes(self.interface) } else { 0 };
        plane_factor_bytes(self.dofs) + dense
    }

    /// Return the cost of multigrid, `times` that of a matrix of all bodies.
    fn multigrid(&self, times: f64) -> Cost {
        let n = self.dofs as f64;
        Cost { seconds: MULTIGRID * times * PRODUCT * n, bytes: LEVELS * n }
    }

    /// Return the cost of the factorisation by nested dissection.
    ///
    /// A cube with n dofs takes 19 n^2 operations, measured on blocks of 32 000 to 500 000 dofs, and no body takes
    /// more. A plate with m x m columns of k nodes is a plane grid of such columns, which takes some 20 m^3 (3 k)^3:
    /// the fraction 3.2 k/m of a cube with as many nodes, which is about its compactness.
    fn factored(&self, is_condensed: bool) -> Cost {
        let n = self.dofs as f64;
        let fill = if self.is_quadratic { FILL_P2 } else { 1.0 };
        let seconds = 19.0 * n * n * self.compactness * fill / RATE + FACTORED * PRODUCT * n;
        // a body that is not condensed is factored in each step
        let times = if is_condensed { 1.0 } else { NEWTON_STEPS };
        Cost { seconds: times * seconds, bytes: 220.0 * pow(n, 4.0 / 3.0) }
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
