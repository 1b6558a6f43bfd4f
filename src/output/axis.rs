//! Axes of plots: what range shows some values, and which ticks it has.

use super::{superscript, trimmed};

/// Most labels of an axis.
const TICKS: usize = 8;
/// Numbers and ranges below this count as zero.
const TINY: f64 = 1e-290;

/// An axis with its range.
pub struct Axis {
    /// Ends of the axis: values, or their decimal logarithms.
    ends: [f64; 2],
    log: bool,
    /// The power of ten that the labels leave out.
    power: i32,
    /// Values with a line across the plot.
    pub ticks: Vec<Tick>,
}

/// A value of an axis.
pub struct Tick {
    /// The value.
    pub value: f64,
    /// Its label; empty for none.
    pub label: String,
}

impl Axis {
    /// Return whether an axis can show a value.
    pub fn shows(value: f64, log: bool) -> bool {
        // the limits keep differences finite, and on a logarithmic axis also quotients
        if log { (1e-150..1e150).contains(&value) } else { value.abs() < 1e290 }
    }

    /// Return an axis that shows all these values.
    pub fn new(values: &[f64], log: bool) -> Self {
        let ends = values.iter().copied().reduce(f64::min).zip(values.iter().copied().reduce(f64::max));
        if log {
            Self::logarithmic(ends)
        } else {
            Self::linear(ends.unwrap_or((0.0, 1.0)), values.iter().all(|value| value.fract() == 0.0))
        }
    }

    /// Return a logarithmic axis. It begins and ends at a power of ten, or at a multiple of one if it has fewer than
    /// three of them, since other numbers have labels then, too.
    fn logarithmic(ends: Option<(f64, f64)>) -> Self {
        let (low, high) = ends.map_or((0.0, 1.0), |(low, high)| (low.log10(), high.log10()));
        let digit = |log: f64| 10f64.powf(log - log.floor()).floor();
        let is_divided = high - low.floor() < 2.0;
        let ends = if is_divided {
            [low.floor() + digit(low).log10(), high.floor() + (digit(high) + 1.0).log10()]
        } else {
            [low.floor(), high.ceil()]
        };
        let powers = ends[0].floor() as i32..=ends[1].ceil() as i32;
        let every = (ends[1] - ends[0]) as i32 / TICKS as i32 + 1;
        let is_short = ends[1] - ends[0] < 1.0;
        let mut ticks = Vec::new();
        for power in powers.filter(|power| is_divided || power.rem_euclid(every) == 0) {
            for digit in 1..if is_divided { 10 } else { 2 } {
                let label = match digit {
                    1 => format!("10{}", superscript(power)),
                    digit if is_short || matches!(digit, 2 | 5) => format!("{digit}·10{}", superscript(power)),
                    _ => String::new(),
                };
                ticks.push(Tick { value: f64::from(digit) * 10f64.powi(power), label });
            }
        }
        Self { ends, log: true, power: 0, ticks }.with_inner_ticks()
    }

    /// Return an even axis. Whole numbers have no ticks between them.
    fn linear((low, high): (f64, f64), are_whole: bool) -> Self {
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
        let step = step((high - low) / unit, are_whole && power == 0);
        let digits = (-step.log10().floor()).max(0.0) as usize;
        let label = |count: i64| {
            let text = format!("{:.digits$}", count as f64 * step);
            if trimmed(&text) == "-0" { "0".to_owned() } else { trimmed(&text).replace('-', "−") }
        };
        let counts = (low / unit / step).floor() as i64..=(high / unit / step).ceil() as i64;
        let ticks = counts.map(|count| Tick { value: count as f64 * step * unit, label: label(count) }).collect();
        Self { ends: [low, high], log: false, power, ticks }.with_inner_ticks()
    }

    /// Return the axis without ticks beyond its ends.
    fn with_inner_ticks(mut self) -> Self {
        let ticks = std::mem::take(&mut self.ticks);
        // rounding must not take the ticks at both ends
        self.ticks = ticks.into_iter().filter(|tick| (-1e-9..1.0 + 1e-9).contains(&self.share(tick.value))).collect();
        self
    }

    /// Return the place of a value between the ends of the axis, 0 and 1.
    pub fn share(&self, value: f64) -> f64 {
        let [low, high] = self.ends;
        ((if self.log { value.log10() } else { value }) - low) / (high - low)
    }

    /// Return the title of the axis with the power of ten that its labels leave out.
    pub fn title(&self, label: &str) -> String {
        if self.power == 0 { label.to_owned() } else { format!("{label} (×10{})", superscript(self.power)) }
    }
}

/// Return the step 1, 2 or 5 times a power of ten with at most [`TICKS`] ticks over a width.
fn step(width: f64, are_whole: bool) -> f64 {
    let power = 10f64.powf((width / TICKS as f64).log10().floor());
    let steps = [1.0, 2.0, 5.0, 10.0].map(|digit| digit * power);
    let step = steps.into_iter().find(|step| width / step < TICKS as f64).unwrap_or(steps[3]);
    if are_whole { step.max(1.0) } else { step }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round() {
        for (values, log, expected) in [
            (&[0.0, 0.7, 1.0][..], false, "0 0.2 0.4 0.6 0.8 1"),
            (&[-1.0, 0.1, 1.0], false, "−1 −0.5 0 0.5 1"),
            (&[0.0, 2.1e6], false, "0 0.5 1 1.5 2 (×10⁶)"),
            (&[0.0, 4e-6], false, "0 1 2 3 4 (×10⁻⁶)"),
            (&[0.0, 3.0], false, "0 1 2 3"),
            (&[1.0, 2e-3], true, "10⁻³ 10⁻² 10⁻¹ 10⁰"),
            (&[1.0, 1e-16], true, "10⁻¹⁵ 10⁻¹² 10⁻⁹ 10⁻⁶ 10⁻³ 10⁰"),
            (&[3.0, 15.0], true, "3·10⁰ 4·10⁰ 5·10⁰ 6·10⁰ 7·10⁰ 8·10⁰ 9·10⁰ 10¹ 2·10¹"),
            (&[3006.0, 5688.0], true, "3·10³ 4·10³ 5·10³ 6·10³"),
        ] {
            let axis = Axis::new(values, log);
            let labels = axis.ticks.iter().map(|tick| tick.label.clone()).filter(|label| !label.is_empty());
            let all = labels.chain(Some(axis.title("").trim().to_owned())).filter(|text| !text.is_empty());
            assert_eq!(all.collect::<Vec<_>>().join(" "), expected);
        }
    }

    #[test]
    fn every_axis_covers_its_values_and_has_ticks() {
        for (a, b) in [(1.0, 1.0), (0.0, 5e-324), (-3.0, -1e-3), (1e-12, 1e12), (5.0, 5.1), (1e-280, 1e280)] {
            for log in [false, true] {
                let values: Vec<f64> = [a, b].into_iter().filter(|&value| Axis::shows(value, log)).collect();
                let axis = Axis::new(&values, log);
                assert!(values.iter().all(|&value| (0.0..=1.0).contains(&axis.share(value))), "{a} {b} {log}");
                // a divided axis has all digits of two decades
                let most = if log { 19 } else { TICKS + 1 };
                assert!((1..=most).contains(&axis.ticks.len()), "{a} {b} {log} {}", axis.ticks.len());
            }
        }
    }
}
