//! Linear layer.

use super::{LayerLaw, Response};

/// p(c) = stiffness * c.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Linear {
    /// Pressure per unit of compression, > 0.
    pub stiffness: f64,
}

impl LayerLaw for Linear {
    fn compressed(&self, _point: usize, c: f64) -> Response {
        Response { pressure: self.stiffness * c, tangent: self.stiffness, energy: 0.5 * self.stiffness * c * c }
    }
}
