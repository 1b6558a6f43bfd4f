//! The table of PETSc's options, which all solvers of a process share, and the words with which PETSc's options begin.

use super::library::{self, flag, is_set, petsc, string, text};
use super::{Session, ffi};
use crate::error::{Error, Kind, Result};
use std::collections::BTreeMap;
use std::ffi::{CString, c_char};
use std::ptr::{null, null_mut};

/// An option: its name with the dash, and its value if it has one.
pub type Entry = (String, Option<String>);

/// PETSc's table of options, filled from the command line, `PETSC_OPTIONS`, `.petscrc` of the home folder and `-options_file`.
///
/// Names may be given with or without their dash and are returned with it. PETSc ignores the case of their letters. Queries of this type do
/// not mark an option as read. Before PETSc is started there are no options, and setting one starts it.
///
/// ```
/// use winkler::petsc::Session;
/// let words = ["-ksp_type", "cg", "-shift", "-1e-3", "-note", "a -b c", "-flag"].map(String::from);
/// let options = Session::start(&words)?.options();
/// assert_eq!(options.get("-shift").as_deref(), Some("-1e-3"));
/// assert_eq!(options.get("-note").as_deref(), Some("a -b c"));
/// assert!(options.has("flag") && !options.has("-b"));
/// assert!(!options.used("-flag"));
/// options.mark_used("-flag")?;
/// assert!(options.used("-flag"));
/// options.set("-ksp_rtol", Some("1e-8"))?;
/// options.clear("-shift")?;
/// let names: Vec<String> = options.all()?.into_iter().map(|(name, _)| name).collect();
/// assert_eq!(names, ["-flag", "-ksp_rtol", "-ksp_type", "-note"]);
/// assert_eq!(options.left()?.len(), 3); // all but -flag
/// assert_eq!(options.get("-flag").as_deref(), Some("")); // without a value
/// assert_eq!(options.get("-shift"), None);
/// assert!(options.set("-1", None).is_err());
/// # Ok::<(), winkler::error::Error>(())
/// ```
#[derive(Clone)]
pub struct Options {
    _session: Session,
}

impl Session {
    /// Return the options of this process.
    pub fn options(&self) -> Options {
        Options { _session: self.clone() }
    }
}

impl Options {
    /// Set an option or replace its value.
    ///
    /// # Errors
    /// When the name does not begin with a letter after its dash or has a blank, or a text has a zero byte.
    pub fn set(&self, name: &str, value: Option<&str>) -> Result<()> {
        let (name, value) = (key(name)?, value.map(text).transpose()?);
        let value = value.as_ref().map_or(null(), |value| value.as_ptr());
        // SAFETY: both texts live until the end of the call and end with a zero byte; PETSc copies them.
        unsafe { petsc!(PetscOptionsSetValue(null_mut(), name.as_ptr(), value)) }
    }

    /// Return the value of an option. It is empty for an option without a value, and `None` for an option that is not set.
    pub fn get(&self, name: &str) -> Option<String> {
        let name = dashed(name);
        let all = self.all().ok()?;
        all.into_iter().find(|(known, _)| known.eq_ignore_ascii_case(&name)).map(|(_, value)| value.unwrap_or_default())
    }

    /// Return whether an option is set.
    pub fn has(&self, name: &str) -> bool {
        self.get(name).is_some()
    }

    /// Remove an option, if it is set.
    ///
    /// # Errors
    /// When the name is not a valid name of an option.
    pub fn clear(&self, name: &str) -> Result<()> {
        let name = key(name)?;
        if !library::runs() {
            return Ok(());
        }
        // SAFETY: the text lives until the end of the call; null means PETSc's one table.
        unsafe { petsc!(PetscOptionsClearValue(null_mut(), name.as_ptr())) }
    }

    /// Return all options that are set, sorted by name.
    ///
    /// PETSc's own list is one text, in which a value may look like a name. A word of it counts as a name if it is among those
    /// [`left`](Self::left), or if PETSc says that such an option was read.
    pub fn all(&self) -> Result<Vec<Entry>> {
        if !library::runs() {
            return Ok(Vec::new());
        }
        let mut entries: BTreeMap<String, Option<String>> = self.left()?.into_iter().collect();
        let mut whole: *mut c_char = null_mut();
        // SAFETY: PETSc allocates the text and ends it with a zero byte; its own function frees it, once.
        let words = unsafe {
            petsc!(PetscOptionsGetAll(null_mut(), &mut whole))?;
            let words = string(whole);
            if let Some(free) = *library::running()?.address::<*const Option<ffi::Free>>("PetscTrFree")? {
                free(whole.cast(), 0, c"Options::all".as_ptr(), c"options.rs".as_ptr());
            }
            words
        };
        for word in words.split_whitespace().filter(|word| word.starts_with('-')) {
            if !entries.contains_key(word) && self.used(word) {
                entries.insert(word.to_owned(), read(word)?);
            }
        }
        Ok(entries.into_iter().collect())
    }

    /// Return whether an option is set and was read by PETSc or [`mark_used`](Self::mark_used).
    pub fn used(&self, name: &str) -> bool {
        let Some(name) = key(name).ok().filter(|_| library::runs()) else { return false };
        let mut used = flag(false);
        // this function of PETSc expects the name without its dash
        let bare = &name.as_c_str().to_bytes_with_nul()[1..];
        // SAFETY: the rest of a text that ends with a zero byte and lives until the end of the call.
        let queried = unsafe { petsc!(PetscOptionsUsed(null_mut(), bare.as_ptr().cast(), &mut used)) };
        queried.is_ok() && is_set(used)
    }

    /// Mark an option as read, so that PETSc does not warn about it at its end.
    ///
    /// # Errors
    /// When the name is not a valid name of an option.
    pub fn mark_used(&self, name: &str) -> Result<()> {
        if library::runs() { read(name).map(drop) } else { key(name).map(drop) }
    }

    /// Return the options that nobody has read so far, sorted by name.
    pub fn left(&self) -> Result<Vec<Entry>> {
        if !library::runs() {
            return Ok(Vec::new());
        }
        let mut count = 0;
        let (mut names, mut values) = (null_mut(), null_mut());
        // SAFETY: PETSc returns `count` names and as many values; a value may be null. They are copied before PETSc takes its two lists
        // back.
        let mut entries: Vec<Entry> = unsafe {
            petsc!(PetscOptionsLeftGet(null_mut(), &mut count, &mut names, &mut values))?;
            let entry = |i: usize| {
                let value = *values.add(i);
                (format!("-{}", string(*names.add(i))), (!value.is_null()).then(|| string(value)))
            };
            let entries = (0..count as usize).map(entry).collect();
            petsc!(PetscOptionsLeftRestore(null_mut(), &mut count, &mut names, &mut values))?;
            entries
        };
        entries.sort();
        Ok(entries)
    }
}

/// Return the value of an option of the running PETSc, and mark it as read.
fn read(name: &str) -> Result<Option<String>> {
    let (name, mut value, mut set) = (key(name)?, null(), flag(false));
    // SAFETY: the name lives until the end of the call; PETSc writes to the two variables only.
    unsafe { petsc!(PetscOptionsFindPair(null_mut(), null(), name.as_ptr(), &mut value, &mut set)) }?;
    // SAFETY: null, or a text that PETSc keeps until the option changes; it is copied.
    Ok((!value.is_null()).then(|| unsafe { string(value) }))
}

fn dashed(name: &str) -> String {
    if name.starts_with('-') { name.to_owned() } else { format!("-{name}") }
}

/// Return a name as PETSc expects it, or refuse it: PETSc would store any text and never find some of them again.
fn key(name: &str) -> Result<CString> {
    let name = dashed(name);
    let is_valid = name.trim_start_matches('-').starts_with(char::is_alphabetic) && !name.contains(char::is_whitespace);
    if !is_valid {
        return Err(Error::new(Kind::Solver, format!("`{name}` is not the name of a PETSc option")));
    }
    text(&name)
}

/// The words after the prefix with which the options of a solver begin: its objects, and objects nested in them.
const FAMILIES: &str = "ksp pc mat sub mg fieldsplit vec esteig redundant telescope deflation hpddm lsc matmatmult matproduct \
    matptap mattransposematmult";

/// The options of PETSc as a whole. PETSc reads some of them only at its end.
const GLOBAL: &str = "log log_all log_exclude log_exclude_actions log_exclude_objects log_mpe log_nvtx log_perfstubs \
    log_summary log_sync log_threshold log_trace log_view log_view_gpu_energy log_view_gpu_time log_view_memory \
    options_file options_file_yaml options_left options_monitor options_monitor_cancel options_string_yaml \
    options_suppress_deprecated_warnings options_view malloc malloc_coalesce malloc_debug malloc_dump malloc_hbw \
    malloc_info malloc_requested_size malloc_test malloc_view malloc_view_threshold on_error_abort \
    on_error_attach_debugger on_error_emacs on_error_malloc_dump on_error_mpiabort help version info info_exclude \
    memory_view objects_dump error_output_none error_output_stdout debug_terminal debugger_nodes debugger_pause \
    debugger_ranks start_in_debugger stop_for_debugger fp_trap no_signal_handler check_pointer_intensity citations \
    history get_total_flops shared_tmp not_shared_tmp tmp mpi_return_on_error nox nox_warning display x_virtual \
    skip_petscrc process_view petsc_ci petsc_ci_portable_error_output petsc_sleep use_gpu_aware_mpi saws_options \
    splitreduction_async vecscatter_view build_twosided";

/// The first words of options that PETSc reads when it creates a device, a window or a file.
const GLOBAL_WORDS: &str = "draw drawaxis viewer device cuda hip lg prefix";

/// Further words that begin options of PETSc, besides [`FAMILIES`] and the options of PETSc as a whole.
const MORE_WORDS: &str = "snes ts tao dm is da dmda dmplex petscspace petscfv petscds sf sfnode partitioner petscpartitioner \
    vecscatter ao pf ps eps svd st bv hypre mumps npc no not winklerprobe";

fn has(words: &str, word: &str) -> bool {
    words.split_whitespace().any(|known| known == word)
}

/// Return the first word of an option without its dash.
fn first(name: &str) -> &str {
    name.split('_').next().unwrap_or(name)
}

/// Return whether an option, without its dash, is one of PETSc as a whole.
pub fn is_global(name: &str) -> bool {
    has(GLOBAL, name) || has(GLOBAL_WORDS, first(name))
}

/// Return whether options of PETSc begin with this word.
pub fn begins_options(word: &str) -> bool {
    [FAMILIES, GLOBAL_WORDS, MORE_WORDS].iter().any(|words| has(words, word))
        || GLOBAL.split_whitespace().any(|name| first(name) == word)
}

/// Return whether a word names a family of objects; such words stand alone or between two `_` (`-sub_ksp_type`).
pub fn is_family(word: &str) -> bool {
    has(FAMILIES, word)
}

/// Return whether an option, without its dash and the prefix of its solver, belongs to a family of objects.
pub fn is_of_family(bare: &str) -> bool {
    bare.split_once('_').is_some_and(|(first, _)| is_family(first))
}
