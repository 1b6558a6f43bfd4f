//! The folder of results. One run at a time writes to it, no file is left half written, and the files that the last `report.json` lists are
//! removed before a run writes its own.

use crate::error::{Error, Kind, Result};
use serde_json::Value;
use std::cell::RefCell;
use std::collections::BTreeSet;
use std::fs::{self, File, TryLockError};
use std::io::{self, BufWriter, Write};
use std::path::{Component, Path, PathBuf};

/// A folder for the results of one run.
#[derive(Debug)]
pub struct Folder {
    path: PathBuf,
    /// Names of the files written so far.
    files: RefCell<BTreeSet<String>>,
    /// The open folder, locked for the process that writes the tables of a run.
    _lock: Option<Lock>,
}

/// The name of the report in the folder.
pub const REPORT: &str = "report.json";

/// The folder of the fields of load steps in that of the results.
pub const STEPS: &str = "steps";

/// A locked folder. A child of the process that has not begun its own program yet has the file, too, and closing it would leave the lock to the child.
#[derive(Debug)]
struct Lock(File);

impl Drop for Lock {
    fn drop(&mut self) {
        // a lock that cannot be released ends with the process
        let _ = self.0.unlock();
    }
}

impl Folder {
    /// Open the folder, which is created with its parents if needed.
    ///
    /// # Errors
    /// A folder that cannot be made.
    pub fn create(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref().to_owned();
        make_folder(&path)?;
        Ok(Self { path, files: RefCell::default(), _lock: None })
    }

    /// Open the folder as [`Self::create`] does, and lock it for one run until this value is dropped.
    ///
    /// # Errors
    /// Those of [`Self::create`], and [`Kind::File`] while another process has the folder. A file system without locks has none.
    pub fn claim(path: impl AsRef<Path>) -> Result<Self> {
        let folder = Self::create(path)?;
        let file = File::open(&folder.path).map_err(|cause| failed(&folder.path, &cause))?;
        if let Err(TryLockError::WouldBlock) = file.try_lock() {
            let message = format!("another process is writing its results to {}", folder.path.display());
            return Err(Error::new(Kind::File, message)
                .help("name another folder with `-o FOLDER`, or wait until it has ended"));
        }
        Ok(Self { _lock: Some(Lock(file)), ..folder })
    }

    /// Remove the files that the report of an earlier run lists, then the report, and nothing else.
    ///
    /// # Errors
    /// A file that cannot be removed.
    pub fn clear(&self) -> Result<()> {
        let text = fs::read(self.path.join(REPORT)).unwrap_or_default();
        let report: Value = serde_json::from_slice(&text).unwrap_or_default();
        let Some(files) = report["files"].as_array() else { return Ok(()) };
        let names = files.iter().filter_map(Value::as_str).filter(|name| may_be_result(name));
        for name in names.filter(|name| *name != REPORT).chain([REPORT]) {
            let path = self.path.join(name);
            // files below a link to another folder stay
            let is_inside = path.parent().is_some_and(|parent| parent == self.path || !parent.is_symlink());
            if is_inside && path.symlink_metadata().is_ok_and(|data| !data.is_dir()) {
                fs::remove_file(&path).map_err(|cause| Error::file(&path, "remove the old", &cause))?;
            }
        }
        // a folder that is not empty stays
        let _ = fs::remove_dir(self.path.join(STEPS));
        Ok(())
    }

    /// Return the path of the folder, as it was given.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Return the names of the files written so far, sorted, each once.
    pub fn files(&self) -> Vec<String> {
        self.files.borrow().iter().cloned().collect()
    }

    /// Write a whole file `name` and replace one of this name.
    ///
    /// # Errors
    /// A file that cannot be written; the old one then stays.
    pub fn write(&self, name: &str, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<()> {
        write_whole(&self.path.join(name), fill)?;
        self.files.borrow_mut().insert(name.to_owned());
        Ok(())
    }

    /// Open an empty file `name` that grows while the program works. It replaces one of this name.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn open(&self, name: &str) -> Result<File> {
        let file = replace(&self.path.join(name), |_| Ok(()))?;
        self.files.borrow_mut().insert(name.to_owned());
        Ok(file)
    }

    /// Create the folder [`STEPS`], unless it is there already.
    ///
    /// # Errors
    /// A link to another place, and a folder that cannot be made.
    pub fn make_steps(&self) -> Result<()> {
        let path = self.path.join(STEPS);
        if path.is_symlink() {
            return Err(Error::new(Kind::File, format!("{} is a link to another place", path.display()))
                .help("remove it: results stay in their folder"));
        }
        make_folder(&path)
    }
}

/// Return whether a run may have written a file of this name: in the folder itself or in [`STEPS`].
fn may_be_result(name: &str) -> bool {
    match Path::new(name).components().collect::<Vec<_>>()[..] {
        [Component::Normal(_)] => true,
        [Component::Normal(first), Component::Normal(_)] => first == STEPS,
        _ => false,
    }
}

/// Create a folder with its parents, unless it is there already.
///
/// # Errors
/// A folder that cannot be made.
pub fn make_folder(path: &Path) -> Result<()> {
    fs::create_dir_all(path).map_err(|cause| {
        Error::file(path, "create the folder", &cause).help("name a folder that you can write to (`-o FOLDER`)")
    })
}

/// Write a whole file or nothing: fill a temporary file beside `path` and rename it. A link of this name is replaced, not followed.
///
/// # Errors
/// A file that cannot be written, and a path that is a folder, a pipe or a device.
pub fn write_whole(path: &Path, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<()> {
    replace(path, fill).map(|_| ())
}

/// Write a whole file as [`write_whole`] does, and return it, positioned at its end.
fn replace(path: &Path, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<File> {
    if fs::metadata(path).is_ok_and(|data| !data.is_file()) {
        return Err(Error::new(Kind::File, format!("{} is no file that can be replaced", path.display()))
            .help("rename or remove it, or name another file or folder with `-o`"));
    }
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let part = path.with_file_name(format!(".{name}.{}.part", std::process::id()));
    let write = || {
        let mut out = BufWriter::new(File::create(&part)?);
        fill(&mut out)?;
        let file = out.into_inner().map_err(io::IntoInnerError::into_error)?;
        // network file systems and quotas may refuse the data only at this point
        file.sync_all()?;
        fs::rename(&part, path)?;
        Ok(file)
    };
    write().map_err(|cause| {
        // The error reports why writing failed. Removing the temporary file may fail as well, for example because it was never created.
        let _ = fs::remove_file(&part);
        failed(path, &cause)
    })
}

/// Return the error for a file that could not be written.
pub(super) fn failed(path: &Path, cause: &io::Error) -> Error {
    let help = match cause.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
            "free some space, or name a folder on another disk with `-o FOLDER`"
        }
        io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => {
            "give yourself write permission, or name another folder with `-o FOLDER`"
        }
        _ => "name another folder with `-o FOLDER`",
    };
    Error::file(path, "write", cause).help(help)
}

/// Return `name` as a safe file name: characters other than letters, digits, `-`, `_` and `.` become `_`. An empty name, or
/// one that begins with a dot, gets a `_` in front.
pub fn safe_name(name: &str) -> String {
    let safe: String = name.chars().map(|c| if c.is_alphanumeric() || "-_.".contains(c) { c } else { '_' }).collect();
    if safe.is_empty() || safe.starts_with('.') { format!("_{safe}") } else { safe }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).unwrap();
        let mut names: Vec<_> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_failure_keeps_the_old_file_and_no_part() {
        let base = tempfile::tempdir().unwrap();
        let folder = Folder::create(base.path().join("a/b")).unwrap();
        folder.write("x.txt", |out| out.write_all(b"whole")).unwrap();
        let full = |out: &mut dyn Write| {
            out.write_all(&[b'h'; 100_000])?;
            Err(io::ErrorKind::StorageFull.into())
        };
        let error = folder.write("x.txt", full).unwrap_err();
        assert!(error.message().contains("x.txt") && error.advice().unwrap().contains("space"), "{error}");
        assert_eq!(fs::read_to_string(folder.path().join("x.txt")).unwrap(), "whole");
        assert_eq!((names(folder.path()), folder.files()), (vec!["x.txt".to_owned()], vec!["x.txt".to_owned()]));
    }

    #[test]
    fn names_stay_in_the_folder() {
        assert_eq!(safe_name("upper bottom/../x"), "upper_bottom_.._x");
        assert_eq!([safe_name("..\\x"), safe_name(""), safe_name("größe-1")], ["_.._x", "_", "größe-1"]);
        let may = |name: &str| may_be_result(name);
        assert!(may("a.vtu") && may("steps/a-1.vtu"));
        assert!(!["../x.csv", "/etc/x.csv", "steps/../x.csv", "b/c.vtu", ""].into_iter().any(may));
    }

    #[test]
    fn what_the_last_report_lists_goes_and_nothing_else() {
        let base = tempfile::tempdir().unwrap();
        let folder = Folder::claim(base.path()).unwrap();
        assert!(Folder::claim(base.path()).is_err());
        fs::create_dir(base.path().join(STEPS)).unwrap();
        for name in ["a.vtu", "steps/a-1.vtu", "own.csv", REPORT] {
            fs::write(base.path().join(name), r#"{"files": ["a.vtu", "steps/a-1.vtu", "gone.csv"]}"#).unwrap();
        }
        folder.clear().unwrap();
        assert_eq!(names(base.path()), ["own.csv"]);
        drop(folder);
        assert!(Folder::claim(base.path()).is_ok());
    }
}
