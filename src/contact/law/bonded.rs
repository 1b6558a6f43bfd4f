//! The law of a bonded layer, which pulls where it is stretched.

use super::{LayerLaw, Response};
use std::rc::Rc;

/// The paper's law g without its cut at zero: p(c) of one law for c > 0, and -p(-c) of another law, or of the same one,
/// for c < 0.
#[derive(Debug)]
pub struct Bonded {
    /// The law for c > 0.
    pub compression: Rc<dyn LayerLaw>,
    /// The law for c < 0, of the stretch -c.
    pub tension: Rc<dyn LayerLaw>,
}

impl Bonded {
    /// Return the law of a side, and the sign of compressions and pressures there.
    fn side(&self, c: f64) -> (&dyn LayerLaw, f64) {
        if c < 0.0 { (&*self.tension, -1.0) } else { (&*self.compression, 1.0) }
    }

    /// Return the tangent between compression and tension; it is zero for laws that begin without stiffness.
    fn at_rest(&self, point: usize) -> f64 {
        let tangent = self.compression.pressure_and_tangent(point, 0.0).1;
        if tangent.is_finite() { tangent } else { 0.0 }
    }
}

impl LayerLaw for Bonded {
    fn compressed(&self, point: usize, c: f64) -> Response {
        self.response(point, c)
    }

    fn response(&self, point: usize, c: f64) -> Response {
        let (law, sign) = self.side(c);
        match law.response(point, sign * c) {
            _ if c == 0.0 => Response { tangent: self.at_rest(point), ..Response::default() },
            Response { pressure, tangent, energy } => Response { pressure: sign * pressure, tangent, energy },
        }
    }

    fn is_bonded(&self) -> bool {
        true
    }

    fn pressure(&self, point: usize, c: f64) -> f64 {
        let (law, sign) = self.side(c);
        sign * law.pressure(point, sign * c)
    }

    fn pressure_and_tangent(&self, point: usize, c: f64) -> (f64, f64) {
        if c == 0.0 {
            return (0.0, self.at_rest(point));
        }
        let (law, sign) = self.side(c);
        let (pressure, tangent) = law.pressure_and_tangent(point, sign * c);
        (sign * pressure, tangent)
    }

    fn end(&self, point: usize) -> f64 {
        self.compression.end(point)
    }

    fn end_in_tension(&self, point: usize) -> f64 {
        self.tension.end(point)
    }

    fn robin_tangent(&self, point: usize, c: f64) -> f64 {
        self.response(point, c).tangent
    }

    fn resolvent(&self, point: usize, s: f64, rho: f64) -> f64 {
        let (law, sign) = self.side(s);
        sign * law.resolvent(point, sign * s, rho)
    }

    fn compression(&self, point: usize, pressure: f64) -> f64 {
        // Both graphs pass through the origin, so that pressures have the signs of compressions.
        let (law, sign) = self.side(pressure);
        sign * law.compression(point, sign * pressure)
    }
}
