//! Preconditioners that the program makes: multigrid of two levels (PCMG), and exact solves in subspaces around any preconditioner.

use super::library::{flag, petsc};
use super::matrix::check;
use super::subspace::{Started, Subspace, Wrapper};
use super::vector::DETERMINE;
use super::{Int, Ksp, Matrix, Scope, ffi};
use crate::error::{Error, Kind, Result};
use mpi::collective::SystemOperation;
use mpi::traits::CommunicatorCollectives;
use std::ffi::CStr;
use std::ptr::null_mut;

impl Ksp {
    /// Choose multigrid of two levels (PCMG) as preconditioner. To be called before the options are read.
    ///
    /// P interpolates from the coarse level, P' restricts, and the matrix of the coarse level is P'AP. It is computed anew when the
    /// `matrix` A of this solver changes.
    ///
    /// P has one row for each row of A on this process. Row `i` has the global columns `columns[row_ptr[i]..row_ptr[i + 1]]`, in
    /// increasing order, and the values at the same positions. This process owns `own` columns.
    ///
    /// ```
    /// use winkler::petsc::{Ksp, Matrix, Session};
    /// let words = ["-mg_levels_ksp_type", "richardson", "-mg_levels_pc_type", "sor", "-ksp_type", "cg"];
    /// let session = Session::start(&words.map(String::from))?;
    /// // two springs in a row; the coarse level is their mean
    /// let a = Matrix::from_csr(&session, 1, vec![0, 2, 4], vec![0, 1, 0, 1], vec![3.0, -1.0, -1.0, 3.0])?;
    /// let mut ksp = Ksp::new(&session, "")?;
    /// ksp.set_operator(&a)?;
    /// ksp.set_interpolation(&a, [&[0, 1, 2], &[0, 0]], &[1.0, 1.0], 1)?;
    /// ksp.set_from_options()?;
    /// let mut x = [0.0; 2];
    /// ksp.solve(&[1.0, 1.0], &mut x)?;
    /// assert!(ksp.pc_type() == "mg" && (x[0] - 0.5).abs() < 1e-12 && (x[1] - 0.5).abs() < 1e-12);
    /// # Ok::<(), winkler::error::Error>(())
    /// ```
    ///
    /// # Errors
    /// When the arrays do not describe such rows.
    pub fn set_interpolation(
        &mut self,
        matrix: &Matrix,
        [row_ptr, columns]: [&[Int]; 2],
        values: &[f64],
        own: usize,
    ) -> Result<()> {
        let (rows, block) = (matrix.rows(), matrix.block_size() as Int);
        let mut width = own;
        if matrix.scope() == Scope::World {
            matrix.session().world().all_reduce_into(&own, &mut width, SystemOperation::sum());
        }
        check(row_ptr, columns, values, width)?;
        if row_ptr.len() != rows + 1 {
            let message = format!("an interpolation of {} rows for a matrix of {rows}", row_ptr.len() - 1);
            return Err(Error::new(Kind::Solver, message));
        }
        let (i, j, v) = (row_ptr.as_ptr(), columns.as_ptr(), values.as_ptr());
        let (comm, mut mat, pc) = (matrix.scope().comm(matrix.session()), null_mut(), self.pc()?);
        // SAFETY: the new matrix.
        unsafe { petsc!(MatCreate(comm, &mut mat)) }?;
        // SAFETY: the three arrays were checked to be rows of this width; PETSc copies them.
        let made = (|| unsafe {
            petsc!(MatSetSizes(mat, rows as Int, own as Int, DETERMINE, DETERMINE))?;
            petsc!(MatSetType(mat, c"aij".as_ptr()))?;
            petsc!(MatSetBlockSizes(mat, block, block))?;
            // one call is for matrices of one process and one for several; each ignores the other kind
            petsc!(MatSeqAIJSetPreallocationCSR(mat, i, j, v))?;
            petsc!(MatMPIAIJSetPreallocationCSR(mat, i, j, v))?;
            petsc!(PCSetType(pc, c"mg".as_ptr()))?;
            petsc!(PCMGSetLevels(pc, 2, null_mut()))?;
            petsc!(PCMGSetInterpolation(pc, 1, mat))?;
            petsc!(PCMGSetGalerkin(pc, ffi::PCMGGalerkinType_PC_MG_GALERKIN_BOTH))
        })();
        // SAFETY: our reference; the preconditioner keeps its own.
        unsafe { petsc!(MatDestroy(&mut mat)) }?;
        made
    }

    /// Set up the smoother again with the current values of the `matrix`, where the preconditioner is otherwise kept.
    ///
    /// Chebyshev's method estimates its bounds anew. The matrix of the coarse level stays as it is.
    ///
    /// ```
    /// use winkler::petsc::{Ksp, Matrix, Session};
    /// let words = "-ksp_type cg -ksp_rtol 1e-10 -mg_levels_ksp_type chebyshev -mg_levels_pc_type jacobi -mg_coarse_pc_type cholesky";
    /// let session = Session::start(&words.split(' ').map(String::from).collect::<Vec<_>>())?;
    /// // sixty springs to the ground; then a stiff alternating motion of the last thirty, which the coarse level cannot represent
    /// let (n, row) = (60, |spring: f64, i: usize| {
    ///     let spring = move |j: usize| if i.min(j) < 30 { 0.0 } else { spring * [1.0, -1.0][(i + j) % 2] };
    ///     (0..60).map(move |j| f64::from(u8::from(i == j)) + spring(j))
    /// });
    /// let columns = (0..n).flat_map(|_| 0..n as _).collect();
    /// let values = (0..n).flat_map(|i| row(0.0, i)).collect();
    /// let mut a = Matrix::from_csr(&session, 1, (0..=n).map(|i| (i * n) as _).collect(), columns, values)?;
    /// a.set_spd()?;
    /// let mut ksp = Ksp::new(&session, "")?;
    /// ksp.set_operator(&a)?;
    /// ksp.set_interpolation(&a, [&(0..=60).collect::<Vec<_>>(), &(0..60).map(|i| i / 2).collect::<Vec<_>>()], &[1.0; 60], 30)?;
    /// ksp.set_from_options()?;
    /// ksp.set_up()?;
    /// ksp.set_reuse_preconditioner(true)?;
    /// a.update(|values| (0..n).for_each(|i| (0..n).zip(row(1.0, i)).for_each(|(j, value)| values[n * i + j] = value)))?;
    /// let (b, mut x) = ((0..n).map(|i| (i % 7) as f64).collect::<Vec<_>>(), vec![0.0; n]);
    /// assert!(!ksp.solve(&b, &mut x)?.reason.converged());
    /// ksp.renew_smoother(&a)?;
    /// assert!(ksp.solve(&b, &mut x)?.reason.converged());
    /// # Ok::<(), winkler::error::Error>(())
    /// ```
    ///
    /// # Errors
    /// PETSc's, also when the preconditioner has no two levels.
    pub fn renew_smoother(&self, matrix: &Matrix) -> Result<()> {
        let (pc, mut smoother) = (self.pc()?, null_mut());
        // SAFETY: the smoother belongs to the preconditioner, and refers to this matrix already.
        unsafe {
            petsc!(PCMGGetSmoother(pc, 1, &mut smoother))?;
            // newer versions of PETSc keep the smoother's own preconditioner with that of all levels
            petsc!(KSPSetReusePreconditioner(smoother, flag(false)))?;
            petsc!(KSPSetOperators(smoother, matrix.raw(), matrix.raw()))?;
            petsc!(KSPSetUp(smoother))
        }
    }
}

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
    pub fn wrap(&mut self, matrix: &Matrix, name: &'static CStr, subspace: Box<dyn Subspace>) -> Result<()> {
        let wrapper = Wrapper::new(matrix, self.outermost_pc()?, name, subspace)?;
        // SAFETY: a preconditioner of the same matrix.
        unsafe { petsc!(KSPSetPC(self.ksp, wrapper.pc)) }?;
        self.wrappers.push(wrapper);
        Ok(())
    }

    /// Go back to the preconditioner that options chose.
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
    /// All residuals of conjugate gradients from there have Q r = 0 up to rounding. So an application needs no solve before M, which saves half of the work in
    /// the space, until the returned guard is dropped. Return `None` without a subspace, or for another method than `cg`.
    pub(super) fn start(&self, rest: &mut Vec<f64>, x: &mut [f64]) -> Result<Option<Started<'_>>> {
        let Some(outermost) = self.wrappers.last().filter(|_| self.ksp_type() == "cg") else { return Ok(None) };
        outermost.start(rest, x).map(Some)
    }
}
