//! Everything the program writes: lines and tables on the terminal, and the files of a run; and the formats of numbers.
//!
//! Nothing here knows the space dimension: points and vectors have three components, with z = 0 in the plane. A
//! function that writes to an `out` returns the errors of that writer.

mod axis;
pub mod closing;
mod fields;
pub mod folder;
mod mark;
pub mod plot;
pub mod report;
mod status;
pub mod tables;
pub mod terminal;
pub mod views;
pub mod vtu;

pub use closing::{UNSETTLED, UnitWords, warning_lines};
pub use fields::{BodyField, CellKind, FieldArray, LargestStress, UnstructuredGrid};
pub use folder::{Folder, make_folder, refuse_foreign, safe_name, write_whole};
pub use mark::{Mark, Role};
pub use plot::{Color, LEGEND, Plot, PlotAxis, Series, Style};
pub use report::{
    BalanceReport, BodyReport, EstimateReport, Extent, ForceReport, InnerTimes, IntervalReport, LISTED, ObstacleReport,
    PairEstimate, PairReport, PairResult, ReactionReport, Report, RoundReport, SealReport, StepReport, TensionReport,
    UnmetReport, busiest,
};
pub use status::RunStatus;
pub use tables::{ContactTable, HistoryWriter, ResultNames, RowFile, StepTable};
pub use terminal::IterationTable;

use crate::error::{Error, Result};
use std::io::{ErrorKind, Write};
use std::path::Path;

/// Print a line to standard output. A reader that has closed the pipe is no error.
///
/// # Errors
/// [`Kind::File`](crate::error::Kind::File) when the line is lost for another reason, as on a full disk.
pub fn say(text: impl std::fmt::Display) -> Result<()> {
    // one write for the whole text: standard output would flush after each of its lines
    let mut out = std::io::stdout();
    match out.write_all(format!("{text}\n").as_bytes()).and_then(|()| out.flush()) {
        Err(cause) if cause.kind() != ErrorKind::BrokenPipe => {
            Err(Error::file(Path::new("standard output"), "write", &cause))
        }
        _ => Ok(()),
    }
}

/// Format a number for people: `digits` after the point and a two-digit exponent (`1.23e-08`); NaN is `-`.
pub fn sci(value: f64, digits: usize) -> String {
    if value.is_nan() {
        return "-".into();
    }
    let text = format!("{value:.digits$e}");
    match text.split_once('e') {
        Some((mantissa, exponent)) => {
            let (sign, power) = match exponent.strip_prefix('-') {
                Some(power) => ('-', power),
                None => ('+', exponent),
            };
            format!("{mantissa}e{sign}{power:0>2}")
        }
        None => text, // infinite
    }
}

/// Format a duration in seconds for people: two decimals below 100 s, none from 10 000 s on; NaN is `-`.
pub fn seconds(value: f64) -> String {
    match value {
        v if v.is_nan() => "-".into(),
        v if v < 100.0 => format!("{v:.2}"),
        v if v < 10_000.0 => format!("{v:.1}"),
        v => format!("{v:.0}"),
    }
}

/// Format a number for programs: the shortest text that reads back as the same number; NaN is an empty field.
pub(super) fn field(value: f64) -> String {
    if value.is_nan() { String::new() } else { format!("{value:?}") }
}

/// Return the text of a number without zeros at the end of its fraction.
pub fn trimmed(text: &str) -> &str {
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { text }
}

/// Escape a text for HTML and XML, between tags and in the value of an attribute. A character that XML does not allow
/// becomes U+FFFD.
pub fn escape(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => safe += "&amp;",
            '<' => safe += "&lt;",
            '>' => safe += "&gt;",
            '"' => safe += "&quot;",
            '\t' | '\n' | '\r' => safe.push(c),
            _ if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => safe.push('\u{fffd}'),
            _ => safe.push(c),
        }
    }
    safe
}

/// Format an integer in superscript digits, for powers of ten.
pub(super) fn superscript(value: i32) -> String {
    value
        .to_string()
        .chars()
        .map(|digit| match digit {
            '-' => '⁻',
            '1' => '¹',
            '2' => '²',
            '3' => '³',
            '0' | '4'..='9' => char::from_u32('⁰' as u32 + digit as u32 - '0' as u32).unwrap_or(digit),
            other => other,
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_for_people() {
        assert_eq!(sci(1.2345e-8, 2), "1.23e-08");
        assert_eq!(sci(-9.999, 1), "-1.0e+01");
        assert_eq!(sci(1e-123, 0), "1e-123");
        assert_eq!(sci(f64::NAN, 3), "-");
        assert_eq!(sci(f64::INFINITY, 3), "inf");
        assert_eq!(seconds(0.123), "0.12");
        assert_eq!(seconds(123.45), "123.5");
        assert_eq!(seconds(86_400.4), "86400");
    }

    #[test]
    fn numbers_for_programs_read_back() {
        for value in [0.1, 1.0 / 3.0, -2.5e-300, 1e22, 0.0] {
            assert_eq!(field(value).parse::<f64>(), Ok(value));
        }
        assert_eq!(field(f64::NAN), "");
    }

    #[test]
    fn texts_are_escaped() {
        assert_eq!(
            escape("a ]]> <b> & \"\u{1b}\u{ffff}\" größe"),
            "a ]]&gt; &lt;b&gt; &amp; &quot;\u{fffd}\u{fffd}&quot; größe"
        );
    }

    #[test]
    fn superscripts() {
        assert_eq!(superscript(-1203), "⁻¹²⁰³");
        assert_eq!(superscript(456_789), "⁴⁵⁶⁷⁸⁹");
    }
}
