//! PETSc's library: opened and started by the first call that needs it.
//!
//! It brings a hundred other libraries, which take longer to load than a small scene to solve. A lone process whose bodies are
//! all condensed makes no object of PETSc and never opens it.

use super::error::{check_in, record};
use super::{ffi, keep_apart, table, waiting};
use crate::error::{Error, Kind, Result};
use std::cell::Cell;
use std::ffi::{CString, c_char, c_int};
use std::path::Path;
use std::ptr::{null, null_mut};
use std::sync::OnceLock;

/// The file that this program was built with.
const FILE: &str = env!("WINKLER_PETSC_LIBRARY");

/// Leaves the signals to Rust, so that a panic or a stack overflow prints its own message.
const NO_SIGNALS: &str = "-no_signal_handler";

/// Keeps PETSc from the files of options that it looks for by itself; that of the home folder is handed to it.
const NO_FILES: &str = "-skip_petscrc";

thread_local! {
    /// Whether PETSc runs; it belongs to the thread of the session.
    static RUNS: Cell<bool> = const { Cell::new(false) };
}

/// The functions of PETSc, from its file.
pub(super) fn open() -> Result<&'static ffi::Library> {
    static LIBRARY: OnceLock<std::result::Result<ffi::Library, String>> = OnceLock::new();
    // SAFETY: the file is that of the headers the declarations were made from, or one with the same name; its
    // initialisers are those of any program that links it.
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

/// Whether PETSc has been started and not ended.
pub(super) fn runs() -> bool {
    RUNS.get()
}

/// Whether nothing is lost if PETSc starts later, or never: it has no options to read.
pub(super) fn may_wait(words: &[String], home: Option<&Path>) -> bool {
    let set = |name: &str| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    words.is_empty() && home.is_none() && !["PETSC_OPTIONS", "PETSC_OPTIONS_YAML"].into_iter().any(set)
}

/// The functions of the running PETSc, which is started if it waited, with the options that were set meanwhile.
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

/// Calls one PETSc function, of a PETSc that is started if it waits, and checks its return code:
/// `unsafe { petsc!(MatMult(a, x, y)) }?`. The call stands in the `unsafe` block of whoever writes it, with the reason.
///
/// What holds for every call here, so that reasons need not repeat it: a wrapper has made its PETSc object and destroys it once, in
/// `Drop`; it holds the session, so that PETSc runs on this thread; the types of arguments are those of PETSc's headers, checked by the
/// compiler; what PETSc is to write to are variables of that call, of which it keeps no pointer.
macro_rules! petsc {
    ($function:ident($($argument:expr),* $(,)?)) => {
        $crate::petsc::library::check(stringify!($function), |petsc| petsc.$function($($argument),*))
    };
}
pub(super) use petsc;

/// [`check_in`] for the PETSc that runs, which is started if it waited.
pub(super) fn check(function: &str, call: impl FnOnce(&ffi::Library) -> ffi::PetscErrorCode) -> Result<()> {
    check_in(running()?, function, call)
}

/// Starts PETSc with the options in `words`, in the environment, in the `home` file, which is there on the first process, and in files that
/// these name. MPI runs already.
pub(super) fn start(words: &[String], home: Option<&Path>) -> Result<()> {
    let library = open()?;
    let nul = |_| Error::new(Kind::Solver, "a PETSc option contains a zero byte");
    // PETSc keeps a pointer to these words till its end; they are leaked, once.
    let mut arguments = Vec::with_capacity(words.len() + 4);
    for word in std::iter::once("winkler").chain(words.iter().map(String::as_str)).chain([NO_SIGNALS, NO_FILES]) {
        arguments.push(CString::new(word).map_err(nul)?.into_raw());
    }
    let mut count = arguments.len() as c_int;
    arguments.push(null_mut());
    let mut arguments: *mut *mut c_char = Vec::leak(arguments).as_mut_ptr();
    let (count, arguments) = (&raw mut count, &raw mut arguments);
    // Pushed first, so that errors of the start are recorded too and handlers that the user asks for
    // (-on_error_abort, -start_in_debugger) come on top.
    // SAFETY: the handler has PETSc's own type.
    check_in(library, "PetscPushErrorHandler", |petsc| unsafe {
        petsc.PetscPushErrorHandler(Some(record), null_mut())
    })?;
    let home = home.map(|path| CString::new(path.as_os_str().as_encoded_bytes())).transpose().map_err(nul)?;
    let file = home.as_ref().map_or(null(), |path| path.as_ptr());
    // SAFETY: MPI runs; words and count live till the end of the process, the name of the file till that of the call.
    check_in(library, "PetscInitialize", |petsc| unsafe { petsc.PetscInitialize(count, arguments, file, null()) })?;
    RUNS.set(true);
    for name in [NO_SIGNALS, NO_FILES] {
        let name = CString::new(name).map_err(nul)?;
        // SAFETY: the name lives till the end of the call.
        check_in(library, "PetscOptionsClearValue", |petsc| unsafe {
            petsc.PetscOptionsClearValue(null_mut(), name.as_ptr())
        })?;
    }
    Ok(())
}

/// Ends PETSc, if it runs. What the user asked to see at the end (-log_view) is printed here.
pub(super) fn end() -> Result<()> {
    if !runs() {
        return Ok(());
    }
    RUNS.set(false);
    // SAFETY: no object of PETSc is left: each held the session.
    check_in(open()?, "PetscFinalize", |petsc| unsafe { petsc.PetscFinalize() })
}
