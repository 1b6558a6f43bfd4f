//! PETSc's error codes as [`Error`], with PETSc's own message.
//!
//! PETSc reports an error frame by frame, innermost first, to a handler. The handler of this module records the frames and prints nothing.
//! [`check_in`] reads them when the code has come back to Rust.

use super::ffi;
use crate::error::{Error, Kind, Result};
use std::cell::RefCell;
use std::ffi::{CStr, c_char, c_int, c_void};

/// PETSc's report of an error that is being passed up.
#[derive(Default)]
struct Trace {
    message: String,
    /// `function (file:line)`, innermost first.
    frames: Vec<String>,
}

thread_local! {
    static TRACE: RefCell<Trace> = RefCell::default();
}

/// Run `call`, and turn a nonzero code into an error with PETSc's message.
pub(super) fn check_in(
    library: &ffi::Library,
    function: &str,
    call: impl FnOnce(&ffi::Library) -> ffi::PetscErrorCode,
) -> Result<()> {
    TRACE.take();
    let code = call(library);
    // the code is an int in PETSc 3.18 and an enum in newer ones
    if code as i64 == 0 { Ok(()) } else { Err(failure(library, function, code)) }
}

/// Return the error of a failed call.
fn failure(library: &ffi::Library, function: &str, code: ffi::PetscErrorCode) -> Error {
    let trace = TRACE.take();
    let mut error = Error::new(Kind::Solver, format!("PETSc failed in {function}"));
    let kind = meaning(library, code);
    error = match (trace.message.is_empty(), kind) {
        (false, Some(kind)) => error.because(format!("{} ({kind})", trace.message)),
        (false, None) => error.because(trace.message),
        (true, Some(kind)) => error.because(kind),
        (true, None) => error.because(format!("error code {code}")),
    };
    if let Some(innermost) = trace.frames.first() {
        error = error.because(format!("raised in {innermost}"));
    }
    error
}

/// Return PETSc's general text for an error code.
fn meaning(library: &ffi::Library, code: ffi::PetscErrorCode) -> Option<String> {
    let mut text: *const c_char = std::ptr::null();
    // SAFETY: PETSc sets the pointer to a static text or to null; the message of the error itself is not requested.
    unsafe {
        library.PetscErrorMessage(code as _, &mut text, std::ptr::null_mut());
        (!text.is_null()).then(|| string(text))
    }
    .filter(|text| !text.is_empty())
}

/// Return a copy of a C text; empty for null.
///
/// # Safety
/// `text` is null or ends with a zero byte.
pub(super) unsafe fn string(text: *const c_char) -> String {
    if text.is_null() {
        return String::new();
    }
    // SAFETY: the caller's promise.
    unsafe { CStr::from_ptr(text) }.to_string_lossy().into_owned()
}

/// Return a copy of the text that a call returns through a pointer; `None` if the call fails or the pointer is null.
///
/// # Safety
/// The call sets the pointer to null or to a text that ends with a zero byte.
pub(super) unsafe fn text_from(call: impl FnOnce(&mut *const c_char) -> Result<()>) -> Option<String> {
    let mut text = std::ptr::null();
    call(&mut text).ok()?;
    // SAFETY: the caller's promise.
    (!text.is_null()).then(|| unsafe { string(text) })
}

/// The handler for `PetscPushErrorHandler`: record a frame.
///
/// # Safety
/// PETSc alone calls it, with texts that end with a zero byte.
pub(super) unsafe extern "C" fn record(
    _comm: mpi::ffi::MPI_Comm,
    line: c_int,
    function: *const c_char,
    file: *const c_char,
    code: ffi::PetscErrorCode,
    kind: ffi::PetscErrorType,
    message: *const c_char,
    _context: *mut c_void,
) -> ffi::PetscErrorCode {
    // SAFETY: PETSc's texts end with a zero byte.
    let (function, file, message) = unsafe { (string(function), string(file), string(message)) };
    TRACE.with_borrow_mut(|trace| {
        if kind == ffi::PetscErrorType_PETSC_ERROR_INITIAL {
            *trace = Trace::default();
        }
        // outer frames have a blank message
        if trace.message.is_empty() {
            trace.message = message.trim().to_owned();
        }
        let file = file.rsplit('/').next().unwrap_or_default();
        trace.frames.push(format!("{function} ({file}:{line})"));
    });
    code
}
