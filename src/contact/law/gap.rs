//! Fenchel's gap: the area between the graph of a law and the corner (c, p) of a compression and a pressure.

use super::quadrature::integral_to;
use crate::linalg::portable::expm1;

/// Relative error of the quadrature of the gap. It enters bounds that exceed the error they bound by a factor.
const SHARE: f64 = 1e-5;
/// Relative rounding of a law's value, below which no quadrature gets.
const ROUNDING: f64 = 2.0 * f64::EPSILON;
/// Relative difference of compressions that is too rounded to integrate over: a root has an error of a few units in the last place,
/// 1e-3 of this many.
const CLOSE: f64 = 4096.0 * f64::EPSILON;
/// Relative difference of pressures within which a law counts as straight, if its tangents at both ends agree.
const NEAR: f64 = 1e-6;
/// Relative difference up to which these tangents agree. The gap is then too large by at most two thirds of it.
const STRAIGHT: f64 = 5e-4;

/// Return the gap of a compression c and a `pressure`, which is the integral of p(.) - `pressure` from `on_graph` to c. The law has this
/// pressure at the compression `on_graph`. `law` gives p(c) and `tangent` p'(c).
pub(super) fn by_quadrature(
    c: f64,
    pressure: f64,
    on_graph: f64,
    law: impl Fn(f64) -> f64,
    tangent: impl Fn(f64) -> f64,
) -> f64 {
    if on_graph == f64::INFINITY {
        return f64::INFINITY;
    }
    let excess = |c: f64| law(c) - pressure;
    let (difference, width) = (excess(c), c - on_graph);
    let is_close = width.abs() <= CLOSE * c;
    if is_close || difference.abs() <= NEAR * pressure {
        if difference == 0.0 {
            return 0.0;
        }
        let [at_c, at_graph] = [c, on_graph].map(tangent);
        let least = at_c.min(at_graph);
        if is_close || (at_c - at_graph).abs() < STRAIGHT * least {
            // The width is rounded, but the difference of pressures is not. The flatter side gives the larger gap.
            return 0.5 * difference * (difference / least);
        }
    }
    let rounding = ROUNDING * pressure * width.abs();
    let gap = integral_to(&excess, on_graph, c, SHARE, rounding);
    // NaN comes from values that overflow or lie beyond the end of a law.
    if gap.is_nan() { f64::INFINITY } else { gap.max(0.0) }
}

/// Return e^x - 1 - x without cancellation where x is small.
pub(super) fn exp_less_line(x: f64) -> f64 {
    if x.abs() < 1e-2 {
        x * x * (0.5 + x * (1.0 / 6.0 + x * (1.0 / 24.0 + x * (1.0 / 120.0 + x / 720.0))))
    } else {
        expm1(x) - x
    }
}
