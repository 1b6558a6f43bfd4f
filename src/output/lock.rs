//! The lock of a folder of results, so that one command at a time writes its tables there.
//!
//! The lock is one of the kernel (`flock`) on a file that names its holder. The kernel releases it when the process ends, so that a
//! killed run does not block the next one. Network file systems share the lock between hosts. Where a file system has no locks,
//! the name of the holder alone decides.

use crate::error::{Error, Kind, Result};
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Read, Seek, Write};
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

/// Name of the lock file in the folder.
const FILE: &str = ".winkler.lock";

/// Most bytes of a holder's text: a process id and the longest name of a host.
const LONGEST: u64 = 300;

/// A folder that is locked until this value is dropped.
#[derive(Debug)]
pub struct Lock {
    path: PathBuf,
    /// The open file, whose closing releases the lock.
    _file: File,
}

/// A process on a host.
#[derive(Debug, PartialEq, Eq)]
struct Holder {
    process: u32,
    host: String,
}

impl Lock {
    /// Lock a folder.
    ///
    /// # Errors
    /// [`Kind::File`] when another process writes there or may do so, or the lock file cannot be written.
    pub fn take(folder: &Path) -> Result<Self> {
        let path = folder.join(FILE);
        let failed = |cause: io::Error| {
            Error::file(&path, "lock", &cause).help("remove this file, or name another folder with `-o FOLDER`")
        };
        loop {
            let mut file = open(&path).map_err(failed)?;
            let previous = Holder::read(&mut file);
            match file.try_lock() {
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => return Err(in_use(folder, previous.as_ref())),
                // without locks, a name counts unless its process has certainly ended
                Err(TryLockError::Error(_)) => match previous.filter(Holder::may_live) {
                    Some(holder) if holder != Holder::this() => return Err(may_be_in_use(folder, &path, &holder)),
                    _ => {}
                },
            }
            // The previous holder may have removed the file since it was opened. A lock on a removed file excludes nobody.
            let is_same = |found: fs::Metadata| file.metadata().is_ok_and(|own| own.ino() == found.ino());
            if fs::symlink_metadata(&path).is_ok_and(is_same) {
                Holder::this().write(&mut file).map_err(failed)?;
                return Ok(Self { path, _file: file });
            }
        }
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        // The lock is still held, so this cannot remove the file of another holder. A file that stays excludes nobody.
        let _ = fs::remove_file(&self.path);
    }
}

/// Open the lock file, never through a link. Opening for reading and writing does not block on a pipe.
fn open(path: &Path) -> io::Result<File> {
    let file = OpenOptions::new().read(true).write(true).create(true).custom_flags(libc::O_NOFOLLOW).open(path)?;
    match file.metadata()?.is_file() {
        true => Ok(file),
        false => Err(io::Error::other("it is no regular file")),
    }
}

/// Return the error for a folder that another process has locked.
fn in_use(folder: &Path, holder: Option<&Holder>) -> Error {
    let who = holder.map_or("another process".to_owned(), Holder::in_words);
    Error::new(Kind::File, format!("{who} is writing its results to {}", folder.display()))
        .help("name another folder with `-o FOLDER`, or wait until it has ended")
}

/// Return the error for a folder whose holder may still run.
fn may_be_in_use(folder: &Path, path: &Path, holder: &Holder) -> Error {
    Error::new(Kind::File, format!("{} may be writing its results to {}", holder.in_words(), folder.display()))
        .because("the file system has no locks that would tell whether it still runs")
        .help(format!("name another folder with `-o FOLDER`, or remove {} if it has ended", path.display()))
}

impl Holder {
    /// Return the holder that stands for this process.
    fn this() -> Self {
        let host = fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
        Self { process: std::process::id(), host: host.trim().to_owned() }
    }

    /// Read the holder that a lock file names, if any.
    fn read(file: &mut File) -> Option<Self> {
        let mut text = String::new();
        Read::take(file, LONGEST).read_to_string(&mut text).ok()?;
        let (process, host) = text.trim().split_once(' ')?;
        Some(Self { process: process.parse().ok()?, host: host.to_owned() })
    }

    /// Replace the text of a lock file by this holder.
    fn write(&self, file: &mut File) -> io::Result<()> {
        file.set_len(0)?;
        file.rewind()?;
        file.write_all(format!("{} {}\n", self.process, self.host).as_bytes())
    }

    /// Whether the process may still run; on another host this is unknown.
    fn may_live(&self) -> bool {
        self.host != Self::this().host || Path::new("/proc").join(self.process.to_string()).exists()
    }

    /// Return the holder in words, with its host if that is another one.
    fn in_words(&self) -> String {
        match self.host == Self::this().host {
            true => format!("process {}", self.process),
            false => format!("process {} on host {}", self.process, self.host),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_holds_at_a_time_and_names_itself() {
        let folder = tempfile::tempdir().unwrap();
        let lock = Lock::take(folder.path()).unwrap();
        let error = Lock::take(folder.path()).unwrap_err();
        assert!(error.message().contains(&format!("process {} is writing", std::process::id())), "{error}");
        assert_eq!(error.kind(), Kind::File);
        drop(lock);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
        drop(Lock::take(folder.path()).unwrap());
    }

    #[test]
    fn what_a_killed_process_left_stops_nobody() {
        let folder = tempfile::tempdir().unwrap();
        for text in ["", "1 elsewhere\n", "4194305 here\n", "no holder"] {
            fs::write(folder.path().join(FILE), text).unwrap();
            drop(Lock::take(folder.path()).unwrap());
        }
    }

    #[test]
    fn a_holder_on_another_host_is_named_with_it() {
        let other = Holder { process: 7, host: "elsewhere".to_owned() };
        assert!(other.may_live() && Holder::this().may_live());
        assert!(!Holder { process: 4_194_305, ..Holder::this() }.may_live());
        let error = in_use(Path::new("out"), Some(&other));
        assert_eq!(error.message(), "process 7 on host elsewhere is writing its results to out");
    }

    #[test]
    fn nothing_else_serves_as_lock() {
        let folder = tempfile::tempdir().unwrap();
        let (path, target) = (folder.path().join(FILE), folder.path().join("target"));
        std::os::unix::fs::symlink(&target, &path).unwrap();
        assert!(Lock::take(folder.path()).is_err());
        assert!(!target.exists());
        fs::remove_file(&path).unwrap();
        fs::create_dir(&path).unwrap();
        assert!(Lock::take(folder.path()).is_err());
    }
}
