//! Exponential layer.

use super::{LayerLaw, Response};

/// p(c) = p0 (e^(c/c0) - 1), continued as a straight line beyond e^60: no load gets there, but trial states do, and
/// their numbers must stay finite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Exponential {
    p0: f64,
    c0: f64,
}

/// c/c0 beyond which the law is a straight line.
const LINE: f64 = 60.0;

impl Exponential {
    /// p0 > 0 is a pressure, c0 > 0 the compression over which the slope grows by e.
    pub fn new(p0: f64, c0: f64) -> Self {
        Self { p0, c0 }
    }
}

impl LayerLaw for Exponential {
    fn compressed(&self, _point: usize, c: f64) -> Response {
        let s = (c / self.c0).min(LINE);
        let beyond = c - s * self.c0;
        let growth = s.exp_m1();
        // e^s - 1 - s loses all digits where s is small
        let work = if s < 1e-2 {
            s * s * (0.5 + s * (1.0 / 6.0 + s * (1.0 / 24.0 + s * (1.0 / 120.0 + s / 720.0))))
        } else {
            growth - s
        };
        let curve = Response {
            pressure: self.p0 * growth,
            tangent: self.p0 / self.c0 * s.exp(),
            energy: self.p0 * self.c0 * work,
        };
        if c <= LINE * self.c0 { curve } else { curve.straight(beyond) }
    }
}
