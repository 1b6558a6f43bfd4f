//! A CSV file that grows row by row.

use super::folder::{Folder, failed};
use crate::error::Result;
use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt;
use std::path::PathBuf;

/// A CSV file to which every row is written at once, so that a killed run keeps all that it had computed.
///
/// A row that cannot be written, as on a full disk, is kept and tried again with each later row and at the end.
pub struct RowFile {
    path: PathBuf,
    file: File,
    /// Length of the file in bytes, always whole rows.
    length: u64,
    /// Rows that are not in the file yet, as CSV.
    waiting: Vec<u8>,
    /// Cause of the last failed attempt, until one succeeds.
    failure: Option<io::Error>,
    /// Whether [`Self::complaint`] has reported a failure.
    is_reported: bool,
}

impl RowFile {
    /// Open a file with its header and the rows that are `known` already. It replaces a file of this name.
    ///
    /// # Errors
    /// [`Kind::File`](crate::error::Kind::File) when the file cannot be written.
    pub fn create(folder: &Folder, name: &str, header: &[String], known: &[Vec<String>]) -> Result<Self> {
        let mut start = line(header);
        known.iter().for_each(|row| start.extend(line(row)));
        let (path, file) = folder.open(name, &start)?;
        let (length, waiting) = (start.len() as u64, Vec::new());
        Ok(Self { path, file, length, waiting, failure: None, is_reported: false })
    }

    /// Return the first failure in words, only once, for a warning while the program goes on.
    pub fn complaint(&mut self) -> Option<String> {
        let failure = self.failure.as_ref().filter(|_| !self.is_reported)?;
        self.is_reported = true;
        Some(format!("{} lacks rows: {failure}; they are kept in memory and tried again", self.path.display()))
    }

    /// Append a row.
    pub fn push(&mut self, fields: &[String]) {
        self.waiting.extend(line(fields));
        self.write();
    }

    /// Write all waiting rows or nothing: after half a row the next one would not begin a line.
    fn write(&mut self) {
        match self.file.write_all_at(&self.waiting, self.length) {
            Ok(()) => {
                self.length += self.waiting.len() as u64;
                self.waiting.clear();
                self.failure = None;
            }
            Err(cause) => {
                // if even this fails, half a row stays at the end
                let _ = self.file.set_len(self.length);
                self.failure = Some(cause);
            }
        }
    }

    /// Complete the file.
    ///
    /// # Errors
    /// [`Kind::File`](crate::error::Kind::File) when rows could still not be written.
    pub fn finish(mut self) -> Result<()> {
        if self.failure.is_some() {
            self.write();
        }
        self.failure.map_or(Ok(()), |cause| Err(failed(&self.path, &cause)))
    }
}

/// Format a row as a line of CSV.
fn line(fields: &[String]) -> Vec<u8> {
    let mut csv = csv::Writer::from_writer(Vec::new());
    // writing to memory does not fail
    let _ = csv.write_record(fields);
    csv.into_inner().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(target_os = "linux")]
    #[test]
    fn a_full_disk_is_reported_once_and_tried_again() {
        let full = || File::options().write(true).open("/dev/full").unwrap();
        let failure = None;
        let mut rows = RowFile {
            path: "history.csv".into(),
            file: full(),
            length: 0,
            waiting: Vec::new(),
            failure,
            is_reported: false,
        };
        rows.push(&["1".to_owned()]);
        assert!(rows.complaint().unwrap().contains("history.csv lacks rows"));
        rows.push(&["2".to_owned()]);
        assert_eq!(rows.complaint(), None);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rows");
        rows.file = File::create(&path).unwrap();
        rows.push(&["3, 4".to_owned()]);
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "1\n2\n\"3, 4\"\n");
        rows.file = full();
        rows.push(&["5".to_owned()]);
        let error = rows.finish().unwrap_err();
        assert!(error.message().contains("history.csv"), "{error}");
        assert!(error.advice().unwrap().contains("space"), "{error}");
    }
}
