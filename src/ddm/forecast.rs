//! Estimates of the iterations that a run would still need, from the spectrum of G^-1 F1'' and the method's own rate.

use super::history::Row;
use crate::linalg::portable::{log, pow};

/// An estimate of the iterations to come.
#[derive(Debug, Clone, PartialEq)]
pub struct Forecast {
    /// Factor by which an iteration reduces the residual in the long run; 1 or more where it does not.
    pub factor: f64,
    /// Iterations from the last iterate to the residual that was asked for; infinite if it is never reached.
    pub iterations: f64,
}

/// Iterations whose mean factor is used for a method without a rate of its own.
const RECENT: usize = 10;

impl Forecast {
    /// Estimate from the history of a run, the residual that was asked for, and the method's own factor if it has one.
    pub fn new(rows: &[Row], target: f64, factor: Option<f64>) -> Option<Self> {
        let last = rows.last()?.residual;
        let seen = || {
            let before = rows.len().checked_sub(RECENT + 1)?;
            Some(pow(last / rows[before].residual, 1.0 / RECENT as f64))
        };
        let factor = match (factor, seen()) {
            // a mode that grows from a small amplitude appears in the history before it appears in the spectrum
            (Some(own), Some(seen)) if seen >= 1.0 => own.max(seen),
            (own, seen) => own.or(seen)?,
        };
        if !factor.is_finite() {
            return None;
        }
        let gain = target / last;
        let iterations = match factor {
            _ if gain >= 1.0 => 0.0,
            factor if factor >= 1.0 => f64::INFINITY,
            // a thousandth of an iteration counts as rounding
            factor => (log(gain) / log(factor) - 1e-3).ceil(),
        };
        (!iterations.is_nan()).then_some(Self { factor, iterations })
    }
}

/// Return the factor of a relaxed iteration with this gamma: the largest |1 - gamma lambda| over the spectrum (low, high).
pub fn relaxed_factor(gamma: f64, (low, high): (f64, f64)) -> f64 {
    (1.0 - gamma * low).abs().max((1.0 - gamma * high).abs())
}

/// Return the gamma with the least such factor.
pub fn best_gamma((low, high): (f64, f64)) -> f64 {
    2.0 / (low + high)
}

/// Return that factor, (kappa - 1)/(kappa + 1) with the condition number kappa. An exact line search has the same factor in the worst case.
pub fn best_factor(spectrum: (f64, f64)) -> f64 {
    relaxed_factor(best_gamma(spectrum), spectrum)
}

/// Return the factor of conjugate gradients, (sqrt kappa - 1)/(sqrt kappa + 1).
pub fn gradients_factor((low, high): (f64, f64)) -> f64 {
    let root = (high / low).sqrt();
    (root - 1.0) / (root + 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(factor: f64, count: i32) -> Vec<Row> {
        (0..=count).map(|k| Row { residual: factor.powi(k), ..Row::default() }).collect()
    }

    /// The closed forms of two modes 1 -+ theta.
    #[test]
    fn factors_of_two_modes() {
        let theta = 0.6;
        let spectrum = (1.0 - theta, 1.0 + theta);
        assert!((best_gamma(spectrum) - 1.0).abs() < 1e-15 && (best_factor(spectrum) - theta).abs() < 1e-15);
        assert!((relaxed_factor(0.5, spectrum) - 0.8).abs() < 1e-15);
        assert!((relaxed_factor(1.5, spectrum) - 1.4).abs() < 1e-15);
        // sqrt(1.6/0.4) = 2
        assert!((gradients_factor(spectrum) - 1.0 / 3.0).abs() < 1e-15);
    }

    #[test]
    fn iterations_follow_from_the_factor() {
        let left = |factor: Option<f64>| Forecast::new(&rows(0.1, 3), 1e-8, factor);
        assert_eq!(left(Some(0.1)).map(|f| f.iterations), Some(5.0));
        assert_eq!(left(Some(0.01)).map(|f| f.iterations), Some(3.0));
        assert_eq!(left(Some(1.2)).map(|f| f.iterations), Some(f64::INFINITY));
        // a residual that rises will not fall, whatever the spectrum says
        let risen = Forecast::new(&rows(1.1, 12), 1e-8, Some(0.8)).expect("a forecast");
        assert!((risen.factor - 1.1).abs() < 1e-12 && risen.iterations == f64::INFINITY, "{risen:?}");
        // a short history gives no factor, a longer one its mean
        assert_eq!(left(None), None);
        let seen = Forecast::new(&rows(0.5, 20), 0.5f64.powi(24), None).expect("a forecast");
        assert!((seen.factor - 0.5).abs() < 1e-12 && (4.0..=5.0).contains(&seen.iterations), "{seen:?}");
        assert_eq!(Forecast::new(&rows(0.1, 9), 1e-8, Some(0.1)).map(|f| f.iterations), Some(0.0));
    }
}
