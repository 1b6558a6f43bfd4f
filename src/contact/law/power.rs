//! Power law of a rough surface.

use super::gap::exp_less_line;
use super::{LayerLaw, Response};
use crate::linalg::portable::{exp, log, log1p, pow};

/// Value of log((c + p/rho)/s) below which the next error, of fourth order, is rounding. For exponents up to 50 even 1e-4
/// would leave 1e-14.
const SETTLED: f64 = 1e-5;
/// Largest number of steps. The worst start needs 3, for exponents of 3 to 50.
const MOST: usize = 12;

/// The law p(c) = (c/B)^(1/a) of the rough surface in the paper's numerical section.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Power {
    b: f64,
    exponent: f64,
}

impl Power {
    /// Make the law from the compression B > 0 at unit pressure and 0 < a <= 1.
    pub fn new(b: f64, a: f64) -> Self {
        Self { b, exponent: 1.0 / a }
    }
}

impl LayerLaw for Power {
    fn compressed(&self, _point: usize, c: f64) -> Response {
        let pressure = pow(c / self.b, self.exponent);
        Response {
            pressure,
            // For a = 1 the tangent is exactly constant, so that a settled contact set changes no matrix.
            tangent: if self.exponent == 1.0 { 1.0 / self.b } else { self.exponent * pressure / c },
            energy: pressure * c / (self.exponent + 1.0),
        }
    }

    fn meet_loaded(&self, _point: usize, s: f64, rho: f64) -> f64 {
        let m = self.exponent;
        if m == 1.0 {
            return s / (1.0 + 1.0 / self.b / rho);
        }
        if m == 2.0 {
            return 2.0 * s / (1.0 + (1.0 + 4.0 * (s / self.b) / self.b / rho).sqrt());
        }
        // Householder's method of fourth order solves for log c with the function log(c + p(c)/rho), whose derivatives cost
        // nothing. It starts at the smaller of the c that p = 0 and c = 0 would give. The sum is between s and 2 s there.
        let pressure_over_rho = |c: f64| pow(c / self.b, m) / rho;
        let all_pressure = self.compression_loaded(0, rho * s);
        let (mut c, mut p_rho) = if s < all_pressure { (s, pressure_over_rho(s)) } else { (all_pressure, s) };
        // The start `all_pressure` has the rounding of an inverse, so the method must not stop there.
        let mut exact = s < all_pressure;
        for _ in 0..MOST {
            let sum = c + p_rho;
            let excess = log(sum / s);
            let share = p_rho / sum;
            let slope = 1.0 + (m - 1.0) * share;
            let second = (m - 1.0).powi(2) * share * (1.0 - share);
            let third = second * (m - 1.0) * (1.0 - 2.0 * share);
            let newton = excess / slope;
            let (bend, twist) = (0.5 * newton * second / slope, newton * newton * third / (6.0 * slope));
            c *= exp(-newton * (1.0 - bend) / (1.0 - 2.0 * bend + twist));
            if exact && excess.abs() < SETTLED {
                break;
            }
            (p_rho, exact) = (pressure_over_rho(c), true);
        }
        c
    }

    fn compression_loaded(&self, _point: usize, pressure: f64) -> f64 {
        self.b * pow(pressure, 1.0 / self.exponent)
    }

    fn gap_loaded(&self, point: usize, c: f64, pressure: f64) -> f64 {
        let (m, at_c) = (self.exponent, self.pressure(point, c));
        let excess = (at_c - pressure) / pressure;
        if excess.abs() < 0.5 {
            // With u = log(p(c)/p) the gap is c p (e^u - 1 + m (e^(-u/m) - 1))/(m + 1), whose terms of first order cancel.
            let u = log1p(excess);
            c * pressure * (exp_less_line(u) + m * exp_less_line(-u / m)) / (m + 1.0)
        } else {
            (c * at_c + m * self.compression_loaded(point, pressure) * pressure) / (m + 1.0) - c * pressure
        }
    }
}
