//! The arrays of a sparse matrix: checked, then owned by PETSc's matrix.

use super::library::petsc;
use super::{Int, ffi};
use crate::error::{Error, Kind, Result};
use mpi::ffi::RSMPI_COMM_SELF;
use std::ffi::c_void;
use std::ptr::null_mut;

/// The arrays that PETSc works on. They live exactly as long as PETSc's matrix, which may outlive `Matrix` inside a
/// solver: PETSc calls [`free`] at the end.
pub(super) struct Arrays {
    pub(super) row_ptr: Vec<Int>,
    pub(super) columns: Vec<Int>,
    /// Of the columns of other processes; empty for a matrix of one.
    pub(super) other_row_ptr: Vec<Int>,
    pub(super) other_columns: Vec<Int>,
    pub(super) values: Vec<f64>,
}

/// Frees the arrays of a matrix.
pub(super) unsafe extern "C" fn free(arrays: *mut c_void) -> ffi::PetscErrorCode {
    // SAFETY: `from_csr` made the pointer from a box and gave it to PETSc's container, which calls this once.
    drop(unsafe { Box::from_raw(arrays.cast::<Arrays>()) });
    Default::default()
}

/// Gives the arrays to the matrix: they are freed when PETSc destroys it.
pub(super) fn attach(mat: ffi::Mat, arrays: *mut Arrays) -> Result<()> {
    // SAFETY: the constant of MPI itself.
    let comm = unsafe { RSMPI_COMM_SELF };
    let mut container = null_mut();
    petsc!(PetscContainerCreate(comm, &mut container))?;
    petsc!(PetscContainerSetPointer(container, arrays.cast()))?;
    petsc!(PetscContainerSetUserDestroy(container, Some(free)))?;
    petsc!(PetscObjectCompose(mat.cast(), c"winkler_arrays".as_ptr(), container.cast()))?;
    petsc!(PetscContainerDestroy(&mut container))
}

/// Checks that arrays are those of a square matrix with sorted columns.
pub(super) fn check(block_size: usize, row_ptr: &[Int], columns: &[Int], values: usize) -> Result<()> {
    check_rows(block_size, row_ptr, columns, values, row_ptr.len().saturating_sub(1))
}

/// Checks that arrays are compressed rows of so many columns, sorted.
pub(super) fn check_rows(
    block_size: usize,
    row_ptr: &[Int],
    columns: &[Int],
    values: usize,
    width: usize,
) -> Result<()> {
    let wrong = |what: &str| Err(Error::new(Kind::Solver, format!("not a sparse matrix in compressed rows: {what}")));
    let Some((&last, rows)) = row_ptr.split_last() else {
        return wrong("row_ptr is empty");
    };
    let rows = rows.len();
    if block_size == 0 || rows % block_size != 0 {
        return wrong("the block size does not divide the number of rows");
    }
    if row_ptr[0] != 0 || row_ptr.windows(2).any(|pair| pair[0] > pair[1]) {
        return wrong("row_ptr does not start at 0 and grow");
    }
    if last as usize != columns.len() || columns.len() != values {
        return wrong("the numbers of columns and values are not the last entry of row_ptr");
    }
    for row in row_ptr.windows(2) {
        let row = &columns[row[0] as usize..row[1] as usize];
        if row.windows(2).any(|pair| pair[0] >= pair[1]) {
            return wrong("the columns of a row do not increase");
        }
        if row.first().is_some_and(|c| *c < 0) || row.last().is_some_and(|c| *c as usize >= width) {
            return wrong("a column is not among the rows");
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bad_rows_are_refused_in_words() {
        let cases: [(usize, &[Int], &[Int], &str); 7] = [
            (1, &[], &[], "empty"),
            (2, &[0, 1], &[0], "block size"),
            (0, &[0, 1], &[0], "block size"),
            (1, &[0, 2, 1], &[0], "grow"),
            (1, &[0, 2], &[0], "last entry"),
            (1, &[0, 2, 2], &[1, 0], "increase"),
            (1, &[0, 1], &[1], "not among"),
        ];
        for (block_size, row_ptr, columns, words) in cases {
            let error = check(block_size, row_ptr, columns, columns.len()).expect_err(words);
            assert!(error.message().contains(words), "{error}");
        }
        assert!(check(1, &[0, 1, 2], &[0, 1], 2).is_ok());
    }
}
