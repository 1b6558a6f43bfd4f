//! Sparse matrices.

use super::arrays::{Arrays, attach, check, free};
use super::library::petsc;
use super::vector::Vector;
use super::{Int, Session, ffi};
use crate::error::{Error, Kind, Result};
use mpi::ffi::RSMPI_COMM_SELF;
use std::cell::Cell;
use std::ptr::null_mut;
use std::rc::Rc;

/// A square sparse matrix of this process (PETSc's sequential AIJ, rows compressed).
///
/// ```
/// use winkler::petsc::{Matrix, Session};
/// let session = Session::start(&[])?;
/// let mut a = Matrix::from_csr(&session, 1, vec![0, 2, 4], vec![0, 1, 0, 1], vec![2.0, 1.0, 1.0, 2.0])?;
/// a.set_spd()?;
/// a.set_near_null_space(&[vec![1.0, 1.0]])?;
/// let mut y = [0.0; 2];
/// a.multiply(&[1.0, 2.0], &mut y)?;
/// assert_eq!(y, [4.0, 5.0]);
/// a.update(|values| values[0] += 1.0)?;
/// a.multiply(&[1.0, 2.0], &mut y)?;
/// assert_eq!((y, a.values()), ([5.0, 5.0], &[3.0, 1.0, 1.0, 2.0][..]));
/// assert_eq!((a.rows(), a.nonzeros(), a.block_size(), a.session().size()), (2, 4, 1, 1));
/// assert!(a.multiply(&[1.0], &mut y).is_err());
/// assert!(Matrix::from_csr(&session, 1, vec![0, 1], vec![7], vec![1.0]).is_err());
/// # Ok::<(), winkler::error::Error>(())
/// ```
pub struct Matrix {
    mat: ffi::Mat,
    rows: usize,
    nonzeros: usize,
    block_size: usize,
    values: *mut f64,
    /// Number of updates, for the solvers of this matrix.
    updates: Rc<Cell<u64>>,
    x: Vector,
    y: Vector,
    session: Session,
}

impl Matrix {
    /// Takes a matrix over from its compressed rows: row `i` has the columns `columns[row_ptr[i]..row_ptr[i + 1]]`, in
    /// increasing order, and the values at the same places. `block_size` dofs belong to one node (1 if unsure); it
    /// divides the number of rows.
    ///
    /// # Errors
    /// When the arrays are not those of a square matrix with sorted columns.
    pub fn from_csr(
        session: &Session,
        block_size: usize,
        row_ptr: Vec<Int>,
        columns: Vec<Int>,
        values: Vec<f64>,
    ) -> Result<Matrix> {
        check(block_size, &row_ptr, &columns, &values)?;
        let (rows, nonzeros) = (row_ptr.len() - 1, values.len());
        let [x, y] = [Vector::new(session, rows, block_size)?, Vector::new(session, rows, block_size)?];
        let arrays = Box::into_raw(Box::new(Arrays { row_ptr, columns, values }));
        // SAFETY: the box was just made. Only raw pointers to its vectors are kept, so PETSc and we may both use them.
        let (row_ptr, columns, values) =
            unsafe { ((*arrays).row_ptr.as_mut_ptr(), (*arrays).columns.as_mut_ptr(), (*arrays).values.as_mut_ptr()) };
        // SAFETY: the constant of MPI itself.
        let comm = unsafe { RSMPI_COMM_SELF };
        let n = rows as Int;
        let mut mat = null_mut();
        if let Err(error) = petsc!(MatCreateSeqAIJWithArrays(comm, n, n, row_ptr, columns, values, &mut mat)) {
            // SAFETY: PETSc did not take the arrays.
            unsafe { free(arrays.cast()) };
            return Err(error);
        }
        let matrix =
            Matrix { mat, rows, nonzeros, block_size, values, updates: Rc::default(), x, y, session: session.clone() };
        attach(mat, arrays)?;
        petsc!(MatSetBlockSize(mat, block_size as Int))?;
        Ok(matrix)
    }

    /// Number of rows, which is that of columns.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of stored values.
    pub fn nonzeros(&self) -> usize {
        self.nonzeros
    }

    /// Number of dofs of a node.
    pub fn block_size(&self) -> usize {
        self.block_size
    }

    /// The session.
    pub fn session(&self) -> &Session {
        &self.session
    }

    /// The stored values, in the order they were given.
    pub fn values(&self) -> &[f64] {
        // SAFETY: PETSc keeps the array while `self.mat` lives, and writes to it in no call that is made with `&self`
        // (the solver refuses -ksp_diagonal_scale, which would).
        unsafe { std::slice::from_raw_parts(self.values, self.nonzeros) }
    }

    /// Changes values in place; the pattern stays. Solvers refactor at their next use.
    ///
    /// # Errors
    /// When PETSc refuses, which it does not for a matrix of this type.
    pub fn update<T>(&mut self, change: impl FnOnce(&mut [f64]) -> T) -> Result<T> {
        let mut values = null_mut();
        petsc!(MatSeqAIJGetArray(self.mat, &mut values))?;
        // SAFETY: PETSc uses the array in its own calls only, and `&mut self` excludes the slice of `values`.
        let result = change(unsafe { std::slice::from_raw_parts_mut(self.values, self.nonzeros) });
        // Raises the state of the matrix and forgets its inverted diagonal.
        petsc!(MatSeqAIJRestoreArray(self.mat, &mut values))?;
        self.updates.set(self.updates.get() + 1);
        Ok(result)
    }

    /// Declares the matrix symmetric and positive definite, now and after every update.
    ///
    /// # Errors
    /// When PETSc refuses, which it does not for a matrix of this type.
    pub fn set_spd(&mut self) -> Result<()> {
        for option in [
            ffi::MatOption_MAT_SYMMETRIC,
            ffi::MatOption_MAT_SYMMETRY_ETERNAL,
            ffi::MatOption_MAT_SPD,
            ffi::MatOption_MAT_SPD_ETERNAL,
        ] {
            petsc!(MatSetOption(self.mat, option, ffi::PetscBool_PETSC_TRUE))?;
        }
        Ok(())
    }

    /// Tells multigrid what the matrix nearly annihilates: for elasticity the rigid motions, each one vector over all
    /// rows. They need not be orthonormal; dependent ones are left out.
    ///
    /// # Errors
    /// When a mode has not one entry a row.
    pub fn set_near_null_space(&mut self, modes: &[Vec<f64>]) -> Result<()> {
        for mode in modes {
            same("a near-null mode", mode.len(), self.rows)?;
        }
        // SAFETY: the constant of MPI itself.
        let comm = unsafe { RSMPI_COMM_SELF };
        let vectors: Vec<Vector> = orthonormal(modes)
            .iter()
            .map(|mode| Vector::owned(&self.session, mode, self.block_size))
            .collect::<Result<_>>()?;
        let handles: Vec<ffi::Vec> = vectors.iter().map(|vector| vector.vec).collect();
        let (count, mut space) = (handles.len() as Int, null_mut());
        // The space keeps references to the vectors, the matrix one to the space.
        petsc!(MatNullSpaceCreate(comm, ffi::PetscBool_PETSC_FALSE, count, handles.as_ptr(), &mut space))?;
        let set = petsc!(MatSetNearNullSpace(self.mat, space));
        petsc!(MatNullSpaceDestroy(&mut space))?;
        set
    }

    /// `y = A x`.
    ///
    /// # Errors
    /// When `x` or `y` has not one entry a row.
    pub fn multiply(&self, x: &[f64], y: &mut [f64]) -> Result<()> {
        same("x", x.len(), self.rows)?;
        same("y", y.len(), self.rows)?;
        let x = self.x.place(x.as_ptr())?;
        let y = self.y.place(y.as_mut_ptr())?;
        petsc!(MatMult(self.mat, x.vec(), y.vec()))
    }

    /// Number of updates so far, which goes on counting.
    pub(super) fn updates(&self) -> Rc<Cell<u64>> {
        self.updates.clone()
    }

    /// PETSc's matrix.
    pub(super) fn raw(&self) -> ffi::Mat {
        self.mat
    }
}

impl Drop for Matrix {
    fn drop(&mut self) {
        let _ = petsc!(MatDestroy(&mut self.mat));
    }
}

/// An orthonormal basis of the span of vectors; those that depend on others up to rounding are left out.
fn orthonormal(vectors: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
    let mut basis: Vec<Vec<f64>> = Vec::new();
    for vector in vectors {
        let mut rest = vector.clone();
        let before = dot(&rest, &rest).sqrt();
        // Twice is enough for orthogonality to rounding.
        for _ in 0..2 {
            for known in &basis {
                let share = dot(known, &rest);
                rest.iter_mut().zip(known).for_each(|(r, k)| *r -= share * k);
            }
        }
        let after = dot(&rest, &rest).sqrt();
        if after > 1e-10 * before {
            rest.iter_mut().for_each(|r| *r /= after);
            basis.push(rest);
        }
    }
    basis
}

/// Checks the length of a slice.
pub(super) fn same(what: &str, length: usize, rows: usize) -> Result<()> {
    if length == rows {
        return Ok(());
    }
    Err(Error::new(Kind::Solver, format!("{what} has {length} entries for a matrix of {rows} rows")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_basis_is_orthonormal_and_leaves_out_what_depends() {
        let basis = orthonormal(&[vec![3.0, 0.0, 0.0], vec![1.0, 1e-3, 0.0], vec![5.0, 7.0, 0.0], vec![0.0; 3]]);
        assert_eq!(basis.len(), 2);
        assert!((basis[1][1] - 1.0).abs() < 1e-12 && basis[1][0].abs() < 1e-12);
    }
}
