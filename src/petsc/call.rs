//! How functions of PETSc are called, and what their errors become.
//!
//! PETSc reports an error frame by frame, innermost first, to a handler. The handler of this module records the frames
//! and prints nothing. [`check`] reads them when the code has come back to Rust.
//!
//! Each library has integers of its own width. PETSc has [`Int`](super::Int), 32 or 64 bits as it was configured. MUMPS
//! has [`MumpsInt`](super::ffi::MumpsInt) and METIS [`idx_t`](super::ffi::idx_t). Patterns of this program have 32
//! bits.

use super::error::{Error, Result};
use super::ffi;
use super::ffi::PetscBool;
use std::cell::{Cell, RefCell};
use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::ptr::{null, null_mut};

/// Options that the program gives PETSc at its start: signals are left to Rust, so that a panic or a stack overflow
/// prints its own message, and no files of options are looked for. They can run programs, and the current folder may
/// belong to anybody.
const OWN: [&str; 2] = ["-no_signal_handler", "-skip_petscrc"];

thread_local! {
    /// Whether PETSc runs. It belongs to the thread of the session.
    static RUNS: Cell<bool> = const { Cell::new(false) };
}

/// Return whether PETSc was started and has not ended.
pub(super) fn runs() -> bool {
    RUNS.get()
}

/// Call one function of PETSc and check its return code: `unsafe { petsc!(MatMult(a, x, y)) }?`.
///
/// Each call stands in an `unsafe` block with its reason. The following holds for every call and is not repeated there:
/// - A wrapper creates its object of PETSc and destroys it once, in `Drop`.
/// - The wrapper holds the session, so that PETSc runs on this thread.
/// - The types of arguments are those of PETSc's headers, checked by the compiler.
/// - PETSc writes to variables of the call and keeps no pointer to them.
macro_rules! petsc {
    ($function:ident($($argument:expr),* $(,)?)) => {
        $crate::petsc::call::check(stringify!($function), || $crate::petsc::ffi::$function($($argument),*))
    };
}

pub(super) use petsc;

/// Start PETSc with the options in `words`, in the environment, and in files that these name. MPI runs.
pub(super) fn start(words: &[String]) -> Result<()> {
    // PETSc keeps a pointer to these words until its end, so they are leaked, once
    let mut arguments = Vec::with_capacity(words.len() + OWN.len() + 2);
    for word in std::iter::once("winkler").chain(words.iter().map(String::as_str)).chain(OWN) {
        arguments.push(text(word)?.into_raw());
    }
    let mut count = arguments.len() as c_int;
    arguments.push(null_mut());
    let mut arguments: *mut *mut c_char = Vec::leak(arguments).as_mut_ptr();
    let (count, arguments) = (&raw mut count, &raw mut arguments);
    // The handler is pushed first, so that errors of the start are recorded, too. Handlers of the user
    // (-on_error_abort, -start_in_debugger) come on top of it. SAFETY: the handler has PETSc's own type.
    check("PetscPushErrorHandler", || unsafe { ffi::PetscPushErrorHandler(Some(record), null_mut()) })?;
    // SAFETY: words and count live until the end of the process.
    let initialize = || unsafe { ffi::PetscInitialize(count, arguments, null(), null()) };
    check("PetscInitialize", initialize)?;
    RUNS.set(true);
    OWN.into_iter().try_for_each(clear_option)
}

/// Remove an option, by its name with the dash, from PETSc's table.
pub(super) fn clear_option(name: &str) -> Result<()> {
    let name = text(name)?;
    // SAFETY: the name lives until the end of the call; null means PETSc's one table.
    unsafe { petsc!(PetscOptionsClearValue(null_mut(), name.as_ptr())) }
}

/// End PETSc. It prints what options request for its end (-log_view).
pub(super) fn end() -> Result<()> {
    RUNS.set(false);
    // SAFETY: no object of PETSc is left, since each holds the session.
    check("PetscFinalize", || unsafe { ffi::PetscFinalize() })
}

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
pub(super) fn check(function: &str, call: impl FnOnce() -> ffi::PetscErrorCode) -> Result<()> {
    TRACE.take();
    let code = call();
    // the code is an int in PETSc 3.18 and an enum in newer ones
    if code as i64 == 0 { Ok(()) } else { Err(failure(function, code)) }
}

/// Return the error of a failed call.
fn failure(function: &str, code: ffi::PetscErrorCode) -> Error {
    let trace = TRACE.take();
    let mut error = Error::new(format!("PETSc failed in {function}"));
    let kind = meaning(code);
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
fn meaning(code: ffi::PetscErrorCode) -> Option<String> {
    let mut text: *const c_char = null();
    // SAFETY: PETSc sets the pointer to a static text or to null; the message of the error itself is not requested.
    unsafe {
        ffi::PetscErrorMessage(code as _, &mut text, null_mut());
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
    let mut text = null();
    call(&mut text).ok()?;
    // SAFETY: the caller's promise.
    (!text.is_null()).then(|| unsafe { string(text) })
}

/// The handler for `PetscPushErrorHandler`: record a frame.
///
/// # Safety
/// PETSc alone calls it, with texts that end with a zero byte.
unsafe extern "C" fn record(
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

/// Return a text that ends with a zero byte, as C expects it.
pub(super) fn text(text: &str) -> Result<CString> {
    CString::new(text).map_err(|_| Error::new(format!("a zero byte in a PETSc option: {text:?}")))
}

/// Return a count as an integer of a `library`; the message names what is counted.
///
/// Larger numbers of an object are checked once, so that the smaller ones may be converted without a check.
///
/// # Errors
/// When the integers of the library have too few bits.
pub(super) fn fit<T: TryFrom<usize>>(library: &str, what: &str, count: usize) -> Result<T> {
    T::try_from(count).map_err(|_| {
        let bits = 8 * size_of::<T>();
        Error::new(format!("{count} {what} do not fit into the integers of {library}, which have {bits} bits"))
            .help("take a coarser mesh, or more ranks")
    })
}

/// Return a flag of PETSc: C's bool from PETSc 3.24 on, before that an enumeration.
#[allow(clippy::useless_conversion)]
pub(super) fn flag(value: bool) -> PetscBool {
    value.into()
}

/// Return whether a flag of PETSc is set.
pub(super) fn is_set(flag: PetscBool) -> bool {
    flag != self::flag(false)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_that_do_not_fit_are_refused_in_words() {
        assert_eq!(fit::<i32>("MUMPS", "dofs", i32::MAX as usize).expect("it fits"), i32::MAX);
        assert_eq!(fit::<i64>("PETSc", "dofs", 1 << 31).expect("it fits"), 1 << 31);
        let error = fit::<i32>("MUMPS", "dofs", 1 << 31).expect_err("it does not fit");
        assert!(error.message.contains("2147483648 dofs do not fit into the integers of MUMPS, which have 32 bits"));
    }
}
