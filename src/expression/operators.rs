//! The operators and functions of expressions, on plain `f64`.
//!
//! Truth is a number: comparisons give 1 or 0, and a number > 0 is true. Nothing hides a NaN, so that a value
//! outside the domain of a function can be refused where it is used.

use super::program::Number;
use crate::data::Data;

type Unary = fn(f64) -> f64;
type Binary = fn(f64, f64) -> f64;

/// Functions of one value, by name.
pub(super) const UNARY: &[(&str, Unary)] = &[
    ("abs", f64::abs),
    ("acos", f64::acos),
    ("asin", f64::asin),
    ("atan", f64::atan),
    ("ceil", f64::ceil),
    ("cos", f64::cos),
    ("cosh", f64::cosh),
    ("exp", f64::exp),
    ("floor", f64::floor),
    ("log", f64::ln),
    ("log10", f64::log10),
    ("sign", sign),
    ("sin", f64::sin),
    ("sinh", f64::sinh),
    ("sqrt", f64::sqrt),
    ("tan", f64::tan),
    ("tanh", f64::tanh),
];

/// Functions of two values, by name; `min` and `max` take more, one after the other.
pub(super) const BINARY: &[(&str, Binary)] = &[("atan2", f64::atan2), ("max", max), ("min", min)];

/// Binary operators: symbol, binding power (higher binds tighter), value.
pub(super) const INFIX: &[(&str, u8, Binary)] = &[
    ("||", 1, or),
    ("&&", 2, and),
    ("==", COMPARISON, |a, b| compare(a, b, a == b)),
    ("!=", COMPARISON, |a, b| compare(a, b, a != b)),
    ("<=", COMPARISON, |a, b| compare(a, b, a <= b)),
    (">=", COMPARISON, |a, b| compare(a, b, a >= b)),
    ("<", COMPARISON, |a, b| compare(a, b, a < b)),
    (">", COMPARISON, |a, b| compare(a, b, a > b)),
    ("+", 4, |a, b| a + b),
    ("-", 4, |a, b| a - b),
    ("*", 5, |a, b| a * b),
    ("/", 5, |a, b| a / b),
    ("^", POWER, f64::powf),
];

/// Binding power of comparisons, which do not chain.
pub(super) const COMPARISON: u8 = 3;
/// Binding power of a sign: -x*y is (-x)*y, and -x^2 is -(x^2).
pub(super) const SIGN: u8 = 6;
/// Binding power of `^`, which groups to the right.
pub(super) const POWER: u8 = 7;

/// Signs: what they make of a value.
const SIGNS: [(&str, Unary); 2] = [("-", |a| -a), ("!", not)];

/// The sign or function of one value that has a name.
pub(super) fn unary(name: &str) -> Option<Unary> {
    UNARY.iter().chain(&SIGNS).find(|(known, _)| *known == name).map(|(_, apply)| *apply)
}

/// The operator or function of two values that has a name.
pub(super) fn binary(name: &str) -> Option<Binary> {
    let infix = INFIX.iter().map(|(symbol, _, apply)| (symbol, apply));
    BINARY
        .iter()
        .map(|(known, apply)| (known, apply))
        .chain(infix)
        .find(|(known, _)| **known == name)
        .map(|found| *found.1)
}

/// Names of the functions.
pub(super) fn functions() -> impl Iterator<Item = &'static str> {
    UNARY.iter().map(|(name, _)| *name).chain(BINARY.iter().map(|(name, _)| *name))
}

impl Number for f64 {
    fn constant(value: f64) -> Self {
        value
    }

    fn unary(name: &str) -> Option<Unary> {
        unary(name)
    }

    fn binary(name: &str) -> Option<Binary> {
        binary(name)
    }

    fn data(data: &Data, place: &[f64]) -> f64 {
        data.sample(place).value
    }
}

fn number(truth: bool) -> f64 {
    if truth { 1.0 } else { 0.0 }
}

pub(super) fn compare(a: f64, b: f64, truth: bool) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { number(truth) }
}

/// False if one side is, whatever the other: `x > 0 && log(x) > 1` is defined for all x.
pub(super) fn and(a: f64, b: f64) -> f64 {
    if a <= 0.0 || b <= 0.0 { 0.0 } else { compare(a, b, true) }
}

/// True if one side is, whatever the other.
pub(super) fn or(a: f64, b: f64) -> f64 {
    if a > 0.0 || b > 0.0 { 1.0 } else { compare(a, b, false) }
}

pub(super) fn not(a: f64) -> f64 {
    compare(a, a, a <= 0.0)
}

/// Sign of a number, 0 for 0.
pub(super) fn sign(a: f64) -> f64 {
    if a == 0.0 { 0.0 } else { a.signum() }
}

/// Larger of two numbers; unlike `f64::max` it keeps a NaN.
pub(super) fn max(a: f64, b: f64) -> f64 {
    if a.is_nan() || a > b { a } else { b }
}

/// Smaller of two numbers; unlike `f64::min` it keeps a NaN.
pub(super) fn min(a: f64, b: f64) -> f64 {
    if a.is_nan() || a < b { a } else { b }
}
