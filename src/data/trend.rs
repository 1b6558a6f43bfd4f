//! The plane or parabola that fits heights best, and its subtraction.

use super::rule::Detrend;
use crate::linalg::bounds;
use nalgebra::{DMatrix, DVector};

/// A polynomial that was subtracted, by its derivatives at the middle of the data, in the units of the scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trend {
    /// First derivatives.
    pub slope: [f64; 2],
    /// Second derivatives by x, by x and y, and by y; zero for a plane.
    pub second: [f64; 3],
}

/// Subtract from the heights the polynomial that is nearest to them in the mean square, and return it. `places` gives the place of each
/// height. Heights that are NaN stay so, and do not count.
pub fn subtract(detrend: Detrend, places: impl Fn(usize) -> [f64; 2], heights: &mut [f64]) -> Option<Trend> {
    let terms = match detrend {
        Detrend::None => return None,
        Detrend::Plane => 3,
        Detrend::Parabola => 6,
    };
    let scale = Scale::new((0..heights.len()).map(&places));
    let (mut matrix, mut right) = (DMatrix::zeros(terms, terms), DVector::zeros(terms));
    for (k, height) in heights.iter().enumerate().filter(|(_, height)| !height.is_nan()) {
        let powers = scale.powers(places(k));
        for i in 0..terms {
            right[i] += powers[i] * height;
            (0..terms).for_each(|j| matrix[(i, j)] += powers[i] * powers[j]);
        }
    }
    // points on a line, or too few, leave terms undetermined: these become as small as possible
    let least = f64::EPSILON * heights.len() as f64;
    let found = matrix.svd(true, true).solve(&right, least).ok()?;
    for (k, height) in heights.iter_mut().enumerate() {
        let powers = scale.powers(places(k));
        *height -= (0..terms).map(|i| found[i] * powers[i]).sum::<f64>();
    }
    let term = |i: usize| if i < terms { found[i] } else { 0.0 };
    let [a, b] = scale.half;
    let second = [2.0 * term(3) / (a * a), term(4) / (a * b), 2.0 * term(5) / (b * b)];
    Some(Trend { slope: [term(1) / a, term(2) / b], second })
}

/// A map of the data to places from -1 to 1 in each direction, where powers are of one size.
struct Scale {
    middle: [f64; 2],
    half: [f64; 2],
}

impl Scale {
    fn new(places: impl Iterator<Item = [f64; 2]>) -> Self {
        let [low, high] = bounds(places);
        let half = [0, 1].map(|d| if high[d] > low[d] { 0.5 * (high[d] - low[d]) } else { 1.0 });
        Self { middle: [0, 1].map(|d| 0.5 * (low[d] + high[d])), half }
    }

    /// Return 1, x, y, x^2, xy, y^2 of a place.
    fn powers(&self, place: [f64; 2]) -> [f64; 6] {
        let [x, y] = [0, 1].map(|d| (place[d] - self.middle[d]) / self.half[d]);
        [1.0, x, y, x * x, x * y, y * y]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_are_found_and_subtracted() {
        let place = |k: usize| [100.0 + 0.5 * (k % 7) as f64, -3.0 + 2.0 * (k / 7) as f64];
        let parabola = |k: usize| {
            let [x, y] = [place(k)[0] - 101.5, place(k)[1] - 2.0];
            1.0 + 2.0 * x - 3.0 * y + 0.5 * x * x + 0.25 * x * y
        };
        let mut heights: Vec<f64> = (0..42).map(parabola).collect();
        heights[17] = f64::NAN;
        let found = subtract(Detrend::Parabola, place, &mut heights).expect("a trend");
        let error = [
            found.slope[0] - 2.0,
            found.slope[1] + 3.0,
            found.second[0] - 1.0,
            found.second[1] - 0.25,
            found.second[2],
        ];
        assert!(error.iter().all(|error| error.abs() < 1e-11), "{found:?}");
        assert!(heights[17].is_nan());
        assert!(heights.iter().filter(|height| !height.is_nan()).all(|height| height.abs() < 1e-11), "{heights:?}");
        // a profile, whose second coordinate is the same everywhere
        let mut line: Vec<f64> = (0..5).map(|k| 7.0 - 3.0 * f64::from(k)).collect();
        let along = |k: usize| [k as f64, 0.0];
        let found = subtract(Detrend::Plane, along, &mut line).expect("a trend");
        assert!((found.slope[0] + 3.0).abs() < 1e-12 && line.iter().all(|height| height.abs() < 1e-12), "{line:?}");
        assert_eq!(subtract(Detrend::None, along, &mut line), None);
    }
}
