//! Linear law.

use super::{LayerLaw, Response};

/// The law p(c) = stiffness * c.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Linear {
    /// Pressure per unit of compression, > 0.
    pub stiffness: f64,
}

impl LayerLaw for Linear {
    fn compressed(&self, _point: usize, c: f64) -> Response {
        Response { pressure: self.stiffness * c, tangent: self.stiffness, energy: 0.5 * self.stiffness * c * c }
    }

    fn meet_loaded(&self, _point: usize, s: f64, rho: f64) -> f64 {
        s / (1.0 + self.stiffness / rho)
    }

    fn compression_loaded(&self, _point: usize, pressure: f64) -> f64 {
        pressure / self.stiffness
    }

    fn gap_loaded(&self, _point: usize, c: f64, pressure: f64) -> f64 {
        let excess = self.stiffness * c - pressure;
        0.5 * excess * (excess / self.stiffness)
    }
}
