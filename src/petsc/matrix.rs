//! Sparse matrices (MATAIJ), the rows that they are made of, and their index sets (IS) and submatrices.

use super::call::{fit, flag, petsc};
use super::error::{Error, Result};
use super::vector::{Vector, check_length};
use super::{Int, Scope, Session, ffi};
use mpi::ffi::{MPI_Comm, RSMPI_COMM_SELF};
use std::ffi::c_void;
use std::ops::Range;
use std::ptr::{null, null_mut};

/// A square sparse matrix in compressed rows (AIJ), of this process or distributed by rows over all processes.
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
    /// The global numbers of the rows of this process.
    own: Range<usize>,
    total: usize,
    nonzeros: usize,
    block_size: usize,
    values: *mut f64,
    x: Vector,
    y: Vector,
    session: Session,
}

impl Matrix {
    /// Create a matrix of this process from compressed rows ([`Rows::all`]).
    ///
    /// # Errors
    /// When the arrays do not describe a square matrix with sorted columns, or the block size does not divide it.
    pub fn from_csr(
        session: &Session,
        block_size: usize,
        row_ptr: Vec<Int>,
        columns: Vec<Int>,
        values: Vec<f64>,
    ) -> Result<Matrix> {
        Self::new(session, block_size, Rows::all(row_ptr, columns, values)?)
    }

    /// Create a matrix from rows, without copies. `block_size` dofs belong to one node (1 if unsure). Collective for
    /// distributed rows.
    ///
    /// # Errors
    /// When the block size does not divide the number of rows.
    pub fn new(session: &Session, block_size: usize, rows: Rows) -> Result<Matrix> {
        let (scope, own, total, nonzeros) = (rows.scope, rows.own(), rows.total, rows.values.len());
        let count = own.len();
        if block_size == 0 || count % block_size != 0 {
            return Err(Error::new(format!("blocks of {block_size} do not divide {count} rows")));
        }
        let header = || Vector::new(session, scope, count, block_size);
        let (x, y, session) = (header()?, header()?, session.clone());
        let rows = Box::into_raw(Box::new(rows));
        // SAFETY: the box was just made, and nobody else has it.
        let (mat, values) = match unsafe { create(scope.comm(&session), rows) } {
            Ok(made) => made,
            Err(error) => {
                // SAFETY: PETSc did not take the arrays.
                unsafe { free(rows.cast()) };
                return Err(error);
            }
        };
        let matrix = Matrix { mat, scope, own, total, nonzeros, block_size, values, x, y, session };
        // SAFETY: the matrix was just made over the rows, whose box nobody else has.
        unsafe {
            attach(mat, rows)?;
            petsc!(MatSetBlockSize(mat, block_size as Int))?;
        }
        Ok(matrix)
    }

    /// Return the processes that own the matrix.
    pub fn scope(&self) -> Scope {
        self.scope
    }

    /// Return the number of rows of this process, which is the number of its entries in a vector.
    pub fn rows(&self) -> usize {
        self.own.len()
    }

    /// Return the global numbers of the rows of this process.
    pub fn own(&self) -> Range<usize> {
        self.own.clone()
    }

    /// Return the number of rows of all processes.
    pub fn total(&self) -> usize {
        self.total
    }

    /// Return the number of values that this process stores.
    pub fn nonzeros(&self) -> usize {
        self.nonzeros
    }

    /// Return the number of dofs of a node.
    pub fn block_size(&self) -> usize {
        self.block_size
    }

    /// Return the session.
    pub fn session(&self) -> &Session {
        &self.session
    }

    /// Return the stored values, in the order of [`Rows`].
    pub fn values(&self) -> &[f64] {
        // SAFETY: PETSc keeps the array while `self.mat` lives. Its solvers write to it with -ksp_diagonal_scale alone,
        // and have restored it when their call returns.
        unsafe { std::slice::from_raw_parts(self.values, self.nonzeros) }
    }

    /// Change values in place and return what `change` returns. The pattern stays, and solvers factor again at their
    /// next use.
    pub fn update<T>(&mut self, change: impl FnOnce(&mut [f64]) -> T) -> Result<T> {
        // SAFETY: PETSc uses the array in its own calls only, and `&mut self` excludes the slice of `values`.
        let result = change(unsafe { std::slice::from_raw_parts_mut(self.values, self.nonzeros) });
        let parts = match self.scope {
            Scope::Process => [self.mat, null_mut()],
            Scope::World => {
                let (mut own, mut others) = (null_mut(), null_mut());
                let mut state = 0;
                // SAFETY: a distributed matrix, to which its two parts belong.
                unsafe {
                    petsc!(MatMPIAIJGetSeqAIJ(self.mat, &mut own, &mut others, null_mut()))?;
                    petsc!(PetscObjectStateGet(self.mat.cast(), &mut state))?;
                    petsc!(PetscObjectStateSet(self.mat.cast(), state + 1))?;
                }
                [own, others]
            }
        };
        for part in parts.into_iter().filter(|part| !part.is_null()) {
            let mut values = null_mut();
            // SAFETY: nothing is written between the calls, which raise the state of the matrix and invalidate its
            // inverted diagonal.
            unsafe {
                petsc!(MatSeqAIJGetArray(part, &mut values))?;
                petsc!(MatSeqAIJRestoreArray(part, &mut values))?;
            }
        }
        Ok(result)
    }

    /// Declare the matrix symmetric and positive definite, now and after every update.
    pub fn set_spd(&mut self) -> Result<()> {
        for option in [
            ffi::MatOption_MAT_SYMMETRIC,
            ffi::MatOption_MAT_SYMMETRY_ETERNAL,
            ffi::MatOption_MAT_SPD,
            ffi::MatOption_MAT_SPD_ETERNAL,
        ] {
            // SAFETY: the matrix of this wrapper.
            unsafe { petsc!(MatSetOption(self.mat, option, flag(true))) }?;
        }
        Ok(())
    }

    /// Give multigrid the modes that the matrix nearly annihilates: for elasticity, the rigid motions.
    ///
    /// Each mode has one entry for each row of this process. Modes need not be orthonormal; dependent ones are left
    /// out.
    ///
    /// # Errors
    /// When a mode does not have one entry for each row.
    pub fn set_near_null_space(&mut self, modes: &[Vec<f64>]) -> Result<()> {
        for mode in modes {
            check_length("a near-null mode", mode.len(), self.rows())?;
        }
        let (scope, session) = (self.scope, &self.session);
        let comm = scope.comm(session);
        let vectors: Vec<Vector> = orthonormal(modes, &|values| scope.sum(session, values))
            .iter()
            .map(|mode| Vector::owned(session, scope, mode, self.block_size))
            .collect::<Result<_>>()?;
        let handles: Vec<ffi::Vec> = vectors.iter().map(|vector| vector.vec).collect();
        let (count, mut space) = (handles.len() as Int, null_mut());
        // SAFETY: `count` vectors; the space keeps references to them, the matrix one to the space.
        unsafe {
            petsc!(MatNullSpaceCreate(comm, flag(false), count, handles.as_ptr(), &mut space))?;
            let set = petsc!(MatSetNearNullSpace(self.mat, space));
            petsc!(MatNullSpaceDestroy(&mut space))?;
            set
        }
    }

    /// Compute `y = A x`.
    ///
    /// # Errors
    /// When `x` or `y` does not have one entry for each row.
    pub fn multiply(&self, x: &[f64], y: &mut [f64]) -> Result<()> {
        // SAFETY: the product reads one and writes to the other.
        self.x.map(("x", x), &self.y, ("y", y), |x, y| unsafe { petsc!(MatMult(self.mat, x, y)) })
    }

    /// Compute `y = A x` with the values that `change` writes.
    ///
    /// `restore` has to undo the change to the last bit, since solvers of the matrix do not notice it.
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
    /// When `x` or `y` does not have one entry for each row.
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

    /// Return PETSc's handle.
    pub(super) fn raw(&self) -> ffi::Mat {
        self.mat
    }
}

impl Drop for Matrix {
    fn drop(&mut self) {
        // SAFETY: the one reference of this wrapper.
        let _ = unsafe { petsc!(MatDestroy(&mut self.mat)) };
    }
}

/// Create PETSc's matrix over the arrays of `rows`, and return it with the pointer to the values.
///
/// # Safety
/// The rows come from a box that nobody else uses. It has to live as long as the matrix.
unsafe fn create(comm: MPI_Comm, rows: *mut Rows) -> Result<(ffi::Mat, *mut f64)> {
    // SAFETY: the caller's promise. Only raw pointers to the vectors are kept, so PETSc and we may both use them.
    let rows = unsafe { &mut *rows };
    let (n, total, values) = (rows.own().len() as Int, rows.total as Int, rows.values.as_mut_ptr());
    let (i, j) = (rows.row_ptr.as_mut_ptr(), rows.columns.as_mut_ptr());
    let mut mat = null_mut();
    match rows.scope {
        // SAFETY: `Rows` has checked that the arrays fit each other; they live as long as PETSc's matrix, by the
        // caller's promise.
        Scope::Process => unsafe { petsc!(MatCreateSeqAIJWithArrays(comm, n, n, i, j, values, &mut mat)) },
        Scope::World => {
            let (other_i, other_j) = (rows.other_row_ptr.as_mut_ptr(), rows.other_columns.as_mut_ptr());
            // SAFETY: as above. `values` first has one value for each entry of `columns`, and then those of the other
            // columns.
            unsafe {
                let other_values = values.add(rows.columns.len());
                petsc!(MatCreateMPIAIJWithSplitArrays(
                    comm,
                    n,
                    n,
                    total,
                    total,
                    i,
                    j,
                    values,
                    other_i,
                    other_j,
                    other_values,
                    &mut mat
                ))
            }
        }
    }?;
    Ok((mat, values))
}

/// Return an orthonormal basis of the span of the vectors. Vectors that depend on others to rounding are left out.
/// `sum` sums over processes.
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

/// The rows of a square matrix: all, or those of one of several processes.
///
/// They live exactly as long as PETSc's matrix, which may outlive [`Matrix`](super::Matrix) inside a solver. PETSc
/// calls `free` at the end.
///
/// A column is an own column if this process has the row of the same number. All values in own columns come first, row
/// by row. All other values follow, row by row.
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
    other_row_ptr: Vec<Int>,
    other_columns: Vec<Int>,
    pub(super) values: Vec<f64>,
}

impl Rows {
    /// Take all rows of a matrix.
    ///
    /// Row `i` has the columns `columns[row_ptr[i]..row_ptr[i + 1]]`, in increasing order, and the values at the same
    /// positions.
    ///
    /// # Errors
    /// When the arrays do not describe a square matrix with sorted columns.
    pub fn all(row_ptr: Vec<Int>, columns: Vec<Int>, values: Vec<f64>) -> Result<Rows> {
        let total = row_ptr.len().saturating_sub(1);
        check(&row_ptr, &columns, &values, total)?;
        let (other_row_ptr, other_columns) = (vec![0; total + 1], Vec::new());
        Ok(Rows { scope: Scope::Process, first: 0, total, row_ptr, columns, other_row_ptr, other_columns, values })
    }

    /// Take the rows of this process, from the global number `first` on among `total`, with global columns. No second
    /// copy is made.
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
            return Err(Error::new(format!("a process has the rows {own:?} of {total}")));
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
        if self.own().contains(&j) {
            find(&self.row_ptr, &self.columns, j - self.first)
        } else {
            find(&self.other_row_ptr, &self.other_columns, j).map(|at| self.columns.len() + at)
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
unsafe fn attach(mat: ffi::Mat, rows: *mut Rows) -> Result<()> {
    let mut container = null_mut();
    // SAFETY: the communicator is the constant of MPI itself; the matrix takes a reference to the container; the
    // destructor fits the pointer by the caller's promise.
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
    let wrong = |what: &str| Err(Error::new(format!("not a sparse matrix in compressed rows: {what}")));
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
}

impl Drop for Indices {
    fn drop(&mut self) {
        // SAFETY: the one reference of this type.
        let _ = unsafe { petsc!(ISDestroy(&mut self.0)) };
    }
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
            assert!(error.message.contains(words), "{error}");
        }
        assert!(Rows::all(vec![0, 1, 2], vec![0, 1], vec![1.0, 1.0]).is_ok());
        assert!(Rows::of_process(2, 2, vec![0, 0], Vec::new(), Vec::new()).is_err());
    }
}
