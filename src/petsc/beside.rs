//! MUMPS with the BLAS and LAPACK that it brings: the very libraries that PETSc uses.
//!
//! A lone process whose bodies are all condensed needs MUMPS and not PETSc, whose hundred libraries take longer to load than a small scene takes.
//! So the file of MUMPS is opened alone. The build asks the loader which file has the function that PETSc calls.

use super::ffi;
use super::ffi::mumps::DMUMPS_STRUC_C;
use super::keep_apart;
use crate::error::{Error, Kind, Result};
use libloading::Library;
use std::ffi::{CStr, c_void};
use std::sync::OnceLock;

/// The file with MUMPS: a library of its own, or PETSc's with MUMPS inside.
const MUMPS: &str = env!("WINKLER_MUMPS_LIBRARY");

/// The name of MUMPS' one function.
const FUNCTION: &CStr = c"dmumps_c";

/// MUMPS' one function.
pub(super) type Mumps = unsafe extern "C" fn(*mut DMUMPS_STRUC_C);

/// Return the library with MUMPS, which is opened at the first call.
///
/// If its file cannot be opened alone, PETSc is: its file says where its libraries are, and theirs may not.
fn opened() -> Result<&'static Library> {
    static OPENED: OnceLock<std::result::Result<Library, String>> = OnceLock::new();
    // SAFETY: initialisers of libraries run as in any program that links them.
    let open = |file| unsafe { Library::new(file) };
    let opened = OPENED.get_or_init(|| {
        let opened = open(MUMPS).or_else(|_| open(ffi::FILE)).map_err(|cause| cause.to_string());
        keep_apart();
        opened
    });
    opened.as_ref().map_err(|cause| {
        Error::new(Kind::Solver, format!("MUMPS cannot be loaded from {MUMPS}"))
            .because(cause.clone())
            .help("install the PETSc that winkler was built with, or build winkler again (scripts/setup)")
    })
}

/// Return the function of MUMPS.
pub(super) fn mumps() -> Result<Mumps> {
    // SAFETY: the type of MUMPS' header.
    let found = unsafe { opened()?.get::<Mumps>(FUNCTION.to_bytes_with_nul()) };
    found
        .map(|function| *function)
        .map_err(|cause| Error::new(Kind::Solver, format!("there is no MUMPS in {MUMPS}")).because(cause.to_string()))
}

/// Check that PETSc, which was just opened, uses the MUMPS that this program calls.
///
/// # Errors
/// When two MUMPS are loaded: their common blocks and names would get mixed up.
pub(super) fn check_one_mumps(petsc: &ffi::Library) -> Result<()> {
    let Ok(own) = mumps() else { return Ok(()) };
    // SAFETY: the type of MUMPS' header.
    match unsafe { petsc.address::<Mumps>("dmumps_c") } {
        Ok(of_petsc) if of_petsc as usize != own as usize => {
            Err(Error::new(Kind::Solver, format!("PETSc uses another MUMPS than {MUMPS}"))
                .because("two of them cannot serve in one process")
                .help("build winkler again, with the PETSc that it is to use"))
        }
        _ => Ok(()),
    }
}

/// Return the address of a function of the BLAS or LAPACK that MUMPS uses, or null if it does not exist.
///
/// Libraries that were loaded with the program come first, as they do for MUMPS itself.
pub(super) fn address(name: &CStr) -> *mut c_void {
    // SAFETY: the name ends with a zero byte.
    let global = unsafe { libc::dlsym(libc::RTLD_DEFAULT, name.as_ptr()) };
    if !global.is_null() {
        return global;
    }
    // SAFETY: an address without a type, which is not used as one.
    let found = opened().ok().and_then(|library| unsafe { library.get::<*mut c_void>(name.to_bytes_with_nul()) }.ok());
    found.map_or(std::ptr::null_mut(), |address| *address)
}
