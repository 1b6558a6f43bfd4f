//! Where an increasing function of the compression has a given value.

use crate::linalg::portable::{exp, log};

/// Relative distance below which two numbers are the same to rounding.
const ROUNDING: f64 = 2.0 * f64::EPSILON;
/// First factor by which the search goes down from a bound while it knows no lower one; the next is its square. 5 of
/// them span the 37 decades between a trial state of 1e30 and a layer of 1e-6.
const DOWN: f64 = 1.0 / 16.0;
/// Largest exponent d log p/d log c that a root can have and pass for one by its step alone.
const STEEPEST: f64 = 1e6;
/// Share of the last step beyond which a step of Newton's is slow: at the corner of c + c^50 they fall to 0.53.
const SLOW: f64 = 0.75;
/// Evaluations at most. Bisecting the logarithms of all double numbers down to neighbours takes 63, with two slow steps
/// of Newton's before each at most.
const MOST: usize = 200;

/// The c in (low, high) where `value`, which gives an increasing function and its derivative, is `target` > 0, searched
/// from `start`.
///
/// Newton's method for log value against log c: powers are straight lines there, and sums of powers convex with slopes
/// between the least and the largest exponent. Where a step is hardly shorter than the last, the function may be closer
/// to an exponential, and the step is taken for log value against c. Bisection of log c where that happens twice, or
/// where a step leaves the bracket. NaN counts as too large.
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
        let (here, slope) = value(c);
        if here < target {
            low = c;
        } else {
            high = c;
            reached = here >= target;
        }
        let excess = log(here / target);
        if excess.abs() <= ROUNDING {
            return Ok(c);
        }
        let step = excess * (here / c / slope);
        // an infinite slope gives no step and is no root
        if step.abs() <= ROUNDING && excess.abs() < STEEPEST * ROUNDING {
            // c has another neighbour next to the root, and steep laws tell them apart
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

/// The compression c in the bracket with c + p(c)/rho = s, for the pressure and tangent `law`. A law that is not a
/// number any more from some compression on has a rigid stop there.
pub(super) fn meeting(s: f64, rho: f64, bracket: [f64; 2], start: f64, law: impl Fn(f64) -> (f64, f64)) -> f64 {
    let sum = |c: f64| {
        let (pressure, tangent) = law(c);
        (c + pressure / rho, 1.0 + tangent / rho)
    };
    match root(s, bracket, start, sum) {
        Ok(c) | Err(c) => c,
    }
}
