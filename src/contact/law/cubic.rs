//! Cubic layer.

use super::{LayerLaw, Response};
use crate::linalg::portable::cbrt;

/// p(c) = k1 c + k3 c^3: a linear layer that hardens.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cubic {
    /// Pressure per unit of compression at first touch, > 0.
    pub k1: f64,
    /// Hardening, >= 0: pressure per cube of compression.
    pub k3: f64,
}

impl Cubic {
    /// The c > 0 with k1 c + k3 c^3 = target > 0, for a k1 that need not be the law's.
    fn root(self, k1: f64, target: f64) -> f64 {
        // without one of the terms c is larger: Newton falls from there, the function is convex
        let mut c = (target / k1).min(cbrt(target / self.k3));
        for _ in 0..MOST {
            let square = c * c;
            let step = (c * (k1 + self.k3 * square) - target) / (k1 + 3.0 * self.k3 * square);
            c -= step;
            if step.abs() <= SETTLED * c {
                break;
            }
        }
        c
    }
}

/// Newton steps at most: 4 from the worst start, twice the target, and rounding can never hold up more.
const MOST: usize = 8;
/// Relative step that leaves an error of rounding: the next would be its square.
const SETTLED: f64 = 1e-8;

impl LayerLaw for Cubic {
    fn compressed(&self, _point: usize, c: f64) -> Response {
        let (k1, k3, square) = (self.k1, self.k3, c * c);
        Response {
            pressure: c * (k1 + k3 * square),
            tangent: k1 + 3.0 * k3 * square,
            energy: square * (0.5 * k1 + 0.25 * k3 * square),
        }
    }

    fn meet_loaded(&self, _point: usize, s: f64, rho: f64) -> f64 {
        self.root(rho + self.k1, rho * s)
    }

    fn compression_loaded(&self, _point: usize, pressure: f64) -> f64 {
        self.root(self.k1, pressure)
    }

    fn gap_loaded(&self, point: usize, c: f64, pressure: f64) -> f64 {
        let (k1, k3, on_graph) = (self.k1, self.k3, self.root(self.k1, pressure));
        // p(c) - p is divided by the difference of compressions, which rounding may have taken
        let secant = k1 + k3 * (c * c + c * on_graph + on_graph * on_graph);
        let way = (self.pressure(point, c) - pressure) / secant;
        way * way * (0.5 * k1 + k3 * (1.5 * on_graph * on_graph + way * (on_graph + 0.25 * way)))
    }
}
