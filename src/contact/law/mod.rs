//! Laws of Winkler layers: pressure against compression.
//!
//! The paper writes sigma_n = g(w) with w = -c; here p(c) = -g(-c). A law is monotone with p(0) = 0 and a
//! bounded tangent on bounded ranges, conditions (6)-(7). A new law is a new file and a line in [`make`].

mod linear;
mod power;

pub use linear::Linear;
pub use power::Power;

use crate::scene::LayerSpec;

/// Answer of a layer at one point.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Response {
    /// p(c), force per area.
    pub pressure: f64,
    /// p'(c).
    pub tangent: f64,
    /// P(c), the integral of p from 0 to c: energy per area.
    pub energy: f64,
}

/// A layer's law at the points of one pair.
pub trait LayerLaw: std::fmt::Debug {
    /// Response at contact point `point` to a compression `c > 0`.
    fn compressed(&self, point: usize, c: f64) -> Response;

    /// Response to any compression: nothing for `c <= 0`, where the layer is open; NaN stays NaN.
    fn response(&self, point: usize, c: f64) -> Response {
        if c <= 0.0 { Response::default() } else { self.compressed(point, c) }
    }

    /// g'(-c) of (38): the tangent of the paper's law g, which also runs through tension as an odd function. For `c > 0` it is
    /// p'(c). Robin terms of open points use it; pressure never does.
    fn robin_tangent(&self, point: usize, c: f64) -> f64 {
        self.response(point, c.abs()).tangent
    }
}

/// The law that a scene asks for.
pub fn make(spec: &LayerSpec) -> Box<dyn LayerLaw> {
    match *spec {
        LayerSpec::Power { b, a } => Box::new(Power::new(b, a)),
        LayerSpec::Linear { stiffness } => Box::new(Linear { stiffness }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every law must be its own energy's derivative, and its tangent its pressure's.
    fn check(law: &dyn LayerLaw, scale: f64) {
        assert_eq!(law.response(0, 0.0), Response::default());
        assert_eq!(law.response(0, -scale), Response::default());
        assert!(law.response(0, f64::NAN).pressure.is_nan());
        let mut last = 0.0;
        for step in 1..40 {
            let c = scale * 0.1 * step as f64;
            let h = 1e-5 * c;
            let (minus, here, plus) = (law.response(0, c - h), law.response(0, c), law.response(0, c + h));
            let slope = (plus.pressure - minus.pressure) / (2.0 * h);
            let work = (plus.energy - minus.energy) / (2.0 * h);
            assert!((slope / here.tangent - 1.0).abs() < 1e-7, "{law:?} at {c}: p' {slope} {here:?}");
            assert!((work / here.pressure - 1.0).abs() < 1e-7, "{law:?} at {c}: P' {work} {here:?}");
            assert!(here.pressure > last, "{law:?} is not increasing at {c}");
            last = here.pressure;
        }
    }

    #[test]
    fn laws_are_consistent() {
        for a in [0.1, 0.3, 0.5, 1.0] {
            check(&Power::new(2.5e-5, a), 5e-5);
        }
        check(&Linear { stiffness: 1e5 }, 1e-4);
        // V1: a closing of B q^a carries q
        let (b, a, q) = (2.5e-5, 0.5, 10.0f64);
        let p = Power::new(b, a).response(0, b * q.powf(a)).pressure;
        assert!((p - q).abs() < 1e-13);
    }
}
