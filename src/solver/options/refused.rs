//! Options that PETSc takes and that would end the program in words of its own, or without any.

use crate::error::{Error, Kind, Result};
use crate::petsc::Session;
use std::fs::OpenOptions;
use std::path::Path;

/// Refuses traps of numbers that are not finite, and values that PETSc would read beyond their end.
///
/// # Errors
/// `-fp_trap` is on; a variable in a value, such as `${HOME}`, is not closed.
pub fn refuse_traps(session: &Session) -> Result<()> {
    let is_off = |value: &str| ["false", "no", "off", "0"].contains(&value.to_lowercase().as_str());
    let is_open = |value: &str| value.rsplit_once("${").is_some_and(|(_, rest)| !rest.contains('}'));
    for (name, value) in session.options().all()? {
        let value = value.unwrap_or_default();
        if is_open(&value) {
            // PETSc reads it at its end, too
            session.options().clear(&name)?;
            let message = format!("the value `{value}` of {name} begins a variable that it does not end");
            return Err(Error::new(Kind::Solver, message).help("write `${NAME}`"));
        }
        if name == "-fp_trap" && !is_off(&value) {
            let message = "-fp_trap would end this program: it computes with infinities on purpose";
            return Err(Error::new(Kind::Solver, message)
                .help("a number that should be finite and is not ends a run anyway, with the status `not-finite`"));
        }
    }
    Ok(())
}

/// Refuses a log that PETSc could not write at its end, when nobody hears of it. It may lie in the folder of results.
///
/// # Errors
/// The file cannot be written.
pub fn refuse_log(session: &Session) -> Result<()> {
    // TYPE:FILE:FORMAT
    let log = session.options().get("-log_view").unwrap_or_default();
    match log.split(':').nth(1).filter(|file| !file.is_empty() && session.rank() == 0) {
        Some(file) => try_file(Path::new(file)),
        None => Ok(()),
    }
}

/// Whether a file can be written; nothing is left of the trial.
fn try_file(path: &Path) -> Result<()> {
    let is_new = !path.exists();
    OpenOptions::new().append(true).create(true).open(path).map_err(|cause| {
        Error::file(path, "write", &cause).help("-log_view names this file: let it lie in a folder that is there")
    })?;
    if is_new {
        // it was made a moment ago; PETSc makes it again
        let _ = std::fs::remove_file(path);
    }
    Ok(())
}
