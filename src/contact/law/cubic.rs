//! Cubic law.

use super::{LayerLaw, Response};
use crate::linalg::portable::cbrt;

/// The law p(c) = k1 c + k3 c^3 of a layer that hardens.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cubic {
    /// Pressure per unit of compression at first touch, > 0.
    pub k1: f64,
    /// Pressure per cube of compression, >= 0.
    pub k3: f64,
}

impl Cubic {
    /// Return the c > 0 with k1 c + k3 c^3 = target > 0, for a k1 that need not be the law's.
    fn root(self, k1: f64, target: f64) -> f64 {
        // Without one of the terms c is larger. From there Newton's iterates decrease, since the function is convex.
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

/// Largest number of Newton steps. The worst start, at twice the target, needs 4, and the limit also ends steps of rounding.
const MOST: usize = 8;
/// Relative step at which Newton's method stops. The next step would be its square, which is rounding.
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
        // The difference of compressions follows from that of pressures, since direct subtraction may lose all digits.
        let secant = k1 + k3 * (c * c + c * on_graph + on_graph * on_graph);
        let distance = (self.pressure(point, c) - pressure) / secant;
        distance * distance * (0.5 * k1 + k3 * (1.5 * on_graph * on_graph + distance * (on_graph + 0.25 * distance)))
    }
}
