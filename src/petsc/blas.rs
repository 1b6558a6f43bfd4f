//! The BLAS and LAPACK that MUMPS and PETSc use: its name, its threads, and its dense Cholesky factorisation.
//!
//! Factorisations with the reference BLAS are up to 11 times slower, so a run reports its name. Functions are looked up by name when they are
//! needed: the library that has them depends on the installation, and only OpenBLAS has those with `openblas_`, which are public.
//!
//! OpenBLAS chooses its kernels by the model number of the processor. For a model newer than itself it may choose those for the first
//! processors with SSE3. On a Xeon of 2023 `hertz-sphere` with n = 6 and quadratic elements takes 84 CPU s with these and 30 with those for
//! AVX-512. On an EPYC `groove3d` with n = 12 takes 1.19 CPU s by MUMPS with these and 0.92 with those for AVX2. So a run warns, with the
//! variable to set.

use super::library::address;
use crate::error::{Error, Kind, Result};
use std::ffi::{CStr, c_char, c_int, c_void};
use std::path::PathBuf;

/// Return the file of the library that has the function `dgemm_` of this process, with links resolved.
///
/// Several BLAS may be loaded; this is the one in use.
fn file() -> Option<PathBuf> {
    let address = address(c"dgemm_");
    // SAFETY: plain C data, which dladdr fills with pointers to texts that live as long as the library is loaded.
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

/// Return the name of the BLAS in use: `OpenBLAS`, `MKL`, `BLIS`, `ATLAS`, `Accelerate`, `reference BLAS`, or the file of an unknown one.
pub(super) fn name() -> String {
    match file() {
        Some(path) => name_of(&path.to_string_lossy()),
        None => "unknown BLAS".to_owned(),
    }
}

// Fortran passes the length of a text after all arguments.
type Potrf = unsafe extern "C" fn(*const c_char, *const c_int, *mut f64, *const c_int, *mut c_int, usize);
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

/// Return the address of a function of LAPACK.
fn lapack(name: &CStr) -> Result<*mut c_void> {
    let address = address(name);
    if address.is_null() {
        let name = name.to_string_lossy();
        return Err(Error::new(Kind::Solver, format!("no LAPACK is loaded: `{name}` is not there"))
            .help("install OpenBLAS where PETSc finds it (Debian: libopenblas0-pthread)"));
    }
    Ok(address)
}

/// Return the number of rows of a dense matrix for LAPACK, after a check of its size.
fn order(matrix: &[f64], n: usize) -> Result<c_int> {
    match c_int::try_from(n) {
        Ok(order) if matrix.len() == n * n => Ok(order),
        _ => Err(Error::new(Kind::Solver, format!("{} numbers are not a dense matrix of {n} rows", matrix.len()))),
    }
}

/// Factor a dense symmetric matrix of `n` rows in place by Cholesky's method (LAPACK's dpotrf), and return whether it is positive definite.
///
/// The other triangle is not changed.
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
/// When no LAPACK is loaded, or the slice does not have n^2 entries.
pub fn cholesky(matrix: &mut [f64], n: usize) -> Result<bool> {
    let (n, mut info) = (order(matrix, n)?, 0);
    if n == 0 {
        return Ok(true);
    }
    let address = lapack(c"dpotrf_")?;
    // SAFETY: LAPACK's dpotrf, with a matrix of n x n numbers.
    unsafe {
        let factor: Potrf = std::mem::transmute(address);
        factor(UPPER.as_ptr(), &n, matrix.as_mut_ptr(), &n, &mut info, 1);
    }
    Ok(info == 0)
}

/// Solve with a factor of [`cholesky`] in place: `x` is the right-hand side and becomes the solution, `n` entries.
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

/// The triangle that holds the factor.
const UPPER: &CStr = c"U";

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

/// Return the name of OpenBLAS' kernels in use, if it can choose among several.
pub(super) fn kernels() -> Option<String> {
    let address = address(c"openblas_get_corename");
    if address.is_null() {
        return None;
    }
    // SAFETY: OpenBLAS declares it as char *(void), and the text is a constant of its own.
    unsafe {
        let name: extern "C" fn() -> *const c_char = std::mem::transmute(address);
        Some(CStr::from_ptr(name()).to_string_lossy().into_owned())
    }
}

/// Return the kernels that this processor could use instead of those in use, unless the user chose the kernels.
#[cfg(target_arch = "x86_64")]
pub(super) fn faster_kernels() -> Option<&'static str> {
    let is_wide = is_x86_feature_detected!("avx512f")
        && is_x86_feature_detected!("avx512bw")
        && is_x86_feature_detected!("avx512dq")
        && is_x86_feature_detected!("avx512vl");
    let is_avx2 = is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma");
    let typed = std::env::var_os("OPENBLAS_CORETYPE").is_some();
    kernels().filter(|_| !typed).and_then(|kernels| faster_than(&kernels, is_avx2, is_wide))
}

/// Return `None`: other processors have one set of kernels, or OpenBLAS knows them.
#[cfg(not(target_arch = "x86_64"))]
pub(super) fn faster_kernels() -> Option<&'static str> {
    None
}

/// Return kernels that use the instruction sets of the processor, if the `chosen` ones do not.
#[cfg(any(target_arch = "x86_64", test))]
fn faster_than(chosen: &str, has_avx2: bool, has_avx512: bool) -> Option<&'static str> {
    // all kernels with 256-bit registers; those for Zen are chosen by the maker of the processor
    const AVX2: [&str; 5] = ["Haswell", "Zen", "SkylakeX", "Cooperlake", "SapphireRapids"];
    let is_one_of = |known: &[&str]| known.iter().any(|name| name.eq_ignore_ascii_case(chosen));
    match (has_avx512, has_avx2) {
        (true, _) if !is_one_of(&AVX2[1..]) => Some("SkylakeX"),
        (false, true) if !is_one_of(&AVX2) => Some("Haswell"),
        _ => None,
    }
}

/// Return the name of the BLAS in a file by its path: Debian's alternatives all end in `libblas.so.3`.
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
    use super::{faster_than, name_of};

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

    #[test]
    fn kernels_are_those_of_the_instruction_sets() {
        for (chosen, has_avx2, has_avx512, faster) in [
            ("Prescott", true, true, Some("SkylakeX")),
            ("Haswell", true, true, Some("SkylakeX")),
            ("Prescott", true, false, Some("Haswell")),
            ("Sandybridge", true, false, Some("Haswell")),
            ("Zen", true, true, None),
            ("SkylakeX", true, true, None),
            ("Cooperlake", true, true, None),
            ("Haswell", true, false, None),
            ("Prescott", false, false, None),
        ] {
            assert_eq!(faster_than(chosen, has_avx2, has_avx512), faster, "{chosen}");
        }
    }
}
