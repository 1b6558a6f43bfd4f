//! An exact solve on a few dofs around the preconditioner of a solver.
//!
//! A preconditioner M of a matrix that was near A everywhere but on some dofs P becomes one of A by a multiplicative Schwarz step, made
//! symmetric:
//!
//! ```text
//! y = S r_P,   z = P y + M (r - A P y),   z += P S (r - A z)_P       S = (P'AP)^-1
//! ```
//!
//! Both products are with columns P alone. Of several processes each has its rows of them, and its part of P'AP, which MUMPS factors on all.

use super::around::Subspace;
use super::library::petsc;
use super::vector::Vector;
use super::{Int, Ksp, Matrix, ffi};
use crate::error::Result;
use mpi::ffi::{MPI_Comm, RSMPI_COMM_SELF};
use std::ptr::{null, null_mut};

/// What the preconditioner around another needs.
struct Patch {
    /// The dofs P of this process, as entries of its vectors.
    inside: Vec<usize>,
    /// The rows of this process that have entries in columns P, likewise.
    touched: Vec<usize>,
    /// A in these rows and the columns P.
    columns: ffi::Mat,
    /// Vectors over the rows, and over P.
    parts: [Vector; 2],
    solver: Ksp,
}

impl Ksp {
    /// Solves exactly on some `dofs` of the `matrix` of this solver, and on those within `layers` of its graph around them, before and after
    /// the preconditioner, which stays that of an older matrix. Collective, with the same dofs, counted through all processes, on each. New
    /// values of the matrix need a new patch.
    ///
    /// ```
    /// use winkler::petsc::{Ksp, Matrix, Session};
    /// let session = Session::start(&["-ksp_type", "cg", "-pc_type", "jacobi"].map(String::from))?;
    /// // a spring in a chain of ten becomes a million times as stiff
    /// let (mut ptr, mut columns, mut values) = (vec![0], vec![], vec![]);
    /// for i in 0..10 {
    ///     for j in [i - 1, i, i + 1].into_iter().filter(|j| (0..10).contains(j)) {
    ///         columns.push(j);
    ///         values.push(if i == j { 2.0 } else { -1.0 });
    ///     }
    ///     ptr.push(columns.len() as i32);
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
    /// ksp.patch(&matrix, &[3, 4], 0)?;
    /// let patched = ksp.solve(&[1.0; 10], &mut x)?.iterations;
    /// assert!(patched < worn && (x[3] - x[4]).abs() < 1e-4 && x[3] > 12.0, "{worn} {patched} {x:?}");
    /// ksp.unwrap()?;
    /// assert_eq!(ksp.pc_type(), "jacobi");
    /// # Ok::<(), winkler::error::Error>(())
    /// ```
    ///
    /// False, without a patch, if P'AP is not positive definite to rounding.
    ///
    /// # Errors
    /// PETSc's.
    pub fn patch(&mut self, matrix: &Matrix, dofs: &[usize], layers: usize) -> Result<bool> {
        self.recover()?;
        let Some(patch) = Patch::new(matrix, dofs, layers)? else { return Ok(false) };
        let name = c"exact solve on some dofs around the preconditioner";
        self.wrap(matrix, name, Box::new(patch))?;
        Ok(true)
    }
}

impl Patch {
    fn new(matrix: &Matrix, dofs: &[usize], layers: usize) -> Result<Option<Self>> {
        let (session, scope, own) = (matrix.session(), matrix.scope(), matrix.own());
        let new = |rows: &[usize]| Vector::new(session, scope, rows.len(), 1);
        let mut inside = Indices::around(matrix, dofs, layers)?;
        let mut touched = Indices::around(matrix, &inside, 1)?;
        inside.retain(|i| own.contains(i));
        touched.retain(|i| own.contains(i));
        let parts = [new(&touched)?, new(&inside)?];
        let patch = Indices::new(scope.comm(session), &inside)?;
        let mut block = patch.submatrix(matrix, &patch)?;
        // SAFETY: a matrix of rows and columns of one that is positive definite.
        unsafe {
            petsc!(MatSetOption(block, ffi::MatOption_MAT_SYMMETRIC, ffi::PetscBool_PETSC_TRUE))?;
            petsc!(MatSetOption(block, ffi::MatOption_MAT_SPD, ffi::PetscBool_PETSC_TRUE))?;
        }
        let solver = Ksp::factored(session, scope, block, inside.len());
        // SAFETY: our reference; the solver has its own.
        unsafe { petsc!(MatDestroy(&mut block)) }?;
        let solver = solver?;
        if solver.failure().is_some() {
            return Ok(None);
        }
        let columns = Indices::new(scope.comm(session), &touched)?.submatrix(matrix, &patch)?;
        inside.iter_mut().chain(&mut touched).for_each(|i| *i -= own.start);
        Ok(Some(Self { inside, touched, columns, parts, solver }))
    }
}

impl Subspace for Patch {
    fn start(&self, r: &mut [f64], x: &mut [f64]) -> Result<()> {
        let residual: Vec<f64> = self.inside.iter().map(|&i| r[i]).collect();
        let (mut y, mut ay) = (vec![0.0; residual.len()], vec![0.0; self.touched.len()]);
        self.solver.solve(&residual, &mut y)?;
        // SAFETY: the product reads one and writes to the other.
        let product = |y, ay| unsafe { petsc!(MatMult(self.columns, y, ay)) };
        self.parts[1].map(("y", &y), &self.parts[0], ("A y", &mut ay), product)?;
        self.touched.iter().zip(&ay).for_each(|(&i, ay)| r[i] -= ay);
        self.inside.iter().zip(&y).for_each(|(&i, y)| x[i] += y);
        Ok(())
    }

    fn project(&self, z: &mut [f64]) -> Result<()> {
        let part: Vec<f64> = self.touched.iter().map(|&i| z[i]).collect();
        let (mut az, mut y) = (vec![0.0; self.inside.len()], vec![0.0; self.inside.len()]);
        // SAFETY: as above.
        let product = |part, az| unsafe { petsc!(MatMultTranspose(self.columns, part, az)) };
        self.parts[0].map(("z", &part), &self.parts[1], ("A z", &mut az), product)?;
        self.solver.solve(&az, &mut y)?;
        self.inside.iter().zip(&y).for_each(|(&i, y)| z[i] -= y);
        Ok(())
    }
}

impl Drop for Patch {
    fn drop(&mut self) {
        // SAFETY: the one reference of this type.
        let _ = unsafe { petsc!(MatDestroy(&mut self.columns)) };
    }
}

/// Numbers of rows, in increasing order.
struct Indices(ffi::IS);

impl Indices {
    /// What each process of a communicator has of them.
    fn new(comm: MPI_Comm, numbers: &[usize]) -> Result<Self> {
        let numbers: Vec<Int> = numbers.iter().map(|&i| i as Int).collect();
        let (count, copy, mut is) = (numbers.len() as Int, ffi::PetscCopyMode_PETSC_COPY_VALUES, null_mut());
        // SAFETY: PETSc copies the numbers.
        unsafe { petsc!(ISCreateGeneral(comm, count, numbers.as_ptr(), copy, &mut is)) }?;
        Ok(Self(is))
    }

    /// These `rows` of a matrix and those within `layers` of its graph around them. Collective.
    fn around(matrix: &Matrix, rows: &[usize], layers: usize) -> Result<Vec<usize>> {
        let mut rows = rows.to_vec();
        rows.sort_unstable();
        rows.dedup();
        // SAFETY: the constant of MPI itself.
        let mut indices = Self::new(unsafe { RSMPI_COMM_SELF }, &rows)?;
        let (mut count, mut numbers) = (0, null());
        // SAFETY: one set, in the place of which PETSc puts a new one, and its array, read before it is given back.
        unsafe {
            petsc!(MatIncreaseOverlap(matrix.raw(), 1, &mut indices.0, layers as Int))?;
            petsc!(ISSort(indices.0))?;
            petsc!(ISGetLocalSize(indices.0, &mut count))?;
            petsc!(ISGetIndices(indices.0, &mut numbers))?;
            let copy = (0..count as usize).map(|k| *numbers.add(k) as usize).collect();
            petsc!(ISRestoreIndices(indices.0, &mut numbers))?;
            Ok(copy)
        }
    }

    /// These rows and those columns of a matrix, of its processes.
    fn submatrix(&self, matrix: &Matrix, columns: &Indices) -> Result<ffi::Mat> {
        let (scall, mut part) = (ffi::MatReuse_MAT_INITIAL_MATRIX, null_mut());
        // SAFETY: sets of the matrix's processes.
        unsafe { petsc!(MatCreateSubMatrix(matrix.raw(), self.0, columns.0, scall, &mut part)) }?;
        Ok(part)
    }
}

impl Drop for Indices {
    fn drop(&mut self) {
        // SAFETY: the one reference of this type.
        let _ = unsafe { petsc!(ISDestroy(&mut self.0)) };
    }
}
