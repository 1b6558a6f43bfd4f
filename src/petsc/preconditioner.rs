//! Multigrid of two levels (PCMG), whose interpolation the program makes.

use super::call::{flag, petsc};
use super::error::{Error, Result};
use super::matrix::check;
use super::vector::DETERMINE;
use super::{Int, Ksp, Matrix, Scope, ffi};
use mpi::collective::SystemOperation;
use mpi::traits::CommunicatorCollectives;
use std::ptr::null_mut;

impl Ksp {
    /// Choose multigrid of two levels (PCMG) as preconditioner. To be called before the options are read.
    ///
    /// P interpolates from the coarse level, P' restricts, and the matrix of the coarse level is P'AP. It is computed
    /// anew when the `matrix` A of this solver changes.
    ///
    /// P has one row for each row of A on this process. Row `i` has the global columns `columns[row_ptr[i]..row_ptr[i +
    /// 1]]`, in increasing order, and the values at the same positions. This process owns `own` columns.
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
            return Err(Error::new(message));
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

    /// Return the number of levels of a multigrid (PCMG).
    ///
    /// # Errors
    /// PETSc's, also when the preconditioner is no such multigrid.
    pub fn multigrid_levels(&self) -> Result<usize> {
        let (pc, mut levels) = (self.pc()?, 0);
        // SAFETY: the preconditioner of this solver.
        unsafe { petsc!(PCMGGetLevels(pc, &mut levels)) }?;
        Ok(usize::try_from(levels).unwrap_or(0))
    }

    /// Set up the smoother again with the current values of the `matrix`, where the preconditioner is otherwise kept.
    ///
    /// Chebyshev's method estimates its bounds anew. The matrix of the coarse level stays as it is.
    ///
    /// # Errors
    /// PETSc's, also when the preconditioner has no two levels.
    pub fn renew_smoother(&self, matrix: &Matrix) -> Result<()> {
        let smoother = self.smoother(1)?;
        // SAFETY: the smoother belongs to the preconditioner, and refers to this matrix already.
        unsafe {
            // newer versions of PETSc keep the smoother's own preconditioner with that of all levels
            petsc!(KSPSetReusePreconditioner(smoother, flag(false)))?;
            petsc!(KSPSetOperators(smoother, matrix.raw(), matrix.raw()))?;
            petsc!(KSPSetUp(smoother))
        }
    }
}
