//! The law of a layer in a problem with scaled loads.

use super::{LayerLaw, Response};
use std::rc::Rc;

/// The law p(s c)/s for a law p and a factor s > 0.
///
/// If bodies under s times their loads have displacements that are divided by s, these satisfy the equations of the full loads.
/// This is then the law of the layer between them.
#[derive(Debug)]
pub struct Scaled {
    /// The law p.
    pub law: Rc<dyn LayerLaw>,
    /// The factor s.
    pub factor: f64,
}

impl LayerLaw for Scaled {
    fn compressed(&self, point: usize, c: f64) -> Response {
        let s = self.factor;
        let Response { pressure, tangent, energy } = self.law.compressed(point, s * c);
        Response { pressure: pressure / s, tangent, energy: energy / (s * s) }
    }

    fn pressure(&self, point: usize, c: f64) -> f64 {
        self.law.pressure(point, self.factor * c) / self.factor
    }

    fn pressure_and_tangent(&self, point: usize, c: f64) -> (f64, f64) {
        let (pressure, tangent) = self.law.pressure_and_tangent(point, self.factor * c);
        (pressure / self.factor, tangent)
    }

    fn meet_loaded(&self, point: usize, s: f64, rho: f64) -> f64 {
        self.law.meet(point, self.factor * s, rho) / self.factor
    }

    fn compression_loaded(&self, point: usize, pressure: f64) -> f64 {
        self.law.compression(point, self.factor * pressure) / self.factor
    }

    fn gap_loaded(&self, point: usize, c: f64, pressure: f64) -> f64 {
        let s = self.factor;
        self.law.duality_gap(point, s * c, s * pressure) / (s * s)
    }

    fn end(&self, point: usize) -> f64 {
        self.law.end(point) / self.factor
    }
}
