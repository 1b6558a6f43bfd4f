//! Texts of numbers, as profilometers and spreadsheets write them.
//!
//! The separator of fields is the first of `;`, tab, comma and blank that the last line has. If the last line is a single number, the first
//! line decides. With `;` and tabs a decimal comma is read, too. Lines that begin with `#`, and lines before the first number, are skipped.

use super::rows::Rows;
use super::rule::{DataSpec, Missing};
use crate::error::{Error, Result};
use crate::file::other_encoding;

/// Read a text.
///
/// # Errors
/// Bytes that are no text, a field that is no number, rows of different lengths.
pub fn rows(spec: &DataSpec, bytes: &[u8]) -> Result<Rows> {
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
    let (mut rows, mut skipped) = (Rows::default(), None);
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

/// Return the fields of a line.
fn fields_of(text: &[u8], separator: u8) -> impl Iterator<Item = &[u8]> {
    let fields = text.split(move |&byte| byte == separator).map(<[u8]>::trim_ascii);
    // several blanks are one separator
    fields.filter(move |field| separator != b' ' || !field.is_empty())
}

/// Return the fields of a line. A separator at its end is ignored, unless an empty field stands for no height.
fn fields<'a>(text: &'a [u8], separator: u8, named: &Missing) -> impl Iterator<Item = &'a [u8]> + use<'a> {
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

/// Return the refusal of a field that is no number.
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
fn height(field: &[u8], separator: u8, named: &Missing) -> Option<f64> {
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
