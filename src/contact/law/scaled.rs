//! A layer as a smaller load sees it.

use super::{LayerLaw, Response};
use std::rc::Rc;

/// p(s c)/s for a law p and a factor s > 0.
///
/// With displacements measured in shares s of themselves, bodies under s times their loads have the equations of the full loads,
/// and this is the layer between them.
#[derive(Debug)]
pub struct Scaled {
    /// The law p.
    pub law: Rc<dyn LayerLaw>,
    /// s.
    pub factor: f64,
}

impl LayerLaw for Scaled {
    fn compressed(&self, point: usize, c: f64) -> Response {
        let s = self.factor;
        let Response { pressure, tangent, energy } = self.law.compressed(point, s * c);
        Response { pressure: pressure / s, tangent, energy: energy / (s * s) }
    }
}
