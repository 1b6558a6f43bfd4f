//! Declarations of PETSc, MUMPS, METIS and LAPACK. `build.rs` generates those that have a header.
#![allow(
    missing_docs,
    non_upper_case_globals,
    non_camel_case_types,
    non_snake_case,
    dead_code,
    unsafe_op_in_unsafe_fn,
    clippy::all
)]

include!(concat!(env!("OUT_DIR"), "/petsc.rs"));

use std::ffi::{c_char, c_int};

/// PETSc's integer for rows and columns.
pub type Int = PetscInt;

// Fortran passes the length of a text after all arguments.
unsafe extern "C" {
    /// Factor a dense symmetric matrix by Cholesky's method.
    pub fn dpotrf_(
        part: *const c_char,
        n: *const c_int,
        a: *mut f64,
        lda: *const c_int,
        info: *mut c_int,
        length: usize,
    );
    /// Turn a factor of [`dpotrf_`] into the inverse of the matrix.
    pub fn dpotri_(
        part: *const c_char,
        n: *const c_int,
        a: *mut f64,
        lda: *const c_int,
        info: *mut c_int,
        length: usize,
    );
    /// Solve with a factor of [`dpotrf_`].
    pub fn dpotrs_(
        part: *const c_char,
        n: *const c_int,
        columns: *const c_int,
        a: *const f64,
        lda: *const c_int,
        b: *mut f64,
        ldb: *const c_int,
        info: *mut c_int,
        length: usize,
    );
}
