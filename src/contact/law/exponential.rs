//! Exponential law.

use super::gap::{by_quadrature, exp_less_line};
use super::root::meeting;
use super::{LayerLaw, Response};
use crate::linalg::portable::{exp, expm1, log1p};

/// The law p(c) = p0 (e^(c/c0) - 1), continued as a straight line beyond c = 60 c0. No load compresses a layer so far, but trial
/// states do, and their values must stay finite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Exponential {
    p0: f64,
    c0: f64,
    /// Compression from which the law is a straight line.
    end: f64,
    at_end: Response,
}

/// Ratio c/c0 beyond which the law is a straight line.
const LINE: f64 = 60.0;

impl Exponential {
    /// Make the law from a pressure p0 > 0 and the compression c0 > 0 over which the slope grows by e.
    pub fn new(p0: f64, c0: f64) -> Self {
        let mut law = Self { p0, c0, end: LINE * c0, at_end: Response::default() };
        law.at_end = law.compressed(0, law.end);
        law
    }
}

impl LayerLaw for Exponential {
    fn compressed(&self, _point: usize, c: f64) -> Response {
        let s = (c / self.c0).min(LINE);
        let growth = expm1(s);
        let curve = Response {
            pressure: self.p0 * growth,
            tangent: self.p0 / self.c0 * exp(s),
            energy: self.p0 * self.c0 * exp_less_line(s),
        };
        if c <= self.end { curve } else { curve.straight(c - self.end) }
    }

    fn meet_loaded(&self, point: usize, s: f64, rho: f64) -> f64 {
        let beyond = self.at_end.straight_meet(self.end, s, rho);
        if beyond > 0.0 {
            return self.end + beyond;
        }
        // The start is the smaller of the c that p = 0 and c = 0 would give. The sum c + p/rho is between s and 2 s there.
        let start = s.min(self.compression_loaded(point, rho * s));
        meeting(s, rho, [0.0, s.min(self.end)], start, |c| self.pressure_and_tangent(point, c))
    }

    fn compression_loaded(&self, _point: usize, pressure: f64) -> f64 {
        match pressure <= self.at_end.pressure {
            true => self.c0 * log1p(pressure / self.p0),
            false => self.end + self.at_end.straight_compression(pressure),
        }
    }

    fn gap_loaded(&self, point: usize, c: f64, pressure: f64) -> f64 {
        if c > self.end || pressure > self.at_end.pressure {
            let (law, tangent) = (|c| self.pressure(point, c), |c| self.pressure_and_tangent(point, c).1);
            return by_quadrature(c, pressure, self.compression(point, pressure), law, tangent);
        }
        // The gap is (p + p0) c0 (e^d - 1 - d), where d is the distance of c from the graph in units of c0.
        let slope = pressure + self.p0;
        let distance = log1p((self.pressure(point, c) - pressure) / slope);
        slope * self.c0 * exp_less_line(distance)
    }
}
