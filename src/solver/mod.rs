//! Inner solvers: how a body solves G z = r.
//!
//! [`SparseBody`] owns K, f and B and answers the verbs of [`Body`](crate::model::Body); a [`RobinMatrix`] is G, by an
//! [`InnerSolver`]. A new way to solve is a new file with that trait. [`CondensedBody`] is such a body whose dofs are those of its contact.
//!
//! Errors are failures of the solver library, and PETSc being out of memory, but for what functions say of their own.

mod coarse;
mod condensed;
pub mod cost;
pub mod dense;
pub mod krylov;
pub mod memory;
pub mod monolithic;
pub mod options;
pub mod preset;
mod retained;
mod robin;
mod sparse;
pub mod speed;
mod split;

pub use coarse::RigidSpace;
pub use condensed::CondensedBody;
pub use dense::Dense;
pub use krylov::Krylov;
pub use monolithic::{Monolithic, Union};
pub use retained::Retained;
pub use robin::RobinMatrix;
pub use sparse::SparseBody;
pub use split::Split;

use crate::error::Result;
use crate::linalg::Csr;
use crate::model::Solved;
use crate::petsc::{Enough, Int, Matrix, Rows, Subspace};

/// A whole matrix as PETSc's, or the rows of this rank from number `start` on.
fn rows(matrix: Csr, start: Option<usize>) -> Result<Rows> {
    let Csr { columns, ptr, col, values } = matrix;
    match start {
        None => Rows::all(integers(ptr), integers(col), values),
        Some(start) => Rows::of_process(start, columns, integers(ptr), integers(col), values),
    }
}

/// A pattern in PETSc's integers; where these have 32 bits, the array itself.
#[allow(clippy::useless_conversion)]
fn integers(part: Vec<i32>) -> Vec<Int> {
    part.into_iter().map(Int::from).collect()
}

/// A change of G = K + B' diag(d) B.
pub struct Change<'a> {
    /// Writes the values of G in the order of the pattern it was made with.
    pub write: &'a dyn Fn(&mut [f64]),
    /// Dofs of the contact rows that a kept preconditioner is poor at.
    pub far: &'a dyn Fn() -> Vec<usize>,
    /// Those that a new one is poor at: stiff ones.
    pub stiff: &'a dyn Fn() -> Vec<usize>,
    /// What rigid motions of bodies put around a preconditioner, if there are any.
    pub coarse: &'a dyn Fn() -> Option<Box<dyn Subspace>>,
}

/// What a solver works with after a change of G.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Seen {
    /// The preconditioner of an older G.
    Older,
    /// One of G, around which stiff rows are solved exactly.
    Patched,
    /// G itself.
    Whole,
}

/// Owner of the matrix G with a way to solve G z = r.
pub trait InnerSolver {
    /// Whether it has G in rows, with which K can be applied: nobody else needs K then.
    const HAS_ROWS: bool = false;

    /// G, for products that leave it as it is, of a solver that has it in rows.
    fn matrix_mut(&mut self) -> Option<&mut Matrix> {
        None
    }

    /// Changes values of G; the next solve uses the new matrix.
    fn update(&mut self, change: Change) -> Result<Seen>;

    /// Factors G, or sets its preconditioner up, if it changed since.
    fn set_up(&mut self) -> Result<()>;

    /// Solves G z = r with zero guess.
    ///
    /// # Errors
    /// Failures of the solver library; not converging is told in [`Solved`].
    fn solve(&mut self, r: &[f64], z: &mut [f64]) -> Result<Solved>;

    /// The same, until `enough` is true of z and the share of r that it leaves, for solvers that come nearer step by step. If the user
    /// set a tolerance, that ends the solve.
    fn solve_until(&mut self, r: &[f64], z: &mut [f64], _enough: &mut Enough) -> Result<Solved> {
        self.solve(r, z)
    }

    /// How far solves have to reduce r, unless the user says; false if solves are what they are.
    fn precision(&mut self, _rtol: f64) -> Result<bool> {
        Ok(false)
    }

    /// Share of the energy norm of z that the last solve may be off: zero for a direct solver.
    fn accuracy(&self) -> f64 {
        0.0
    }

    /// z = M^-1 r with a fixed symmetric M near G: one application of the preconditioner of an iterative solver, a whole solve
    /// of a direct one.
    fn precondition(&mut self, r: &[f64], z: &mut [f64]) -> Result<Solved> {
        self.solve(r, z)
    }

    /// Symbolic and numeric factorisations or preconditioner set-ups so far, and exact solves made around a preconditioner.
    fn factorizations(&self) -> [usize; 3];

    /// Whether the factorisations are dense ones, which are counted apart.
    fn is_dense(&self) -> bool {
        false
    }

    /// One line for the report.
    fn describe(&self) -> String;
}
