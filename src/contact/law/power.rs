//! Power law of a rough surface.

use super::{LayerLaw, Response};

/// p(c) = (c/B)^(1/a): roughness in the paper's numerical section.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Power {
    b: f64,
    exponent: f64,
}

impl Power {
    /// B > 0 is the closing at unit pressure, 0 < a <= 1.
    pub fn new(b: f64, a: f64) -> Self {
        Self { b, exponent: 1.0 / a }
    }
}

impl LayerLaw for Power {
    fn compressed(&self, _point: usize, c: f64) -> Response {
        let pressure = (c / self.b).powf(self.exponent);
        Response {
            pressure, // exact for a = 1, so that a settled contact set changes no matrix
            tangent: if self.exponent == 1.0 { 1.0 / self.b } else { self.exponent * pressure / c },
            energy: pressure * c / (self.exponent + 1.0),
        }
    }
}
