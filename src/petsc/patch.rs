//! An exact solve on a few dofs around the preconditioner of a solver.
//!
//! A preconditioner M of a matrix that was near A everywhere but on some dofs P becomes one of A by a multiplicative Schwarz step, made
//! symmetric:
//!
//! ```text
//! y = S r_P,   z = P y + M (r - A P y),   z += P S (r - A z)_P       S = (P'AP)^-1
//! ```
//!
//! Both products are with columns P alone. Of several processes each has its rows of them, and all have S.

use super::around::Subspace;
use super::library::petsc;
use super::vector::Vector;
use super::{Int, Ksp, Matrix, Scope, Session, ffi};
use crate::error::Result;
use std::ptr::{null, null_mut};

/// What the preconditioner around another needs.
struct Patch {
    /// The dofs P of this process: (entry of a vector here, place in P).
    own: Vec<(usize, usize)>,
    /// The rows here that have entries in columns P.
    rows: Vec<usize>,
    /// A in these rows and the columns P.
    columns: ffi::Mat,
    /// Vectors over the rows, and over P.
    parts: [Vector; 2],
    solver: Ksp,
    scope: Scope,
    session: Session,
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
        let (session, scope, own) = (matrix.session().clone(), matrix.scope(), matrix.own());
        let new = |rows| Vector::new(&session, Scope::Process, rows, 1);
        let mut patch = Indices::new(dofs)?;
        patch.grow(matrix, layers)?;
        let inside = patch.get()?;
        let mut touched = Indices::new(&inside)?;
        touched.grow(matrix, 1)?;
        let rows: Vec<usize> = touched.get()?.into_iter().filter(|i| own.contains(i)).collect();
        let mut block = patch.submatrix(matrix, &patch)?;
        // SAFETY: a matrix of this process, of rows and columns of one that is positive definite.
        unsafe {
            petsc!(MatSetOption(block, ffi::MatOption_MAT_SYMMETRIC, ffi::PetscBool_PETSC_TRUE))?;
            petsc!(MatSetOption(block, ffi::MatOption_MAT_SPD, ffi::PetscBool_PETSC_TRUE))?;
        }
        let solver = Ksp::factored(&session, block, inside.len());
        // SAFETY: our reference; the solver has its own.
        unsafe { petsc!(MatDestroy(&mut block)) }?;
        let solver = solver?;
        if solver.failure().is_some() {
            return Ok(None);
        }
        let here = |(place, dof): (usize, &usize)| own.contains(dof).then(|| (dof - own.start, place));
        Ok(Some(Self {
            own: inside.iter().enumerate().filter_map(here).collect(),
            columns: Indices::new(&rows)?.submatrix(matrix, &patch)?,
            parts: [new(rows.len())?, new(inside.len())?],
            rows: rows.into_iter().map(|i| i - own.start).collect(),
            solver,
            scope,
            session,
        }))
    }

    /// (P'AP)^-1 of what the processes have of a vector over P, altogether.
    fn solve(&self, mut part: Vec<f64>) -> Result<Vec<f64>> {
        self.scope.sum(&self.session, &mut part);
        let mut y = vec![0.0; part.len()];
        self.solver.solve(&part, &mut y)?;
        Ok(y)
    }
}

impl Subspace for Patch {
    fn start(&self, r: &mut [f64], x: &mut [f64]) -> Result<()> {
        let mut residual = vec![0.0; self.parts[1].len()];
        self.own.iter().for_each(|&(i, k)| residual[k] = r[i]);
        let y = self.solve(residual)?;
        let mut part = vec![0.0; self.rows.len()];
        // SAFETY: the product reads one and writes to the other.
        let product = |y, part| unsafe { petsc!(MatMult(self.columns, y, part)) };
        self.parts[1].map(("y", &y), &self.parts[0], ("A y", &mut part), product)?;
        self.rows.iter().zip(&part).for_each(|(&i, ay)| r[i] -= ay);
        self.own.iter().for_each(|&(i, k)| x[i] += y[k]);
        Ok(())
    }

    fn project(&self, z: &mut [f64]) -> Result<()> {
        let part: Vec<f64> = self.rows.iter().map(|&i| z[i]).collect();
        let mut az = vec![0.0; self.parts[1].len()];
        // SAFETY: as above.
        let product = |part, az| unsafe { petsc!(MatMultTranspose(self.columns, part, az)) };
        self.parts[0].map(("z", &part), &self.parts[1], ("A z", &mut az), product)?;
        let y = self.solve(az)?;
        self.own.iter().for_each(|&(i, k)| z[i] -= y[k]);
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
    fn new(numbers: &[usize]) -> Result<Self> {
        let mut numbers: Vec<Int> = numbers.iter().map(|&i| i as Int).collect();
        numbers.sort_unstable();
        numbers.dedup();
        let (count, copy, mut is) = (numbers.len() as Int, ffi::PetscCopyMode_PETSC_COPY_VALUES, null_mut());
        // SAFETY: PETSc copies the numbers.
        unsafe { petsc!(ISCreateGeneral(mpi::ffi::RSMPI_COMM_SELF, count, numbers.as_ptr(), copy, &mut is)) }?;
        Ok(Self(is))
    }

    /// Adds the columns of these rows, so many times.
    fn grow(&mut self, matrix: &Matrix, layers: usize) -> Result<()> {
        if layers == 0 {
            return Ok(());
        }
        // SAFETY: one set, which PETSc puts a new one in the place of.
        unsafe {
            petsc!(MatIncreaseOverlap(matrix.raw(), 1, &mut self.0, layers as Int))?;
            petsc!(ISSort(self.0))
        }
    }

    fn get(&self) -> Result<Vec<usize>> {
        let (mut count, mut numbers) = (0, null());
        // SAFETY: PETSc's array, read before it is given back.
        unsafe {
            petsc!(ISGetLocalSize(self.0, &mut count))?;
            petsc!(ISGetIndices(self.0, &mut numbers))?;
            let copy = (0..count as usize).map(|k| *numbers.add(k) as usize).collect();
            petsc!(ISRestoreIndices(self.0, &mut numbers))?;
            Ok(copy)
        }
    }

    /// These rows and those columns of a matrix, on this process.
    fn submatrix(&self, matrix: &Matrix, columns: &Indices) -> Result<ffi::Mat> {
        let (scall, mut list) = (ffi::MatReuse_MAT_INITIAL_MATRIX, null_mut());
        // SAFETY: PETSc makes a list of one matrix; our reference keeps the matrix when the list goes.
        unsafe {
            petsc!(MatCreateSubMatrices(matrix.raw(), 1, &self.0, &columns.0, scall, &mut list))?;
            let part = *list;
            petsc!(PetscObjectReference(part.cast()))?;
            petsc!(MatDestroySubMatrices(1, &mut list))?;
            Ok(part)
        }
    }
}

impl Drop for Indices {
    fn drop(&mut self) {
        // SAFETY: the one reference of this type.
        let _ = unsafe { petsc!(ISDestroy(&mut self.0)) };
    }
}
