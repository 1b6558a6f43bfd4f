//! The operators and functions of expressions, each with its derivatives.
//!
//! Truth is a number: comparisons give 1 or 0, and a number > 0 is true. Operators and functions keep a NaN, so that a value outside the
//! domain of a function can be refused where it is used.

use crate::linalg::portable;

/// A sign or a function of one value.
#[derive(Debug)]
pub(super) struct Unary {
    /// Its name in an expression.
    pub name: &'static str,
    /// The function.
    pub value: fn(f64) -> f64,
    /// Its derivative, as a function of the argument and the value; none for a function that is constant between jumps.
    pub slope: Option<fn(f64, f64) -> f64>,
}

/// An operator or a function of two values.
#[derive(Debug)]
pub(super) struct Binary {
    /// Its name in an expression.
    pub name: &'static str,
    /// The function.
    pub kind: Two,
}

/// A function of two values.
#[derive(Debug)]
pub(super) enum Two {
    /// A differentiable function. The second function returns its derivatives by both arguments, from the arguments and the value.
    Smooth(fn(f64, f64) -> f64, fn(f64, f64, f64) -> [f64; 2]),
    /// A function whose value is a truth.
    Truth(fn(f64, f64) -> f64),
    /// The choice of one argument: the first, if the condition holds, or the second.
    Pick(fn(f64, f64) -> bool),
}

const fn smooth(name: &'static str, value: fn(f64) -> f64, slope: fn(f64, f64) -> f64) -> Unary {
    Unary { name, value, slope: Some(slope) }
}

const fn steps(name: &'static str, value: fn(f64) -> f64) -> Unary {
    Unary { name, value, slope: None }
}

/// Functions of one value.
pub(super) static UNARY: [Unary; 17] = [
    smooth("abs", f64::abs, |a, _| a.signum()),
    smooth("acos", portable::acos, |a, _| -1.0 / (1.0 - a * a).sqrt()),
    smooth("asin", portable::asin, |a, _| 1.0 / (1.0 - a * a).sqrt()),
    smooth("atan", portable::atan, |a, _| 1.0 / (1.0 + a * a)),
    steps("ceil", f64::ceil),
    smooth("cos", portable::cos, |a, _| -portable::sin(a)),
    smooth("cosh", portable::cosh, |a, _| portable::sinh(a)),
    smooth("exp", portable::exp, |_, value| value),
    steps("floor", f64::floor),
    smooth("log", portable::log, |a, _| 1.0 / a),
    smooth("log10", portable::log10, |a, _| 1.0 / (a * std::f64::consts::LN_10)),
    // 0 at 0, unlike `signum`
    steps("sign", |a| if a == 0.0 { 0.0 } else { a.signum() }),
    smooth("sin", portable::sin, |a, _| portable::cos(a)),
    smooth("sinh", portable::sinh, |a, _| portable::cosh(a)),
    smooth("sqrt", f64::sqrt, |_, value| 0.5 / value),
    smooth("tan", portable::tan, |_, value| 1.0 + value * value),
    smooth("tanh", portable::tanh, |_, value| 1.0 - value * value),
];

/// The signs, which stand before a value.
pub(super) static SIGNS: [Unary; 2] = [smooth("-", |a| -a, |_, _| -1.0), steps("!", |a| compare(a, a, a <= 0.0))];

/// Functions of two values. `min` and `max` take more values, one after another, and unlike those of `f64` they keep a NaN.
pub(super) static BINARY: [Binary; 3] = [
    two("atan2", Two::Smooth(portable::atan2, |a, b, _| [b, -a].map(|x| x / (a * a + b * b)))),
    two("max", Two::Pick(|a, b| a.is_nan() || a > b)),
    two("min", Two::Pick(|a, b| a.is_nan() || a < b)),
];

/// Operators with their binding powers. An operator with a higher power binds more tightly.
pub(super) static INFIX: [(u8, Binary); 13] = [
    // true if one side is true, even if the other is NaN
    (1, two("||", Two::Truth(|a, b| if a > 0.0 || b > 0.0 { 1.0 } else { compare(a, b, false) }))),
    // false if one side is false, even if the other is NaN: `x > 0 && log(x) > 1` is defined for all x
    (2, two("&&", Two::Truth(|a, b| if a <= 0.0 || b <= 0.0 { 0.0 } else { compare(a, b, true) }))),
    (COMPARISON, two("==", Two::Truth(|a, b| compare(a, b, a == b)))),
    (COMPARISON, two("!=", Two::Truth(|a, b| compare(a, b, a != b)))),
    (COMPARISON, two("<=", Two::Truth(|a, b| compare(a, b, a <= b)))),
    (COMPARISON, two(">=", Two::Truth(|a, b| compare(a, b, a >= b)))),
    (COMPARISON, two("<", Two::Truth(|a, b| compare(a, b, a < b)))),
    (COMPARISON, two(">", Two::Truth(|a, b| compare(a, b, a > b)))),
    (4, two("+", Two::Smooth(|a, b| a + b, |_, _, _| [1.0, 1.0]))),
    (4, two("-", Two::Smooth(|a, b| a - b, |_, _, _| [1.0, -1.0]))),
    (5, two("*", Two::Smooth(|a, b| a * b, |a, b, _| [b, a]))),
    (5, two("/", Two::Smooth(|a, b| a / b, |_, b, value| [1.0 / b, -value / b]))),
    (
        POWER,
        two("^", Two::Smooth(portable::pow, |a, b, value| [b * portable::pow(a, b - 1.0), value * portable::log(a)])),
    ),
];

const fn two(name: &'static str, kind: Two) -> Binary {
    Binary { name, kind }
}

/// Binding power of comparisons, which do not chain.
pub(super) const COMPARISON: u8 = 3;
/// Binding power of a sign: -x*y is (-x)*y, and -x^2 is -(x^2).
pub(super) const SIGN: u8 = 6;
/// Binding power of `^`, which groups to the right.
pub(super) const POWER: u8 = 7;

/// Return the names of the functions.
pub(super) fn functions() -> impl Iterator<Item = &'static str> {
    UNARY.iter().map(|function| function.name).chain(BINARY.iter().map(|function| function.name))
}

/// Return a truth as a number, or NaN if an argument is NaN.
fn compare(a: f64, b: f64, truth: bool) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { f64::from(u8::from(truth)) }
}
