//! Expressions as programs for a stack of numbers, with their operators and exact derivatives. The evaluation is a loop
//! over steps, however long or deep the text is.
//!
//! Truth is a number: comparisons give 1 or 0, and a number > 0 is true. Operators and functions keep a NaN, so that a
//! value outside the domain of a function can be refused where it is used.

use crate::data::Data;
use crate::linalg::portable;
use smallvec::SmallVec;
use std::sync::Arc;

/// Largest number of variables of an expression.
pub(super) const MOST_VARIABLES: usize = 4;

pub(super) type Values<T> = [T; MOST_VARIABLES];

/// A step of an expression in postfix order.
#[derive(Debug, Clone)]
pub(super) enum Operation {
    Number(f64),
    /// A variable, by its index among the values.
    Variable(usize),
    /// A factor of the load steps, by its index. Its number is known in each step ([`Program::in_step`]).
    Factor(usize),
    Unary(&'static Unary),
    Binary(&'static Binary),
    /// A function from a file, which takes as many values as it has arguments.
    Data(Arc<Data>),
}

/// The numbers for which expressions are evaluated: plain numbers, or pairs of a value and a derivative.
pub(super) trait Number: Copy + Default {
    fn constant(value: f64) -> Self;
    /// Return a function of this number.
    fn one(self, function: &Unary) -> Self;
    /// Return a function of this number and another.
    fn two(self, other: Self, function: &Binary) -> Self;
    /// Return the value of data at a place.
    fn data(data: &Data, place: &[Self]) -> Self;
}

impl Number for f64 {
    fn constant(value: f64) -> Self {
        value
    }

    fn one(self, function: &Unary) -> Self {
        (function.value)(self)
    }

    fn two(self, other: Self, function: &Binary) -> Self {
        match function.kind {
            Two::Smooth(value, _) | Two::Truth(value) => value(self, other),
            Two::Pick(is_first) if is_first(self, other) => self,
            Two::Pick(_) => other,
        }
    }

    fn data(data: &Data, place: &[f64]) -> f64 {
        data.sample(place).value
    }
}

impl PartialEq for Operation {
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Number(a), Self::Number(b)) => a == b,
            (Self::Variable(a), Self::Variable(b)) | (Self::Factor(a), Self::Factor(b)) => a == b,
            (Self::Unary(a), Self::Unary(b)) => std::ptr::eq(*a, *b),
            (Self::Binary(a), Self::Binary(b)) => std::ptr::eq(*a, *b),
            (Self::Data(a), Self::Data(b)) => a == b,
            _ => false,
        }
    }
}

/// An expression as a sequence of steps.
#[derive(PartialEq)]
pub(super) struct Program {
    steps: Vec<Operation>,
    /// Largest number of values on the stack.
    depth: usize,
}

/// Size of a stack without an allocation. Expressions of a usual size need less than ten numbers.
const SHALLOW: usize = 16;

impl Program {
    /// Return the program of some steps. Every step must find its arguments on the stack.
    pub(super) fn new(steps: Vec<Operation>) -> Self {
        let (mut held, mut depth) = (0, 0);
        for step in &steps {
            held = match step {
                Operation::Number(_) | Operation::Variable(_) | Operation::Factor(_) => held + 1,
                Operation::Unary(_) => held,
                Operation::Binary(_) => held - 1,
                Operation::Data(data) => held + 1 - data.arguments(),
            };
            depth = depth.max(held);
        }
        Self { steps, depth }
    }

    pub(super) fn eval<T: Number>(&self, variables: &Values<T>) -> T {
        self.eval_with(variables, |_, _| {})
    }

    /// Return the value, and call `watch` for each use of data with its place.
    fn eval_with<T: Number>(&self, variables: &Values<T>, mut watch: impl FnMut(&Arc<Data>, &[T])) -> T {
        let mut stack = SmallVec::<[T; SHALLOW]>::from_elem(T::default(), self.depth);
        let (stack, mut top) = (&mut stack[..], 0);
        for step in &self.steps {
            let value = match step {
                Operation::Number(value) => T::constant(*value),
                Operation::Variable(place) => variables[*place],
                Operation::Factor(_) => T::constant(f64::NAN),
                Operation::Unary(function) => {
                    top -= 1;
                    stack[top].one(function)
                }
                Operation::Binary(function) => {
                    top -= 2;
                    stack[top].two(stack[top + 1], function)
                }
                Operation::Data(data) => {
                    let end = top;
                    top -= data.arguments();
                    watch(data, &stack[top..end]);
                    T::data(data, &stack[top..end])
                }
            };
            stack[top] = value;
            top += 1;
        }
        stack[0]
    }

    /// Return the first data that have no value at the place where they are needed, and that place.
    pub(super) fn outside(&self, variables: &Values<f64>) -> Option<(Arc<Data>, Vec<f64>)> {
        let mut found = None;
        self.eval_with(variables, |data, place: &[f64]| {
            if found.is_none() && place.iter().all(|x| x.is_finite()) && data.sample(place).value.is_nan() {
                found = Some((data.clone(), place.to_vec()));
            }
        });
        found
    }

    /// Return all data that it uses.
    pub(super) fn data(&self) -> impl Iterator<Item = &Arc<Data>> {
        self.steps.iter().filter_map(|step| match step {
            Operation::Data(data) => Some(data),
            _ => None,
        })
    }

    /// Return the indices of the variables that it uses.
    pub(super) fn variables(&self) -> impl Iterator<Item = usize> {
        self.steps.iter().filter_map(|step| match step {
            Operation::Variable(variable) => Some(*variable),
            _ => None,
        })
    }
}

impl Program {
    /// Return the program with these numbers in the places of the factors.
    pub(super) fn in_step(&self, factors: &[f64]) -> Self {
        let known = |step: &Operation| match step {
            Operation::Factor(factor) => Operation::Number(factors[*factor]),
            other => other.clone(),
        };
        Self { steps: self.steps.iter().map(known).collect(), depth: self.depth }
    }

    /// Return the indices of the factors that it uses.
    pub(super) fn factors(&self) -> impl Iterator<Item = usize> {
        self.steps.iter().filter_map(|step| match step {
            Operation::Factor(factor) => Some(*factor),
            _ => None,
        })
    }
}

/// A value and its derivative by one variable.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Dual {
    pub value: f64,
    pub slope: f64,
}

/// Return the derivative of a function times the slope of its argument. It is zero for a constant argument, even if the
/// derivative is infinite.
fn times(derivative: f64, slope: f64) -> f64 {
    if slope == 0.0 { 0.0 } else { derivative * slope }
}

impl Number for Dual {
    fn constant(value: f64) -> Self {
        Dual { value, slope: 0.0 }
    }

    fn one(self, function: &Unary) -> Self {
        let value = (function.value)(self.value);
        Dual { value, slope: function.slope.map_or(0.0, |slope| times(slope(self.value, value), self.slope)) }
    }

    fn two(self, other: Self, function: &Binary) -> Self {
        let (a, b) = (self.value, other.value);
        match function.kind {
            Two::Smooth(value, slopes) => {
                let value = value(a, b);
                let [by_self, by_other] = slopes(a, b, value);
                Dual { value, slope: times(by_self, self.slope) + times(by_other, other.slope) }
            }
            Two::Truth(value) => Self::constant(value(a, b)),
            Two::Pick(is_first) => {
                if is_first(a, b) {
                    self
                } else {
                    other
                }
            }
        }
    }

    fn data(data: &Data, place: &[Dual]) -> Self {
        let mut values = [0.0; 2];
        values.iter_mut().zip(place).for_each(|(value, dual)| *value = dual.value);
        let sample = data.sample(&values[..place.len()]);
        let slope = place.iter().zip(sample.gradient).map(|(dual, by)| times(by, dual.slope)).sum();
        Dual { value: sample.value, slope }
    }
}

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
    /// A differentiable function. The second function returns its derivatives by both arguments, from the arguments and
    /// the value.
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

/// Functions of two values. `min` and `max` take more values, one after another, and unlike those of `f64` they keep a
/// NaN.
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

pub(super) fn functions() -> impl Iterator<Item = &'static str> {
    UNARY.iter().map(|function| function.name).chain(BINARY.iter().map(|function| function.name))
}

/// Return a truth as a number, or NaN if an argument is NaN.
fn compare(a: f64, b: f64, truth: bool) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { f64::from(u8::from(truth)) }
}
