//! A factorisation of a principal submatrix P'AP, distributed over the processes of A.

use super::indices::Indices;
use super::integers::flag;
use super::library::petsc;
use super::substructures::Substructures;
use super::{Ksp, Matrix, ffi};
use crate::error::Result;

/// The factor of P'AP, where P are some dofs of a matrix A. A run has one or two of them.
#[allow(clippy::large_enum_variant)]
pub(super) enum Factor {
    /// Two halves, each eliminated by one process.
    Halves(Substructures),
    /// One factorisation by MUMPS on all processes.
    Parallel(Ksp),
}

impl Factor {
    /// Factor P'AP. Collective. Return `None` if it is not positive definite to rounding.
    ///
    /// `dofs` are all dofs P, the same on all processes: whole nodes in increasing order. `owned` are the `count` dofs that this process owns.
    ///
    /// # Errors
    /// Lack of memory, and other failures of MUMPS.
    pub fn new(matrix: &Matrix, dofs: &[usize], owned: &Indices, count: usize) -> Result<Option<Self>> {
        let (session, scope) = (matrix.session(), matrix.scope());
        // a half is to be no larger than what a process has of the matrix anyway
        if dofs.len() * scope.processes(session) <= 2 * matrix.total() {
            return Ok(Substructures::new(matrix, dofs)?.map(Self::Halves));
        }
        let mut block = owned.submatrix(matrix, owned)?;
        // SAFETY: a matrix of rows and columns of one that is positive definite.
        unsafe {
            petsc!(MatSetOption(block, ffi::MatOption_MAT_SYMMETRIC, flag(true)))?;
            petsc!(MatSetOption(block, ffi::MatOption_MAT_SPD, flag(true)))?;
        }
        let solver = Ksp::factored(session, scope, block, count);
        // SAFETY: our reference; the solver has its own.
        unsafe { petsc!(MatDestroy(&mut block)) }?;
        let solver = solver?;
        Ok(solver.failure().is_none().then_some(Self::Parallel(solver)))
    }

    /// Compute x = (P'AP)^-1 b; the slices have one entry for each dof P that this process owns. Collective.
    ///
    /// # Errors
    /// Failures of MUMPS.
    pub fn solve(&self, b: &[f64], x: &mut [f64]) -> Result<()> {
        match self {
            Self::Halves(halves) => halves.solve(b, x),
            Self::Parallel(solver) => solver.solve(b, x).map(|_| ()),
        }
    }
}
