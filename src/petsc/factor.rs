//! A factor of some rows and columns of a matrix, on the processes that have them.

use super::indices::Indices;
use super::library::petsc;
use super::substructures::Substructures;
use super::{Ksp, Matrix, ffi};
use crate::error::Result;

/// P'AP, factored: of a matrix A and some of its dofs P. A run has one or two.
#[allow(clippy::large_enum_variant)]
pub(super) enum Factor {
    /// In two halves.
    Halves(Substructures),
    /// By MUMPS on all.
    Parallel(Ksp),
}

impl Factor {
    /// Of dofs in increasing order, whole nodes, the same on all processes, and of which `here` has so many of this process; collective. `None` if
    /// it is not positive definite to rounding.
    ///
    /// # Errors
    /// Memory, and what else stops MUMPS.
    pub fn new(matrix: &Matrix, dofs: &[usize], (here, count): (&Indices, usize)) -> Result<Option<Self>> {
        let (session, scope) = (matrix.session(), matrix.scope());
        // a half is to be no larger than what a process has of the matrix anyway
        if dofs.len() * scope.processes(session) <= 2 * matrix.total() {
            return Ok(Substructures::new(matrix, dofs)?.map(Self::Halves));
        }
        let mut block = here.submatrix(matrix, here)?;
        // SAFETY: a matrix of rows and columns of one that is positive definite.
        unsafe {
            petsc!(MatSetOption(block, ffi::MatOption_MAT_SYMMETRIC, ffi::PetscBool_PETSC_TRUE))?;
            petsc!(MatSetOption(block, ffi::MatOption_MAT_SPD, ffi::PetscBool_PETSC_TRUE))?;
        }
        let solver = Ksp::factored(session, scope, block, count);
        // SAFETY: our reference; the solver has its own.
        unsafe { petsc!(MatDestroy(&mut block)) }?;
        let solver = solver?;
        Ok(solver.failure().is_none().then_some(Self::Parallel(solver)))
    }

    /// `x = (P'AP)^-1 b` for the dofs of this process; collective.
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
