//! Laws given by a curve: a smooth increasing one through measured points, and that of a layer of asperities.

use super::numeric::integral;
use super::{LayerLaw, Response};
use crate::linalg::portable::{exp, hypot};
use crate::problem::layer::{AsperitySpec, Depths};
use std::f64::consts::PI;

/// A monotone piecewise cubic curve through (0, 0) and points (c, p), continued as a straight line beyond the last one.
///
/// Slopes at the points are means of the secants on both sides. They are reduced as in Fritsch and Carlson (SIAM J. Numer. Anal. 17,
/// 1980) so that p' > 0 everywhere. The pressure p is then continuously differentiable and keeps the order of the points.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// Points with their slopes and the energy up to them, from (0, 0) on.
    knots: Vec<Knot>,
    /// Compression up to which the curve is known; infinite if it comes from a formula.
    end: f64,
}

/// Largest norm of the two slopes at the ends of a piece, as shares of its secant. It is three less a margin far above rounding. With
/// exactly three, a piece with a slope of zero at one end could fall below its end by rounding.
const STEEPEST: f64 = 3.0 - 1e-9;

#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Knot {
    c: f64,
    pressure: f64,
    slope: f64,
    energy: f64,
}

impl Table {
    /// Make a curve through at least one point (c, p). Both coordinates increase from (0, 0), which is not among the points.
    pub fn new(points: &[[f64; 2]]) -> Self {
        let mut knots = vec![Knot::default()];
        knots.extend(points.iter().map(|&[c, pressure]| Knot { c, pressure, ..Knot::default() }));
        let secants = secants(&knots);
        let last = secants.len() - 1;
        for (i, knot) in knots.iter_mut().enumerate() {
            knot.slope = 0.5 * (secants[i.saturating_sub(1)] + secants[i.min(last)]);
        }
        let end = knots[last + 1].c;
        Self::through(knots, &secants, end)
    }

    /// Make the curve of a known function with p(0) = p'(0) = 0 from points (c, p, p') with increasing c and p. Its error is of fourth
    /// order in the distance of the points.
    pub fn with_slopes(points: impl Iterator<Item = [f64; 3]>) -> Self {
        let mut knots = vec![Knot::default()];
        // Points whose pressures are equal in double precision become one.
        for [c, pressure, slope] in points {
            if knots.last().is_some_and(|last| pressure > last.pressure) {
                knots.push(Knot { c, pressure, slope, ..Knot::default() });
            }
        }
        let secants = secants(&knots);
        Self::through(knots, &secants, f64::INFINITY)
    }

    /// Make the curve through knots with slopes, which are reduced where p would decrease.
    fn through(mut knots: Vec<Knot>, secants: &[f64], end: f64) -> Self {
        for (i, secant) in secants.iter().enumerate() {
            let size = hypot(knots[i].slope / secant, knots[i + 1].slope / secant);
            if size > STEEPEST {
                knots[i].slope *= STEEPEST / size;
                knots[i + 1].slope *= STEEPEST / size;
            }
        }
        for i in 0..secants.len() {
            knots[i + 1].energy = piece(&knots[i], &knots[i + 1], knots[i + 1].c).energy;
        }
        Self { knots, end }
    }
}

fn secants(knots: &[Knot]) -> Vec<f64> {
    knots.windows(2).map(|two| (two[1].pressure - two[0].pressure) / (two[1].c - two[0].c)).collect()
}

impl Knot {
    fn response(&self) -> Response {
        Response { pressure: self.pressure, tangent: self.slope, energy: self.energy }
    }
}

/// Return the response of the curve between two knots at compression `c`.
fn piece(a: &Knot, b: &Knot, c: f64) -> Response {
    let h = b.c - a.c;
    let s = (c - a.c) / h;
    // In the local coordinate s the pressure is p = p_a + h s (m_a + s (f + s g)), where m_a is the slope at knot a.
    let secant = (b.pressure - a.pressure) / h;
    let f = 3.0 * secant - 2.0 * a.slope - b.slope;
    let g = a.slope + b.slope - 2.0 * secant;
    Response {
        pressure: a.pressure + h * s * (a.slope + s * (f + s * g)),
        tangent: a.slope + s * (2.0 * f + 3.0 * s * g),
        energy: a.energy + h * s * (a.pressure + h * s * (a.slope / 2.0 + s * (f / 3.0 + s * g / 4.0))),
    }
}

impl LayerLaw for Table {
    fn compressed(&self, _point: usize, c: f64) -> Response {
        // NaN is evaluated in the first piece and stays NaN.
        let above = self.knots.partition_point(|knot| knot.c < c).max(1);
        let before = &self.knots[above - 1];
        match self.knots.get(above) {
            Some(next) => piece(before, next, c),
            None => before.response().straight(c - before.c),
        }
    }

    fn end(&self, _point: usize) -> f64 {
        self.end
    }
}

/// Number of even steps of the curve from first touch to its end.
///
/// A cubic piece of length h with exact slopes has an error of h^4/384 times the fourth derivative. For heights up to 4 standard deviations
/// h is a fiftieth of one. In the tail the law grows by e within a quarter of one, which gives (4/50)^4/384 = 1e-7.
const STEPS: f64 = 400.0;
/// Longest step as a share of the compression. Near first touch the law is like c^(5/2), whose fourth derivative is 0.94 c^(5/2)/c^4.
/// The relative error is then 0.12^4/384 times 0.94, which is 5e-7.
const SHARE: f64 = 0.12;
/// Number of standard deviations from the mean beyond which a normal distribution has less than 1e-16.
const BEYOND: f64 = 8.5;
/// First point of the curve as a share of an even step. Below it the law is a straight line, and pressures are under (1e-8)^(3/2) of the
/// pressure after one step.
const LEAST: f64 = 1e-8;

/// Return the law of a layer of asperities after Greenwood and Williamson (Proc. R. Soc. A 295, 1966) as a table with exact slopes at its points.
///
/// Summits of one radius have different heights.
/// Each is in Hertz' contact with a plane and does not interact with the others.
///
/// A layer that is compressed by c has
///
/// p(c) = 4/3 E* sqrt(R) eta int_0^c (c - s)^(3/2) f(s) ds,  p'(c) = 2 E* sqrt(R) eta int_0^c (c - s)^(1/2) f(s) ds,
///
/// where s is the depth of a summit below the highest one, f(s) the density of summits at this depth, eta their number per area, R their
/// radius, and E* the modulus of both bodies.
pub fn asperities(spec: &AsperitySpec) -> Table {
    let end = match &spec.depths {
        Depths::Normal { highest, .. } => 2.0 * highest,
        Depths::Measured(depths) => depths.last().copied().unwrap_or_default(),
    };
    // A single summit, or many of one height, have no extent of heights.
    let end = if end > 0.0 { end } else { spec.radius };
    let step = end / STEPS;
    // Once all summits touch, the law is smooth again, up to the compression at which they are flat.
    let next = |c: &f64| match *c {
        c if c < end => Some(c + step.min(SHARE * c)),
        c if c < spec.radius => Some(c * (1.0 + SHARE)),
        _ => None,
    };
    let compressions = std::iter::successors(Some(LEAST * step), next);
    let stiffness = spec.modulus * spec.radius.sqrt() * spec.density;
    let point = |c: f64| {
        let [pressure, slope] = moments(&spec.depths, c);
        [c, 4.0 / 3.0 * stiffness * pressure, 2.0 * stiffness * slope]
    };
    Table::with_slopes(compressions.map(point))
}

/// Return int_0^c (c - s)^power f(s) ds for the powers 3/2 and 1/2.
fn moments(depths: &Depths, c: f64) -> [f64; 2] {
    match depths {
        Depths::Normal { deviation, highest } => {
            let density = |s: f64| exp(-0.5 * ((highest - s) / deviation).powi(2)) / (deviation * (2.0 * PI).sqrt());
            // The substitution s = c - t^2 removes the root. The density beyond the limits is below double precision.
            let [from, to] = [highest + BEYOND * deviation, highest - BEYOND * deviation];
            let [from, to] = [from, to].map(|s| (c - s.clamp(0.0, c)).sqrt());
            [4, 2].map(|power| integral(&|t: f64| 2.0 * t.powi(power) * density(c - t * t), from, to))
        }
        Depths::Measured(depths) => {
            let touching = depths.iter().take_while(|&&depth| depth < c);
            let sums = touching.map(|depth| c - depth).fold([0.0; 2], |sums: [f64; 2], c| {
                let root = c.sqrt();
                [sums[0] + c * root, sums[1] + root]
            });
            sums.map(|sum| sum / depths.len() as f64)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    fn spec(depths: Depths) -> AsperitySpec {
        AsperitySpec { density: 300.0, radius: 0.02, modulus: 1e5, depths, data: None }
    }

    /// The curve agrees with sums of Hertz' closed form over many summits drawn one by one from the distribution.
    #[test]
    fn the_curve_is_the_sum_over_summits() {
        let (deviation, highest, many) = (1e-4, 4e-4, 400_000);
        let law = asperities(&spec(Depths::Normal { deviation, highest }));
        // Heights are at equal steps of probability, by the trapezoidal rule for the distribution function.
        let (mut depths, mut share, mut z) = (Vec::new(), 0.0, -highest);
        let h = 1e-4 * deviation;
        while z < highest && depths.len() < many {
            let density = |z: f64| (-0.5 * (z / deviation) * (z / deviation)).exp() / (deviation * (2.0 * PI).sqrt());
            share += 0.5 * h * (density(z) + density(z + h));
            z += h;
            while (depths.len() as f64 + 0.5) / many as f64 <= share {
                depths.push(highest - z);
            }
        }
        for c in [2.5e-4, 4e-4, 6e-4] {
            let hertz = |power: f64| depths.iter().map(|&s| (c - s).max(0.0).powf(power)).sum::<f64>() / many as f64;
            let stiffness = 1e5 * 0.02_f64.sqrt() * 300.0;
            let Response { pressure, tangent, .. } = law.response(0, c);
            let expected = [4.0 / 3.0 * stiffness * hertz(1.5), 2.0 * stiffness * hertz(0.5)];
            assert!((pressure / expected[0] - 1.0).abs() < 3e-3, "{c}: {pressure:e} {expected:?}");
            assert!((tangent / expected[1] - 1.0).abs() < 3e-3, "{c}: {tangent:e} {expected:?}");
        }
    }

    /// The curve agrees with the integrals between its points, from first touch on.
    #[test]
    fn the_curve_is_the_integral_between_its_points() {
        let depths = Depths::Normal { deviation: 1e-4, highest: 4e-4 };
        let law = asperities(&spec(depths.clone()));
        let stiffness = 4.0 / 3.0 * 1e5 * 0.02_f64.sqrt() * 300.0;
        for k in 0..70 {
            let c = 9e-3 * 10_f64.powf(-0.117 * f64::from(k));
            let exact = stiffness * moments(&depths, c)[0];
            let found = law.response(0, c).pressure;
            assert!((found / exact - 1.0).abs() < 1e-5, "{c:e}: {found:e} {exact:e}");
        }
    }

    /// One summit gives Hertz' contact without any distribution.
    #[test]
    fn one_summit_is_hertz() {
        let law = asperities(&spec(Depths::Measured(Arc::new([0.0]))));
        for c in [1e-7_f64, 3.3e-6, 1.7e-4, 5e-3] {
            let exact = 4.0 / 3.0 * 1e5 * 0.02_f64.sqrt() * 300.0 * c.powf(1.5);
            let found = law.response(0, c).pressure;
            assert!((found / exact - 1.0).abs() < 1e-5, "{c}: {found} {exact}");
            assert!((law.compression(0, found) / c - 1.0).abs() < 1e-12);
        }
    }
}
