//! The files of a run, read with a look at whether they are what it wrote.

use crate::error::{Error, Kind, Result};
use crate::output::{Checksums, leftovers};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// A row of a table by the names of its columns.
pub type Row = HashMap<String, String>;

/// A folder of results.
pub struct Files {
    folder: PathBuf,
    sums: Option<Checksums>,
}

impl Files {
    /// Opens a folder.
    ///
    /// # Errors
    /// [`Kind::File`] when its list of sums is damaged.
    pub fn open(folder: &Path) -> Result<Self> {
        let path = folder.join(leftovers::SUMS);
        // runs that were killed, or of earlier versions, have none
        let sums = match path.symlink_metadata() {
            Ok(_) => Some(Checksums::parse(&path, &crate::file::read(&path)?)?),
            Err(_) => None,
        };
        Ok(Self { folder: folder.to_owned(), sums })
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The path of a file.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    /// All bytes of a file.
    ///
    /// # Errors
    /// [`Kind::File`] when it cannot be read, or is damaged.
    pub fn read(&self, name: &str) -> Result<Vec<u8>> {
        let bytes = crate::file::read(&self.path(name))?;
        self.sums.as_ref().map_or(Ok(()), |sums| sums.check(&self.folder, name, &bytes))?;
        Ok(bytes)
    }

    /// Rows of a table; none if the file is not there.
    ///
    /// # Errors
    /// Those of [`Self::read`]; [`Kind::File`] when it is no CSV file.
    pub fn rows(&self, name: &str) -> Result<Vec<Row>> {
        if !self.path(name).exists() {
            return Ok(Vec::new());
        }
        let bytes = self.read(name)?;
        let mut table = csv::Reader::from_reader(bytes.as_slice());
        table.deserialize().collect::<std::result::Result<_, csv::Error>>().map_err(|cause| {
            Error::new(Kind::File, format!("{} is no table", self.path(name).display())).because(cause.to_string())
        })
    }
}

/// A number of a row; NaN if it has none.
pub fn value(row: &Row, column: &str) -> f64 {
    row.get(column).and_then(|text| text.parse().ok()).unwrap_or(f64::NAN)
}
