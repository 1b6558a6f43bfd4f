//! Exact solves in a subspace around the preconditioner of a solver.

use super::deflation::{Deflation, Motions};
use super::library::petsc;
use super::{Ksp, Matrix};
use crate::error::Result;

impl Ksp {
    /// Solve exactly in a space before the iteration and after each application of the preconditioner, which stays as it is.
    ///
    /// The space has the unit vectors of `dofs` and of those within `layers` of the graph of the `matrix` around them, by whole nodes, and the
    /// `motions`. `dofs` are global indices, the same on all processes. New values of the matrix need a new call. Collective.
    ///
    /// Return false, and change nothing, if W'AW is not positive definite to rounding.
    ///
    /// ```
    /// use winkler::petsc::{Ksp, Matrix, MotionPart, Motions, Session};
    /// let session = Session::start(&["-ksp_type", "cg", "-pc_type", "jacobi"].map(String::from))?;
    /// // a spring in a chain of ten becomes a million times as stiff
    /// let (mut ptr, mut columns, mut values) = (vec![0], vec![], vec![]);
    /// for i in 0..10 {
    ///     for j in [i - 1, i, i + 1].into_iter().filter(|j| (0..10).contains(j)) {
    ///         columns.push(j);
    ///         values.push(if i == j { 2.0 } else { -1.0 });
    ///     }
    ///     ptr.push(columns.len() as _);
    /// }
    /// let mut matrix = Matrix::from_csr(&session, 1, ptr, columns, values)?;
    /// matrix.set_spd()?;
    /// let mut ksp = Ksp::new(&session, "")?;
    /// ksp.set_operator(&matrix)?;
    /// ksp.set_from_options()?;
    /// ksp.set_up()?;
    /// ksp.set_reuse_preconditioner(true)?;
    /// matrix.update(|values| [9, 12].map(|at| values[at] += 1e6))?;
    /// matrix.update(|values| [10, 11].map(|at| values[at] -= 1e6))?;
    /// let mut x = [0.0; 10];
    /// let worn = ksp.solve(&[1.0; 10], &mut x)?.iterations;
    /// let motions = Motions { count: 1, parts: vec![MotionPart { motion: 0, first: 5, values: vec![5.0, 4.0, 3.0, 2.0, 1.0] }] };
    /// let iterations = [&[][..], &[3, 4]].map(|dofs| {
    ///     assert!(ksp.deflate(&matrix, dofs, 0, Some(&motions)).is_ok_and(|is_definite| is_definite));
    ///     let solved = ksp.solve(&[1.0; 10], &mut x).expect("PETSc");
    ///     ksp.undeflate().expect("PETSc");
    ///     assert!((x[3] - x[4]).abs() < 1e-4 && x[3] > 12.0, "{x:?}");
    ///     solved.iterations
    /// });
    /// assert!(iterations[1] < iterations[0] && iterations[0] < worn, "{worn} {iterations:?}");
    /// assert_eq!(ksp.pc_type(), "jacobi");
    /// // one application corrects before and after: the residual has no part in the space
    /// assert!(ksp.deflate(&matrix, &[3, 4], 0, None)?);
    /// let (mut z, mut az) = ([0.0; 10], [0.0; 10]);
    /// ksp.precondition(&[1.0; 10], &mut z)?;
    /// matrix.multiply(&z, &mut az)?;
    /// assert!((3..5).all(|i| (az[i] - 1.0).abs() < 1e-8) && (az[0] - 1.0).abs() > 0.1, "{az:?}");
    /// // a vector twice is no basis
    /// assert!(!ksp.deflate(&matrix, &[3], 0, Some(&Motions { count: 1, parts: vec![MotionPart { motion: 0, first: 3, values: vec![1.0] }] }))?);
    /// # Ok::<(), winkler::error::Error>(())
    /// ```
    ///
    /// # Errors
    /// PETSc's.
    pub fn deflate(
        &mut self,
        matrix: &Matrix,
        dofs: &[usize],
        layers: usize,
        motions: Option<&Motions>,
    ) -> Result<bool> {
        self.undeflate()?;
        self.recover()?;
        let made = Deflation::new(matrix, self.outermost_pc()?, (dofs, layers), motions)?;
        let Some(deflation) = made else { return Ok(false) };
        // SAFETY: a preconditioner of the same matrix.
        unsafe {
            petsc!(KSPSetPC(self.ksp, deflation.outer))?;
            petsc!(KSPConvergedDefaultSetUIRNorm(self.ksp))?;
        }
        self.deflation = Some(deflation);
        Ok(true)
    }

    /// Go back to the preconditioner that options chose.
    ///
    /// # Errors
    /// PETSc's.
    pub fn undeflate(&mut self) -> Result<()> {
        match self.deflation.take() {
            // SAFETY: the preconditioner that this solver had.
            Some(deflation) => unsafe { petsc!(KSPSetPC(self.ksp, deflation.inner)) },
            None => Ok(()),
        }
    }
}
