//! The BLAS and LAPACK that MUMPS and PETSc run on: which it is, its threads, and its dense Cholesky factorisation. The reference BLAS is
//! up to 11 times slower in factorisations, so a run says it.

use crate::error::{Error, Kind, Result};
use std::ffi::{CStr, c_char, c_int, c_void};
use std::path::PathBuf;

/// Address of a function of the BLAS and LAPACK in use, null if there is none.
///
/// MUMPS is linked and brings them; PETSc, opened later, gets the same ones. The linker leaves MUMPS out of a program that does not
/// name it.
pub(super) fn address(name: &CStr) -> *mut c_void {
    std::hint::black_box(super::ffi::mumps::dmumps_c as *const c_void);
    // SAFETY: the name ends with a zero byte.
    unsafe { libc::dlsym(libc::RTLD_DEFAULT, name.as_ptr()) }
}

/// File of the library that the name `dgemm_` leads to in this process, with links resolved: of several BLAS in the
/// memory map it is the one in use.
fn file() -> Option<PathBuf> {
    let address = address(c"dgemm_");
    // SAFETY: plain C data, which dladdr fills with texts that live as long as the library is loaded.
    let file = unsafe {
        let mut found: libc::Dl_info = std::mem::zeroed();
        if address.is_null() || libc::dladdr(address, &mut found) == 0 || found.dli_fname.is_null() {
            return None;
        }
        CStr::from_ptr(found.dli_fname)
    };
    let path = PathBuf::from(file.to_string_lossy().into_owned());
    Some(path.canonicalize().unwrap_or(path))
}

/// Name of the BLAS in use: `OpenBLAS`, `MKL`, `BLIS`, `ATLAS`, `Accelerate`, `reference BLAS`, or the file of another
/// one.
pub(super) fn name() -> String {
    match file() {
        Some(path) => name_of(&path.to_string_lossy()),
        None => "unknown BLAS".to_owned(),
    }
}

// Fortran passes the length of a text behind all arguments.
type Factor = unsafe extern "C" fn(*const c_char, *const c_int, *mut f64, *const c_int, *mut c_int, usize);
type Solve = unsafe extern "C" fn(
    *const c_char,
    *const c_int,
    *const c_int,
    *const f64,
    *const c_int,
    *mut f64,
    *const c_int,
    *mut c_int,
    usize,
);

/// A function of the LAPACK that PETSc runs on.
fn lapack(name: &CStr) -> Result<*mut c_void> {
    let address = address(name);
    if address.is_null() {
        let name = name.to_string_lossy();
        return Err(Error::new(Kind::Solver, format!("no LAPACK is loaded: `{name}` is not there"))
            .help("install one that PETSc can use, e.g. `apt-get install libopenblas0-pthread`"));
    }
    Ok(address)
}

/// Checks the size of a dense matrix.
fn order(matrix: &[f64], n: usize) -> Result<c_int> {
    match c_int::try_from(n) {
        Ok(order) if matrix.len() == n * n => Ok(order),
        _ => Err(Error::new(Kind::Solver, format!("{} numbers are not a dense matrix of {n} rows", matrix.len()))),
    }
}

/// Cholesky factorisation of a dense symmetric matrix of `n` rows in place (LAPACK's dpotrf; the other triangle is left as it
/// is). False if the matrix is not positive definite.
///
/// ```
/// use winkler::petsc::{cholesky, cholesky_solve};
/// # let session = winkler::petsc::Session::start(&[])?;
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
/// When no LAPACK is loaded, or the slice has not n^2 entries.
pub fn cholesky(matrix: &mut [f64], n: usize) -> Result<bool> {
    let (n, mut info) = (order(matrix, n)?, 0);
    if n == 0 {
        return Ok(true);
    }
    let address = lapack(c"dpotrf_")?;
    // SAFETY: LAPACK's dpotrf, with a matrix of n x n numbers.
    unsafe {
        let factor: Factor = std::mem::transmute(address);
        factor(UPPER.as_ptr(), &n, matrix.as_mut_ptr(), &n, &mut info, 1);
    }
    Ok(info == 0)
}

/// Solves with a factor of [`cholesky`], in place.
///
/// # Errors
/// When no LAPACK is loaded, or a slice has the wrong length.
pub fn cholesky_solve(factor: &[f64], n: usize, x: &mut [f64]) -> Result<()> {
    let (rows, one, mut info) = (order(factor, n)?, 1, 0);
    if x.len() != n {
        return Err(Error::new(Kind::Solver, format!("{} numbers are no right-hand side of {n} rows", x.len())));
    }
    if n == 0 {
        return Ok(());
    }
    let address = lapack(c"dpotrs_")?;
    // SAFETY: LAPACK's dpotrs, with a factor of n x n numbers and one right-hand side of n.
    unsafe {
        let solve: Solve = std::mem::transmute(address);
        solve(UPPER.as_ptr(), &rows, &one, factor.as_ptr(), &rows, x.as_mut_ptr(), &rows, &mut info, 1);
    }
    Ok(())
}

/// The triangle in use.
const UPPER: &CStr = c"U";

/// Asks OpenBLAS for a number of threads; false if another BLAS is in use, which keeps its own number.
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

/// The BLAS that lives in a file, told by its path: Debian's alternatives all end in `libblas.so.3`.
fn name_of(path: &str) -> String {
    let lower = path.to_lowercase();
    let known = [
        ("openblas", "OpenBLAS"),
        ("mkl", "MKL"),
        ("blis", "BLIS"),
        ("atlas", "ATLAS"),
        ("accelerate", "Accelerate"),
        ("veclib", "Accelerate"),
        ("libblas.so", "reference BLAS"),
        ("libblas.dylib", "reference BLAS"),
    ];
    known.iter().find(|(part, _)| lower.contains(part)).map_or_else(|| path.to_owned(), |(_, name)| (*name).to_owned())
}

#[cfg(test)]
mod tests {
    use super::name_of;

    #[test]
    fn the_path_tells_the_blas() {
        let lib = "/usr/lib/x86_64-linux-gnu";
        for (path, name) in [
            ("openblas-pthread/libblas.so.3", "OpenBLAS"),
            ("blas/libblas.so.3.11.0", "reference BLAS"),
            ("blis-serial/libblas.so.3", "BLIS"),
            ("libmkl_rt.so", "MKL"),
        ] {
            assert_eq!(name_of(&format!("{lib}/{path}")), name);
        }
        assert_eq!(name_of("/opt/libsci.so"), "/opt/libsci.so");
    }
}
