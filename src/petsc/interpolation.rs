//! Two levels of multigrid: the interpolation from the coarse one.

use super::library::petsc;
use super::{Int, Ksp, ffi};
use crate::error::{Error, Kind, Result};
use std::ptr::null_mut;

/// Interpolation from a coarse level: the rows of this process, compressed, one a row of the matrix of the fine level.
#[derive(Debug, Clone)]
pub struct Interpolation {
    /// Row starts.
    pub row_ptr: Vec<Int>,
    /// Column of each value, sorted within a row; counted through all processes.
    pub columns: Vec<Int>,
    /// The values.
    pub values: Vec<f64>,
    /// Number of columns that belong to this process.
    pub own_columns: usize,
}

impl Ksp {
    /// Makes the preconditioner multigrid of two levels (PCMG): this interpolation P, its transpose as restriction, and P'AP as the matrix
    /// of the coarse level, made anew when the matrix A changes. After [`set_operator`](Ksp::set_operator), before the options.
    ///
    /// ```
    /// use winkler::petsc::{Interpolation, Ksp, Matrix, Session};
    /// let words = ["-mg_levels_ksp_type", "richardson", "-mg_levels_pc_type", "sor", "-ksp_type", "cg"];
    /// let session = Session::start(&words.map(String::from))?;
    /// // two springs in a row; the coarse level is their mean
    /// let a = Matrix::from_csr(&session, 1, vec![0, 2, 4], vec![0, 1, 0, 1], vec![3.0, -1.0, -1.0, 3.0])?;
    /// let mut ksp = Ksp::new(&session, "")?;
    /// ksp.set_operator(&a)?;
    /// let (row_ptr, columns, values) = (vec![0, 1, 2], vec![0, 0], vec![1.0, 1.0]);
    /// ksp.set_interpolation(Interpolation { row_ptr, columns, values, own_columns: 1 })?;
    /// ksp.set_from_options()?;
    /// let mut x = [0.0; 2];
    /// ksp.solve(&[1.0, 1.0], &mut x)?;
    /// assert!(ksp.pc_type() == "mg" && (x[0] - 0.5).abs() < 1e-12 && (x[1] - 0.5).abs() < 1e-12);
    /// # Ok::<(), winkler::error::Error>(())
    /// ```
    ///
    /// # Errors
    /// When it has not one row a row of the matrix.
    pub fn set_interpolation(&mut self, interpolation: Interpolation) -> Result<()> {
        let Interpolation { row_ptr, columns, values, own_columns } = interpolation;
        let (rows, block) = (self.rows(), self.block_size() as Int);
        if row_ptr.len() != rows + 1 || row_ptr.last().is_none_or(|&last| last as usize != columns.len()) {
            let message =
                format!("an interpolation of {} rows for a matrix of {rows}", row_ptr.len().saturating_sub(1));
            return Err(Error::new(Kind::Solver, message));
        }
        let (i, j, v) = (row_ptr.as_ptr(), columns.as_ptr(), values.as_ptr());
        let (comm, mut mat, pc) = (self.comm(), null_mut(), self.pc()?);
        petsc!(MatCreate(comm, &mut mat))?;
        let made = (|| {
            petsc!(MatSetSizes(mat, rows as Int, own_columns as Int, DETERMINE, DETERMINE))?;
            petsc!(MatSetType(mat, c"aij".as_ptr()))?;
            petsc!(MatSetBlockSizes(mat, block, block))?;
            // each is for one of the two kinds, of one process and of several, and does nothing to the other; both copy
            petsc!(MatSeqAIJSetPreallocationCSR(mat, i, j, v))?;
            petsc!(MatMPIAIJSetPreallocationCSR(mat, i, j, v))?;
            petsc!(PCSetType(pc, c"mg".as_ptr()))?;
            petsc!(PCMGSetLevels(pc, 2, null_mut()))?;
            petsc!(PCMGSetInterpolation(pc, 1, mat))?;
            petsc!(PCMGSetGalerkin(pc, ffi::PCMGGalerkinType_PC_MG_GALERKIN_BOTH))
        })();
        // the preconditioner keeps a reference
        petsc!(MatDestroy(&mut mat))?;
        made
    }
}

/// PETSC_DETERMINE: the sum over the processes.
const DETERMINE: Int = -1;
