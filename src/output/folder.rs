//! The folder of results: made before the work starts, and never left with half a file.

use crate::error::{Error, Result};
use std::cell::RefCell;
use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// A folder for the results of one run.
#[derive(Debug)]
pub struct Folder {
    path: PathBuf,
    files: RefCell<BTreeSet<PathBuf>>,
}

impl Folder {
    /// Makes the folder with its parents, or takes the one that is there, and tries whether it can be written.
    ///
    /// # Errors
    /// [`Kind::File`](crate::error::Kind::File) when it cannot be made, is no folder, or cannot be written.
    pub fn create(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref().to_owned();
        fs::create_dir_all(&path).map_err(|cause| {
            Error::file(&path, "create the folder", &cause).help("name a folder that can be made with `-o FOLDER`")
        })?;
        remove_parts(&path);
        let probe = path.join(format!(".winkler-{}", std::process::id()));
        File::create(&probe).and_then(|_| fs::remove_file(&probe)).map_err(|cause| {
            Error::file(&path, "write to the folder", &cause)
                .help("give yourself write permission, or name another folder with `-o FOLDER`")
        })?;
        Ok(Self { path, files: RefCell::default() })
    }

    /// The folder as it was named.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The files written so far, by name, each once; paths begin with [`Folder::path`].
    pub fn files(&self) -> Vec<PathBuf> {
        self.files.borrow().iter().cloned().collect()
    }

    /// Writes a whole file `name`, replacing one of this name.
    ///
    /// The text goes to a temporary file in the same folder, which takes the name only when it is complete.
    ///
    /// # Errors
    /// [`Kind::File`](crate::error::Kind::File) with the path and the cause; then nothing was changed.
    pub fn write(&self, name: &str, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<()> {
        let path = self.path.join(name);
        write_whole(&path, fill)?;
        self.files.borrow_mut().insert(path);
        Ok(())
    }

    /// Opens a file `name` that grows while the program works, replacing one of this name.
    ///
    /// # Errors
    /// [`Kind::File`](crate::error::Kind::File) with the path and the cause.
    pub fn open(&self, name: &str) -> Result<(PathBuf, File)> {
        let path = self.path.join(name);
        let file = File::create(&path).map_err(|cause| failed(&path, &cause))?;
        self.files.borrow_mut().insert(path.clone());
        Ok((path, file))
    }

    /// Makes a folder in it, or takes the one that is there.
    ///
    /// # Errors
    /// [`Kind::File`](crate::error::Kind::File) with the path and the cause.
    pub fn subfolder(&self, name: &str) -> Result<()> {
        let path = self.path.join(name);
        fs::create_dir_all(&path).map_err(|cause| Error::file(&path, "create the folder", &cause))?;
        remove_parts(&path);
        Ok(())
    }
}

/// Writes a whole file or nothing: fills a temporary file beside `path` and renames it.
///
/// # Errors
/// [`Kind::File`](crate::error::Kind::File) with the path and the cause; then nothing was changed.
pub fn write_whole(path: &Path, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<()> {
    let mut hidden = std::ffi::OsString::from(".");
    hidden.push(path.file_name().unwrap_or_default());
    hidden.push(format!(".{}.part", std::process::id()));
    let part = path.with_file_name(hidden);
    let written = (|| {
        let mut out = BufWriter::new(File::create(&part)?);
        fill(&mut out)?;
        let file = out.into_inner().map_err(io::IntoInnerError::into_error)?;
        // Network file systems and quotas may refuse the data only here.
        file.sync_all()?;
        fs::rename(&part, path)
    })();
    written.map_err(|cause| {
        // The first failure is the one to tell; the part may not even exist.
        let _ = fs::remove_file(&part);
        failed(path, &cause)
    })
}

/// Removes the temporary files of processes that were killed while they wrote; what cannot be removed is litter, not an error.
fn remove_parts(folder: &Path) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        let process = name.strip_prefix('.').and_then(|name| name.strip_suffix(".part")?.rsplit_once('.'));
        let is_dead = |id: &str| id.parse::<u32>().is_ok() && !Path::new("/proc").join(id).exists();
        if process.is_some_and(|(_, id)| is_dead(id)) {
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// The error for a file that could not be written.
pub(super) fn failed(path: &Path, cause: &io::Error) -> Error {
    let help = match cause.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
            "free some space, or name a folder on another disk with `-o FOLDER`"
        }
        io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => {
            "give yourself write permission, or name another folder with `-o FOLDER`"
        }
        io::ErrorKind::IsADirectory => "a folder has the name of this file: rename or remove it",
        _ => "name another folder with `-o FOLDER`",
    };
    Error::file(path, "write", cause).help(help)
}

/// A name that is safe in a file name: characters other than letters, digits, `-`, `_` and `.` become `_`.
/// An empty name, or one that begins with a dot, gets a `_` in front.
pub fn safe_name(name: &str) -> String {
    let safe: String = name.chars().map(|c| if c.is_alphanumeric() || "-_.".contains(c) { c } else { '_' }).collect();
    if safe.is_empty() || safe.starts_with('.') { format!("_{safe}") } else { safe }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Kind;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<_> =
            fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn makes_parents_and_lists_files_once() {
        let base = tempfile::tempdir().unwrap();
        let folder = Folder::create(base.path().join("a/b")).unwrap();
        assert!(names(folder.path()).is_empty());
        for text in ["first", "second"] {
            folder.write("x.txt", |out| write!(out, "{text}")).unwrap();
        }
        assert_eq!(fs::read_to_string(folder.path().join("x.txt")).unwrap(), "second");
        assert_eq!(folder.files(), [folder.path().join("x.txt")]);
        assert_eq!(names(folder.path()), ["x.txt"]);
    }

    #[test]
    fn a_failure_keeps_the_old_file_and_no_part() {
        let base = tempfile::tempdir().unwrap();
        let folder = Folder::create(base.path()).unwrap();
        folder.write("x.txt", |out| out.write_all(b"whole")).unwrap();
        let error = folder
            .write("x.txt", |out| {
                out.write_all(&[b'h'; 100_000])?;
                Err(io::ErrorKind::StorageFull.into())
            })
            .unwrap_err();
        assert_eq!(error.kind(), Kind::File);
        assert!(error.message().contains("x.txt"), "{error}");
        assert!(error.advice().unwrap().contains("space"), "{error}");
        assert_eq!(fs::read_to_string(folder.path().join("x.txt")).unwrap(), "whole");
        assert_eq!(names(folder.path()), ["x.txt"]);
    }

    #[test]
    fn parts_of_the_dead_are_removed() {
        let base = tempfile::tempdir().unwrap();
        let own = format!(".x.txt.{}.part", std::process::id());
        // no process has this number: it is above the largest that the kernel gives
        for name in [".x.txt.4194305.part", ".notes.part", "x.4194305.part", &own] {
            fs::write(base.path().join(name), "").unwrap();
        }
        Folder::create(base.path()).unwrap();
        let mut left = [own.as_str(), ".notes.part", "x.4194305.part"];
        left.sort_unstable();
        assert_eq!(names(base.path()), left);
    }

    #[test]
    fn names_stay_in_the_folder() {
        assert_eq!(safe_name("upper bottom/../x"), "upper_bottom_.._x");
        assert_eq!(safe_name("..\\x"), "_.._x");
        assert_eq!(safe_name(""), "_");
        assert_eq!(safe_name("größe-1"), "größe-1");
    }
}
