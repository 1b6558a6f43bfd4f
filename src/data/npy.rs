//! Arrays of NumPy: `.npy`.

use super::rows::Rows;
use super::rule::DataSpec;
use crate::error::Result;
use npyz::{DType, Deserialize, NpyFile, NpyHeader, Order, TypeChar};

const HELP: &str = "save the heights as they come from NumPy: np.save(\"surface.npy\", heights)";

/// Whether a file is one of NumPy.
pub fn is_ours(bytes: &[u8]) -> bool {
    bytes.starts_with(b"\x93NUMPY")
}

/// An array of one direction, which becomes a column, or two.
pub fn rows(spec: &DataSpec, bytes: &[u8]) -> Result<Rows> {
    let damaged = |cause: std::io::Error| spec.refuse(format_args!("is no file of NumPy: {cause}"), HELP);
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
    // also a header that is wrong must not ask for memory
    let size = kind.num_bytes().unwrap_or(1).max(1);
    if count.checked_mul(columns).and_then(|all| all.checked_mul(size)).is_none_or(|all| all > rest.len()) {
        return Err(spec.refuse(format!("ends before its {count} x {columns} numbers"), "copy it once more"));
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
    Ok(Rows { columns, values, lines: Vec::new() })
}

fn numbers<T: Deserialize + Into<f64>>(file: NpyFile<&[u8]>) -> std::io::Result<Vec<f64>> {
    file.data::<T>().map_err(std::io::Error::other)?.map(|number| number.map(Into::into)).collect()
}
