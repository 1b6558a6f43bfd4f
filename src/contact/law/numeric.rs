//! Numerical methods of laws: roots of equations with an increasing function of the compression, and integrals.

use crate::linalg::portable::{exp, log};

/// Relative rounding of a law's value. Numbers closer than that are the same.
const ROUNDING: f64 = 2.0 * f64::EPSILON;
/// First factor by which the search goes down from the upper bound while it knows no lower one; each next factor is the
/// square of the one before. Five of them span the 37 decades between a trial state of 1e30 and a layer of 1e-6.
const DOWN: f64 = 1.0 / 16.0;
/// Largest exponent d log p/d log c at which a root is accepted because of its short step alone.
const STEEPEST: f64 = 1e6;
/// Ratio of two steps beyond which Newton's method is slow. At the corner of c + c^50 the ratios fall to 0.53.
const SLOW: f64 = 0.75;
/// Largest number of evaluations. Bisecting the logarithms of all double numbers down to neighbours takes 63, with at
/// most two slow Newton steps before each.
const MOST: usize = 200;

/// Return the c in (low, high) where an increasing function has the value `target` > 0, searched from `start`. `value`
/// gives the function and its derivative.
///
/// The search is Newton's method for the logarithm of the value as a function of log c. There, powers are straight
/// lines, and sums of powers are convex with slopes between the least and the largest exponent. Where a step is hardly
/// shorter than the last one, the function may be closer to an exponential, so the step is taken for the logarithm of
/// the value as a function of c. Where this happens twice, or a step leaves the bracket, log c is bisected. NaN counts
/// as too large.
///
/// # Errors
/// The largest c with a value below `target`, where no larger c was found with a value above.
pub fn root(
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

/// Points in (0, 1] and weights of the Gauss-Lobatto rule with 7 points on [-1, 1]. The rule includes the ends of an
/// interval, so that a kink just before an end does not hide between points.
const LOBATTO: [(f64, f64); 3] = [
    (0.468_848_793_470_714_2, 0.431_745_381_209_862_6),
    (0.830_223_896_278_566_9, 0.276_826_047_361_565_9),
    (1.0, 1.0 / 21.0),
];
/// Weight of the middle point of this rule.
const MIDDLE: f64 = 256.0 / 525.0;

/// Largest number of times that an interval is halved.
const DEPTH: usize = 30;

/// Return the integral of `f` from `a` to `b`. Intervals are halved until the rule on each and on its halves agree to
/// 1e-13 of the whole integral.
pub fn integral(f: &dyn Fn(f64) -> f64, a: f64, b: f64) -> f64 {
    let whole = rule(f, a, b);
    halves(f, a, b, whole, 1e-13 * whole.abs(), DEPTH)
}

fn halves(f: &dyn Fn(f64) -> f64, a: f64, b: f64, whole: f64, tolerance: f64, depth: usize) -> f64 {
    let middle = 0.5 * (a + b);
    let (left, right) = (rule(f, a, middle), rule(f, middle, b));
    let sum = left + right;
    // A comparison with NaN is false and ends the recursion.
    if depth > 0 && (sum - whole).abs() > tolerance {
        halves(f, a, middle, left, tolerance, depth - 1) + halves(f, middle, b, right, tolerance, depth - 1)
    } else {
        sum
    }
}

fn rule(f: &dyn Fn(f64) -> f64, a: f64, b: f64) -> f64 {
    let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
    let sides: f64 = LOBATTO.iter().map(|(x, weight)| weight * (f(middle - half * x) + f(middle + half * x))).sum();
    half * (sides + MIDDLE * f(middle))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn smooth_and_kinked_functions() {
        assert!((integral(&f64::exp, 0.0, 2.0) - 2f64.exp_m1()).abs() < 1e-13 * 2f64.exp());
        assert!((integral(&|x: f64| x.powf(1.5), 0.0, 1e-4) / (0.4 * 1e-10) - 1.0).abs() < 1e-12);
        assert!((integral(&|x: f64| (x - 0.3).max(0.0), 0.0, 1.0) - 0.245).abs() < 1e-12);
        assert!((integral(&|x: f64| (x - 0.999).max(0.0), 0.0, 1.0) / 5e-7 - 1.0).abs() < 1e-9);
        assert!(integral(&|_| f64::NAN, 0.0, 1.0).is_nan());
    }
}
