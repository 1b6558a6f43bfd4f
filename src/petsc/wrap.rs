//! Spaces in which a matrix is solved exactly, around the preconditioner of a solver.

use super::around::{Around, Started, Subspace};
use super::library::petsc;
use super::{Ksp, Matrix};
use crate::error::Result;

impl Ksp {
    /// Puts a space in which the `matrix` of this solver is solved exactly around its preconditioner, with what is around that already; `name`
    /// is what `-ksp_view` shows. Collective. New values of the matrix need a new space.
    ///
    /// ```
    /// use std::{cell::Cell, rc::Rc};
    /// use winkler::{error::Result, petsc::{Ksp, Matrix, Session, Subspace}};
    /// /// The first unknown of diag(1e6, 2, 3), and how often its two parts were asked for.
    /// struct First(Rc<[Cell<usize>; 2]>);
    /// impl Subspace for First {
    ///     fn start(&self, r: &mut [f64], x: &mut [f64]) -> Result<()> {
    ///         self.0[0].set(self.0[0].get() + 1);
    ///         (x[0], r[0]) = (x[0] + r[0] / 1e6, 0.0);
    ///         Ok(())
    ///     }
    ///     fn project(&self, z: &mut [f64]) -> Result<()> {
    ///         self.0[1].set(self.0[1].get() + 1);
    ///         z[0] = 0.0;
    ///         Ok(())
    ///     }
    /// }
    /// let options = ["-ksp_type", "cg", "-pc_type", "none", "-ksp_rtol", "1e-12"].map(String::from);
    /// let session = Session::start(&options)?;
    /// let a = Matrix::from_csr(&session, 1, vec![0, 1, 2, 3], vec![0, 1, 2], vec![1e6, 2.0, 3.0])?;
    /// let mut ksp = Ksp::new(&session, "")?;
    /// ksp.set_operator(&a)?;
    /// ksp.set_from_options()?;
    /// let asked = Rc::new([Cell::new(0), Cell::new(0)]);
    /// ksp.wrap(&a, c"first", Box::new(First(asked.clone())))?;
    /// let mut x = [0.0; 3];
    /// // two eigenvalues are left; the space is solved in once, and each application corrects afterwards alone
    /// assert_eq!(ksp.solve_until(&[1e6, 2.0, 3.0], &mut x, &mut |_| false)?.iterations, 2);
    /// assert!(x.iter().all(|x| (x - 1.0).abs() < 1e-12));
    /// assert_eq!((asked[0].get(), asked[1].get()), (1, 3));
    /// // one application by itself corrects before and after
    /// ksp.precondition(&[1e6, 2.0, 3.0], &mut x)?;
    /// assert_eq!((x, asked[0].get(), asked[1].get()), ([1.0, 2.0, 3.0], 2, 4));
    /// # Ok::<(), winkler::error::Error>(())
    /// ```
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
