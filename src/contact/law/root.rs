//! Roots of equations with an increasing function of the compression.

use crate::linalg::portable::{exp, log};

/// Relative distance up to which two numbers are the same to rounding.
const ROUNDING: f64 = 2.0 * f64::EPSILON;
/// First factor by which the search goes down from the upper bound while it knows no lower one; each next factor is the square
/// of the one before. Five of them span the 37 decades between a trial state of 1e30 and a layer of 1e-6.
const DOWN: f64 = 1.0 / 16.0;
/// Largest exponent d log p/d log c at which a root is accepted because of its short step alone.
const STEEPEST: f64 = 1e6;
/// Ratio of two steps beyond which Newton's method is slow. At the corner of c + c^50 the ratios fall to 0.53.
const SLOW: f64 = 0.75;
/// Largest number of evaluations. Bisecting the logarithms of all double numbers down to neighbours takes 63, with at most two
/// slow Newton steps before each.
const MOST: usize = 200;

/// Return the c in (low, high) where an increasing function has the value `target` > 0, searched from `start`. `value` gives the
/// function and its derivative.
///
/// The search is Newton's method for the logarithm of the value as a function of log c. There, powers are straight lines, and sums
/// of powers are convex with slopes between the least and the largest exponent. Where a step is hardly shorter than the last one,
/// the function may be closer to an exponential, so the step is taken for the logarithm of the value as a function of c. Where
/// this happens twice, or a step leaves the bracket, log c is bisected. NaN counts as too large.
///
/// # Errors
/// The largest c with a value below `target`, where no larger c was found with a value above.
pub(super) fn root(
    target: f64,
    [mut low, mut high]: [f64; 2],
    start: f64,
    value: impl Fn(f64) -> (f64, f64),
) -> Result<f64, f64> {
    let (mut c, mut last, mut down, mut reached) = (start, f64::INFINITY, DOWN, false);
    let mut slow = 0;
    for _ in 0..MOST {
        let (at_c, slope) = value(c);
        if at_c < target {
            low = c;
        } else {
            high = c;
            reached = at_c >= target;
        }
        let excess = log(at_c / target);
        if excess.abs() <= ROUNDING {
            return Ok(c);
        }
        let step = excess * (at_c / c / slope);
        // The second condition excludes an infinite slope, which gives no step but is no root.
        if step.abs() <= ROUNDING && excess.abs() < STEEPEST * ROUNDING {
            // The step may still lead to a neighbour of c that is closer to the root, which matters for steep laws.
            return Ok(c * (1.0 - step));
        }
        slow = if step.abs() > SLOW * last { slow + 1 } else { 0 };
        last = step.abs();
        let newton = if slow > 0 { c * (1.0 - step) } else { c * exp(-step) };
        c = if low < newton && newton < high && slow < 2 {
            newton
        } else if low == 0.0 && high * down > 0.0 {
            let far = high * down;
            down *= down;
            far
        } else {
            low.max(f64::MIN_POSITIVE).sqrt() * high.sqrt()
        };
        if !(low < c && c < high) {
            break;
        }
    }
    if reached { Ok(high) } else { Err(low) }
}

/// Return the compression c in the bracket with c + p(c)/rho = s, searched from `start`. `law` gives pressure and tangent. A law that
/// is NaN from some compression on has a rigid stop there.
pub(super) fn meeting(s: f64, rho: f64, bracket: [f64; 2], start: f64, law: impl Fn(f64) -> (f64, f64)) -> f64 {
    let sum = |c: f64| {
        let (pressure, tangent) = law(c);
        (c + pressure / rho, 1.0 + tangent / rho)
    };
    match root(s, bracket, start, sum) {
        Ok(c) | Err(c) => c,
    }
}
