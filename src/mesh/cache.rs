//! The cache of meshes that Gmsh made: one file for each combination of script, numbers, order, dimension, algorithm
//! and Gmsh. Its name is a digest of these.
//!
//! Where there is no Gmsh, the newest mesh of the other inputs serves: the login node of a cluster meshes, and its
//! other nodes solve.

use crate::error::{Error, Kind, Result};
use crate::file::digest;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Return what the name of a mesh with these inputs begins with: the name of its script, and a digest. Behind it stands
/// the Gmsh that made the mesh. The digest includes a version, which changes with the way this program calls Gmsh.
pub fn name(made_from: impl Serialize, path: &Path) -> String {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    // a prefix of 128 bits is long enough
    format!("{stem}-{:.32}-", digest(&("winkler mesh 6", made_from)))
}

/// The folder with the files of the cache.
pub struct Cache {
    folder: PathBuf,
}

impl Cache {
    /// Return the cache in $WINKLER_CACHE, else in $XDG_CACHE_HOME/winkler, else in ~/.cache/winkler.
    ///
    /// # Errors
    /// None of the variables is set.
    pub fn of_user() -> Result<Self> {
        let variable = |name: &str| std::env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from);
        let folder = variable("WINKLER_CACHE")
            .or_else(|| Some(variable("XDG_CACHE_HOME")?.join("winkler")))
            .or_else(|| Some(variable("HOME")?.join(".cache").join("winkler")));
        let missing = || Error::new(Kind::File, "there is no folder for the mesh cache").help(HELP);
        folder.map(Self::at).ok_or_else(missing)
    }

    /// Return the cache in a folder.
    pub fn at(folder: PathBuf) -> Self {
        Self { folder }
    }

    /// Return the files whose names begin with `name`, newest first.
    pub fn all(&self, name: &str) -> Vec<PathBuf> {
        let entries = std::fs::read_dir(&self.folder).into_iter().flatten().flatten();
        let named = entries.filter(|entry| entry.file_name().to_string_lossy().starts_with(name));
        let mut files: Vec<_> =
            named.map(|entry| (entry.metadata().and_then(|data| data.modified()).ok(), entry.path())).collect();
        files.sort();
        files.into_iter().rev().map(|(_, file)| file).collect()
    }

    /// Return the path of the file of this name.
    pub fn file(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    /// Make the file of this name, over an older one, and return what `make` returns. It gets a folder to work in and
    /// the path of the file that it must write there. The finished file is renamed, so that nobody ever reads half a
    /// file.
    ///
    /// # Errors
    /// Those of `make`, and folders that cannot be written.
    pub fn make<T>(&self, name: &str, make: impl FnOnce(&Path, &Path) -> Result<T>) -> Result<T> {
        let failed = |cause| Error::file(&self.folder, "create a file in", &cause).help(HELP);
        std::fs::create_dir_all(&self.folder).map_err(failed)?;
        // a name that no other process has, on whatever host; the folder is removed when it is dropped
        let work = tempfile::Builder::new().prefix("winkler-").tempdir_in(&self.folder).map_err(failed)?;
        let (made, to) = (work.path().join(name), self.file(name));
        let result = make(work.path(), &made)?;
        std::fs::rename(&made, &to).map_err(|cause| Error::file(&to, "create", &cause))?;
        Ok(result)
    }
}

/// Advice for a cache that cannot be written.
const HELP: &str = "meshes are kept there: name a folder that can be written in $WINKLER_CACHE";
