//! Integrals of functions of one variable.

/// Points in (0, 1] and weights of the Gauss-Lobatto rule with 7 points on [-1, 1]. The rule includes the ends of an interval, so
/// that a kink just before an end does not hide between points.
const LOBATTO: [(f64, f64); 3] = [
    (0.468_848_793_470_714_2, 0.431_745_381_209_862_6),
    (0.830_223_896_278_566_9, 0.276_826_047_361_565_9),
    (1.0, 1.0 / 21.0),
];
/// Weight of the middle point of this rule.
const MIDDLE: f64 = 256.0 / 525.0;

/// Largest number of times that an interval is halved.
const DEPTH: usize = 30;

/// Return the integral of `f` from `a` to `b`. Intervals are halved until the rule on each and on its halves agree to 1e-13 of the
/// whole integral.
pub fn integral(f: &dyn Fn(f64) -> f64, a: f64, b: f64) -> f64 {
    integral_to(f, a, b, 1e-13, 0.0)
}

/// Return the integral of `f` from `a` to `b`. Intervals are halved until the rules agree to a `share` of the whole integral, or to
/// `rounding`, the error of the integral from that of the values of `f`.
pub fn integral_to(f: &dyn Fn(f64) -> f64, a: f64, b: f64, share: f64, rounding: f64) -> f64 {
    let whole = rule(f, a, b);
    halves(f, a, b, whole, rounding.max(share * whole.abs()), DEPTH)
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
