//! PETSc's library, which the first call that needs it opens and starts.
//!
//! It brings a hundred other libraries, whose loading takes longer than the solution of a small scene. A lone process whose bodies are all
//! condensed creates no object of PETSc and never opens it.

use super::error::{check_in, record};
use super::ffi::FILE;
use super::{beside, ffi, keep_apart, table, waiting};
use crate::error::{Error, Kind, Result};
use std::cell::Cell;
use std::ffi::{CString, c_char, c_int};
use std::path::Path;
use std::ptr::{null, null_mut};
use std::sync::OnceLock;

/// Option that leaves the signals to Rust, so that a panic or a stack overflow prints its own message.
const NO_SIGNALS: &str = "-no_signal_handler";

/// Option that keeps PETSc from looking for files of options. It gets the file of the home folder by name instead.
const NO_FILES: &str = "-skip_petscrc";

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

/// Return the functions of the running PETSc. If it does not run yet, it is started with the options that were set meanwhile.
pub(super) fn running() -> Result<&'static ffi::Library> {
    if !runs() {
        start(&[], None)?;
        let library = open()?;
        for (name, value, is_read) in waiting::take() {
            table::set(library, &name, value.as_deref())?;
            if is_read {
                table::read(library, &name)?;
            }
        }
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
    beside::check_one_mumps(library)?;
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
        check_in(library, "PetscOptionsClearValue", |petsc| unsafe {
            petsc.PetscOptionsClearValue(null_mut(), name.as_ptr())
        })?;
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
