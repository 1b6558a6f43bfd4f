//! Inner solvers: how G z = r is solved, where G is the stiffness K of one body, or of all bodies, plus springs at
//! contact points.
//!
//! A [`SpringMatrix`] holds G = K + B' diag(d) B and solves with it by an [`InnerSolver`]: [`Krylov`] or [`Dense`].
//! [`interface_dofs`] are those of a body that is condensed to its contact. A new way to solve is a new file with an
//! implementation of `InnerSolver`.
//!
//! Where a function says nothing else, its errors are failures of the solver library, and PETSc being out of memory.

pub mod cost;
mod dense;
mod interface;
mod krylov;
pub mod names;
pub mod options;
pub mod preset;
mod springs;

pub use dense::Dense;
pub use interface::interface_dofs;
pub use krylov::Krylov;
pub use springs::{MakeSolver, MakeSubspace, SpringMatrix};

use crate::error::Result;
use crate::linalg::Csr;
use crate::petsc::{ConvergenceTest, Int, Rows, Subspace};
use serde::{Deserialize, Serialize};

/// Turn a whole matrix into PETSc's rows, or the rows of this rank, which begin with number `start`.
pub fn rows_of(matrix: Csr, start: Option<usize>) -> Result<Rows> {
    let Csr { columns, ptr, col, values } = matrix;
    let rows = match start {
        None => Rows::all(integers(ptr), integers(col), values),
        Some(start) => Rows::of_process(start, columns, integers(ptr), integers(col), values),
    };
    Ok(rows?)
}

/// Convert an array of a pattern to PETSc's integers. Where these have 32 bits, the array is not copied.
#[allow(clippy::useless_conversion)]
fn integers(part: Vec<i32>) -> Vec<Int> {
    part.into_iter().map(Int::from).collect()
}

/// The outcome of a solve G z = r.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SolveOutcome {
    /// Krylov iterations; 0 for a direct solver.
    pub iterations: usize,
    /// Why the inner solver gave up, in its own message; `None` if it reached its tolerance.
    pub failure: Option<String>,
}

/// Counters of the work of a body so far.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct BodyCounts {
    /// Number of numeric factorisations or preconditioner set-ups.
    pub factorizations: usize,
    /// Number of dense factorisations of the Robin matrices of condensed bodies.
    pub dense_factorizations: usize,
    /// Number of local corrections (exact solves near the contact) that were set up in place of preconditioners.
    pub patches: usize,
    /// Number of symbolic factorisations.
    pub symbolic: usize,
    /// Number of bodies condensed to their interfaces. Each is one of the `factorizations`, too.
    pub condensations: usize,
    /// Number of solves G z = r.
    pub solves: usize,
    /// Number of Krylov iterations in these solves.
    pub inner_iterations: usize,
    /// Number of changes of the Robin term that changed the matrix.
    pub robin_updates: usize,
    /// Number of requested changes that left the Robin term as it was.
    pub robin_skipped: usize,
    /// Wall seconds in factorisations or preconditioner set-ups.
    pub factor_seconds: f64,
    /// Wall seconds of the first one, which contains the symbolic factorisation. They are included in `factor_seconds`.
    pub first_seconds: f64,
    /// Wall seconds in solves, without set-ups.
    pub solve_seconds: f64,
}

impl std::ops::AddAssign for BodyCounts {
    fn add_assign(&mut self, other: Self) {
        self.factorizations += other.factorizations;
        self.dense_factorizations += other.dense_factorizations;
        self.patches += other.patches;
        self.symbolic += other.symbolic;
        self.condensations += other.condensations;
        self.solves += other.solves;
        self.inner_iterations += other.inner_iterations;
        self.robin_updates += other.robin_updates;
        self.robin_skipped += other.robin_skipped;
        self.factor_seconds += other.factor_seconds;
        self.first_seconds += other.first_seconds;
        self.solve_seconds += other.solve_seconds;
    }
}

/// A function that changes the values of G.
pub type Write<'a> = dyn Fn(&mut [f64]) + 'a;

/// A change of G = K + B' diag(d) B. An iterative solver may keep the preconditioner of an earlier G and correct it by
/// exact solves on a few dofs.
pub struct Change<'a> {
    /// Writes the values of G, in the order of the pattern that the solver was made with.
    pub write: &'a Write<'a>,
    /// The contact rows B.
    pub rows: &'a Csr,
    /// Spring stiffnesses d of G, one a row of B.
    pub springs: &'a [f64],
    /// Spring stiffnesses that double the stiffness under a row.
    pub soft: &'a [f64],
    /// Returns the rigid motions of bodies as a subspace to be put around a preconditioner, if there are any.
    pub coarse: &'a dyn Fn() -> Option<Box<dyn Subspace>>,
}

/// An owner of the matrix G with a way to solve G z = r. Nobody else stores K, which G has but for the springs.
pub trait InnerSolver {
    /// Return the values of G, in the order of the pattern that the solver was made with.
    fn values(&self) -> &[f64];

    /// Compute y = K x with G. The first of `changes` turns its values into those of K, and the second one undoes that
    /// to the last bit.
    fn multiply(&mut self, changes: [&Write; 2], x: &[f64], y: &mut [f64]) -> Result<()>;

    /// Change values of G. The next solve uses the new matrix.
    fn update(&mut self, change: Change) -> Result<()>;

    /// Factor G, or set up its preconditioner, if G has changed since.
    fn set_up(&mut self) -> Result<()>;

    /// Solve G z = r with zero initial guess.
    ///
    /// # Errors
    /// Failures of the solver library. A solve that does not converge is reported in [`SolveOutcome`].
    fn solve(&mut self, r: &[f64], z: &mut [f64]) -> Result<SolveOutcome>;

    /// Solve G z = r until `enough` accepts an iterate, for iterative solvers. If the user set a tolerance, that ends
    /// the solve instead.
    fn solve_until(&mut self, r: &[f64], z: &mut [f64], _enough: &mut ConvergenceTest) -> Result<SolveOutcome> {
        self.solve(r, z)
    }

    /// Set the relative tolerance of iterative solves, unless the user has set one.
    fn set_tolerance(&mut self, _rtol: f64) -> Result<()> {
        Ok(())
    }

    /// Return the relative error of the last solve in the energy norm, at most: zero for a direct solver.
    fn accuracy(&self) -> f64 {
        0.0
    }

    /// Compute z = M^-1 r with a fixed symmetric M that approximates G: one application of the preconditioner of an
    /// iterative solver, a whole solve of a direct one.
    fn precondition(&mut self, r: &[f64], z: &mut [f64]) -> Result<SolveOutcome> {
        self.solve(r, z)
    }

    /// Return the numbers of symbolic factorisations, of numeric factorisations or preconditioner set-ups, and of exact
    /// solves that were set up around a preconditioner, so far.
    fn factorizations(&self) -> [usize; 3];

    /// Return whether the factorisations are dense ones, which are counted separately.
    fn is_dense(&self) -> bool {
        false
    }

    /// Return one line for the report.
    fn describe(&self) -> String;
}
