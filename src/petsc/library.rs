//! The libraries of PETSc and MUMPS: how they are opened, started and called, and what their errors become.
//!
//! PETSc brings a hundred other libraries, whose loading takes longer than the solution of a small scene. So it is opened and started by the first
//! call that needs it. A lone process whose bodies are all condensed needs MUMPS only, whose file is opened alone, with the BLAS and LAPACK that it
//! brings. The build asks the loader which file has the function that PETSc calls.
//!
//! PETSc reports an error frame by frame, innermost first, to a handler. The handler of this module records the frames and prints nothing.
//! [`check_in`] reads them when the code has come back to Rust.
//!
//! Each library has integers of its own width. PETSc has [`Int`](super::Int), 32 or 64 bits as it was configured. MUMPS has
//! [`MumpsInt`](super::ffi::MumpsInt), which is mostly 32 bits beside either PETSc. METIS has one of two widths, which it shows when it is loaded.
//! Patterns of this program have 32 bits.

use super::ffi::mumps::DMUMPS_STRUC_C;
use super::ffi::{FILE, PetscBool};
use super::{ffi, keep_apart};
use crate::error::{Error, Kind, Result};
use libloading::Library;
use std::cell::{Cell, RefCell};
use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::path::Path;
use std::ptr::{null, null_mut};
use std::sync::OnceLock;

/// Option that leaves the signals to Rust, so that a panic or a stack overflow prints its own message.
const NO_SIGNALS: &str = "-no_signal_handler";

/// Option that keeps PETSc from looking for files of options. It gets the file of the home folder by name instead.
pub(super) const NO_FILES: &str = "-skip_petscrc";

thread_local! {
    /// Whether PETSc runs. It belongs to the thread of the session.
    static RUNS: Cell<bool> = const { Cell::new(false) };
}

/// Return the functions of PETSc, whose file is opened at the first call.
pub(super) fn open() -> Result<&'static ffi::Library> {
    static LIBRARY: OnceLock<std::result::Result<ffi::Library, String>> = OnceLock::new();
    // SAFETY: the declarations were made from the headers of this file, or of one with the same name; its initialisers run as in any program
    // that links it.
    let open = || unsafe { ffi::Library::new(FILE) }.map_err(|cause| cause.to_string());
    let opened = LIBRARY.get_or_init(|| {
        let opened = open();
        keep_apart();
        opened
    });
    opened.as_ref().map_err(|cause| {
        Error::new(Kind::Solver, format!("PETSc cannot be loaded from {FILE}"))
            .because(cause.clone())
            .help("install the PETSc that winkler was built with, or build winkler again (scripts/setup)")
    })
}

/// Return whether PETSc was started and has not ended.
pub(super) fn runs() -> bool {
    RUNS.get()
}

/// Return whether PETSc has no options to read, so that it may start later or never.
pub(super) fn may_wait(words: &[String], home: Option<&Path>) -> bool {
    let set = |name: &str| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    words.is_empty() && home.is_none() && !["PETSC_OPTIONS", "PETSC_OPTIONS_YAML"].into_iter().any(set)
}

/// Return the functions of the running PETSc, which is started if it does not run yet.
pub(super) fn running() -> Result<&'static ffi::Library> {
    if !runs() {
        start(&[], None)?;
    }
    open()
}

/// Call one function of PETSc, which is started if necessary, and check its return code: `unsafe { petsc!(MatMult(a, x, y)) }?`.
///
/// Each call stands in an `unsafe` block with its reason. The following holds for every call and is not repeated there:
/// - A wrapper creates its object of PETSc and destroys it once, in `Drop`.
/// - The wrapper holds the session, so that PETSc runs on this thread.
/// - The types of arguments are those of PETSc's headers, checked by the compiler.
/// - PETSc writes to variables of the call and keeps no pointer to them.
macro_rules! petsc {
    ($function:ident($($argument:expr),* $(,)?)) => {
        $crate::petsc::library::check(stringify!($function), |petsc| petsc.$function($($argument),*))
    };
}

pub(super) use petsc;

/// Call [`check_in`] for the running PETSc, which is started if necessary.
pub(super) fn check(function: &str, call: impl FnOnce(&ffi::Library) -> ffi::PetscErrorCode) -> Result<()> {
    check_in(running()?, function, call)
}

/// Start PETSc with the options in `words`, in the environment, in the `home` file, and in files that these name. MPI runs already.
///
/// The `home` file exists on rank 0, which reads it for all.
pub(super) fn start(words: &[String], home: Option<&Path>) -> Result<()> {
    let library = open()?;
    check_one_mumps(library)?;
    let nul = |_| Error::new(Kind::Solver, "a PETSc option contains a zero byte");
    // PETSc keeps a pointer to these words until its end, so they are leaked, once
    let mut arguments = Vec::with_capacity(words.len() + 4);
    for word in std::iter::once("winkler").chain(words.iter().map(String::as_str)).chain([NO_SIGNALS, NO_FILES]) {
        arguments.push(CString::new(word).map_err(nul)?.into_raw());
    }
    let mut count = arguments.len() as c_int;
    arguments.push(null_mut());
    let mut arguments: *mut *mut c_char = Vec::leak(arguments).as_mut_ptr();
    let (count, arguments) = (&raw mut count, &raw mut arguments);
    // The handler is pushed first, so that errors of the start are recorded, too. Handlers of the user (-on_error_abort,
    // -start_in_debugger) come on top of it.
    // SAFETY: the handler has PETSc's own type.
    check_in(library, "PetscPushErrorHandler", |petsc| unsafe {
        petsc.PetscPushErrorHandler(Some(record), null_mut())
    })?;
    let home = home.map(|path| CString::new(path.as_os_str().as_encoded_bytes())).transpose().map_err(nul)?;
    let file = home.as_ref().map_or(null(), |path| path.as_ptr());
    // SAFETY: MPI runs; words and count live until the end of the process, and the name of the file until that of the call.
    check_in(library, "PetscInitialize", |petsc| unsafe { petsc.PetscInitialize(count, arguments, file, null()) })?;
    RUNS.set(true);
    for name in [NO_SIGNALS, NO_FILES] {
        let name = CString::new(name).map_err(nul)?;
        // SAFETY: the name lives until the end of the call.
        unsafe { petsc!(PetscOptionsClearValue(null_mut(), name.as_ptr())) }?;
    }
    Ok(())
}

/// End PETSc, if it runs. It prints what options request for its end (-log_view).
pub(super) fn end() -> Result<()> {
    if !runs() {
        return Ok(());
    }
    RUNS.set(false);
    // SAFETY: no object of PETSc is left, since each holds the session.
    check_in(open()?, "PetscFinalize", |petsc| unsafe { petsc.PetscFinalize() })
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
fn check_in(
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
    let mut text: *const c_char = null();
    // SAFETY: PETSc sets the pointer to a static text or to null; the message of the error itself is not requested.
    unsafe {
        library.PetscErrorMessage(code as _, &mut text, null_mut());
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

/// The file with MUMPS: a library of its own, or PETSc's with MUMPS inside.
const MUMPS: &str = env!("WINKLER_MUMPS_LIBRARY");

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
    let found = unsafe { opened()?.get::<Mumps>(b"dmumps_c\0") };
    found
        .map(|function| *function)
        .map_err(|cause| Error::new(Kind::Solver, format!("there is no MUMPS in {MUMPS}")).because(cause.to_string()))
}

/// Check that PETSc, which was just opened, uses the MUMPS that this program calls.
///
/// # Errors
/// When two MUMPS are loaded: their common blocks and names would get mixed up.
fn check_one_mumps(petsc: &ffi::Library) -> Result<()> {
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
    found.map_or(null_mut(), |address| *address)
}

/// Return a text that ends with a zero byte, as C expects it.
pub(super) fn text(text: &str) -> Result<CString> {
    CString::new(text).map_err(|_| Error::new(Kind::Solver, format!("a zero byte in a PETSc option: {text:?}")))
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
        Error::new(
            Kind::Solver,
            format!("{count} {what} do not fit into the integers of {library}, which have {bits} bits"),
        )
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
        assert!(error.message().contains("2147483648 dofs do not fit into the integers of MUMPS, which have 32 bits"));
    }
}
