//! Exact solves in subspaces around the preconditioner of a solver.

use super::around::{Started, Subspace, Wrapper};
use super::library::petsc;
use super::{Ksp, Matrix};
use crate::error::Result;
use std::ffi::CStr;

impl Ksp {
    /// Put an exact solve in a subspace around the preconditioner of this solver, and around subspaces that were added before.
    ///
    /// `matrix` is the matrix of this solver, and `name` is what `-ksp_view` shows. Collective. New values of the matrix need a new subspace.
    ///
    /// ```
    /// use std::{cell::Cell, rc::Rc};
    /// use winkler::{error::Result, petsc::{Ksp, Matrix, Session, Subspace}};
    /// /// The first unknown of diag(1e6, 2, 3), and how often it was solved.
    /// struct First(Rc<Cell<usize>>);
    /// impl Subspace for First {
    ///     fn correct(&self, r: &[f64], z: &mut [f64]) -> Result<()> {
    ///         self.0.set(self.0.get() + 1);
    ///         z[0] = r[0] / 1e6;
    ///         Ok(())
    ///     }
    /// }
    /// let options = ["-ksp_type", "cg", "-pc_type", "none", "-ksp_rtol", "1e-12"].map(String::from);
    /// let session = Session::start(&options)?;
    /// let a = Matrix::from_csr(&session, 1, vec![0, 1, 2, 3], vec![0, 1, 2], vec![1e6, 2.0, 3.0])?;
    /// let mut ksp = Ksp::new(&session, "")?;
    /// ksp.set_operator(&a)?;
    /// ksp.set_from_options()?;
    /// let calls = Rc::new(Cell::new(0));
    /// ksp.wrap(&a, c"first", Box::new(First(calls.clone())))?;
    /// let mut x = [0.0; 3];
    /// // two eigenvalues are left; the space is solved in before, and each application corrects afterwards alone
    /// assert_eq!(ksp.solve_until(&[1e6, 2.0, 3.0], &mut x, &mut |_| false)?.iterations, 2);
    /// assert!(x.iter().all(|x| (x - 1.0).abs() < 1e-12));
    /// assert_eq!(calls.get(), 4);
    /// // one application by itself corrects before and after
    /// ksp.precondition(&[1e6, 2.0, 3.0], &mut x)?;
    /// assert_eq!((x, calls.get()), ([1.0, 2.0, 3.0], 6));
    /// # Ok::<(), winkler::error::Error>(())
    /// ```
    ///
    /// # Errors
    /// PETSc's.
    pub fn wrap(&mut self, matrix: &Matrix, name: &'static CStr, subspace: Box<dyn Subspace>) -> Result<()> {
        let wrapper = Wrapper::new(matrix, self.outermost_pc()?, name, subspace)?;
        // SAFETY: a preconditioner of the same matrix.
        unsafe { petsc!(KSPSetPC(self.ksp, wrapper.pc)) }?;
        self.wrappers.push(wrapper);
        Ok(())
    }

    /// Go back to the preconditioner that options chose.
    ///
    /// # Errors
    /// PETSc's.
    pub fn unwrap(&mut self) -> Result<()> {
        if let Some(innermost) = self.wrappers.first() {
            // SAFETY: the preconditioner that this solver had.
            unsafe { petsc!(KSPSetPC(self.ksp, innermost.inner())) }?;
        }
        // the outermost first
        while self.wrappers.pop().is_some() {}
        Ok(())
    }

    /// Solve exactly in the outermost subspace before the iteration: set `x` to Q b and replace `rest` = b by b - A x.
    ///
    /// All residuals of conjugate gradients from there have Q r = 0. So an application needs no solve before M, which saves half of the work in
    /// the space, until the returned guard is dropped. Return `None` without a subspace, or for another method than `cg`.
    ///
    /// # Errors
    /// Failures of the solver library.
    pub(super) fn start(&self, rest: &mut Vec<f64>, x: &mut [f64]) -> Result<Option<Started<'_>>> {
        let Some(outermost) = self.wrappers.last().filter(|_| self.ksp_type() == "cg") else { return Ok(None) };
        outermost.start(rest, x).map(Some)
    }
}
