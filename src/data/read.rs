//! Reading of numbers in rows from a file of any supported kind.
//!
//! Texts are those of profilometers and spreadsheets. The separator of their fields is the first of `;`, tab, comma and blank that the last
//! line has. If the last line is a single number, the first line decides. With `;` and tabs a decimal comma is read, too. Lines that begin
//! with `#`, and lines before the first number, are skipped.

use super::raster;
use super::rule::{DataSpec, NoData, NumberRows};
use crate::error::{Error, Result};
use crate::file::other_encoding;
use npyz::{DType, Deserialize, NpyFile, NpyHeader, Order, TypeChar};
use std::cmp::Ordering;

/// Read a file of NumPy, a grid with a header, or a text. Points without a height have NaN.
///
/// # Errors
/// A file that cannot be read, that is damaged, or that has coordinates that are not finite.
pub fn rows(spec: &DataSpec) -> Result<NumberRows> {
    let bytes = crate::file::read(&spec.file).map_err(|error| error.at(&spec.place))?;
    raster::refuse_other_kinds(spec, &bytes)?;
    let mut rows = match () {
        () if bytes.starts_with(b"\x93NUMPY") => of_numpy(spec, &bytes)?,
        () if raster::is_ours(&bytes) => raster::rows(spec, &bytes)?,
        () => of_text(spec, &crate::file::with_unix_lines(bytes))?,
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

/// Read a text.
///
/// # Errors
/// Bytes that are no text, a field that is no number, rows of different lengths.
fn of_text(spec: &DataSpec, bytes: &[u8]) -> Result<NumberRows> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    if let Some(other) = other_encoding(bytes) {
        let what = format!("is neither text nor a file of NumPy: it {other}");
        return Err(spec.refuse(what, "export the heights as CSV or text in UTF-8"));
    }
    let is_row = |line: &&[u8]| !line.is_empty() && !line.starts_with(b"#");
    let is_end = |byte: &u8| *byte == b'\n';
    let last = bytes.rsplit(is_end).map(<[u8]>::trim_ascii).find(is_row).unwrap_or_default();
    // a line with one number has no separator
    let first = || bytes.split(is_end).map(<[u8]>::trim_ascii).find(is_row).unwrap_or_default();
    let separator = separator(last).or_else(|| separator(first())).unwrap_or(b' ');
    let named = spec.missing.clone().unwrap_or_default();
    let (mut rows, mut skipped) = (NumberRows::default(), None);
    let lines = bytes.split(is_end).map(<[u8]>::trim_ascii).zip(1..);
    for (text, line) in lines.filter(|(text, _)| is_row(text)) {
        let fields = || fields(text, separator, &named);
        if rows.columns == 0 && fields().all(|field| height(field, separator, &named).is_none()) {
            skipped = Some((line, text));
            continue;
        }
        let before = rows.values.len();
        for field in fields() {
            rows.values.push(height(field, separator, &named).ok_or_else(|| refuse_field(spec, line, field))?);
        }
        let found = rows.values.len() - before;
        if rows.columns == 0 {
            rows.columns = found;
            skipped.map_or(Ok(()), |(line, text)| refuse_empty_row(spec, line, fields_of(text, separator), found))?;
        }
        if found != rows.columns {
            let what = format!("line {line} has {found} numbers, lines before it {}", rows.columns);
            return Err(spec.refuse(what, "every row needs as many"));
        }
        rows.lines.push(line);
    }
    Ok(rows)
}

fn fields_of(text: &[u8], separator: u8) -> impl Iterator<Item = &[u8]> {
    let fields = text.split(move |&byte| byte == separator).map(<[u8]>::trim_ascii);
    // several blanks are one separator
    fields.filter(move |field| separator != b' ' || !field.is_empty())
}

/// Return the fields of a line. A separator at its end is ignored, unless an empty field stands for no height.
fn fields<'a>(text: &'a [u8], separator: u8, named: &NoData) -> impl Iterator<Item = &'a [u8]> + use<'a> {
    let text = if named.has_word("") { text } else { text.strip_suffix(&[separator]).unwrap_or(text) };
    fields_of(text, separator)
}

/// Refuse a line before the first number that looks like a row without heights: as many fields as a row has, all with one word.
fn refuse_empty_row<'a>(
    spec: &DataSpec,
    line: u64,
    mut fields: impl Iterator<Item = &'a [u8]>,
    columns: usize,
) -> Result<()> {
    let first = fields.next().unwrap_or_default();
    let (mut count, mut is_one) = (1, true);
    fields.for_each(|field| (count, is_one) = (count + 1, is_one && field == first));
    if columns < 2 || count != columns || !is_one {
        return Ok(());
    }
    let word = start_of(first);
    let help = format!(
        "if it stands for points without a height, write missing = {word:?} and fill = \"linear\" or \"nearest\"; else begin the line with #"
    );
    Err(spec.refuse(format!("line {line} has no number, but {count} times `{word}`"), &help))
}

fn refuse_field(spec: &DataSpec, line: u64, field: &[u8]) -> Error {
    let what = match field.is_empty() {
        true => format!("line {line} lacks a number between two separators"),
        false => format!("line {line}: `{}` is not a number", start_of(field)),
    };
    let word = start_of(field);
    let help = format!(
        "if this stands for a point without a height, write missing = {word:?}; lines that are no data begin with #; decimal commas need fields \
         parted by ; or tabs"
    );
    spec.refuse(what, &help)
}

/// Return the start of a field, for a message.
fn start_of(field: &[u8]) -> String {
    const SHOWN: usize = 40;
    let text = String::from_utf8_lossy(field);
    let start: String = text.chars().take(SHOWN).collect();
    if start.len() < text.len() { start + "..." } else { start }
}

/// Return the separator of the fields of a line; none if there is one field.
fn separator(line: &[u8]) -> Option<u8> {
    b";\t, ".iter().copied().find(|separator| line.contains(separator))
}

/// Return the height in a field, NaN if it has the word for no height; none if it is neither.
fn height(field: &[u8], separator: u8, named: &NoData) -> Option<f64> {
    let is_named = || std::str::from_utf8(field).is_ok_and(|word| named.has_word(word));
    number(field, separator).or_else(|| is_named().then_some(f64::NAN))
}

/// Return the number in a field; none if it is no number.
fn number(field: &[u8], separator: u8) -> Option<f64> {
    // spreadsheets may quote every field
    let bare = field.strip_prefix(b"\"").and_then(|rest| rest.strip_suffix(b"\"")).unwrap_or(field);
    let text = std::str::from_utf8(bare.trim_ascii()).ok()?;
    match matches!(separator, b';' | b'\t') && text.contains(',') {
        true => text.replace(',', ".").parse().ok(),
        false => text.parse().ok(),
    }
}

const HELP: &str = "save the heights as they come from NumPy: np.save(\"surface.npy\", heights)";

/// Read a file of NumPy (`.npy`): an array of one direction, which becomes a column, or of two.
///
/// # Errors
/// A damaged file, or an array of another kind.
fn of_numpy(spec: &DataSpec, bytes: &[u8]) -> Result<NumberRows> {
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
    Ok(NumberRows { columns, values, lines: Vec::new(), frame: None })
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

fn numbers<T: Deserialize + Into<f64>>(file: NpyFile<&[u8]>) -> std::io::Result<Vec<f64>> {
    file.data::<T>().map_err(std::io::Error::other)?.map(|number| number.map(Into::into)).collect()
}
