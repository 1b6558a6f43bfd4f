//! The uncertainty of coordinates, as the digits of a mesh show it.
//!
//! Many files have coordinates of 6 to 9 decimal digits, or of single precision. Such a coordinate is known to half a
//! unit of its last digit. What the coordinates tell of a mesh is uncertain by that: whether a facet belongs to a
//! plane, whether a node lies on an axis, whether two surfaces touch.

use std::fmt::Write;

/// Fewest decimal digits that a program writes of a coordinate by default: those of `%g` in C. Numbers of fewer digits
/// are those that a person has drawn, and exact.
const LEAST: usize = 6;

/// Decimal digits from which a coordinate may have all digits of a double.
const ALL: usize = 16;

/// Share of the different coordinates that have all digits of the mesh, or one less. Among rounded numbers it is 0.99,
/// and among drawn ones it is small. Both occur together where some faces are at drawn coordinates.
const ROUNDED: f64 = 0.5;

/// Binary digits of single precision.
const SINGLE: u32 = f32::MANTISSA_DIGITS;

/// Binary digits up to which numbers are exact: the multiples of 1/1024 on a mesh of 1024 units, as grids have them.
const GRID: u32 = 20;

/// Return the uncertainty of coordinates: half a unit of the last digit of the largest one. It is zero if the
/// coordinates have the digits of doubles, whose rounding [`datum::rounding`](super::datum::rounding) gives, or are
/// exact.
pub fn uncertainty<const D: usize>(points: &[[f64; D]]) -> f64 {
    let values = || points.iter().flatten().map(|x| x.abs()).filter(|x| *x > 0.0 && x.is_finite());
    let largest = values().fold(0.0, f64::max);
    let bits = values().map(binary_digits).max().unwrap_or(0);
    if bits <= GRID {
        return 0.0;
    }
    let unit = 2f64.powi(largest.log2().floor() as i32 + 1 - SINGLE as i32);
    if bits <= SINGLE {
        return 0.5 * unit;
    }
    let (mut text, mut count) = (String::new(), 0);
    for x in values() {
        count = count.max(decimal_digits(x, &mut text));
        if count >= ALL {
            return 0.0;
        }
    }
    if count < LEAST {
        return 0.0;
    }
    let mut distinct: Vec<f64> = values().collect();
    distinct.sort_unstable_by(f64::total_cmp);
    distinct.dedup();
    let full = distinct.iter().filter(|x| decimal_digits(**x, &mut text) + 1 >= count).count();
    if (full as f64) < ROUNDED * distinct.len() as f64 {
        return 0.0;
    }
    let decimal = 10f64.powi(largest.log10().floor() as i32 + 1 - count as i32);
    // Nine digits may be those of numbers of single precision, which have seven.
    let is_single = [None, Some(count - 1)].into_iter().any(|places| distinct.iter().all(|&x| is_printed(x, places)));
    0.5 * if is_single { decimal.max(unit) } else { decimal }
}

/// Return the number of binary digits of a number without zeros at the end.
fn binary_digits(x: f64) -> u32 {
    f64::MANTISSA_DIGITS.saturating_sub(x.to_bits().trailing_zeros())
}

/// Return the least number of decimal digits that give this number. `text` is a work array.
fn decimal_digits(x: f64, text: &mut String) -> usize {
    text.clear();
    // Writing to a string cannot fail.
    let _ = write!(text, "{x:e}");
    text.bytes().take_while(|byte| *byte != b'e').filter(u8::is_ascii_digit).count()
}

/// Return whether a number is one of single precision, as printed with this number of decimal places in scientific
/// notation, or with as few as give it.
fn is_printed(x: f64, places: Option<usize>) -> bool {
    let single = x as f32;
    let text = match places {
        Some(places) => format!("{single:.places$e}"),
        None => format!("{single:e}"),
    };
    text.parse() == Ok(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points of a turned grid, written by `write` and read again.
    fn written(scale: f64, write: impl Fn(f64) -> String) -> f64 {
        let (sine, cosine) = 0.1f64.sin_cos();
        let turned = |i: usize| {
            let [x, y] = [(i % 9) as f64 * 0.25, (i / 9) as f64 * 0.25];
            [x * cosine - y * sine, x * sine + y * cosine].map(|x| write(scale * x).parse().expect("a number"))
        };
        uncertainty(&(0..81).map(turned).collect::<Vec<[f64; 2]>>())
    }

    /// The largest coordinate lies between 2 and 3, and ten times that.
    #[test]
    fn digits_of_files_are_found() {
        for digits in [6, 7, 8, 9, 12] {
            let half = 0.5 * 10f64.powi(1 - digits);
            let written = [1.0, 10.0].map(|scale| written(scale, |x| format!("{x:.*e}", digits as usize - 1)) / scale);
            assert!(written.iter().all(|found| (found / half - 1.0).abs() < 1e-9), "{digits}: {written:?}");
        }
        // The same number of places for all.
        assert!((written(1.0, |x| format!("{x:.6}")) / 0.5e-6 - 1.0).abs() < 1e-9);
        // Single precision has 23 places behind the first binary digit, which is that of 2.
        for text in
            [|x: f64| f64::from(x as f32).to_string(), |x| (x as f32).to_string(), |x| format!("{:.8e}", x as f32)]
        {
            assert_eq!(written(1.0, text), 2f64.powi(-23));
        }
    }

    #[test]
    fn doubles_and_drawn_numbers_are_exact() {
        assert_eq!(written(1.0, |x| x.to_string()), 0.0);
        let grid = |step: f64| (0..65).map(|i| [step * f64::from(i), 1.0 + step * f64::from(i)]).collect::<Vec<_>>();
        assert_eq!(uncertainty(&grid(1.0 / 64.0)), 0.0);
        assert_eq!(uncertainty(&grid(0.01)), 0.0);
        // One surface is drawn a little above another one.
        assert_eq!(uncertainty(&[[0.0, 1.0], [0.5, 1.000001], [1.0, 2.000001], [0.25, 0.75]]), 0.0);
        assert_eq!(uncertainty::<3>(&[]), 0.0);
    }
}
