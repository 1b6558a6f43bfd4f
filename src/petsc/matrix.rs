//! Sparse matrices.

use super::arrays::{Arrays, attach, check, check_rows, free};
use super::library::petsc;
use super::vector::Vector;
use super::{Int, Scope, Session, ffi};
use crate::error::{Error, Kind, Result};
use mpi::collective::SystemOperation;
use mpi::traits::CommunicatorCollectives;
use std::cell::Cell;
use std::ptr::null_mut;
use std::rc::Rc;

/// The rows of a square matrix that this process owns, one of several.
#[derive(Debug, Clone, Default)]
pub struct OwnedRows {
    /// Number of the first of them among all.
    pub first: usize,
    /// Number of all rows.
    pub total: usize,
    /// Compressed rows in the columns of the same numbers: starts.
    pub row_ptr: Vec<Int>,
    /// Their columns, counted from `first`, increasing in each row.
    pub columns: Vec<Int>,
    /// The same rows in the columns of other processes: starts.
    pub other_row_ptr: Vec<Int>,
    /// Their columns, counted through all, increasing in each row.
    pub other_columns: Vec<Int>,
    /// Values: all in own columns, row by row, then all in the columns of others, row by row.
    pub values: Vec<f64>,
}

/// A square sparse matrix (PETSc's AIJ, rows compressed) of this process, or of all with rows on each.
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
    scope: Scope,
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
        check(block_size, &row_ptr, &columns, values.len())?;
        let (rows, nonzeros, scope) = (row_ptr.len() - 1, values.len(), Scope::Process);
        let [x, y] = [Vector::new(session, scope, rows, block_size)?, Vector::new(session, scope, rows, block_size)?];
        let (other_row_ptr, other_columns) = (Vec::new(), Vec::new());
        let arrays = Box::into_raw(Box::new(Arrays { row_ptr, columns, other_row_ptr, other_columns, values }));
        // SAFETY: the box was just made. Only raw pointers to its vectors are kept, so PETSc and we may both use them.
        let (row_ptr, columns, values) =
            unsafe { ((*arrays).row_ptr.as_mut_ptr(), (*arrays).columns.as_mut_ptr(), (*arrays).values.as_mut_ptr()) };
        let comm = scope.comm(session);
        let n = rows as Int;
        let mut mat = null_mut();
        if let Err(error) = petsc!(MatCreateSeqAIJWithArrays(comm, n, n, row_ptr, columns, values, &mut mat)) {
            // SAFETY: PETSc did not take the arrays.
            unsafe { free(arrays.cast()) };
            return Err(error);
        }
        let (updates, session) = (Rc::default(), session.clone());
        let matrix = Matrix { mat, scope, rows, nonzeros, block_size, values, updates, x, y, session };
        attach(mat, arrays)?;
        petsc!(MatSetBlockSize(mat, block_size as Int))?;
        Ok(matrix)
    }

    /// Takes the rows of this process over into a matrix of all processes; collective. Rows follow each other in the order of
    /// the processes, any of which may own none.
    ///
    /// ```
    /// use winkler::petsc::{Matrix, OwnedRows, Session};
    /// let session = Session::start(&[])?;
    /// let (row_ptr, columns, values) = (vec![0, 2, 3], vec![0, 1, 1], vec![2.0, 1.0, 5.0]);
    /// let rows = OwnedRows { total: 2, row_ptr, columns, other_row_ptr: vec![0; 3], values, ..OwnedRows::default() };
    /// let mut a = Matrix::from_owned_rows(&session, 1, rows)?;
    /// a.update(|values| values[2] = 3.0)?;
    /// let mut y = [0.0; 2];
    /// a.multiply(&[1.0, 2.0], &mut y)?;
    /// assert_eq!(y, [4.0, 6.0]);
    /// assert!(Matrix::from_owned_rows(&session, 1, OwnedRows::default()).is_err());
    /// # Ok::<(), winkler::error::Error>(())
    /// ```
    ///
    /// # Errors
    /// When the arrays are not those of such rows.
    pub fn from_owned_rows(session: &Session, block_size: usize, rows: OwnedRows) -> Result<Matrix> {
        let OwnedRows { first, total, row_ptr, columns, other_row_ptr, other_columns, values } = rows;
        check(block_size, &row_ptr, &columns, columns.len())?;
        let (n, nonzeros, scope) = (row_ptr.len() - 1, values.len(), Scope::World);
        same("other_row_ptr", other_row_ptr.len(), n + 1)?;
        check_rows(block_size, &other_row_ptr, &other_columns, nonzeros - columns.len().min(nonzeros), total)?;
        if first + n > total || other_columns.iter().any(|&j| (first..first + n).contains(&(j as usize))) {
            return Err(Error::new(
                Kind::Solver,
                "the rows of a process are not those it says, or their columns its own",
            ));
        }
        let [x, y] = [Vector::new(session, scope, n, block_size)?, Vector::new(session, scope, n, block_size)?];
        let own = columns.len();
        let arrays = Box::into_raw(Box::new(Arrays { row_ptr, columns, other_row_ptr, other_columns, values }));
        // SAFETY: the box was just made. Only raw pointers to its vectors are kept, so PETSc and we may both use them; the values of
        // other columns begin behind those of own ones, both of which were counted above.
        let (i, j, oi, oj, values, other_values) = unsafe {
            let all = &mut *arrays;
            let values = all.values.as_mut_ptr();
            let [i, j] = [all.row_ptr.as_mut_ptr(), all.columns.as_mut_ptr()];
            (i, j, all.other_row_ptr.as_mut_ptr(), all.other_columns.as_mut_ptr(), values, values.add(own))
        };
        let (comm, n_here, n_all) = (scope.comm(session), n as Int, total as Int);
        let mut mat = null_mut();
        if let Err(error) = petsc!(MatCreateMPIAIJWithSplitArrays(
            comm,
            n_here,
            n_here,
            n_all,
            n_all,
            i,
            j,
            values,
            oi,
            oj,
            other_values,
            &mut mat
        )) {
            // SAFETY: PETSc did not take the arrays.
            unsafe { free(arrays.cast()) };
            return Err(error);
        }
        let (updates, session) = (Rc::default(), session.clone());
        let matrix = Matrix { mat, scope, rows: n, nonzeros, block_size, values, updates, x, y, session };
        attach(mat, arrays)?;
        petsc!(MatSetBlockSize(mat, block_size as Int))?;
        Ok(matrix)
    }

    /// The processes that own it.
    pub fn scope(&self) -> Scope {
        self.scope
    }

    /// Number of rows of this process, which is that of its entries in a vector.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of values stored on this process.
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
        // SAFETY: PETSc uses the array in its own calls only, and `&mut self` excludes the slice of `values`.
        let result = change(unsafe { std::slice::from_raw_parts_mut(self.values, self.nonzeros) });
        let parts = match self.scope {
            Scope::Process => [self.mat, null_mut()],
            Scope::World => {
                let (mut own, mut others) = (null_mut(), null_mut());
                petsc!(MatMPIAIJGetSeqAIJ(self.mat, &mut own, &mut others, null_mut()))?;
                let mut state = 0;
                petsc!(PetscObjectStateGet(self.mat.cast(), &mut state))?;
                petsc!(PetscObjectStateSet(self.mat.cast(), state + 1))?;
                [own, others]
            }
        };
        for part in parts.into_iter().filter(|part| !part.is_null()) {
            let mut values = null_mut();
            petsc!(MatSeqAIJGetArray(part, &mut values))?;
            // Raises the state of the matrix and forgets its inverted diagonal.
            petsc!(MatSeqAIJRestoreArray(part, &mut values))?;
        }
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

    /// Tells multigrid what the matrix nearly annihilates: for elasticity the rigid motions, each one vector over the
    /// rows of this process. They need not be orthonormal; dependent ones are left out.
    ///
    /// # Errors
    /// When a mode has not one entry a row.
    pub fn set_near_null_space(&mut self, modes: &[Vec<f64>]) -> Result<()> {
        for mode in modes {
            same("a near-null mode", mode.len(), self.rows)?;
        }
        let (scope, session) = (self.scope, &self.session);
        let comm = scope.comm(session);
        let sum = |values: &mut [f64]| {
            if scope == Scope::World {
                let mine = values.to_vec();
                session.world().all_reduce_into(&mine[..], values, SystemOperation::sum());
            }
        };
        let vectors: Vec<Vector> = orthonormal(modes, &sum)
            .iter()
            .map(|mode| Vector::owned(session, scope, mode, self.block_size))
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

    /// `y = A x` for the values that `change` makes, which `restore` takes back to the bit: solvers of the matrix do not see it.
    ///
    /// ```
    /// # use winkler::petsc::{Matrix, Session};
    /// # let session = Session::start(&[])?;
    /// let mut a = Matrix::from_csr(&session, 1, vec![0, 1, 2], vec![0, 1], vec![2.0, 3.0])?;
    /// let mut y = [0.0; 2];
    /// a.multiply_changed(|values| values[0] = 5.0, |values| values[0] = 2.0, &[1.0, 1.0], &mut y)?;
    /// assert_eq!((y, a.values()), ([5.0, 3.0], &[2.0, 3.0][..]));
    /// # Ok::<(), winkler::error::Error>(())
    /// ```
    ///
    /// # Errors
    /// When `x` or `y` has not one entry a row.
    pub fn multiply_changed(
        &mut self,
        change: impl FnOnce(&mut [f64]),
        restore: impl FnOnce(&mut [f64]),
        x: &[f64],
        y: &mut [f64],
    ) -> Result<()> {
        // SAFETY: PETSc uses the array in its own calls only, and `&mut self` excludes the slice of `values`.
        change(unsafe { std::slice::from_raw_parts_mut(self.values, self.nonzeros) });
        let product = self.multiply(x, y);
        // SAFETY: as above.
        restore(unsafe { std::slice::from_raw_parts_mut(self.values, self.nonzeros) });
        product
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

/// An orthonormal basis of the span of vectors; those that depend on others up to rounding are left out. `sum` adds up what
/// processes have.
fn orthonormal(vectors: &[Vec<f64>], sum: &dyn Fn(&mut [f64])) -> Vec<Vec<f64>> {
    let dot = |a: &[f64], b: &[f64]| -> f64 {
        let mut product = [a.iter().zip(b).map(|(a, b)| a * b).sum()];
        sum(&mut product);
        product[0]
    };
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
        let basis =
            orthonormal(&[vec![3.0, 0.0, 0.0], vec![1.0, 1e-3, 0.0], vec![5.0, 7.0, 0.0], vec![0.0; 3]], &|_| ());
        assert_eq!(basis.len(), 2);
        assert!((basis[1][1] - 1.0).abs() < 1e-12 && basis[1][0].abs() < 1e-12);
    }
}
