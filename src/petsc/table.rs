//! Access to single options in PETSc's own table.

use super::error::{check_in, string};
use super::ffi;
use super::integers::flag;
use crate::error::{Error, Kind, Result};
use std::ffi::{CString, c_char};
use std::ptr::{null, null_mut};

/// Set an option of the running PETSc.
pub(super) fn set(library: &ffi::Library, name: &str, value: Option<&str>) -> Result<()> {
    let name = key(name)?;
    let value = value.map(text).transpose()?;
    let value = value.as_ref().map_or(null(), |value| value.as_ptr());
    // SAFETY: both texts live until the end of the call and end with a zero byte; PETSc copies them.
    check_in(library, "PetscOptionsSetValue", |petsc| unsafe {
        petsc.PetscOptionsSetValue(null_mut(), name.as_ptr(), value)
    })
}

/// Return the value of an option of the running PETSc, and mark it as read.
pub(super) fn read(library: &ffi::Library, name: &str) -> Result<Option<String>> {
    let name = key(name)?;
    let mut value: *const c_char = null();
    let mut set = flag(false);
    // SAFETY: the name lives until the end of the call; PETSc writes to the two variables only.
    check_in(library, "PetscOptionsFindPair", |petsc| unsafe {
        petsc.PetscOptionsFindPair(null_mut(), null(), name.as_ptr(), &mut value, &mut set)
    })?;
    // SAFETY: null, or a text that PETSc keeps until the option changes; it is copied.
    Ok((!value.is_null()).then(|| unsafe { string(value) }))
}

/// Return a name with its dash.
pub(super) fn dashed(name: &str) -> String {
    if name.starts_with('-') { name.to_owned() } else { format!("-{name}") }
}

/// Return a name as PETSc expects it, or refuse it: PETSc would store any text and never find some of them again.
pub(super) fn key(name: &str) -> Result<CString> {
    let name = dashed(name);
    let valid =
        name.strip_prefix('-').is_some_and(|bare| bare.trim_start_matches('-').starts_with(char::is_alphabetic))
            && !name.contains(char::is_whitespace);
    if !valid {
        return Err(Error::new(Kind::Solver, format!("`{name}` is not the name of a PETSc option")));
    }
    text(&name)
}

/// Return a text that ends with a zero byte, as C expects it.
pub(super) fn text(text: &str) -> Result<CString> {
    CString::new(text).map_err(|_| Error::new(Kind::Solver, format!("a zero byte in a PETSc option: {text:?}")))
}
