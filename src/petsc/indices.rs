//! Sets of rows (IS), and rows.

use super::library::petsc;
use super::vector::slice;
use super::{Int, Matrix, ffi};
use crate::error::Result;
use mpi::ffi::{MPI_Comm, RSMPI_COMM_SELF};
use std::ptr::{null, null_mut};

/// Numbers of rows, in increasing order.
pub(super) struct Indices(pub(super) ffi::IS);

impl Indices {
    /// What each process of a communicator has of them.
    pub(super) fn new(comm: MPI_Comm, numbers: &[usize]) -> Result<Self> {
        let numbers: Vec<Int> = numbers.iter().map(|&i| i as Int).collect();
        let (count, copy, mut is) = (numbers.len() as Int, ffi::PetscCopyMode_PETSC_COPY_VALUES, null_mut());
        // SAFETY: PETSc copies the numbers.
        unsafe { petsc!(ISCreateGeneral(comm, count, numbers.as_ptr(), copy, &mut is)) }?;
        Ok(Self(is))
    }

    /// What this process alone has of them.
    pub(super) fn alone(numbers: &[usize]) -> Result<Self> {
        // SAFETY: the constant of MPI itself.
        Self::new(unsafe { RSMPI_COMM_SELF }, numbers)
    }

    /// These `rows` of a matrix and those within `layers` of its graph around them. Collective.
    pub(super) fn around(matrix: &Matrix, rows: &[usize], layers: usize) -> Result<Vec<usize>> {
        let mut rows = rows.to_vec();
        rows.sort_unstable();
        rows.dedup();
        let mut indices = Self::alone(&rows)?;
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
    pub(super) fn submatrix(&self, matrix: &Matrix, columns: &Indices) -> Result<ffi::Mat> {
        let (scall, mut part) = (ffi::MatReuse_MAT_INITIAL_MATRIX, null_mut());
        // SAFETY: sets of the matrix's processes.
        unsafe { petsc!(MatCreateSubMatrix(matrix.raw(), self.0, columns.0, scall, &mut part)) }?;
        Ok(part)
    }

    /// Reads these rows of a matrix, which may belong to other processes, in those columns: rows and columns as numbers in the sets. Collective;
    /// each process has sets of its own.
    pub(super) fn of_others(
        &self,
        matrix: &Matrix,
        columns: &Indices,
        read: impl FnOnce(ffi::Mat) -> Result<()>,
    ) -> Result<()> {
        let (scall, mut parts) = (ffi::MatReuse_MAT_INITIAL_MATRIX, null_mut());
        // SAFETY: one matrix, of this process, which lives until `read` is done.
        unsafe {
            petsc!(MatCreateSubMatrices(matrix.raw(), 1, &self.0, &columns.0, scall, &mut parts))?;
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

/// What `read` makes of a row of this process, number `i` of all: of its columns, counted through all processes, and values.
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
