//! PETSc's own declarations, made by `build.rs` with bindgen, and some that bindgen cannot make portably.
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

use std::ffi::{c_char, c_int, c_void};

/// PETSc's integer, of rows and columns.
pub type Int = PetscInt;

/// MUMPS, which is linked.
pub mod mumps {
    include!(concat!(env!("OUT_DIR"), "/mumps.rs"));
}

/// The hook through which PETSc prints everything. On the platforms of PETSc a `va_list` argument has the shape of
/// one pointer: a decayed array (x86-64), a reference to a copy (AArch64) or a plain pointer (Apple, Windows).
pub type Printf = unsafe extern "C" fn(file: *mut c_void, format: *const c_char, list: *mut c_void) -> PetscErrorCode;

/// `PetscVSNPrintf(text, size, format, length, list)`.
pub type Format =
    unsafe extern "C" fn(*mut c_char, usize, *const c_char, *mut usize, list: *mut c_void) -> PetscErrorCode;

/// `PetscTrFree`, which frees what PETSc made.
pub type Free = unsafe extern "C" fn(*mut c_void, c_int, *const c_char, *const c_char) -> PetscErrorCode;

impl Library {
    /// Address of a variable or function of PETSc by its name; `T` is a pointer.
    ///
    /// # Errors
    /// When this PETSc has no such name.
    pub unsafe fn address<T: Copy>(&self, name: &str) -> crate::error::Result<T> {
        // SAFETY: the caller's promise about the type.
        let found = unsafe { self.__library.get::<T>(name.as_bytes()) };
        found.map(|symbol| *symbol).map_err(|cause| {
            crate::error::Error::new(crate::error::Kind::Solver, format!("PETSc has no `{name}`"))
                .because(cause.to_string())
        })
    }
}

unsafe extern "C" {
    /// The C library's; MPI_Abort and PETSc write past Rust's own buffers.
    pub fn fflush(file: *mut c_void) -> i32;
}
