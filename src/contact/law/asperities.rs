//! Layer of asperities after Greenwood and Williamson (Proc. R. Soc. A 295, 1966). Summits of one radius have different heights.
//! Each is in Hertz' contact with a plane and does not interact with the others.
//!
//! A layer that is compressed by c has
//!
//! p(c) = 4/3 E* sqrt(R) eta int_0^c (c - s)^(3/2) f(s) ds,  p'(c) = 2 E* sqrt(R) eta int_0^c (c - s)^(1/2) f(s) ds,
//!
//! where s is the depth of a summit below the highest one, f(s) the density of summits at this depth, eta their number per area, R their
//! radius, and E* the modulus of both bodies.

use super::Table;
use super::quadrature::integral;
use crate::linalg::portable::exp;
use crate::problem::layer::{AsperitySpec, Depths};
use std::f64::consts::PI;

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

/// Return the law for the summits of a scene, as a table with exact slopes at its points.
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
    use crate::contact::law::{LayerLaw, Response};
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
