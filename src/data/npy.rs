//! Files of NumPy with an array: `.npy`.

use super::rows::Rows;
use super::rule::DataSpec;
use crate::error::Result;
use npyz::{DType, Deserialize, NpyFile, NpyHeader, Order, TypeChar};
use std::cmp::Ordering;

const HELP: &str = "save the heights as they come from NumPy: np.save(\"surface.npy\", heights)";

/// Return whether bytes are those of a file of NumPy.
pub fn is_ours(bytes: &[u8]) -> bool {
    bytes.starts_with(b"\x93NUMPY")
}

/// Read an array of one direction, which becomes a column, or of two.
///
/// # Errors
/// A damaged file, or an array of another kind.
pub fn rows(spec: &DataSpec, bytes: &[u8]) -> Result<Rows> {
    let damaged = |cause: std::io::Error| spec.refuse(format_args!("is no file of NumPy: {cause}"), HELP);
    refuse_short_header(spec, bytes)?;
    let mut rest = bytes;
    let file = NpyHeader::from_reader(&mut rest).map_err(damaged)?;
    let shape: Vec<usize> = file.shape().iter().map(|&length| length as usize).collect();
    let (count, columns) = match shape[..] {
        [count] => (count, 1),
        [count, columns] => (count, columns),
        _ => return Err(spec.refuse(format!("has an array of {} directions", shape.len()), "one or two are needed")),
    };
    let DType::Plain(kind) = file.dtype() else {
        return Err(spec.refuse("has records, not numbers", HELP));
    };
    // compared before reading, so that no memory is taken for a header that is wrong
    let size = kind.num_bytes().unwrap_or(1).max(1);
    let length = count.checked_mul(columns).and_then(|all| all.checked_mul(size));
    match length.map(|length| length.cmp(&rest.len())) {
        Some(Ordering::Equal) => {}
        Some(Ordering::Less) => {
            let more = rest.len() - length.unwrap_or_default();
            let what = format!("has {more} bytes more than its {count} x {columns} numbers");
            return Err(spec.refuse(what, "one array a file: it is damaged, or has several"));
        }
        _ => return Err(spec.refuse(format!("ends before its {count} x {columns} numbers"), "copy it once more")),
    }
    let order = file.order();
    let kind = kind.clone();
    let file = NpyFile::with_header(file, rest);
    let values = match (kind.type_char(), size) {
        (TypeChar::Float, 8) => numbers::<f64>(file),
        (TypeChar::Float, 4) => numbers::<f32>(file),
        (TypeChar::Int, 1) => numbers::<i8>(file),
        (TypeChar::Int, 2) => numbers::<i16>(file),
        (TypeChar::Int, 4) => numbers::<i32>(file),
        (TypeChar::Uint, 1) => numbers::<u8>(file),
        (TypeChar::Uint, 2) => numbers::<u16>(file),
        (TypeChar::Uint, 4) => numbers::<u32>(file),
        _ => return Err(spec.refuse(format!("has numbers of the kind {kind}"), "convert them: heights.astype(\"f8\")")),
    };
    let values = values.map_err(damaged)?;
    let values = match order {
        Order::C => values,
        Order::Fortran => (0..count * columns).map(|k| values[k / columns + count * (k % columns)]).collect(),
    };
    Ok(Rows { columns, values, lines: Vec::new(), frame: None })
}

/// Refuse a header that is longer than the file, before memory is taken for it.
///
/// The file begins with six bytes of the name and two of the version. The length of the header follows, in two bytes in version 1 and in four
/// in later ones.
fn refuse_short_header(spec: &DataSpec, bytes: &[u8]) -> Result<()> {
    let (version, length) = (bytes.get(6), bytes.get(8..).unwrap_or_default());
    let (at, length) = match version {
        Some(1) => (10, length.first_chunk().map(|two| usize::from(u16::from_le_bytes(*two)))),
        _ => (12, length.first_chunk().map(|four| u32::from_le_bytes(*four) as usize)),
    };
    match length {
        Some(length) if length <= bytes.len().saturating_sub(at) => Ok(()),
        Some(length) => {
            let what = format!("has {} bytes, but a header of {length} bytes by its own words", bytes.len());
            Err(spec.refuse(what, "it was cut short or damaged: copy it once more"))
        }
        None => Err(spec.refuse("ends within its header", "it was cut short: copy it once more")),
    }
}

/// Read the numbers of an array.
fn numbers<T: Deserialize + Into<f64>>(file: NpyFile<&[u8]>) -> std::io::Result<Vec<f64>> {
    file.data::<T>().map_err(std::io::Error::other)?.map(|number| number.map(Into::into)).collect()
}
