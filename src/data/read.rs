//! Heights in rows from a file: an array of NumPy (`.npy`), or a text with numbers parted by commas, semicolons, tabs
//! or blanks.

use super::rule::DataSpec;
use crate::error::{Error, Result};
use crate::file::other_encoding;
use std::fmt::Display;

/// Numbers in rows of one length.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct NumberRows {
    /// Number of columns.
    pub columns: usize,
    /// The numbers, row by row.
    pub values: Vec<f64>,
}

/// Advice for files that are no grid of heights.
const PREPARE: &str =
    "scripts/library/heights.py writes a grid from files of instruments, points in any order, and heights with gaps";

/// Read a file.
///
/// # Errors
/// A file that cannot be read, that is damaged, or that has a number that is not finite.
pub fn rows(spec: &DataSpec) -> Result<NumberRows> {
    let bytes = crate::file::read(&spec.file).map_err(|error| error.at(&spec.file.place))?;
    let rows = match bytes.strip_prefix(b"\x93NUMPY") {
        Some(rest) => of_numpy(spec, rest)?,
        None => of_text(spec, &bytes)?,
    };
    match rows.values.iter().position(|value| !value.is_finite()) {
        Some(at) => {
            let (row, column) = (at / rows.columns, at % rows.columns);
            Err(spec.refuse(format!("has no height in row {row}, column {column} (both from 0)"), PREPARE))
        }
        None => Ok(rows),
    }
}

/// Read a text. Lines that begin with `#` are skipped, and so are lines before the first number, such as names of
/// columns.
fn of_text(spec: &DataSpec, bytes: &[u8]) -> Result<NumberRows> {
    let no_text = |what: &str| spec.refuse(format!("is neither text nor a file of NumPy: it {what}"), PREPARE);
    if let Some(other) = other_encoding(bytes) {
        return Err(no_text(other));
    }
    let text = std::str::from_utf8(bytes).map_err(|_| no_text("has bytes that are no text"))?;
    let mut rows = NumberRows::default();
    let lines = text.trim_start_matches('\u{feff}').lines().map(str::trim).zip(1..);
    for (line, number) in lines.filter(|(line, _)| !line.is_empty() && !line.starts_with('#')) {
        let fields = fields(line);
        if rows.columns == 0 && fields.iter().all(|field| field.parse::<f64>().is_err()) {
            continue;
        }
        for field in &fields {
            let start: String = field.chars().take(40).collect();
            let value =
                field.parse().map_err(|_| spec.refuse(format!("line {number}: `{start}` is not a number"), PREPARE))?;
            rows.values.push(value);
        }
        if rows.columns != 0 && fields.len() != rows.columns {
            let what = format!("line {number} has {} numbers, lines before it {}", fields.len(), rows.columns);
            return Err(spec.refuse(what, "every row needs as many"));
        }
        rows.columns = fields.len();
    }
    Ok(rows)
}

/// Return the fields of a line. Several blanks are one separator, and a separator at the end is ignored.
fn fields(line: &str) -> Vec<&str> {
    match [';', '\t', ','].into_iter().find(|&separator| line.contains(separator)) {
        Some(separator) => line.strip_suffix(separator).unwrap_or(line).split(separator).map(str::trim).collect(),
        None => line.split_whitespace().collect(),
    }
}

/// Read an array of NumPy behind the name of its format: two bytes of the version, the length of the header, the header
/// as a dictionary of Python, and the numbers.
fn of_numpy(spec: &DataSpec, bytes: &[u8]) -> Result<NumberRows> {
    let short = || spec.refuse("ends before its numbers", "it was cut short or damaged: copy it once more");
    // the length has two bytes in version 1 and four in later ones
    let (wide, rest) = (bytes.first().is_some_and(|version| *version > 1), bytes.get(2..).ok_or_else(short)?);
    let (length, rest) = rest.split_at_checked(if wide { 4 } else { 2 }).ok_or_else(short)?;
    let length = length.iter().rev().fold(0, |length, &byte| 256 * length + usize::from(byte));
    let (header, numbers) = rest.split_at_checked(length).ok_or_else(short)?;
    let header = String::from_utf8_lossy(header);
    let value = |key: &str| header.split_once(&format!("'{key}':")).map_or("", |(_, value)| value.trim_start());
    let shape = value("shape").strip_prefix('(').and_then(|shape| shape.split_once(')')).map_or("", |(shape, _)| shape);
    let sides: Vec<usize> = shape.split(',').filter_map(|side| side.trim().parse().ok()).collect();
    let [rows, columns] = match sides[..] {
        [count] => [1, count],
        [rows, columns] => [rows, columns],
        _ => return Err(refuse_array(spec, format!("is no array of one or two directions: ({shape})"))),
    };
    let kind: String = value("descr").trim_matches('\'').chars().take_while(|c| *c != '\'').collect();
    let numbers: Vec<f64> = match kind.as_str() {
        "<f8" => numbers.as_chunks().0.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect(),
        ">f8" => numbers.as_chunks().0.iter().map(|bytes| f64::from_be_bytes(*bytes)).collect(),
        "<f4" => numbers.as_chunks().0.iter().map(|bytes| f32::from_le_bytes(*bytes).into()).collect(),
        ">f4" => numbers.as_chunks().0.iter().map(|bytes| f32::from_be_bytes(*bytes).into()).collect(),
        _ => return Err(refuse_array(spec, format!("has numbers of the kind `{kind}`"))),
    };
    if rows.checked_mul(columns) != Some(numbers.len()) {
        return Err(refuse_array(spec, format!("has {} numbers, and {rows} x {columns} by its header", numbers.len())));
    }
    let values = if value("fortran_order").starts_with("True") {
        (0..numbers.len()).map(|k| numbers[k / columns + rows * (k % columns)]).collect()
    } else {
        numbers
    };
    Ok(NumberRows { columns, values })
}

fn refuse_array(spec: &DataSpec, what: impl Display) -> Error {
    spec.refuse(what, "write it anew: numpy.save(\"heights.npy\", heights.astype(\"f8\"))")
}
