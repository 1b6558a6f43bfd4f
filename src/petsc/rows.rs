//! The rows of a sparse matrix, which are checked and then belong to PETSc's matrix.

use super::integers::fit;
use super::library::petsc;
use super::{Int, Scope, ffi};
use crate::error::{Error, Kind, Result};
use mpi::ffi::RSMPI_COMM_SELF;
use std::ffi::c_void;
use std::ptr::null_mut;

/// The rows of a square matrix: all, or those of one of several processes.
///
/// They live exactly as long as PETSc's matrix, which may outlive [`Matrix`](super::Matrix) inside a solver. PETSc calls `free` at the end.
///
/// A column is an own column if this process has the row of the same number. All values in own columns come first, row by row. All other
/// values follow, row by row.
///
/// ```
/// use winkler::petsc::Rows;
/// // rows 2 and 3 of five
/// let (row_ptr, columns, values) = (vec![0, 3, 5], vec![0, 2, 3, 2, 4], vec![1.0, 2.0, 3.0, 4.0, 5.0]);
/// let rows = Rows::of_process(2, 5, row_ptr, columns, values)?;
/// assert_eq!((rows.own(), rows.values()), (2..4, &[2.0, 3.0, 4.0, 1.0, 5.0][..]));
/// assert_eq!([(0, 0), (1, 2), (1, 3), (1, 4)].map(|(i, j)| rows.position(i, j)), [Some(3), Some(2), None, Some(4)]);
/// # Ok::<(), winkler::error::Error>(())
/// ```
#[derive(Debug)]
pub struct Rows {
    pub(super) scope: Scope,
    pub(super) first: usize,
    pub(super) total: usize,
    /// The compressed rows of the own columns, which are counted from `first`.
    pub(super) row_ptr: Vec<Int>,
    pub(super) columns: Vec<Int>,
    /// The compressed rows of the other columns, in global numbers.
    pub(super) other_row_ptr: Vec<Int>,
    pub(super) other_columns: Vec<Int>,
    pub(super) values: Vec<f64>,
}

impl Rows {
    /// Take all rows of a matrix.
    ///
    /// Row `i` has the columns `columns[row_ptr[i]..row_ptr[i + 1]]`, in increasing order, and the values at the same positions.
    ///
    /// # Errors
    /// When the arrays do not describe a square matrix with sorted columns.
    pub fn all(row_ptr: Vec<Int>, columns: Vec<Int>, values: Vec<f64>) -> Result<Rows> {
        let total = row_ptr.len().saturating_sub(1);
        check(&row_ptr, &columns, &values, total)?;
        let (other_row_ptr, other_columns) = (vec![0; total + 1], Vec::new());
        Ok(Rows { scope: Scope::Process, first: 0, total, row_ptr, columns, other_row_ptr, other_columns, values })
    }

    /// Take the rows of this process, from the global number `first` on among `total`, with global columns. No second copy is made.
    ///
    /// Rows are numbered in the order of the processes, any of which may have none.
    ///
    /// # Errors
    /// When the arrays do not describe such rows.
    pub fn of_process(
        first: usize,
        total: usize,
        mut row_ptr: Vec<Int>,
        mut columns: Vec<Int>,
        mut values: Vec<f64>,
    ) -> Result<Rows> {
        check(&row_ptr, &columns, &values, total)?;
        let own = first..first + row_ptr.len() - 1;
        if own.end > total {
            return Err(Error::new(Kind::Solver, format!("a process has the rows {own:?} of {total}")));
        }
        let (mut other_row_ptr, mut other_columns, mut others) = (vec![0], Vec::new(), Vec::new());
        let (mut next, mut begin) = (0, 0);
        for row in 1..row_ptr.len() {
            let end = row_ptr[row] as usize;
            for k in begin..end {
                let (column, value) = (columns[k], values[k]);
                if own.contains(&(column as usize)) {
                    (columns[next], values[next]) = (column - first as Int, value);
                    next += 1;
                } else {
                    other_columns.push(column);
                    others.push(value);
                }
            }
            begin = end;
            row_ptr[row] = next as Int;
            other_row_ptr.push(other_columns.len() as Int);
        }
        columns.truncate(next);
        columns.shrink_to_fit();
        values.truncate(next);
        values.append(&mut others);
        Ok(Rows { scope: Scope::World, first, total, row_ptr, columns, other_row_ptr, other_columns, values })
    }

    /// Return the global numbers of the rows of this process.
    pub fn own(&self) -> std::ops::Range<usize> {
        self.first..self.first + self.row_ptr.len() - 1
    }

    /// Return the values, in the order of this type.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Return the values alone.
    pub fn into_values(self) -> Vec<f64> {
        self.values
    }

    /// Return the position in the values of the entry in the local row `i` and the global column `j`.
    pub fn position(&self, i: usize, j: usize) -> Option<usize> {
        let find = |row_ptr: &[Int], columns: &[Int], j: usize| {
            let (from, to) = (row_ptr[i] as usize, row_ptr[i + 1] as usize);
            columns[from..to].binary_search(&(j as Int)).ok().map(|at| from + at)
        };
        match self.own().contains(&j) {
            true => find(&self.row_ptr, &self.columns, j - self.first),
            false => find(&self.other_row_ptr, &self.other_columns, j).map(|at| self.columns.len() + at),
        }
    }
}

/// Free the rows of a matrix.
///
/// # Safety
/// The pointer is from a box of [`Rows`] that nobody else frees.
pub(super) unsafe extern "C" fn free(rows: *mut c_void) -> ffi::PetscErrorCode {
    // SAFETY: `Matrix` made the pointer from a box and gave it to PETSc's container, which calls this once.
    drop(unsafe { Box::from_raw(rows.cast::<Rows>()) });
    Default::default()
}

/// Hand the rows to the matrix, so that they are freed when PETSc destroys it.
///
/// # Safety
/// The matrix is one of PETSc's; the rows are from a box that nobody else frees.
pub(super) unsafe fn attach(mat: ffi::Mat, rows: *mut Rows) -> Result<()> {
    let mut container = null_mut();
    // SAFETY: the communicator is the constant of MPI itself; the matrix takes a reference to the container; the destructor fits the
    // pointer by the caller's promise.
    unsafe {
        petsc!(PetscContainerCreate(RSMPI_COMM_SELF, &mut container))?;
        petsc!(PetscContainerSetPointer(container, rows.cast()))?;
        petsc!(PetscContainerSetUserDestroy(container, Some(free)))?;
        petsc!(PetscObjectCompose(mat.cast(), c"winkler_rows".as_ptr(), container.cast()))?;
        petsc!(PetscContainerDestroy(&mut container))
    }
}

/// Check that arrays are compressed rows with sorted columns below `width`.
pub(super) fn check(row_ptr: &[Int], columns: &[Int], values: &[f64], width: usize) -> Result<()> {
    let wrong = |what: &str| Err(Error::new(Kind::Solver, format!("not a sparse matrix in compressed rows: {what}")));
    fit::<Int>("PETSc", "columns", width)?;
    let Some(&last) = row_ptr.last() else {
        return wrong("row_ptr is empty");
    };
    if row_ptr[0] != 0 || row_ptr.windows(2).any(|pair| pair[0] > pair[1]) {
        return wrong("row_ptr does not start at 0 and grow");
    }
    if last as usize != columns.len() || columns.len() != values.len() {
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
        let cases: [(&[Int], &[Int], &str); 5] = [
            (&[], &[], "empty"),
            (&[0, 2, 1], &[0], "grow"),
            (&[0, 2], &[0], "last entry"),
            (&[0, 2, 2], &[1, 0], "increase"),
            (&[0, 1], &[1], "not among"),
        ];
        for (row_ptr, columns, words) in cases {
            let error = Rows::all(row_ptr.to_vec(), columns.to_vec(), vec![1.0; columns.len()]).expect_err(words);
            assert!(error.message().contains(words), "{error}");
        }
        assert!(Rows::all(vec![0, 1, 2], vec![0, 1], vec![1.0, 1.0]).is_ok());
        assert!(Rows::of_process(2, 2, vec![0, 0], Vec::new(), Vec::new()).is_err());
    }
}
