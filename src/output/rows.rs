//! A CSV file that grows by a row at a time.

use super::folder::{Folder, failed};
use crate::error::{Error, Result};
use std::fs::File;
use std::path::PathBuf;

/// Writes rows as they come. Every row reaches the file at once, so that a run that is killed keeps all that it had computed.
pub struct RowFile {
    path: PathBuf,
    csv: csv::Writer<File>,
    failure: Option<Error>,
}

impl RowFile {
    /// Opens a file of this name and writes its header.
    ///
    /// # Errors
    /// [`Kind::File`](crate::error::Kind::File) when the file cannot be written.
    pub fn create(folder: &Folder, name: &str, header: &[String]) -> Result<Self> {
        let (path, file) = folder.open(name)?;
        let mut rows = Self { path, csv: csv::Writer::from_writer(file), failure: None };
        rows.push(header);
        rows.check().map(|()| rows)
    }

    /// The first failure so far, once.
    ///
    /// # Errors
    /// That of a row that could not be written.
    pub fn check(&mut self) -> Result<()> {
        self.failure.take().map_or(Ok(()), Err)
    }

    /// Appends a row. After a failure the file ends with whole rows: going on would leave a hole.
    pub fn push(&mut self, fields: &[String]) {
        if self.failure.is_some() {
            return;
        }
        let written = self.csv.write_record(fields).map_err(Into::into).and_then(|()| self.csv.flush());
        self.failure = written.err().map(|cause| failed(&self.path, &cause));
    }

    /// Ends the file.
    ///
    /// # Errors
    /// The first failure to write a row: later rows were dropped then.
    pub fn finish(self) -> Result<()> {
        self.failure.map_or(Ok(()), Err)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(target_os = "linux")]
    #[test]
    fn a_full_disk_is_told_once_at_the_end() {
        let file = File::options().write(true).open("/dev/full").unwrap();
        let mut rows = RowFile { path: "history.csv".into(), csv: csv::Writer::from_writer(file), failure: None };
        rows.push(&["1".to_owned()]);
        rows.push(&["2".to_owned()]);
        let error = rows.finish().unwrap_err();
        assert!(error.message().contains("history.csv"), "{error}");
        assert!(error.advice().unwrap().contains("space"), "{error}");
    }
}
