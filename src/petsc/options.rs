//! The table of PETSc's options, which all solvers of a process share, and the words with which PETSc's options begin.

use super::Session;
use super::call::{clear_option, flag, is_set, petsc, string, text};
use super::error::{Error, Result};
use super::session::{Entry, left};
use std::ffi::CString;
use std::ptr::{null, null_mut};

/// PETSc's table of options, filled from the command line, `PETSC_OPTIONS` and `-options_file`.
///
/// Names may be given with or without their dash and are returned with it. PETSc ignores the case of their letters.
///
/// ```
/// use winkler::petsc::Session;
/// let words = ["-ksp_type", "cg", "-shift", "-1e-3", "-note", "a -b c", "-flag"].map(String::from);
/// let options = Session::start(&words)?.options();
/// options.set("ksp_rtol", Some("1e-8"))?;
/// options.clear("-shift")?;
/// let typed = [("-flag", None), ("-ksp_rtol", Some("1e-8")), ("-ksp_type", Some("cg")), ("-note", Some("a -b c"))];
/// assert_eq!(options.left()?, typed.map(|(name, value)| (name.to_owned(), value.map(str::to_owned))));
/// assert!(options.get("flag").as_deref() == Some("") && !options.has("-b")); // marks it as read
/// assert!(options.used("-flag") && !options.used("-note"));
/// assert_eq!((options.left()?.len(), options.typed().len()), (3, 4));
/// assert!(options.set("-1", None).is_err());
/// # Ok::<(), winkler::error::Error>(())
/// ```
#[derive(Clone)]
pub struct Options {
    session: Session,
}

impl Session {
    /// Return the options of this process.
    pub fn options(&self) -> Options {
        Options { session: self.clone() }
    }
}

impl Options {
    /// Return the options of solvers that the user gave: those that PETSc did not read itself at its start, and what
    /// was [`set`](Self::set) since, sorted by name.
    pub fn typed(&self) -> Vec<Entry> {
        self.session.typed().borrow().clone().into_iter().collect()
    }

    /// Set an option, or replace its value, as if the user had typed it.
    ///
    /// # Errors
    /// When the name does not begin with a letter after its dash or has a blank, a text has a zero byte, or the table
    /// is full.
    pub fn set(&self, name: &str, value: Option<&str>) -> Result<()> {
        self.put(name, value)?;
        self.session.defaults().borrow_mut().retain(|default| !default.eq_ignore_ascii_case(&dashed(name)));
        self.session.typed().borrow_mut().insert(dashed(name), value.map(str::to_owned));
        Ok(())
    }

    /// Remove an option, if it is set.
    ///
    /// # Errors
    /// When the name is not a valid name of an option.
    pub fn clear(&self, name: &str) -> Result<()> {
        self.session.typed().borrow_mut().remove(&dashed(name));
        key(name)?;
        clear_option(&dashed(name))
    }

    /// Set an option that the user has not typed, until all of these are [cleared](Session::clear_defaults).
    pub(super) fn set_default(&self, name: &str, value: &str) -> Result<()> {
        self.put(name, Some(value))?;
        self.session.defaults().borrow_mut().push(dashed(name));
        Ok(())
    }

    /// Put an option into PETSc's table.
    fn put(&self, name: &str, value: Option<&str>) -> Result<()> {
        let (name, value) = (key(name)?, value.map(text).transpose()?);
        let value = value.as_ref().map_or(null(), |value| value.as_ptr());
        // SAFETY: both texts live until the end of the call and end with a zero byte; PETSc copies them.
        unsafe { petsc!(PetscOptionsSetValue(null_mut(), name.as_ptr(), value)) }
    }

    /// Return the value of an option, empty for an option without a value, and mark it as read.
    pub fn get(&self, name: &str) -> Option<String> {
        let name = key(name).ok()?;
        let (mut value, mut set) = (null(), flag(false));
        // SAFETY: the name lives until the end of the call; PETSc writes to the two variables only.
        unsafe { petsc!(PetscOptionsFindPair(null_mut(), null(), name.as_ptr(), &mut value, &mut set)) }.ok()?;
        // SAFETY: null, or a text that PETSc keeps until the option changes; it is copied.
        is_set(set).then(|| unsafe { string(value) })
    }

    /// Return whether an option is set, and mark it as read.
    pub fn has(&self, name: &str) -> bool {
        self.get(name).is_some()
    }

    /// Return whether an option is set and was read by PETSc or [`get`](Self::get).
    pub fn used(&self, name: &str) -> bool {
        let Some(name) = key(name).ok() else { return false };
        let mut used = flag(false);
        // this function of PETSc expects the name without its dash
        let bare = &name.as_c_str().to_bytes_with_nul()[1..];
        // SAFETY: the rest of a text that ends with a zero byte and lives until the end of the call.
        let queried = unsafe { petsc!(PetscOptionsUsed(null_mut(), bare.as_ptr().cast(), &mut used)) };
        queried.is_ok() && is_set(used)
    }

    /// Return the options that nobody has read so far, sorted by name.
    pub fn left(&self) -> Result<Vec<Entry>> {
        left()
    }
}

fn dashed(name: &str) -> String {
    if name.starts_with('-') { name.to_owned() } else { format!("-{name}") }
}

/// Return a name as PETSc expects it, or refuse it: PETSc would store any text and never find some of them again.
fn key(name: &str) -> Result<CString> {
    let name = dashed(name);
    let is_valid = name.trim_start_matches('-').starts_with(char::is_alphabetic) && !name.contains(char::is_whitespace);
    if !is_valid {
        return Err(Error::new(format!("`{name}` is not the name of a PETSc option")));
    }
    text(&name)
}

/// The words with which the options of a solver begin: its objects, and objects nested in them.
const FAMILIES: [&str; 10] = ["ksp", "pc", "mat", "sub", "mg", "fieldsplit", "vec", "esteig", "redundant", "telescope"];

/// First words of options of PETSc as a whole, some of which it reads at its end only.
const GLOBAL: [&str; 14] = [
    "log",
    "options",
    "malloc",
    "memory",
    "objects",
    "info",
    "viewer",
    "draw",
    "help",
    "version",
    "on",
    "cuda",
    "device",
    "citations",
];

/// Return whether a word names a family of objects of a solver; such words stand alone or between two `_`
/// (`-sub_ksp_type`).
pub fn is_family(word: &str) -> bool {
    FAMILIES.contains(&word)
}

/// Return whether an option, without its dash, is one of PETSc as a whole.
pub fn is_global(name: &str) -> bool {
    name.split('_').next().is_some_and(|first| GLOBAL.contains(&first))
}

/// Return whether options of PETSc begin with this word.
pub fn begins_options(word: &str) -> bool {
    is_family(word) || GLOBAL.contains(&word) || ["snes", "ts", "tao", "dm", "is", "hypre", "mumps"].contains(&word)
}
