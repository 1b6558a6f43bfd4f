//! The law given by a curve: a smooth increasing one through measured points.

use super::LayerLaw;
use crate::linalg::portable::hypot;

/// A monotone piecewise cubic curve through (0, 0) and points (c, p), continued as a straight line beyond the last one.
///
/// Slopes at the points are means of the secants on both sides. They are reduced as in Fritsch and Carlson (SIAM J.
/// Numer. Anal. 17, 1980) so that p' > 0 everywhere. The pressure p is then continuously differentiable and keeps the
/// order of the points.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// Points with their slopes and the energy up to them, from (0, 0) on.
    knots: Vec<Knot>,
}

/// Largest norm of the two slopes at the ends of a piece, as shares of its secant. It is three less a margin far above
/// rounding. With exactly three, a piece with a slope of zero at one end could fall below its end by rounding.
const STEEPEST: f64 = 3.0 - 1e-9;

#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Knot {
    c: f64,
    pressure: f64,
    slope: f64,
    energy: f64,
}

impl Table {
    /// Make a curve through at least one point (c, p). Both coordinates increase from (0, 0), which is not among the
    /// points.
    pub fn new(points: &[[f64; 2]]) -> Self {
        let mut knots = vec![Knot::default()];
        knots.extend(points.iter().map(|&[c, pressure]| Knot { c, pressure, ..Knot::default() }));
        let secants = secants(&knots);
        let last = secants.len() - 1;
        for (i, knot) in knots.iter_mut().enumerate() {
            knot.slope = 0.5 * (secants[i.saturating_sub(1)] + secants[i.min(last)]);
        }
        for (i, secant) in secants.iter().enumerate() {
            let size = hypot(knots[i].slope / secant, knots[i + 1].slope / secant);
            if size > STEEPEST {
                knots[i].slope *= STEEPEST / size;
                knots[i + 1].slope *= STEEPEST / size;
            }
        }
        for i in 0..secants.len() {
            knots[i + 1].energy = piece(&knots[i], &knots[i + 1], knots[i + 1].c)[2];
        }
        Self { knots }
    }

    /// Return p, p' and P at a compression up to the last knot. NaN is evaluated in the first piece and stays NaN.
    fn at(&self, c: f64) -> [f64; 3] {
        let above = self.knots.partition_point(|knot| knot.c <= c).max(1);
        let before = &self.knots[above - 1];
        match self.knots.get(above) {
            Some(next) => piece(before, next, c),
            None => [before.pressure, before.slope, before.energy],
        }
    }
}

fn secants(knots: &[Knot]) -> Vec<f64> {
    knots.windows(2).map(|two| (two[1].pressure - two[0].pressure) / (two[1].c - two[0].c)).collect()
}

/// Return p, p' and P of the curve between two knots at compression `c`.
fn piece(a: &Knot, b: &Knot, c: f64) -> [f64; 3] {
    let h = b.c - a.c;
    let s = (c - a.c) / h;
    // In the local coordinate s the pressure is p = p_a + h s (m_a + s (f + s g)), where m_a is the slope at knot a.
    let secant = (b.pressure - a.pressure) / h;
    let f = 3.0 * secant - 2.0 * a.slope - b.slope;
    let g = a.slope + b.slope - 2.0 * secant;
    [
        a.pressure + h * s * (a.slope + s * (f + s * g)),
        a.slope + s * (2.0 * f + 3.0 * s * g),
        a.energy + h * s * (a.pressure + h * s * (a.slope / 2.0 + s * (f / 3.0 + s * g / 4.0))),
    ]
}

impl LayerLaw for Table {
    fn pressure_and_tangent(&self, _point: usize, c: f64) -> (f64, f64) {
        let [pressure, tangent, _] = self.at(c);
        (pressure, tangent)
    }

    fn energy(&self, _point: usize, c: f64) -> f64 {
        self.at(c)[2]
    }

    fn end(&self, _point: usize) -> f64 {
        self.knots[self.knots.len() - 1].c
    }
}
