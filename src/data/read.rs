//! Numbers in rows, from a file of any kind that is known.

use super::rows::{Fault, Rows};
use super::{npy, text};
use crate::error::Result;
use std::path::Path;

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
