//! Range, ticks and labels of an axis.

use super::format::{superscript, text_width};
use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};
use std::ops::Range;

/// Numbers and ranges below it count as zero.
const TINY: f64 = 1e-290;

/// Where an axis begins and ends, and its ticks; positions are those of [`Scale::at`].
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Scale {
    log: bool,
    /// Position of the low end.
    pub low: f64,
    /// Position of the high end.
    pub high: f64,
    /// Ticks with a label.
    pub major: Vec<(f64, String)>,
    /// Ticks without.
    pub minor: Vec<f64>,
    /// Power of ten taken out of all labels, 0 for none.
    pub power: i32,
}

impl Scale {
    /// A scale that covers all values that can be drawn, with room for about `count` labels.
    pub fn new(values: impl Iterator<Item = f64>, log: bool, count: usize) -> Self {
        let mut bounds: Option<(f64, f64)> = None;
        let mut whole = true;
        for value in values.filter(|&value| drawable(value, log)) {
            let (low, high) = bounds.unwrap_or((value, value));
            bounds = Some((low.min(value), high.max(value)));
            whole &= value.fract() == 0.0;
        }
        let (low, high) = bounds.unwrap_or(if log { (0.1, 10.0) } else { (0.0, 1.0) });
        let mut scale = if log { Self::logarithmic(low, high, count) } else { Self::linear(low, high, whole, count) };
        // Ticks beyond the ends come from rounding outwards.
        let inside = inside(scale.low, scale.high);
        scale.major.retain(|(at, _)| inside(*at));
        scale.minor.retain(|&at| inside(at));
        scale
    }

    /// Position of a value on the scale: the value or its decimal logarithm; `None` if it cannot be drawn.
    pub fn at(&self, value: f64) -> Option<f64> {
        drawable(value, self.log).then(|| if self.log { value.log10() } else { value })
    }

    /// Position between the ends as a fraction from 0 (low) to 1 (high).
    pub fn fraction(&self, at: f64) -> f64 {
        (at - self.low) / (self.high - self.low)
    }

    /// Width of the widest label in pixels.
    pub fn widest_label(&self, size: f64) -> f64 {
        self.major.iter().map(|(_, label)| text_width(label, size)).fold(0.0, f64::max)
    }

    /// Smallest distance of two labels as a fraction of the axis; 1 for fewer than two.
    pub fn spacing(&self) -> f64 {
        let gaps = self.major.windows(2).map(|pair| pair[1].0 - pair[0].0);
        gaps.fold(self.high - self.low, f64::min) / (self.high - self.low)
    }

    fn linear(low: f64, high: f64, whole: bool, count: usize) -> Self {
        let size = low.abs().max(high.abs());
        let (mut low, mut high) = (low, high);
        if high - low <= (1e-9 * size).max(TINY) {
            // One value only: room on both sides.
            let room = if size > TINY { 0.5 * size } else { 1.0 };
            (low, high) = (low - room, high + room);
        } else {
            // Data that begins near zero shows zero, and nothing beyond.
            let width = high - low;
            let pad = 0.03 * width;
            low = if low >= 0.0 && low < 0.25 * width { 0.0 } else { low - pad };
            high = if high <= 0.0 && -high < 0.25 * width { 0.0 } else { high + pad };
        }
        let mut step = nice_step((high - low) / count as f64);
        if whole {
            step = step.max(1.0);
        }
        let ticks: Vec<f64> =
            ((low / step).ceil() as i64..=(high / step).floor() as i64).map(|tick| tick as f64 * step).collect();
        let top = ticks.iter().fold(0.0f64, |top, tick| top.max(tick.abs()));
        let power = match top {
            top if top >= 99_999.0 || top > 0.0 && top < 0.01 => (top.log10() + 1e-9).floor() as i32,
            _ => 0,
        };
        let unit = 10f64.powi(power);
        // Enough decimals to tell neighbours apart.
        let decimals = (-(step / unit * (1.0 + 1e-9)).log10().floor()).clamp(0.0, 12.0) as usize;
        let major = ticks.iter().map(|&tick| (tick, minus(format!("{:.decimals$}", tick / unit + 0.0)))).collect();
        Self { log: false, low, high, major, minor: Vec::new(), power }
    }

    fn logarithmic(low: f64, high: f64, count: usize) -> Self {
        let (mut from, mut to) = (low.log10(), high.log10());
        let pad = if to - from < 1e-9 { 0.3 } else { 0.03 * (to - from) };
        (from, to) = (from - pad, to + pad);
        let (first, last) = (from.floor() as i32, to.ceil() as i32);
        let decades = to - from;
        let inside = inside(from, to);
        let powers = (first..=last).filter(|&power| inside(power.into())).count();
        // Two powers of ten make an axis readable; with fewer, label other numbers too.
        let short = powers < 2;
        let plain = short && first >= -2 && last <= 4;
        let label = |digit: i32, power: i32| match digit {
            _ if plain => {
                let decimals = (-power).max(0) as usize;
                format!("{:.decimals$}", f64::from(digit) * 10f64.powi(power))
            }
            1 => format!("10{}", superscript(power)),
            _ => format!("{digit}·10{}", superscript(power)),
        };
        let mut major = Vec::new();
        let mut minor = Vec::new();
        let stride = (1..).find(|stride| decades / f64::from(*stride) <= count as f64).unwrap_or(1);
        for power in first..=last {
            let at = f64::from(power);
            if power.rem_euclid(stride) == 0 {
                major.push((at, label(1, power)));
            } else {
                minor.push(at);
            }
            if stride == 1 && decades <= 8.0 {
                for digit in 2..10 {
                    let at = at + f64::from(digit).log10();
                    if short && (decades < 0.7 || digit == 2 || digit == 5) {
                        major.push((at, label(digit, power)));
                    } else {
                        minor.push(at);
                    }
                }
            }
        }
        Self { log: true, low: from, high: to, major, minor, power: 0 }
    }
}

/// Values are positions, those of [`Scale::at`].
impl Ranged for Scale {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, at: &f64, (from, to): (i32, i32)) -> i32 {
        from + (self.fraction(*at) * f64::from(to - from)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        let minor = self.minor.iter().filter(|_| hint.weight().allow_light_points());
        self.major.iter().map(|(at, _)| at).chain(minor).copied().collect()
    }

    fn range(&self) -> Range<f64> {
        self.low..self.high
    }
}

impl ValueFormatter<f64> for Scale {
    fn format_ext(&self, position: &f64) -> String {
        self.major.iter().find(|(at, _)| at == position).map_or(String::new(), |(_, label)| label.clone())
    }
}

/// Whether a value has a place on an axis.
pub(super) fn drawable(value: f64, log: bool) -> bool {
    // Far from overflow, so that differences and logarithms are safe.
    value.abs() < 1e300 && (!log || value > TINY)
}

/// Tells whether a position lies between two ends, allowing for rounding.
fn inside(low: f64, high: f64) -> impl Fn(f64) -> bool {
    let slack = 1e-9 * (high - low);
    move |at| at >= low - slack && at <= high + slack
}

/// The smallest of 1, 2, 5 times a power of ten that is not below `step`.
fn nice_step(step: f64) -> f64 {
    let unit = 10f64.powf(step.log10().floor());
    let factor = [1.0, 2.0, 5.0].into_iter().find(|factor| factor * unit >= step * (1.0 - 1e-9));
    factor.unwrap_or(10.0) * unit
}

/// The typographic minus sign.
fn minus(text: String) -> String {
    text.replace('-', "−")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(values: &[f64], log: bool) -> (String, Scale) {
        let scale = Scale::new(values.iter().copied(), log, 8);
        let labels: Vec<_> = scale.major.iter().map(|(_, label)| label.as_str()).collect();
        (labels.join(" "), scale)
    }

    #[test]
    fn linear_ticks_are_round_and_few() {
        assert_eq!(labels(&[0.0, 0.7, 1.0], false).0, "0.0 0.2 0.4 0.6 0.8 1.0");
        assert_eq!(labels(&[-1.0, 0.1, 1.0], false).0, "−1.0 −0.5 0.0 0.5 1.0");
        assert_eq!(labels(&[0.0, 437.0], false).0, "0 100 200 300 400");
        assert_eq!(labels(&[1000.0, 1000.3, 1001.0], false).0, "1000.0 1000.2 1000.4 1000.6 1000.8 1001.0");
    }

    #[test]
    fn zero_is_shown_only_when_it_is_near() {
        assert_eq!(labels(&[0.1, 0.7, 1.0], false).1.low, 0.0);
        assert!(labels(&[0.5, 0.7, 1.0], false).1.low > 0.4);
        assert_eq!(labels(&[-1.0, -0.7, -0.1], false).1.high, 0.0);
    }

    #[test]
    fn counts_have_whole_ticks() {
        assert_eq!(labels(&[0.0, 1.0, 2.0], false).0, "0 1 2");
        assert_ne!(labels(&[0.0, 1.5, 2.0], false).0, "0 1 2");
    }

    #[test]
    fn large_and_small_numbers_share_a_power() {
        let (text, scale) = labels(&[0.0, 2.1e6], false);
        assert_eq!((text.as_str(), scale.power), ("0.0 0.5 1.0 1.5 2.0", 6));
        let (text, scale) = labels(&[0.0, 4e-6], false);
        assert_eq!((text.as_str(), scale.power), ("0 1 2 3 4", -6));
    }

    #[test]
    fn powers_of_ten() {
        assert_eq!(labels(&[1.0, 2e-3, f64::NAN, 0.0, -1.0], true).0, "10⁻² 10⁻¹ 10⁰");
        assert_eq!(labels(&[1.0, 1e-16], true).0, "10⁻¹⁵ 10⁻¹² 10⁻⁹ 10⁻⁶ 10⁻³ 10⁰");
        assert_eq!(labels(&[3.0, 30.0], true).0, "5 10 20");
        assert_eq!(labels(&[0.03, 0.3], true).0, "0.05 0.1 0.2");
        assert_eq!(labels(&[3e-7, 3e-6], true).0, "5·10⁻⁷ 10⁻⁶ 2·10⁻⁶");
    }

    #[test]
    fn every_scale_covers_its_values_and_has_ticks() {
        for (a, b) in [
            (1.0, 1.0),
            (0.0, 0.0),
            (-3.0, -1e-3),
            (1e-12, 1e12),
            (5.0, 5.1),
            (1e-300, 1e300),
            (0.0, 5e-324),
            (-1e299, 1e299),
        ] {
            for log in [false, true] {
                let scale = Scale::new([a, b].into_iter(), log, 8);
                assert!(scale.high > scale.low);
                assert!(!scale.major.is_empty(), "{a} {b} {log} {scale:?}");
                assert!(scale.major.len() <= 12, "{a} {b} {log} {scale:?}");
                for at in [a, b].into_iter().filter_map(|value| scale.at(value)) {
                    assert!((0.0..=1.0).contains(&scale.fraction(at)), "{a} {b} {log} {scale:?}");
                }
            }
        }
    }
}
