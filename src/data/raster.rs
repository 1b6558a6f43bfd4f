//! Grids whose header says where they are: ASCII grids of ESRI (`.asc`) and grids of Surfer (`.grd`, text or binary of version 6).
//!
//! Origin and spacing of the header are in the lengths of the file. Those of the scene place and scale them, as they do with points.

use super::rule::{DataSpec, GridFrame, NumberRows};
use crate::error::{Error, Result};
use std::io::Read;
use std::path::Path;

/// What Surfer writes for a point without a height: heights from it on are blank in the format of its grids (1.70141e+38).
const BLANK: f64 = 1.70141e38;
/// What an ASCII grid of ESRI has for a point without a height if its header has no line NODATA_value, by the definition of the format.
const NODATA: f64 = -9999.0;
/// Bytes before the heights of a binary grid of Surfer 6: its name (4), two counts of 16 bits, and three ranges of two doubles.
const BINARY_HEADER: usize = 4 + 2 * 2 + 6 * 8;

/// Kinds of grids by their first letters.
#[derive(Clone, Copy, PartialEq)]
enum RasterFormat {
    Esri,
    SurferText,
    SurferBinary,
}

/// Return the kind of a file by its first bytes; none if it is no grid with a header.
fn kind(bytes: &[u8]) -> Option<RasterFormat> {
    let starts = |word: &[u8]| bytes.get(..word.len()).is_some_and(|start| start.eq_ignore_ascii_case(word));
    match () {
        () if starts(b"DSAA") => Some(RasterFormat::SurferText),
        () if starts(b"DSBB") => Some(RasterFormat::SurferBinary),
        () if starts(b"ncols") || starts(b"nrows") => Some(RasterFormat::Esri),
        () => None,
    }
}

/// Return whether the bytes of a file are those of a grid with a header.
pub fn is_ours(bytes: &[u8]) -> bool {
    kind(bytes).is_some()
}

/// Return whether a file begins like a grid with a header, so that the scene need not give the spacing; not so if it cannot be read.
pub fn has_header(path: &Path) -> bool {
    let mut start = Vec::new();
    let file = crate::file::open(path);
    file.is_ok_and(|file| file.take(8).read_to_end(&mut start).is_ok()) && is_ours(&start)
}

/// Refuse files of instruments that are known, but not read, with the way to convert them.
///
/// # Errors
/// Such a file.
pub fn refuse_other_kinds(spec: &DataSpec, bytes: &[u8]) -> Result<()> {
    const CONVERT: &str =
        "convert it: scripts/library/heights.py FILE heights.npy (docs/surfaces.md, \"Files of instruments\")";
    let is_sdf = || {
        let names = [&b"aBCR-"[..], b"bBCR-", b"aISO-", b"bISO-"];
        names.iter().any(|name| bytes.get(..name.len()).is_some_and(|start| start.eq_ignore_ascii_case(name)))
    };
    let (kind, help) = match () {
        () if is_sdf() => ("is an SDF file (ISO 25178-71)", CONVERT),
        () if bytes.starts_with(b"PK\x03\x04") => ("is a ZIP archive, as x3p files are (ISO 25178-72)", CONVERT),
        () if bytes.starts_with(b"DSRB") => {
            ("is a grid of Surfer 7", "save it as an ASCII grid or as a grid of Surfer 6")
        }
        () => return Ok(()),
    };
    Err(spec.refuse(kind, help))
}

/// Read a grid with a header. Rows go upwards along the second coordinate.
///
/// # Errors
/// A header that is not complete, a text that is no number, or too few or too many heights.
pub fn rows(spec: &DataSpec, bytes: &[u8]) -> Result<NumberRows> {
    if spec.points {
        return Err(spec.refuse("has a header of a grid", "leave out `points`: its numbers are heights"));
    }
    match kind(bytes) {
        Some(RasterFormat::SurferBinary) => surfer_binary(spec, bytes),
        Some(RasterFormat::SurferText) => surfer_text(spec, Words::new(spec, bytes)?),
        _ => esri(spec, Words::new(spec, bytes)?),
    }
}

/// The size and place of a grid.
struct Header {
    columns: usize,
    count: usize,
    frame: GridFrame,
}

impl Header {
    /// Return a header after a check of its numbers.
    fn new(spec: &DataSpec, counts: [f64; 2], frame: GridFrame) -> Result<Self> {
        let is_count = |n: f64| n >= 1.0 && n.fract() == 0.0 && n <= f64::from(u32::MAX);
        let is_good = |d: usize| frame.origin[d].is_finite() && frame.spacing[d] > 0.0 && frame.spacing[d].is_finite();
        if !(counts.iter().all(|&n| is_count(n)) && is_good(0) && is_good(1)) {
            let GridFrame { origin: [x, y], spacing: [dx, dy] } = frame;
            let [columns, rows] = counts;
            let what =
                format!("has a header of {columns} x {rows} heights from ({x}, {y}) with distances of {dx} and {dy}");
            return Err(spec.refuse(what, "the numbers of columns and rows are whole, the distances are positive"));
        }
        Ok(Self { columns: counts[0] as usize, count: counts[0] as usize * counts[1] as usize, frame })
    }

    /// Return the frame of a grid from the first and the last coordinate in each direction.
    fn between(spec: &DataSpec, counts: [f64; 2], ranges: [[f64; 2]; 2]) -> Result<Self> {
        // a single row has no distance
        let spacing = |d: usize| if counts[d] == 1.0 { 1.0 } else { (ranges[d][1] - ranges[d][0]) / (counts[d] - 1.0) };
        let frame = GridFrame { origin: ranges.map(|range| range[0]), spacing: [0, 1].map(spacing) };
        Self::new(spec, counts, frame)
    }

    /// Return the refusal of a grid with another number of heights than its header says.
    fn refuse_count(&self, spec: &DataSpec, found: usize) -> Error {
        let what = format!("has {found} heights, and {} x {} by its header", self.columns, self.count / self.columns);
        spec.refuse(what, "it was cut short or changed: copy it once more")
    }
}

/// Read an ASCII grid of ESRI, whose first row is the uppermost one.
fn esri(spec: &DataSpec, mut words: Words) -> Result<NumberRows> {
    let mut table = Vec::new();
    while let Some(key) = words.next_unless_number() {
        table.push((key, words.number()?));
    }
    let find = |names: &[&str]| table.iter().find(|(key, _)| names.contains(&key.as_str())).map(|(_, value)| *value);
    let need = |names: &[&str]| {
        let missing = || spec.refuse(format!("has no `{}` in its header", names[0]), "an ASCII grid of ESRI needs it");
        find(names).ok_or_else(missing)
    };
    let spacing = [need(&["cellsize", "dx"])?, need(&["cellsize", "dy"])?];
    // the corner of the lowest cell at the left, or its middle, where the height is
    let start = |middle: &str, corner: &str, d: usize| match find(&[middle]) {
        Some(place) => Ok(place),
        None => need(&[corner]).map(|place| place + 0.5 * spacing[d]),
    };
    let origin = [start("xllcenter", "xllcorner", 0)?, start("yllcenter", "yllcorner", 1)?];
    let header = Header::new(spec, [need(&["ncols"])?, need(&["nrows"])?], GridFrame { origin, spacing })?;
    let nodata = find(&["nodata_value"]).unwrap_or(NODATA);
    let rows = words.rows(&header, |height| height == nodata)?;
    Ok(upwards(rows))
}

/// Return rows in the opposite order.
fn upwards(rows: NumberRows) -> NumberRows {
    let values = rows.values.chunks(rows.columns).rev().flatten().copied().collect();
    let lines = rows.lines.iter().rev().copied().collect();
    NumberRows { values, lines, ..rows }
}

/// Read a text grid of Surfer, whose first row is the lowest one.
fn surfer_text(spec: &DataSpec, mut words: Words) -> Result<NumberRows> {
    words.skip();
    let mut pair = || -> Result<[f64; 2]> { Ok([words.number()?, words.number()?]) };
    let [counts, x, y, _heights] = [pair()?, pair()?, pair()?, pair()?];
    words.rows(&Header::between(spec, counts, [x, y])?, |height| height >= BLANK)
}

/// Read a binary grid of Surfer 6: 32-bit floats after the header.
fn surfer_binary(spec: &DataSpec, bytes: &[u8]) -> Result<NumberRows> {
    let Some((head, heights)) = bytes.split_at_checked(BINARY_HEADER) else {
        return Err(spec.refuse("ends within its header", "it was cut short: copy it once more"));
    };
    let count = |at: usize| f64::from(i16::from_le_bytes([head[at], head[at + 1]]));
    let number = |k: usize| {
        let at = 8 + 8 * k;
        head[at..at + 8].try_into().map_or(f64::NAN, f64::from_le_bytes)
    };
    let header = Header::between(spec, [count(4), count(6)], [[number(0), number(1)], [number(2), number(3)]])?;
    let (floats, rest) = heights.as_chunks::<4>();
    if floats.len() != header.count || !rest.is_empty() {
        return Err(header.refuse_count(spec, floats.len()));
    }
    // the limit is rounded to the digits of the file
    let height = |bytes: &[u8; 4]| Some(f64::from(f32::from_le_bytes(*bytes))).filter(|&height| height < 0.999 * BLANK);
    let values = floats.iter().map(|bytes| height(bytes).unwrap_or(f64::NAN)).collect();
    Ok(NumberRows { columns: header.columns, values, lines: Vec::new(), frame: Some(header.frame) })
}

/// The words of a text with their lines.
struct Words<'a> {
    spec: &'a DataSpec,
    words: std::iter::Peekable<Box<dyn Iterator<Item = (u64, &'a str)> + 'a>>,
}

impl<'a> Words<'a> {
    fn new(spec: &'a DataSpec, bytes: &'a [u8]) -> Result<Self> {
        let text = std::str::from_utf8(bytes).map_err(|_| spec.refuse("is no text", "save it as text in UTF-8"))?;
        let end = if text.contains('\n') { '\n' } else { '\r' };
        let lines = text.split(end).zip(1..);
        let words = lines.flat_map(|(line, number)| line.split_whitespace().map(move |word| (number, word)));
        let words: Box<dyn Iterator<Item = (u64, &'a str)> + 'a> = Box::new(words);
        Ok(Self { spec, words: words.peekable() })
    }

    fn skip(&mut self) {
        self.words.next();
    }

    /// Return the next word in small letters; none if it is a number, or if the text ends.
    fn next_unless_number(&mut self) -> Option<String> {
        self.words.next_if(|(_, word)| number(word).is_none()).map(|(_, word)| word.to_ascii_lowercase())
    }

    /// Return the next number.
    fn number(&mut self) -> Result<f64> {
        let Some((line, word)) = self.words.next() else {
            return Err(self.spec.refuse("ends within its header", "it was cut short: copy it once more"));
        };
        number(word).ok_or_else(|| refuse_word(self.spec, line, word))
    }

    /// Return all other numbers in rows; those for which `is_missing` holds become NaN.
    fn rows(self, header: &Header, is_missing: impl Fn(f64) -> bool) -> Result<NumberRows> {
        let named = self.spec.missing.clone().unwrap_or_default();
        let (mut values, mut lines) = (Vec::new(), Vec::new());
        for (line, word) in self.words {
            if values.len() % header.columns == 0 {
                lines.push(line);
            }
            values.push(match number(word) {
                Some(height) if is_missing(height) => f64::NAN,
                Some(height) => height,
                None if named.has_word(word) => f64::NAN,
                None => return Err(refuse_word(self.spec, line, word)),
            });
        }
        if values.len() != header.count {
            return Err(header.refuse_count(self.spec, values.len()));
        }
        Ok(NumberRows { columns: header.columns, values, lines, frame: Some(header.frame) })
    }
}

fn refuse_word(spec: &DataSpec, line: u64, word: &str) -> Error {
    let start: String = word.chars().take(40).collect();
    let help = format!("if it stands for a point without a height, write missing = {start:?}");
    spec.refuse(format!("line {line}: `{start}` is not a number"), &help)
}

/// Return the number in a word, which may have a decimal comma.
fn number(word: &str) -> Option<f64> {
    word.parse().ok().or_else(|| word.replacen(',', ".", 1).parse().ok())
}
