//! Numbers in rows, from a file of any kind that is known.

use super::{npy, text};
use crate::error::Result;
use std::path::Path;

/// Numbers in rows of one length, all finite.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Rows {
    /// Numbers in a row.
    pub columns: usize,
    /// Row by row.
    pub values: Vec<f64>,
    /// Line of each row in a text; none of another file.
    pub lines: Vec<u64>,
}

impl Rows {
    /// Number of rows.
    pub fn count(&self) -> usize {
        self.values.len() / self.columns.max(1)
    }

    /// Where a row stands, in words.
    pub fn line(&self, row: usize) -> String {
        self.lines.get(row).map_or_else(|| format!("row {row}"), |line| format!("line {line}"))
    }
}

/// What is wrong with a file, and what to do about it.
#[derive(Debug)]
pub struct Fault {
    /// Continues "data `name`, file".
    pub what: String,
    /// The way out; empty if there is none to say.
    pub help: &'static str,
}

impl Fault {
    /// A fault.
    pub fn new(what: impl Into<String>, help: &'static str) -> Self {
        Self { what: what.into(), help }
    }
}

/// Reads a file of NumPy, or a text.
///
/// # Errors
/// The file cannot be read; inside, what is wrong with its contents.
pub fn rows(path: &Path) -> Result<std::result::Result<Rows, Fault>> {
    let bytes = crate::file::read(path)?;
    let rows = if npy::is_ours(&bytes) { npy::rows(&bytes) } else { text::rows(&bytes) };
    Ok(rows.and_then(|rows| match rows.values.iter().position(|value| !value.is_finite()) {
        None => Ok(rows),
        Some(at) => {
            let (row, column) = (at / rows.columns, at % rows.columns);
            let what = format!("{}, column {column} (from 0) is {}", rows.line(row), rows.values[at]);
            Err(Fault::new(what, "fill points that were not measured before: every one needs a value"))
        }
    }))
}
