//! Index sets (IS), and access to rows and submatrices.

use super::library::petsc;
use super::vector::slice;
use super::{Int, Matrix, ffi};
use crate::error::Result;
use mpi::ffi::{MPI_Comm, RSMPI_COMM_SELF};
use std::ptr::{null, null_mut};

/// An index set: global row numbers in increasing order.
pub(super) struct Indices(pub(super) ffi::IS);

impl Indices {
    /// Create an index set over a communicator; `numbers` are those of this process.
    pub(super) fn new(comm: MPI_Comm, numbers: &[usize]) -> Result<Self> {
        let numbers: Vec<Int> = numbers.iter().map(|&i| i as Int).collect();
        let (count, copy, mut is) = (numbers.len() as Int, ffi::PetscCopyMode_PETSC_COPY_VALUES, null_mut());
        // SAFETY: PETSc copies the numbers.
        unsafe { petsc!(ISCreateGeneral(comm, count, numbers.as_ptr(), copy, &mut is)) }?;
        Ok(Self(is))
    }

    /// Create an index set of this process alone.
    pub(super) fn alone(numbers: &[usize]) -> Result<Self> {
        // SAFETY: the constant of MPI itself.
        Self::new(unsafe { RSMPI_COMM_SELF }, numbers)
    }

    /// Return the `rows` of a matrix with the rows within `layers` of its graph around them, sorted. Collective.
    pub(super) fn around(matrix: &Matrix, rows: &[usize], layers: usize) -> Result<Vec<usize>> {
        let mut rows = rows.to_vec();
        rows.sort_unstable();
        rows.dedup();
        let mut indices = Self::alone(&rows)?;
        let (mut count, mut numbers) = (0, null());
        // SAFETY: one set, which PETSc replaces by a new one, and its array, which is read before it is given back.
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

    /// Return the submatrix of these rows and the given `columns`, distributed like the matrix. Collective.
    pub(super) fn submatrix(&self, matrix: &Matrix, columns: &Indices) -> Result<ffi::Mat> {
        let (reuse, mut part) = (ffi::MatReuse_MAT_INITIAL_MATRIX, null_mut());
        // SAFETY: sets of the matrix's processes.
        unsafe { petsc!(MatCreateSubMatrix(matrix.raw(), self.0, columns.0, reuse, &mut part)) }?;
        Ok(part)
    }

    /// Fetch the submatrix of these rows and the given `columns`, which other processes may own, and hand it to `read`.
    ///
    /// Each process has its own index sets. Rows and columns of the submatrix are numbered by their positions in the sets. Collective.
    pub(super) fn fetch(
        &self,
        matrix: &Matrix,
        columns: &Indices,
        read: impl FnOnce(ffi::Mat) -> Result<()>,
    ) -> Result<()> {
        let (reuse, mut parts) = (ffi::MatReuse_MAT_INITIAL_MATRIX, null_mut());
        // SAFETY: one matrix, of this process, which lives until `read` is done.
        unsafe {
            petsc!(MatCreateSubMatrices(matrix.raw(), 1, &self.0, &columns.0, reuse, &mut parts))?;
            let done = read(*parts);
            petsc!(MatDestroySubMatrices(1, &mut parts))?;
            done
        }
    }
}

impl Drop for Indices {
    fn drop(&mut self) {
        // SAFETY: the one reference of this type.
        let _ = unsafe { petsc!(ISDestroy(&mut self.0)) };
    }
}

/// Return what `read` makes of the row with the global number `i`, which this process owns: of its global columns and its values.
pub(super) fn row<T>(matrix: ffi::Mat, i: usize, read: impl FnOnce(&[Int], &[f64]) -> T) -> Result<T> {
    let (i, mut count, mut columns, mut values) = (i as Int, 0, null(), null());
    // SAFETY: the row, of as many columns as values, is read before it is given back.
    unsafe {
        petsc!(MatGetRow(matrix, i, &mut count, &mut columns, &mut values))?;
        let made = read(slice(columns, count as usize), slice(values, count as usize));
        petsc!(MatRestoreRow(matrix, i, &mut count, &mut columns, &mut values))?;
        Ok(made)
    }
}
