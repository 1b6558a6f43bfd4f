//! The folder of results. It is made before the work starts, one run at a time writes to it, and no file is left half written.

use super::leftovers;
use super::lock::Lock;
use crate::error::{Error, Kind, Result};
use std::cell::RefCell;
use std::collections::BTreeSet;
use std::fs::{self, File, FileType, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::os::unix::fs::{FileTypeExt, MetadataExt};
use std::path::{Path, PathBuf};

/// A folder for the results of one run.
#[derive(Debug)]
pub struct Folder {
    path: PathBuf,
    files: RefCell<BTreeSet<PathBuf>>,
    /// The lock of the process that writes the tables of a run.
    _lock: Option<Lock>,
}

impl Folder {
    /// Open the folder, which is created with its parents if needed, and check that it can be written.
    ///
    /// # Errors
    /// [`Kind::File`] when it cannot be created, is no folder, belongs to another user, or cannot be written.
    pub fn create(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref().to_owned();
        make_folder(&path)?;
        let probe = path.join(format!(".winkler-{}", std::process::id()));
        let owner = create_new(&probe).and_then(|file| file.metadata()).map(|data| data.uid());
        let _ = fs::remove_file(&probe);
        let owner = owner.map_err(|cause| {
            Error::file(&path, "write to the folder", &cause)
                .help("give yourself write permission, or name another folder with `-o FOLDER`")
        })?;
        refuse_foreign(&path, owner)?;
        Ok(Self { path, files: RefCell::default(), _lock: None })
    }

    /// Open the folder as [`Self::create`] does, and lock it for one run until this value is dropped. Temporary files of
    /// killed processes are removed.
    ///
    /// # Errors
    /// Those of [`Self::create`], and [`Kind::File`] while another process has the folder.
    pub fn claim(path: impl AsRef<Path>) -> Result<Self> {
        let folder = Self::create(path)?;
        let lock = Lock::take(&folder.path)?;
        remove_parts(&folder.path);
        remove_parts(&folder.path.join(leftovers::STEPS));
        Ok(Self { _lock: Some(lock), ..folder })
    }

    /// Remove the files that an earlier run left, and nothing else.
    ///
    /// # Errors
    /// [`Kind::File`] when a file cannot be removed.
    pub fn clear(&self) -> Result<()> {
        for name in leftovers::files_of_runs(&self.path) {
            let path = self.path.join(&name);
            // Files below a link to another folder stay. A folder is never a result.
            let is_inside = path.parent().is_some_and(|parent| parent == self.path || !parent.is_symlink());
            if is_inside && fs::symlink_metadata(&path).is_ok_and(|data| !data.is_dir()) {
                fs::remove_file(&path).map_err(|cause| Error::file(&path, "remove the old", &cause))?;
            }
        }
        // A folder that is not empty stays.
        let _ = fs::remove_dir(self.path.join(leftovers::STEPS));
        Ok(())
    }

    /// Return the path of the folder, as it was given.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Return the files written so far, sorted by name, each once. Paths begin with [`Folder::path`].
    pub fn files(&self) -> Vec<PathBuf> {
        self.files.borrow().iter().cloned().collect()
    }

    /// Write a whole file `name` and replace one of this name.
    ///
    /// The text goes to a temporary file in the same folder, which is renamed when it is complete.
    ///
    /// # Errors
    /// [`Kind::File`] with the path and the cause; then nothing was changed.
    pub fn write(&self, name: &str, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<()> {
        let path = self.path.join(name);
        write_whole(&path, fill)?;
        self.files.borrow_mut().insert(path);
        Ok(())
    }

    /// Open a file `name` that begins with `start` and grows while the program works. It replaces one of this name.
    ///
    /// # Errors
    /// [`Kind::File`] with the path and the cause; then nothing was changed.
    pub fn open(&self, name: &str, start: &[u8]) -> Result<(PathBuf, File)> {
        let path = self.path.join(name);
        let file = replace(&path, |out| out.write_all(start))?;
        self.files.borrow_mut().insert(path.clone());
        Ok((path, file))
    }

    /// Create a folder inside this one, unless it is there already.
    ///
    /// # Errors
    /// [`Kind::File`] with the path and the cause.
    pub fn subfolder(&self, name: &str) -> Result<()> {
        let path = self.path.join(name);
        if path.is_symlink() {
            return Err(Error::new(Kind::File, format!("{} is a link to another place", path.display()))
                .help("remove it: results stay in their folder"));
        }
        make_folder(&path)
    }
}

/// Create a folder with its parents, unless it is there already.
///
/// # Errors
/// [`Kind::File`] when it cannot be created, or something else has its name.
pub fn make_folder(path: &Path) -> Result<()> {
    // the nearest existing ancestor must be a folder
    let in_the_way = path.ancestors().find(|part| part.symlink_metadata().is_ok()).filter(|part| !part.is_dir());
    if let Some(part) = in_the_way {
        let part_is = match (fs::read_link(part), fs::metadata(part)) {
            (Ok(target), Err(_)) => format!("a link to {}, which is not there", target.display()),
            (_, Ok(data)) => kind_of(data.file_type()).to_owned(),
            (Err(_), Err(_)) => "no folder".to_owned(),
        };
        return Err(Error::new(Kind::File, format!("cannot create the folder {}", path.display()))
            .because(format!("{} is {part_is}", part.display()))
            .help("remove it, or name another folder (`-o FOLDER`)"));
    }
    fs::create_dir_all(path).map_err(|cause| {
        Error::file(path, "create the folder", &cause).help("name a folder that you can write to (`-o FOLDER`)")
    })
}

/// Refuse to write into a folder of another user, as root could do by mistake. A folder that its owner lets a group or
/// everybody write to is accepted. `user` owns the files that this process creates there.
fn refuse_foreign(path: &Path, user: u32) -> Result<()> {
    const SHARED: u32 = 0o022;
    match fs::metadata(path) {
        Ok(data) if data.uid() != user && data.mode() & SHARED == 0 => {
            Err(Error::new(Kind::File, format!("the folder {} belongs to another user", path.display()))
                .because(format!("its owner has the number {}, you have {user}", data.uid()))
                .help("name a folder of your own with `-o FOLDER`, or let its owner share it: chmod g+w"))
        }
        _ => Ok(()),
    }
}

/// Return the kind of a directory entry in words.
fn kind_of(kind: FileType) -> &'static str {
    match () {
        _ if kind.is_file() => "a file, not a folder",
        _ if kind.is_dir() => "a folder",
        _ if kind.is_fifo() => "a pipe",
        _ if kind.is_socket() => "a socket",
        _ => "a device",
    }
}

/// Create a new file, never through a link.
fn create_new(path: &Path) -> io::Result<File> {
    // a killed process with the same id may have left one
    let _ = fs::remove_file(path);
    OpenOptions::new().write(true).create_new(true).open(path)
}

/// Write a whole file or nothing: fill a temporary file beside `path` and rename it. A link of this name is replaced, not
/// followed.
///
/// # Errors
/// [`Kind::File`] with the path and the cause; then nothing was changed.
pub fn write_whole(path: &Path, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<()> {
    replace(path, fill).map(|_| ())
}

/// Write a whole file as [`write_whole`] does, and return it, positioned at its end.
fn replace(path: &Path, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<File> {
    // A folder cannot be replaced, and a file would not serve the purpose of a pipe or a device.
    if let Some(kind) = fs::metadata(path).ok().map(|data| data.file_type()).filter(|kind| !kind.is_file()) {
        return Err(Error::new(Kind::File, format!("{} is {}, not a file", path.display(), kind_of(kind)))
            .help("rename or remove it, or name another file or folder with `-o`"));
    }
    let mut temporary = std::ffi::OsString::from(".");
    temporary.push(path.file_name().unwrap_or_default());
    temporary.push(format!(".{}.part", std::process::id()));
    let part = path.with_file_name(temporary);
    fill_and_rename(&part, path, fill).map_err(|cause| {
        // The first failure is reported; the temporary file may not even exist.
        let _ = fs::remove_file(&part);
        failed(path, &cause)
    })
}

/// Create the file `part`, fill it, rename it to `path`, and return it.
fn fill_and_rename(part: &Path, path: &Path, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<File> {
    let mut out = BufWriter::new(create_new(part)?);
    fill(&mut out)?;
    let file = out.into_inner().map_err(io::IntoInnerError::into_error)?;
    // Network file systems and quotas may refuse the data only at this point.
    file.sync_all()?;
    fs::rename(part, path)?;
    Ok(file)
}

/// Remove the temporary files of processes that were killed while they wrote. A file that cannot be removed is no error.
fn remove_parts(folder: &Path) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        let hidden = name.strip_prefix('.').unwrap_or_default();
        let process = hidden.strip_suffix(".part").and_then(|name| name.rsplit_once('.'));
        let process = process.map(|(_, id)| id).or(hidden.strip_prefix("winkler-"));
        let is_dead = |id: &str| id.parse::<u32>().is_ok() && !Path::new("/proc").join(id).exists();
        if process.is_some_and(is_dead) {
            let _ = fs::remove_file(entry.path());
        }
    }
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
        Folder::claim(base.path()).unwrap();
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
