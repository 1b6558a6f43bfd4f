//! The BLAS and LAPACK that MUMPS and PETSc use: dense Cholesky factorisations, the name, and the number of threads.
//!
//! Factorisations with the reference BLAS are up to 11 times slower, so a run reports the name. Only OpenBLAS has
//! functions with `openblas_`, which are looked up by name.

use super::call::fit;
use super::error::{Error, Result};
use super::ffi::{dpotrf_, dpotri_, dpotrs_};
use std::ffi::{CStr, c_char, c_int, c_void};

/// The triangle that holds the factor.
const UPPER: &CStr = c"U";

/// Return the number of rows of a dense matrix for LAPACK, after a check of its size.
fn order(matrix: &[f64], n: usize) -> Result<c_int> {
    match c_int::try_from(n) {
        Ok(order) if matrix.len() == n * n => Ok(order),
        _ => Err(Error::new(format!("{} numbers are not a dense matrix of {n} rows", matrix.len()))),
    }
}

/// Factor a dense symmetric matrix of `n` rows in place by Cholesky's method (LAPACK's dpotrf), and return whether it
/// is positive definite.
///
/// The other triangle is not changed.
///
/// ```
/// use winkler::petsc::{cholesky, cholesky_solve};
/// let mut g = [4.0, 2.0, 2.0, 5.0];
/// assert!(cholesky(&mut g, 2)?);
/// let mut x = [10.0, 13.0];
/// cholesky_solve(&g, 2, &mut x)?;
/// assert!((x[0] - 1.5).abs() < 1e-15 && (x[1] - 2.0).abs() < 1e-15);
/// assert!(!cholesky(&mut [1.0, 2.0, 2.0, 1.0], 2)?);
/// # Ok::<(), winkler::error::Error>(())
/// ```
///
/// # Errors
/// When the slice does not have n^2 entries.
pub fn cholesky(matrix: &mut [f64], n: usize) -> Result<bool> {
    // LAPACK refuses a leading dimension of 0
    let (rows, lead, mut info) = (order(matrix, n)?, order(matrix, n)?.max(1), 0);
    // SAFETY: a matrix of n x n numbers.
    unsafe { dpotrf_(UPPER.as_ptr(), &rows, matrix.as_mut_ptr(), &lead, &mut info, 1) };
    Ok(info == 0)
}

/// Solve with a factor of [`cholesky`] in place: `x` has right-hand sides one after the other, `n` entries each, and
/// becomes their solutions.
///
/// # Errors
/// When a slice has the wrong length.
pub fn cholesky_solve(factor: &[f64], n: usize, x: &mut [f64]) -> Result<()> {
    let (rows, lead, mut info) = (order(factor, n)?, order(factor, n)?.max(1), 0);
    if !x.len().is_multiple_of(n) {
        return Err(Error::new(format!("{} numbers are no right-hand sides of {n} rows", x.len())));
    }
    let columns: c_int = fit("LAPACK", "right-hand sides", x.len() / n.max(1))?;
    // SAFETY: a factor of n x n numbers and right-hand sides of n.
    unsafe { dpotrs_(UPPER.as_ptr(), &rows, &columns, factor.as_ptr(), &lead, x.as_mut_ptr(), &lead, &mut info, 1) };
    Ok(())
}

/// Turn a factor of [`cholesky`] into the inverse of the matrix, with both triangles (LAPACK's dpotri).
///
/// ```
/// use winkler::petsc::{cholesky, cholesky_inverse};
/// let mut g = [4.0, 2.0, 2.0, 5.0];
/// assert!(cholesky(&mut g, 2)?);
/// cholesky_inverse(&mut g, 2)?;
/// assert!((g[0] - 0.3125).abs() < 1e-15 && (g[1] + 0.125).abs() < 1e-15 && g[1] == g[2]);
/// # Ok::<(), winkler::error::Error>(())
/// ```
///
/// # Errors
/// When the slice does not have n^2 entries.
pub fn cholesky_inverse(factor: &mut [f64], n: usize) -> Result<()> {
    let (rows, lead, mut info) = (order(factor, n)?, order(factor, n)?.max(1), 0);
    // SAFETY: a factor of n x n numbers.
    unsafe { dpotri_(UPPER.as_ptr(), &rows, factor.as_mut_ptr(), &lead, &mut info, 1) };
    for column in 0..n {
        for row in 0..column {
            factor[row * n + column] = factor[column * n + row];
        }
    }
    Ok(())
}

/// Return the address of a function of this process; null if there is none.
fn address(name: &CStr) -> *mut c_void {
    // SAFETY: the name ends with a zero byte.
    unsafe { libc::dlsym(libc::RTLD_DEFAULT, name.as_ptr()) }
}

/// Set the number of threads of OpenBLAS. Return false if another BLAS is in use, which keeps its own number.
pub(super) fn set_threads(count: usize) -> bool {
    let address = address(c"openblas_set_num_threads");
    if address.is_null() {
        return false;
    }
    // SAFETY: OpenBLAS declares it as void (int).
    unsafe {
        let set: extern "C" fn(c_int) = std::mem::transmute(address);
        set(count.clamp(1, 1024) as c_int);
    }
    true
}

/// Return the name of the BLAS in use: `OpenBLAS` with its kernels, `reference BLAS`, or the file of another one.
pub(super) fn name() -> String {
    let kernels = address(c"openblas_get_corename");
    if !kernels.is_null() {
        // SAFETY: OpenBLAS declares it as char *(void), and the text is a constant of its own.
        let kernels = unsafe {
            let name: extern "C" fn() -> *const c_char = std::mem::transmute(kernels);
            CStr::from_ptr(name())
        };
        return format!("OpenBLAS ({})", kernels.to_string_lossy());
    }
    // SAFETY: plain C data, which dladdr fills with pointers to texts that live as long as the library is loaded.
    let file = unsafe {
        let mut found: libc::Dl_info = std::mem::zeroed();
        let is_found = libc::dladdr(address(c"dgemm_"), &mut found) != 0 && !found.dli_fname.is_null();
        is_found.then(|| CStr::from_ptr(found.dli_fname).to_string_lossy().into_owned())
    };
    let file = file.map(|path| std::fs::canonicalize(&path).map_or(path, |path| path.display().to_string()));
    match file {
        // where it lies on Debian
        Some(file) if file.contains("/blas/libblas.so") => "reference BLAS".to_owned(),
        file => file.unwrap_or_else(|| "unknown BLAS".to_owned()),
    }
}
