//! Reading of numbers in rows from a file of any supported kind.

use super::rows::Rows;
use super::rule::DataSpec;
use super::{npy, text};
use crate::error::Result;

/// Read a file of NumPy, or a text.
///
/// # Errors
/// A file that cannot be read, that is damaged, or that has numbers that are not finite.
pub fn rows(spec: &DataSpec) -> Result<Rows> {
    let bytes = crate::file::read(&spec.file).map_err(|error| error.at(&spec.place))?;
    let rows = match npy::is_ours(&bytes) {
        true => npy::rows(spec, &bytes)?,
        false => text::rows(spec, &crate::file::with_unix_lines(bytes))?,
    };
    let Some(at) = rows.values.iter().position(|value| !value.is_finite()) else { return Ok(rows) };
    let (row, column) = (at / rows.columns, at % rows.columns);
    let what = format!("{}, column {column} (from 0) is {}", rows.line(row), rows.values[at]);
    Err(spec.refuse(what, "fill points that were not measured before: every one needs a value"))
}
