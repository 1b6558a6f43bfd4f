//! PETSc's declarations, which `build.rs` generates with bindgen, and some that bindgen cannot generate portably.
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

/// PETSc's integer for rows and columns.
pub type Int = PetscInt;

/// The file of the PETSc that this program was built with.
pub const FILE: &str = env!("WINKLER_PETSC_LIBRARY");

/// MUMPS' struct.
pub mod mumps {
    include!(concat!(env!("OUT_DIR"), "/mumps.rs"));
}

/// MUMPS' integer for rows and columns.
pub use mumps::MumpsInt;

/// The type of `PetscVFPrintf`, the hook through which PETSc prints everything.
///
/// On the platforms of PETSc a `va_list` argument is passed as one pointer: a decayed array (x86-64), a reference to a copy (AArch64) or a
/// plain pointer (Apple, Windows).
pub type Printf = unsafe extern "C" fn(file: *mut c_void, format: *const c_char, list: *mut c_void) -> PetscErrorCode;

/// The type of `PetscVSNPrintf(text, size, format, length, list)`.
pub type Format =
    unsafe extern "C" fn(*mut c_char, usize, *const c_char, *mut usize, list: *mut c_void) -> PetscErrorCode;

/// The type of `PetscTrFree`, which frees memory that PETSc has allocated.
pub type Free = unsafe extern "C" fn(*mut c_void, c_int, *const c_char, *const c_char) -> PetscErrorCode;

impl Library {
    /// Return the address of a variable or function of PETSc by its name; `T` is a pointer.
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
    /// Flush files of the C library, which PETSc and MPI_Abort write to.
    pub fn fflush(file: *mut c_void) -> i32;
}
