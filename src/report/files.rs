//! The files of a run, which are checked against its checksums when they are read.

use crate::error::{Error, Kind, Result};
use crate::output::{Checksums, leftovers};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// A row of a table: values by the names of their columns.
pub type Row = HashMap<String, String>;

/// A folder of results.
pub struct Files {
    folder: PathBuf,
    sums: Option<Checksums>,
}

impl Files {
    /// Open a folder.
    ///
    /// # Errors
    /// [`Kind::File`] when its list of checksums is damaged.
    pub fn open(folder: &Path) -> Result<Self> {
        let path = folder.join(leftovers::SUMS);
        // a killed run or one of an earlier version has no list
        let sums = match path.symlink_metadata() {
            Ok(_) => Some(Checksums::parse(&path, &crate::file::read(&path)?)?),
            Err(_) => None,
        };
        Ok(Self { folder: folder.to_owned(), sums })
    }

    /// Return the path of a file.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    /// Read a file.
    ///
    /// # Errors
    /// [`Kind::File`] when it cannot be read, or is damaged.
    pub fn read(&self, name: &str) -> Result<Vec<u8>> {
        let bytes = crate::file::read(&self.path(name))?;
        self.sums.as_ref().map_or(Ok(()), |sums| sums.check(&self.folder, name, &bytes))?;
        Ok(bytes)
    }

    /// Return the rows of a table, none if there is no such file.
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

/// Return a number of a row, NaN if the column has none.
pub fn value(row: &Row, column: &str) -> f64 {
    row.get(column).and_then(|text| text.parse().ok()).unwrap_or(f64::NAN)
}
