//! The cache of meshes that Gmsh made: one file for each script, set of numbers, order, dimension and Gmsh.

use crate::error::{Error, Kind, Result};
use crate::file::digest;
use serde::Serialize;
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// Name of the file in the cache for what a mesh was made from, beginning with that of its script. It changes with how this program calls
/// Gmsh.
pub fn file_name(made_from: impl Serialize, path: &Path) -> String {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    // 128 bits are plenty.
    format!("{stem}-{:.32}.msh", digest(&("winkler mesh 2", made_from)))
}

/// Folders that may hold the cache, best first: $WINKLER_CACHE alone, or else $XDG_CACHE_HOME/winkler,
/// ~/.cache/winkler and a folder for temporary files.
pub fn folders() -> Vec<PathBuf> {
    choose(|name| std::env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from))
}

fn choose(variable: impl Fn(&str) -> Option<PathBuf>) -> Vec<PathBuf> {
    if let Some(folder) = variable("WINKLER_CACHE") {
        return vec![folder];
    }
    [
        variable("XDG_CACHE_HOME").map(|folder| folder.join("winkler")),
        variable("HOME").map(|folder| folder.join(".cache").join("winkler")),
        Some(std::env::temp_dir().join("winkler")),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// Bytes that a disk must still take after a mesh failed, else it was full: some pages, more than what the end of a file leaves.
const ROOM: usize = 1 << 16;

/// A folder of one process inside the cache, gone with its last use: files are finished there and then moved, so that
/// nobody ever reads half a file. What a killed process left is removed by the next one.
pub struct Workshop {
    cache: PathBuf,
    folder: PathBuf,
    /// Locked as long as the process lives: the sign that the folder is in use.
    _lock: Option<File>,
}

/// How names of workshops begin.
const PREFIX: &str = "tmp-";

/// Age from which a workshop without a lock belongs to nobody; where the file system knows no locks, all are without.
const OLD: Duration = Duration::from_secs(24 * 3600);

impl Workshop {
    /// Opens one in the first of the folders where that is possible.
    ///
    /// # Errors
    /// No folder can be written.
    pub fn open(folders: &[PathBuf]) -> Result<Workshop> {
        static COUNT: AtomicU64 = AtomicU64::new(0);
        let name = format!("{PREFIX}{}-{}", std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed));
        let mut failure = None;
        for cache in folders {
            let folder = cache.join(&name);
            match std::fs::create_dir_all(&folder) {
                Ok(()) => {
                    remove_left(cache);
                    return Ok(Workshop { cache: cache.clone(), _lock: lock(&folder), folder });
                }
                Err(cause) => failure = Some(failure.unwrap_or(Error::file(&folder, "create", &cause))),
            }
        }
        let error = failure.unwrap_or_else(|| Error::new(Kind::File, "there is no folder for the mesh cache"));
        Err(error.help("meshes are kept there: name a folder that can be written in $WINKLER_CACHE"))
    }

    /// The folder to work in.
    pub fn path(&self) -> &Path {
        &self.folder
    }

    /// The error of a mesh that could not be made, or that of the disk, if it is full: then Gmsh leaves half a file.
    pub fn blame(&self, error: Error) -> Error {
        if error.kind() != Kind::Mesh {
            return error;
        }
        let probe = self.folder.join("probe");
        let written =
            File::create(&probe).and_then(|mut file| file.write_all(&[0; ROOM]).and_then(|()| file.sync_all()));
        let _ = std::fs::remove_file(&probe);
        match written {
            Ok(()) => error,
            Err(cause) => Error::file(&self.cache, "write the mesh to", &cause)
                .help("meshes are kept there: free some space, or name a folder on another disk in $WINKLER_CACHE"),
        }
    }

    /// Moves a finished file into the cache, over an older one, and gives its place there.
    ///
    /// # Errors
    /// The file system refuses.
    pub fn publish(&self, file: &Path, name: &str) -> Result<PathBuf> {
        let to = self.cache.join(name);
        std::fs::rename(file, &to).map_err(|cause| Error::file(&to, "create", &cause))?;
        Ok(to)
    }
}

/// Locks a workshop. The file takes its name when it is locked, so that nobody finds it unlocked before.
fn lock(folder: &Path) -> Option<File> {
    let new = folder.join("new-lock");
    let file = File::create(&new).ok()?;
    file.try_lock().ok()?;
    std::fs::rename(&new, folder.join("lock")).ok().map(|()| file)
}

/// Removes the workshops in a cache that nobody uses any more. What cannot be removed stays.
fn remove_left(cache: &Path) {
    for entry in std::fs::read_dir(cache).into_iter().flatten().flatten() {
        let folder = entry.path();
        if !entry.file_name().to_string_lossy().starts_with(PREFIX) || !folder.is_dir() {
            continue;
        }
        let unused = match File::open(folder.join("lock")) {
            Ok(lock) => lock.try_lock().is_ok(),
            Err(_) => {
                let changed = entry.metadata().and_then(|data| data.modified()).ok();
                changed.and_then(|time| time.elapsed().ok()).is_some_and(|age| age > OLD)
            }
        };
        if unused {
            let _ = std::fs::remove_dir_all(&folder);
        }
    }
}

impl Drop for Workshop {
    fn drop(&mut self) {
        // What cannot be removed is litter, not an error.
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_explicit_folder_stands_alone() {
        let all = |name: &str| Some(PathBuf::from(format!("/{name}")));
        assert_eq!(choose(all), [PathBuf::from("/WINKLER_CACHE")]);
        let some = choose(|name| all(name).filter(|_| name != "WINKLER_CACHE"));
        assert_eq!(some[..2], [PathBuf::from("/XDG_CACHE_HOME/winkler"), PathBuf::from("/HOME/.cache/winkler")]);
        assert_eq!(choose(|_| None).len(), 1);
    }

    #[test]
    fn a_workshop_takes_the_first_folder_that_works_and_leaves_nothing_behind() {
        let folder = tempfile::tempdir().unwrap();
        let blocked = folder.path().join("file");
        std::fs::write(&blocked, "").unwrap();
        let good = folder.path().join("good");
        let workshop = Workshop::open(&[blocked.clone(), good.clone()]).unwrap();
        let file = workshop.path().join("a");
        std::fs::write(&file, "a").unwrap();
        assert_eq!(workshop.publish(&file, "b.msh").unwrap(), good.join("b.msh"));
        let blamed = |error: Error| workshop.blame(error).message().to_owned();
        assert_eq!(blamed(Error::new(Kind::Mesh, "no mesh")), "no mesh");
        let left = std::fs::read_dir(workshop.path()).unwrap().map(|entry| entry.unwrap().file_name());
        assert_eq!(left.collect::<Vec<_>>(), ["lock"]);
        // a folder that takes nothing any more is at fault, if the mesh is
        std::fs::remove_dir_all(workshop.path()).unwrap();
        assert_eq!(blamed(Error::new(Kind::Solver, "no memory")), "no memory");
        assert_eq!(blamed(Error::new(Kind::Mesh, "no mesh")), format!("cannot write the mesh to {}", good.display()));
        drop(workshop);
        assert_eq!(std::fs::read_dir(&good).unwrap().count(), 1);
        let error = Workshop::open(&[blocked]).err().unwrap().to_string();
        assert!(error.contains("$WINKLER_CACHE"), "{error}");
    }

    #[test]
    fn what_a_killed_process_left_is_removed_and_nothing_else() {
        let cache = tempfile::tempdir().unwrap();
        let make = |name: &str, lock: bool, age: u64| {
            let folder = cache.path().join(name);
            std::fs::create_dir(&folder).unwrap();
            std::fs::write(folder.join("half.msh"), "").unwrap();
            if lock {
                File::create(folder.join("lock")).unwrap();
            }
            let time = std::time::SystemTime::now() - Duration::from_secs(age);
            File::open(&folder).unwrap().set_modified(time).unwrap();
        };
        make("tmp-1-0", true, 0);
        make("tmp-2-0", false, 90_000);
        make("tmp-3-0", false, 80_000);
        make("results", true, 90_000);
        let first = Workshop::open(&[cache.path().to_owned()]).unwrap();
        let second = Workshop::open(&[cache.path().to_owned()]).unwrap();
        assert!(first.path().is_dir() && second.path().is_dir());
        let own = |workshop: &Workshop| workshop.path().file_name().unwrap().to_string_lossy().into_owned();
        let mut expected = [own(&first), own(&second), "results".to_owned(), "tmp-3-0".to_owned()];
        expected.sort();
        let mut found: Vec<String> = std::fs::read_dir(cache.path())
            .unwrap()
            .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
            .collect();
        found.sort();
        assert_eq!(found, expected);
    }
}
