//! Texts of numbers, as profilometers and spreadsheets write them.
//!
//! Fields are parted by `;`, tabs, commas or blanks, whichever of these, in this order, the last line has (of a number
//! alone: the first line). With the first two a decimal comma is read, too. Lines that begin with `#`, and lines before the first number,
//! are skipped.

use super::rows::Rows;
use super::rule::DataSpec;
use crate::error::Result;
use crate::file::other_encoding;

/// Reads a text.
pub fn rows(spec: &DataSpec, bytes: &[u8]) -> Result<Rows> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    if let Some(other) = other_encoding(bytes) {
        let what = format!("is neither text nor a file of NumPy: it {other}");
        return Err(spec.refuse(what, "export the heights as CSV or text in UTF-8"));
    }
    let is_row = |line: &&[u8]| !line.is_empty() && !line.starts_with(b"#");
    let is_end = |byte: &u8| *byte == b'\n';
    let last = bytes.rsplit(is_end).map(<[u8]>::trim_ascii).find(is_row).unwrap_or_default();
    // a number alone does not say what parts others
    let first = || bytes.split(is_end).map(<[u8]>::trim_ascii).find(is_row).unwrap_or_default();
    let separator = separator(last).or_else(|| separator(first())).unwrap_or(b' ');
    let mut rows = Rows::default();
    let lines = bytes.split(is_end).map(<[u8]>::trim_ascii).zip(1..);
    for (text, line) in lines.filter(|(text, _)| is_row(text)) {
        // a separator at the end of a line ends it, and many blanks are one
        let text = text.strip_suffix(&[separator]).unwrap_or(text);
        let fields = || {
            let fields = text.split(|&byte| byte == separator).map(<[u8]>::trim_ascii);
            fields.filter(|field| separator != b' ' || !field.is_empty())
        };
        if rows.columns == 0 && fields().all(|field| number(field, separator).is_none()) {
            continue;
        }
        let before = rows.values.len();
        for field in fields() {
            let value = number(field, separator).ok_or_else(|| {
                let what = match field.is_empty() {
                    true => format!("line {line} lacks a number between two separators"),
                    false => format!("line {line}: `{}` is not a number", start_of(field)),
                };
                spec.refuse(what, "lines that are no data begin with #; decimal commas need fields parted by ; or tabs")
            })?;
            rows.values.push(value);
        }
        let found = rows.values.len() - before;
        if rows.columns == 0 {
            rows.columns = found;
        }
        if found != rows.columns {
            let what = format!("line {line} has {found} numbers, lines before it {}", rows.columns);
            return Err(spec.refuse(what, "every row needs as many"));
        }
        rows.lines.push(line);
    }
    Ok(rows)
}

/// What a message shows of a field.
fn start_of(field: &[u8]) -> String {
    const SHOWN: usize = 40;
    let text = String::from_utf8_lossy(field);
    let start: String = text.chars().take(SHOWN).collect();
    if start.len() < text.len() { start + "..." } else { start }
}

/// What parts the fields of a line, if there are several.
fn separator(line: &[u8]) -> Option<u8> {
    b";\t, ".iter().copied().find(|separator| line.contains(separator))
}

/// The number that a field is.
fn number(field: &[u8], separator: u8) -> Option<f64> {
    // as spreadsheets may quote every field
    let bare = field.strip_prefix(b"\"").and_then(|rest| rest.strip_suffix(b"\"")).unwrap_or(field);
    let text = std::str::from_utf8(bare.trim_ascii()).ok()?;
    match matches!(separator, b';' | b'\t') && text.contains(',') {
        true => text.replace(',', ".").parse().ok(),
        false => text.parse().ok(),
    }
}
