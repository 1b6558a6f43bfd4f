//! Reading of numbers in rows from a file of any supported kind.

use super::rows::Rows;
use super::rule::DataSpec;
use super::{npy, raster, text};
use crate::error::Result;

/// Read a file of NumPy, a grid with a header, or a text. Points without a height have NaN.
///
/// # Errors
/// A file that cannot be read, that is damaged, or that has coordinates that are not finite.
pub fn rows(spec: &DataSpec) -> Result<Rows> {
    let bytes = crate::file::read(&spec.file).map_err(|error| error.at(&spec.place))?;
    raster::refuse_other_kinds(spec, &bytes)?;
    let mut rows = match () {
        () if npy::is_ours(&bytes) => npy::rows(spec, &bytes)?,
        () if raster::is_ours(&bytes) => raster::rows(spec, &bytes)?,
        () => text::rows(spec, &crate::file::with_unix_lines(bytes))?,
    };
    let named = spec.missing.clone().unwrap_or_default();
    let columns = rows.columns;
    let first = rows.first_height(spec.points);
    for (at, value) in rows.values.iter_mut().enumerate() {
        if at % columns >= first && named.has(*value) {
            *value = f64::NAN;
        }
    }
    let is_bad = |(at, value): &(usize, &f64)| at % columns < first && !value.is_finite();
    let Some((at, value)) = rows.values.iter().enumerate().find(is_bad) else { return Ok(rows) };
    let what = format!("{}, column {} (from 0) is {value}", rows.line(at / columns), at % columns);
    Err(spec.refuse(what, "a point needs its place, also where it has no height"))
}
