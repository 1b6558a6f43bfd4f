//! PETSc's own declarations, made by `build.rs` with bindgen, and three that bindgen cannot make portably.
#![allow(missing_docs, non_upper_case_globals, non_camel_case_types, non_snake_case, dead_code, clippy::all)]

include!(concat!(env!("OUT_DIR"), "/petsc.rs"));

use std::ffi::{c_char, c_void};

/// The hook through which PETSc prints everything. On the platforms of PETSc a `va_list` argument has the shape of
/// one pointer: a decayed array (x86-64), a reference to a copy (AArch64) or a plain pointer (Apple, Windows).
pub type Printf = unsafe extern "C" fn(file: *mut c_void, format: *const c_char, list: *mut c_void) -> PetscErrorCode;

unsafe extern "C" {
    pub static mut PetscVFPrintf: Printf;
    pub fn PetscVSNPrintf(
        text: *mut c_char,
        size: usize,
        format: *const c_char,
        length: *mut usize,
        list: *mut c_void,
    ) -> PetscErrorCode;
    /// The C library's; MPI_Abort and PETSc write past Rust's own buffers.
    pub fn fflush(file: *mut c_void) -> i32;
}
