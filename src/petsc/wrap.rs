//! Spaces in which a matrix is solved exactly, around the preconditioner of a solver.

use super::around::{Around, Started, Subspace};
use super::library::petsc;
use super::{Ksp, Matrix};
use crate::error::Result;

impl Ksp {
    /// Puts a space in which the `matrix` of this solver is solved exactly around its preconditioner, with what is around that already; `name`
    /// is what `-ksp_view` shows. Collective. New values of the matrix need a new space.
    ///
    /// # Errors
    /// PETSc's.
    pub fn wrap(&mut self, matrix: &Matrix, name: &'static std::ffi::CStr, subspace: Box<dyn Subspace>) -> Result<()> {
        let around = Around::new(matrix, self.whole_pc()?, name, subspace)?;
        // SAFETY: a preconditioner of the same matrix.
        unsafe { petsc!(KSPSetPC(self.ksp, around.outer)) }?;
        self.around.push(around);
        Ok(())
    }

    /// Goes back to the solver's own preconditioner.
    ///
    /// # Errors
    /// PETSc's.
    pub fn unwrap(&mut self) -> Result<()> {
        if let Some(around) = self.around.first() {
            // SAFETY: the preconditioner that this solver had.
            unsafe { petsc!(KSPSetPC(self.ksp, around.inner())) }?;
        }
        // those outside first
        while self.around.pop().is_some() {}
        Ok(())
    }

    /// Solves exactly in the outermost space beforehand: x = Q b, and `rest` = b - A x. Conjugate gradients from there have residuals with Q r = 0,
    /// for which z = (I - Q A) M r: half of the work in the space is saved (Tang, Nabben, Vuik, Erlangga, J. Sci. Comput. 39, 2009, "A-DEF2").
    /// What is returned ends that when it is dropped; none without a space or with another method.
    ///
    /// # Errors
    /// Failures of the solver library.
    pub(super) fn start(&self, rest: &mut [f64], x: &mut [f64]) -> Result<Option<Started<'_>>> {
        let Some(around) = self.around.last().filter(|_| self.ksp_type() == "cg") else { return Ok(None) };
        around.start(rest, x).map(Some)
    }
}
