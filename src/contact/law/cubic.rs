//! Cubic layer.

use super::{LayerLaw, Response};

/// p(c) = k1 c + k3 c^3: a linear layer that hardens.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cubic {
    /// Pressure per unit of compression at first touch, > 0.
    pub k1: f64,
    /// Hardening, >= 0: pressure per cube of compression.
    pub k3: f64,
}

impl LayerLaw for Cubic {
    fn compressed(&self, _point: usize, c: f64) -> Response {
        let (k1, k3, square) = (self.k1, self.k3, c * c);
        Response {
            pressure: c * (k1 + k3 * square),
            tangent: k1 + 3.0 * k3 * square,
            energy: square * (0.5 * k1 + 0.25 * k3 * square),
        }
    }
}
