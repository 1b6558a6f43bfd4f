//! Points without a height, and heights that look like such points.

use super::rows::Rows;
use super::rule::{DataSpec, Fill};
use crate::error::{Result, shown};

/// Return the number of points without a height.
///
/// # Errors
/// Points without a height, if the scene does not say how to fill them; a suspicious height, if the scene does not name what stands for
/// points without one.
pub fn count(spec: &DataSpec, rows: &Rows) -> Result<usize> {
    let total = heights(spec, rows).count();
    let missing = heights(spec, rows).filter(|height| height.is_nan()).count();
    if missing > 0 && missing == total {
        let what = format!("has no height at any of its {total} points");
        return Err(spec.refuse(what, "look at `missing`, and at the file"));
    }
    if missing > 0 && spec.fill == Fill::Error {
        let what =
            format!("has no height at {missing} of {total} points, the first {}", place(spec, rows, f64::is_nan));
        let help = "write fill = \"linear\" or \"nearest\", or fill the gaps with the program of the instrument";
        return Err(spec.refuse(what, help));
    }
    let suspect = if spec.missing.is_none() { suspect(|| heights(spec, rows)) } else { None };
    let Some(Suspect { value, count, others }) = suspect else { return Ok(missing) };
    let [low, high, number] = [others[0], others[1], value].map(shown);
    let first = place(spec, rows, |height| height == value);
    let what =
        format!("has {number} at {count} of {total} points, the first {first}; all others are from {low} to {high}");
    let help = format!(
        "if {number} stands for a point without a height, write missing = {number} and fill = \"linear\" or \"nearest\"; if it is a \
         height, write missing = []"
    );
    Err(spec.refuse(what, &help))
}

/// Return all heights in the order of the file.
fn heights<'a>(spec: &DataSpec, rows: &'a Rows) -> impl Iterator<Item = f64> + use<'a> {
    let first = rows.first_height(spec.points);
    rows.values.chunks(rows.columns.max(1)).flat_map(move |row| row[first..].iter().copied())
}

/// Return, as a text, where in the file the first such height is.
fn place(spec: &DataSpec, rows: &Rows, is_such: impl Fn(f64) -> bool) -> String {
    let wide = rows.columns.max(1) - rows.first_height(spec.points);
    let at = heights(spec, rows).position(is_such).unwrap_or(0);
    format!("in {}, column {} (from 0)", rows.line(at / wide), rows.first_height(spec.points) + at % wide)
}

/// A height that probably stands for no height.
#[derive(Debug, PartialEq)]
struct Suspect {
    value: f64,
    count: usize,
    /// The least and the largest of all other heights.
    others: [f64; 2],
}

/// Least number of different other heights in a file that is taken as measured: three bits, fewer than any instrument has. A step that is
/// written by hand is a table of a few numbers.
const LEVELS: usize = 8;

/// How far a single height must be from all others, as a multiple of their range. A picture of the surface to three digits then shows this
/// one spike and nothing else.
const SPIKE: f64 = 1e3;

/// Return a height that probably stands for points without one; none if there is none.
///
/// It is the least or the largest height, and it is farther from all others than these are from each other. A real step of this height would
/// pass the whole gap between two neighbouring points, everywhere along its flank. Measured heights also do not repeat to the last digit,
/// unless they have few digits, and then they do so close to each other. A height that occurs once must be [`SPIKE`] times as far away.
fn suspect<I: Iterator<Item = f64>>(heights: impl Fn() -> I) -> Option<Suspect> {
    let finite = || heights().filter(|height| !height.is_nan());
    let [low, high] = range(finite());
    [low, high].into_iter().find_map(|value| {
        let others = || finite().filter(|&height| height != value);
        let [least, largest] = range(others());
        let count = finite().filter(|&height| height == value).count();
        let distance = (least - value).max(value - largest);
        let far = if count == 1 { SPIKE * (largest - least) } else { largest - least };
        (distance > far && has_levels(others())).then_some(Suspect { value, count, others: [least, largest] })
    })
}

/// Return the least and the largest number.
fn range(numbers: impl Iterator<Item = f64>) -> [f64; 2] {
    numbers.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], number| [low.min(number), high.max(number)])
}

/// Return whether there are at least [`LEVELS`] different heights.
fn has_levels(heights: impl Iterator<Item = f64>) -> bool {
    let mut levels: Vec<f64> = Vec::new();
    for height in heights {
        if !levels.contains(&height) {
            levels.push(height);
        }
        if levels.len() == LEVELS {
            return true;
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Waves of range 2, with some heights replaced.
    fn waves(replaced: &[(usize, f64)]) -> Option<Suspect> {
        let mut heights: Vec<f64> = (0..100).map(|k| (0.37 * f64::from(k)).sin()).collect();
        replaced.iter().for_each(|&(at, height)| heights[at] = height);
        suspect(|| heights.iter().copied())
    }

    #[test]
    fn values_far_from_all_others_are_suspicious() {
        for value in [-9999.0, 1e38, -32768.0, 4.0, -4.0] {
            let found = waves(&[(3, value), (77, value)]).expect("suspicious");
            assert_eq!((found.value, found.count), (value, 2));
        }
        assert_eq!(waves(&[(3, -9999.0)]).map(|found| found.count), Some(1));
        // nearer than the others are to each other, or alone
        assert_eq!(waves(&[]), None);
        assert_eq!(waves(&[(3, 2.9), (77, 2.9)]), None);
        assert_eq!(waves(&[(3, 50.0)]), None);
        // a step by hand
        let step = [0.0, 0.0, 0.0, 0.1, 5.0, 5.0, 5.0, 5.0, 5.0, 5.0];
        assert_eq!(suspect(|| step.into_iter()), None);
        assert_eq!(waves(&[(3, f64::NAN), (77, f64::NAN)]), None);
    }
}
