//! Fenchel's gap: the area between a law's graph and the corner of a compression and a pressure.

use super::quadrature::integral_to;
use crate::linalg::portable::expm1;

/// Error of a quadrature, as a share of the gap: it goes into bounds that are a factor above the error they bound.
const SHARE: f64 = 1e-5;
/// Rounding of a law's value, as a share of it: no quadrature gets below.
const ROUNDING: f64 = 2.0 * f64::EPSILON;
/// Share of c within which a difference of compressions is too rounded to integrate over: a root is found to a few
/// steps of double numbers, 1e-3 of this many.
const CLOSE: f64 = 4096.0 * f64::EPSILON;
/// Relative difference of pressures within which a law is looked upon as straight, if its tangents at both ends say so.
const NEAR: f64 = 1e-6;
/// Relative difference of those tangents: two thirds of it are the error of the gap, upwards.
const STRAIGHT: f64 = 5e-4;

/// The gap of a compression c and a `pressure`, as the integral of p(.) - p from c = `on_graph`, where the law has that pressure, to c.
/// `law` gives p(c), `tangent` p'(c).
pub(super) fn by_quadrature(
    (c, pressure, on_graph): (f64, f64, f64),
    law: impl Fn(f64) -> f64,
    tangent: impl Fn(f64) -> f64,
) -> f64 {
    if on_graph == f64::INFINITY {
        return f64::INFINITY;
    }
    let excess = |c: f64| law(c) - pressure;
    let (difference, way) = (excess(c), c - on_graph);
    let short = way.abs() <= CLOSE * c;
    if short || difference.abs() <= NEAR * pressure {
        if difference == 0.0 {
            return 0.0;
        }
        let [here, there] = [c, on_graph].map(tangent);
        let least = here.min(there);
        if short || (here - there).abs() < STRAIGHT * least {
            // the way is rounded, the difference of pressures is not; the flatter side gives the larger gap
            return 0.5 * difference * (difference / least);
        }
    }
    let rounding = ROUNDING * pressure * way.abs();
    let gap = integral_to(&excess, on_graph, c, SHARE, rounding);
    // NaN: beyond what double numbers hold, or beyond the end of a law
    if gap.is_nan() { f64::INFINITY } else { gap.max(0.0) }
}

/// e^x - 1 - x, with its digits where it is small.
pub(super) fn exp_less_line(x: f64) -> f64 {
    if x.abs() < 1e-2 {
        x * x * (0.5 + x * (1.0 / 6.0 + x * (1.0 / 24.0 + x * (1.0 / 120.0 + x / 720.0))))
    } else {
        expm1(x) - x
    }
}
