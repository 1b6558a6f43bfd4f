//! The scales of the axes of a chart: their ranges, ticks and labels.

use super::format::{superscript, trimmed};
use plotters::coord::combinators::LogCoord;
use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::IntoLogRange;
use std::ops::Range;

/// Approximate upper limit of the labels of an axis.
const TICKS: usize = 8;
/// Number of labels for which plotters divides a decade by all its digits.
pub const DIVIDED: usize = 12;
/// Numbers and ranges below this count as zero.
const TINY: f64 = 1e-290;

/// Whether an axis can show a value.
pub fn is_drawable(value: f64, log: bool) -> bool {
    // the limits keep differences finite, and on a logarithmic axis also quotients
    if log { (1e-150..1e150).contains(&value) } else { value.abs() < 1e290 }
}

/// The scale of an axis.
pub enum Scale {
    /// An even scale; plotters sees values in units of this power of ten.
    Linear(RangedCoordf64, i32),
    Log(LogCoord<f64>),
}

impl Scale {
    /// Return a scale that shows all these values.
    pub fn new(values: &[f64], log: bool) -> Self {
        let low = values.iter().copied().reduce(f64::min);
        let high = values.iter().copied().reduce(f64::max);
        let bounds = low.zip(high);
        if log { Self::logarithmic(bounds) } else { Self::linear(bounds.unwrap_or((0.0, 1.0))) }
    }

    /// Return a logarithmic scale, which begins at a power of ten.
    fn logarithmic(bounds: Option<(f64, f64)>) -> Self {
        let (low, high) = bounds.map_or((0.0, 1.0), |(low, high)| (low.log10().floor(), high.log10()));
        let power = high.floor();
        let high = match high - low {
            // fewer than three powers of ten: other numbers have labels, too
            decades if decades < 2.0 => power + (10f64.powf(high - power).floor() + 1.0).log10(),
            _ => high.ceil(),
        };
        // the margin keeps the ticks at both ends in spite of rounding
        Self::Log((10f64.powf(low) * (1.0 - 1e-9)..10f64.powf(high) * (1.0 + 1e-9)).log_scale().into())
    }

    /// Return an even scale.
    fn linear((low, high): (f64, f64)) -> Self {
        let size = low.abs().max(high.abs());
        let width = high - low;
        let (low, high) = if width <= 1e-9 * size || size < TINY {
            // a single value has room on both sides
            let room = if size < TINY { 1.0 } else { 0.5 * size };
            (low - room, high + room)
        } else {
            // if the data begins near zero, the axis begins at zero
            let pad = 0.03 * width;
            let low = if low >= 0.0 && low < 0.25 * width { 0.0 } else { low - pad };
            (low, if high <= 0.0 && -high < 0.25 * width { 0.0 } else { high + pad })
        };
        let power = match low.abs().max(high.abs()) {
            size if (0.01..1e5).contains(&size) => 0,
            size => size.log10().floor() as i32,
        };
        let unit = 10f64.powi(power);
        Self::Linear((low / unit..high / unit).into(), power)
    }

    /// Return the number of labels to ask plotters for. Whole numbers have no ticks between them.
    pub fn labels(&self, values: &[f64]) -> usize {
        match self {
            Self::Log(axis) if axis.range().end < 99.0 * axis.range().start => DIVIDED,
            Self::Log(_) => TICKS,
            Self::Linear(axis, 0) if values.iter().all(|value| value.fract() == 0.0) => {
                let range = axis.range();
                TICKS.min((range.end.floor() - range.start.ceil()) as usize + 1)
            }
            Self::Linear(..) => TICKS,
        }
    }

    /// Return the title of an axis with the power of ten that its labels leave out.
    pub fn title(&self, label: String) -> String {
        match self {
            Self::Linear(_, power) if *power != 0 => format!("{label} (×10{})", superscript(*power)),
            _ => label,
        }
    }
}

impl Ranged for Scale {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        match self {
            Self::Linear(axis, power) => axis.map(&(value / 10f64.powi(*power)), limit),
            Self::Log(axis) => axis.map(value, limit),
        }
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        match self {
            Self::Linear(axis, power) => axis.key_points(hint).iter().map(|key| key * 10f64.powi(*power)).collect(),
            Self::Log(axis) => {
                // plotters returns both the last number of a decade and the first of the next one
                let mut keys = axis.key_points(hint);
                keys.dedup_by(|a, b| *a <= *b * (1.0 + 1e-6));
                keys
            }
        }
    }

    fn range(&self) -> Range<f64> {
        match self {
            Self::Linear(axis, power) => {
                let unit = 10f64.powi(*power);
                axis.range().start * unit..axis.range().end * unit
            }
            Self::Log(axis) => axis.range(),
        }
    }
}

impl ValueFormatter<f64> for Scale {
    fn format_ext(&self, value: &f64) -> String {
        match self {
            Self::Linear(axis, power) => {
                let width = axis.range().end - axis.range().start;
                // key points have rounding errors
                let digits = (9.0 - width.log10()).clamp(0.0, 15.0) as usize;
                let text = format!("{:.digits$}", value / 10f64.powi(*power));
                if trimmed(&text) == "-0" { "0".to_owned() } else { trimmed(&text).replace('-', "−") }
            }
            Self::Log(_) => {
                let power = (value.log10() + 1e-6).floor();
                let exponent = superscript(power as i32);
                match (value / 10f64.powf(power)).round() as i32 {
                    1 => format!("10{exponent}"),
                    digit @ (2 | 5) => format!("{digit}·10{exponent}"),
                    _ => String::new(),
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_scale_covers_its_values_and_has_ticks() {
        for (a, b) in [(1.0, 1.0), (0.0, 5e-324), (-3.0, -1e-3), (1e-12, 1e12), (5.0, 5.1), (1e-280, 1e280)] {
            for log in [false, true] {
                let values: Vec<f64> = [a, b].into_iter().filter(|&value| is_drawable(value, log)).collect();
                let scale = Scale::new(&values, log);
                let range = scale.range();
                assert!(values.iter().all(|value| range.contains(value)), "{a} {b} {log} {range:?}");
                let ticks = scale.key_points(TICKS).into_iter().filter(|tick| range.contains(tick)).count();
                assert!((1..=TICKS + 1).contains(&ticks), "{a} {b} {log} {ticks}");
            }
        }
    }
}
