//! The cache of meshes that Gmsh made, with one file for each combination of script, numbers, order, dimension and Gmsh.
//!
//! Where there is no Gmsh, the newest mesh of the other inputs serves: the login node of a cluster meshes, and its other nodes solve.

use crate::error::{Error, Kind, Result};
use crate::file::digest;
use nix::unistd::geteuid;
use serde::Serialize;
use std::cmp::Reverse;
use std::fs::{DirBuilder, File, Metadata, Permissions};
use std::io::Write;
use std::os::unix::fs::{DirBuilderExt, MetadataExt, PermissionsExt};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// Return the name in the cache of a mesh with these inputs, without the Gmsh that makes it. It begins with the name of the script. The digest
/// includes a version, which changes with the way this program calls Gmsh.
pub fn file_name(made_from: impl Serialize, path: &Path) -> String {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    // A prefix of 128 bits is long enough.
    format!("{stem}-{:.32}.msh", digest(&("winkler mesh 4", made_from)))
}

/// Return the name of the mesh that a Gmsh makes under a name of [`file_name`]. `identity` distinguishes this Gmsh from others.
pub fn made_by(name: &str, identity: &str) -> String {
    // A prefix of 64 bits distinguishes more than all versions of Gmsh.
    format!("{}{:.16}.msh", start(name), digest(&identity))
}

/// Return the paths of the meshes in a folder that any Gmsh made under a name of [`file_name`], newest first.
pub fn made_by_any(folder: &Path, name: &str) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let named = entries.filter(|entry| entry.file_name().to_string_lossy().starts_with(&start(name)));
    let mut files: Vec<_> = named.map(|entry| entry.path()).collect();
    files.sort_by_key(|file| Reverse(file.metadata().and_then(|data| data.modified()).ok()));
    files
}

/// Return what the names of the meshes of all versions of Gmsh begin with.
fn start(name: &str) -> String {
    format!("{}-", name.trim_end_matches(".msh"))
}

/// Return the folders that may hold the cache, best first. $WINKLER_CACHE stands alone if it is set. Otherwise they are
/// $XDG_CACHE_HOME/winkler, ~/.cache/winkler and a folder of this user for temporary files. Folders that others can write to
/// are excluded, $WINKLER_CACHE too; the others then take its place.
pub fn folders() -> Vec<PathBuf> {
    choose(|name| std::env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from))
}

fn choose(variable: impl Fn(&str) -> Option<PathBuf>) -> Vec<PathBuf> {
    if let Some(folder) = variable("WINKLER_CACHE").filter(|folder| !is_open_to_others(folder)) {
        return vec![folder];
    }
    let usual = [
        variable("XDG_CACHE_HOME").map(|folder| folder.join("winkler")),
        variable("HOME").map(|folder| folder.join(".cache").join("winkler")),
        Some(std::env::temp_dir().join(format!("winkler-{}", geteuid()))),
    ];
    usual.into_iter().flatten().filter(|folder| !is_open_to_others(folder)).collect()
}

/// Return whether another user may have made this file or folder, or may change it.
fn is_of_others(data: &Metadata) -> bool {
    let is_writable = !data.is_symlink() && data.permissions().mode() & WRITABLE_BY_ALL != 0;
    data.uid() != geteuid().as_raw() || is_writable
}

/// The bit of a mode that lets everybody write.
const WRITABLE_BY_ALL: u32 = 0o002;

/// Return whether a folder that exists, or the link to it, belongs to another user or can be written by everybody. Anybody
/// might have put a mesh there, which would then answer another problem.
fn is_open_to_others(folder: &Path) -> bool {
    [std::fs::symlink_metadata(folder), std::fs::metadata(folder)].iter().flatten().any(is_of_others)
}

/// Open a file of the cache, unless another user owns it or everybody can write to it.
pub fn open(path: &Path) -> Option<File> {
    let file = File::open(path).ok()?;
    file.metadata().ok().filter(|data| !is_of_others(data)).map(|_| file)
}

/// Write a file.
///
/// # Errors
/// The file system refuses.
pub fn write(path: &Path, bytes: impl AsRef<[u8]>) -> Result<()> {
    std::fs::write(path, bytes).map_err(|cause| Error::file(path, "write", &cause))
}

/// Bytes that the disk must still accept after a mesh failed; otherwise it was full. They are some pages, more than the end of
/// a file leaves free.
const ROOM: usize = 1 << 16;

/// A folder of one process inside the cache, removed when it is dropped. Files are finished there and then moved, so that
/// nobody ever reads half a file. The next process removes what a killed process left behind.
pub struct Workshop {
    cache: PathBuf,
    folder: PathBuf,
    /// Lock that is held as long as the process lives, to show that the folder is in use.
    _lock: Option<File>,
}

/// Prefix of the names of workshops.
const PREFIX: &str = "tmp-";

/// Age from which a workshop without a lock counts as abandoned. On file systems without locks no workshop has one.
const OLD: Duration = Duration::from_secs(24 * 3600);

impl Workshop {
    /// Open a workshop in the first of the folders where that is possible.
    ///
    /// # Errors
    /// No folder can be written.
    pub fn open(folders: &[PathBuf]) -> Result<Workshop> {
        static COUNT: AtomicU64 = AtomicU64::new(0);
        let name = format!("{PREFIX}{}-{}", std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed));
        let mut failure = None;
        for cache in folders {
            let folder = cache.join(&name);
            // The mode keeps others from writing there, whatever the umask.
            match DirBuilder::new().recursive(true).mode(0o755).create(&folder) {
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

    /// Return the folder to work in.
    pub fn path(&self) -> &Path {
        &self.folder
    }

    /// Return the error of a mesh that could not be made. If the disk is full, return that error instead, because Gmsh then
    /// leaves half a file.
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

    /// Move a finished file into the cache under a name, over an older one, and return its path there.
    ///
    /// # Errors
    /// The file system refuses.
    pub fn publish(&self, file: &Path, name: &str) -> Result<PathBuf> {
        let to = self.cache.join(name);
        let owned = |data: Metadata| Permissions::from_mode(data.permissions().mode() & !WRITABLE_BY_ALL);
        let ours = std::fs::metadata(file).and_then(|data| std::fs::set_permissions(file, owned(data)));
        ours.and_then(|()| std::fs::rename(file, &to)).map_err(|cause| Error::file(&to, "create", &cause))?;
        Ok(to)
    }
}

/// Lock a workshop. The file gets its final name after it is locked, so that nobody finds it unlocked before.
fn lock(folder: &Path) -> Option<File> {
    let new = folder.join("new-lock");
    let file = File::create(&new).ok()?;
    file.try_lock().ok()?;
    std::fs::rename(&new, folder.join("lock")).ok().map(|()| file)
}

/// Remove the workshops in a cache that nobody uses any more. A folder that cannot be removed stays.
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
        // A folder that cannot be removed is litter, not an error.
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
        let last = choose(|_| None);
        assert!(last.len() == 1 && last[0].ends_with(format!("winkler-{}", geteuid())), "{last:?}");
    }

    /// Others may have written the files of a folder that is open to all. They may also have made a file that they own.
    #[test]
    fn what_others_may_have_written_is_not_used() {
        let base = tempfile::tempdir().unwrap();
        let set = |path: &Path, mode| std::fs::set_permissions(path, Permissions::from_mode(mode)).unwrap();
        let make = |name: &str, mode| {
            let folder = base.path().join(name);
            std::fs::create_dir(&folder).unwrap();
            set(&folder, mode);
            folder
        };
        let (own, shared) = (make("own", 0o775), make("shared", 0o1777));
        let chosen = |folder: &Path| choose(|name| (name == "WINKLER_CACHE").then(|| folder.to_owned()));
        assert_eq!(chosen(&own), std::slice::from_ref(&own));
        assert!(!chosen(&shared).contains(&shared));
        let link = base.path().join("link");
        std::os::unix::fs::symlink(&own, &link).unwrap();
        assert_eq!(chosen(&link), [link]);
        let file = own.join("a.msh");
        std::fs::write(&file, "").unwrap();
        set(&file, 0o664);
        assert!(open(&file).is_some());
        set(&file, 0o666);
        assert!(open(&file).is_none());
        set(&file, 0o644);
        // Only root can give files away.
        if std::os::unix::fs::chown(&file, Some(54_321), None).is_ok() {
            assert!(open(&file).is_none());
            std::os::unix::fs::chown(&own, Some(54_321), None).unwrap();
            assert!(!chosen(&own).contains(&own));
            // A link that another user made is not used either.
            let theirs = base.path().join("theirs");
            std::os::unix::fs::symlink(make("target", 0o755), &theirs).unwrap();
            std::os::unix::fs::lchown(&theirs, Some(54_321), None).unwrap();
            assert!(!chosen(&theirs).contains(&theirs));
        }
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
        // If the folder accepts no more files, the error of a mesh becomes that of the disk.
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
