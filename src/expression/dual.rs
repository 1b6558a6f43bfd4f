//! Exact derivatives of expressions: the same text, evaluated on pairs of a value and its slope.

use super::Expression;
use super::operators::{and, compare, not, or, sign};
use super::program::{Number, Program};
use super::scope::Scope;
use crate::data::Data;
use crate::error::{Place, Result};
use std::fmt;
use std::sync::Arc;

/// A value and its derivative.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Dual {
    value: f64,
    slope: f64,
}

impl Dual {
    /// A function of this one, by its value and its derivative there.
    fn then(self, value: f64, derivative: f64) -> Self {
        Dual { value, slope: times(derivative, self.slope) }
    }

    /// A function of two, by its value and its derivatives.
    fn join(self, other: Self, value: f64, by_self: f64, by_other: f64) -> Self {
        Dual { value, slope: times(by_self, self.slope) + times(by_other, other.slope) }
    }

    /// A truth.
    fn truth(value: f64) -> Self {
        Dual { value, slope: 0.0 }
    }
}

/// Derivative times slope; what does not change has no slope, however steep the function.
fn times(derivative: f64, slope: f64) -> f64 {
    if slope == 0.0 { 0.0 } else { derivative * slope }
}

type Unary = fn(Dual) -> Dual;
type Binary = fn(Dual, Dual) -> Dual;

const UNARY: &[(&str, Unary)] = &[
    ("abs", |a| a.then(a.value.abs(), a.value.signum())),
    ("acos", |a| a.then(a.value.acos(), -1.0 / (1.0 - a.value * a.value).sqrt())),
    ("asin", |a| a.then(a.value.asin(), 1.0 / (1.0 - a.value * a.value).sqrt())),
    ("atan", |a| a.then(a.value.atan(), 1.0 / (1.0 + a.value * a.value))),
    ("ceil", |a| a.then(a.value.ceil(), 0.0)),
    ("cos", |a| a.then(a.value.cos(), -a.value.sin())),
    ("cosh", |a| a.then(a.value.cosh(), a.value.sinh())),
    ("exp", |a| a.then(a.value.exp(), a.value.exp())),
    ("floor", |a| a.then(a.value.floor(), 0.0)),
    ("log", |a| a.then(a.value.ln(), 1.0 / a.value)),
    ("log10", |a| a.then(a.value.log10(), 1.0 / (a.value * std::f64::consts::LN_10))),
    ("sign", |a| a.then(sign(a.value), 0.0)),
    ("sin", |a| a.then(a.value.sin(), a.value.cos())),
    ("sinh", |a| a.then(a.value.sinh(), a.value.cosh())),
    ("sqrt", |a| a.then(a.value.sqrt(), 0.5 / a.value.sqrt())),
    ("tan", |a| a.then(a.value.tan(), 1.0 + a.value.tan().powi(2))),
    ("tanh", |a| a.then(a.value.tanh(), 1.0 - a.value.tanh().powi(2))),
    ("!", |a| Dual::truth(not(a.value))),
    ("-", |a| a.then(-a.value, -1.0)),
];

const BINARY: &[(&str, Binary)] = &[
    ("atan2", |a, b| {
        let square = a.value * a.value + b.value * b.value;
        a.join(b, a.value.atan2(b.value), b.value / square, -a.value / square)
    }),
    // a NaN stays, as in `operators::max`
    ("max", |a, b| if a.value.is_nan() || a.value > b.value { a } else { b }),
    ("min", |a, b| if a.value.is_nan() || a.value < b.value { a } else { b }),
    ("||", |a, b| Dual::truth(or(a.value, b.value))),
    ("&&", |a, b| Dual::truth(and(a.value, b.value))),
    ("==", |a, b| Dual::truth(compare(a.value, b.value, a.value == b.value))),
    ("!=", |a, b| Dual::truth(compare(a.value, b.value, a.value != b.value))),
    ("<=", |a, b| Dual::truth(compare(a.value, b.value, a.value <= b.value))),
    (">=", |a, b| Dual::truth(compare(a.value, b.value, a.value >= b.value))),
    ("<", |a, b| Dual::truth(compare(a.value, b.value, a.value < b.value))),
    (">", |a, b| Dual::truth(compare(a.value, b.value, a.value > b.value))),
    ("+", |a, b| a.join(b, a.value + b.value, 1.0, 1.0)),
    ("-", |a, b| a.join(b, a.value - b.value, 1.0, -1.0)),
    ("*", |a, b| a.join(b, a.value * b.value, b.value, a.value)),
    ("/", |a, b| {
        let value = a.value / b.value;
        a.join(b, value, 1.0 / b.value, -value / b.value)
    }),
    ("^", |a, b| {
        let value = a.value.powf(b.value);
        a.join(b, value, b.value * a.value.powf(b.value - 1.0), value * a.value.ln())
    }),
];

impl Number for Dual {
    fn constant(value: f64) -> Self {
        Dual { value, slope: 0.0 }
    }

    fn unary(name: &str) -> Option<Unary> {
        UNARY.iter().find(|(known, _)| *known == name).map(|(_, apply)| *apply)
    }

    fn binary(name: &str) -> Option<Binary> {
        BINARY.iter().find(|(known, _)| *known == name).map(|(_, apply)| *apply)
    }

    fn data(data: &Data, place: &[Dual]) -> Self {
        let mut values = [0.0; 2];
        values.iter_mut().zip(place).for_each(|(value, dual)| *value = dual.value);
        let sample = data.sample(&values[..place.len()]);
        let slope = place.iter().zip(sample.gradient).map(|(dual, by)| times(by, dual.slope)).sum();
        Dual { value: sample.value, slope }
    }
}

/// An expression with its derivative by the first of its variables.
#[derive(Clone)]
pub struct Differentiable {
    plain: Expression,
    dual: Arc<Program<Dual>>,
}

impl Differentiable {
    /// Parses a text like [`Expression::parse`].
    ///
    /// # Errors
    /// Those of [`Expression::parse`].
    pub fn parse(text: &str, place: &Place, scope: Scope) -> Result<Self> {
        let (plain, dual) = Expression::with(text, place, scope)?;
        Ok(Self { plain, dual: Arc::new(dual) })
    }

    /// The expression alone.
    pub fn plain(&self) -> &Expression {
        &self.plain
    }

    /// Value, and derivative by the first variable, for the values of the variables in the order of
    /// [`Differentiable::parse`].
    pub fn eval(&self, values: &[f64]) -> (f64, f64) {
        self.eval_by(0, values)
    }

    /// The same with the derivative by the variable of this number.
    pub fn eval_by(&self, variable: usize, values: &[f64]) -> (f64, f64) {
        let dual = |slot: usize| {
            let value = values.get(slot).copied().unwrap_or(f64::NAN);
            Dual { value, slope: if slot == variable { 1.0 } else { 0.0 } }
        };
        let Dual { value, slope } = self.dual.eval(&std::array::from_fn(dual));
        (value, slope)
    }
}

impl fmt::Debug for Differentiable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.plain.fmt(f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::{DataSpec, Interpolation, Library, Outside};
    use crate::error::Source;
    use crate::expression::operators;

    fn parse(text: &str) -> Differentiable {
        let source = Source { name: "scene.toml".into(), text: format!("pressure = \"{text}\"\n") };
        let place = Place { span: 11..13 + text.len(), source: Arc::new(source) };
        Differentiable::parse(text, &place, Scope::of(&["c", "x"])).unwrap_or_else(|error| panic!("{error}"))
    }

    #[test]
    fn derivatives_agree_with_differences() {
        let functions = operators::UNARY.iter().map(|(name, _)| format!("{name}(0.3*c*x) + c"));
        let others = [
            "3*c^2.5 + x*c",
            "2^c/(1 + c^x)",
            "max(c, x) - min(c, 2*x, 1) + max(-c, -2)",
            "atan2(c, x) + atan2(x, c)",
            "c*(c > x) + !(c >= x)*c^2 + (c < x || c != 1 && x <= 2)*c",
            "-c^2 - -c/x - (c == 3)",
            "(1 - c)^2",
        ];
        for text in functions.chain(others.map(String::from)) {
            let law = parse(&text);
            for (c, x) in [(0.7, 1.1), (1.3, 0.6), (1e-3, 0.9)] {
                let h = 1e-6 * c;
                let (value, slope) = law.eval(&[c, x]);
                let [low, high] = [c - h, c + h].map(|c| law.plain().eval(&[c, x]));
                assert!((value - law.plain().eval(&[c, x])).abs() <= 1e-15 * value.abs(), "{text}");
                let difference = (high - low) / (2.0 * h);
                assert!(
                    (slope - difference).abs() < 1e-7 * (1.0 + slope.abs()) + 1e-9 / c,
                    "{text} at {c}, {x}: {slope} {difference}"
                );
            }
        }
    }

    /// Of data by the chain rule, whatever their places depend on.
    #[test]
    fn derivatives_of_data_agree_with_differences() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("heights.csv");
        std::fs::write(&file, "1,3,2,7\n4,1,5,2\n0,2,6,3\n1,1,4,8\n").unwrap();
        let source = Source { name: "scene.toml".into(), text: "\"f(c*x, 1 + x - 0.5*c)^2 + c*f(1, c)\"".into() };
        let place = Place { span: 0..source.text.len(), source: Arc::new(source) };
        let spec = DataSpec {
            name: "f".into(),
            file,
            place: place.clone(),
            points: false,
            origin: [0.0; 2],
            spacing: [0.5, 0.8],
            unit: 1.0,
            interpolation: Interpolation::Cubic,
            outside: Outside::Error,
        };
        let library = Library::from([("f".to_owned(), Arc::new(Data::new(spec)))]);
        let text = "f(c*x, 1 + x - 0.5*c)^2 + c*f(1, c)";
        let law = Differentiable::parse(text, &place, Scope { variables: &["c", "x"], data: &library }).unwrap();
        for values in [[0.7, 1.1], [1.2, 0.3]] {
            for variable in 0..2 {
                let (value, slope) = law.eval_by(variable, &values);
                let h = 1e-6;
                let [low, high] = [-h, h].map(|h| {
                    let mut moved = values;
                    moved[variable] += h;
                    law.plain().eval(&moved)
                });
                assert_eq!(value, law.plain().eval(&values));
                assert!((slope - (high - low) / (2.0 * h)).abs() < 1e-7 * (1.0 + slope.abs()), "{values:?}: {slope}");
            }
        }
    }

    #[test]
    fn nan_is_not_hidden() {
        for text in ["max(c, log(-1))", "max(log(-1), c)", "min(c, log(-1))", "min(log(-1), c)", "max(0, sqrt(-c))"] {
            assert!(parse(text).eval(&[1.0, 1.0]).0.is_nan(), "{text}");
        }
    }

    #[test]
    fn slopes_at_zero_are_those_of_the_formula() {
        assert_eq!(parse("c^2").eval(&[0.0, 0.0]), (0.0, 0.0));
        assert_eq!(parse("(x - 2)^2*c").eval(&[0.0, 1.0]).1, 1.0);
        assert_eq!(parse("(x - 2)^2*c").eval_by(1, &[3.0, 1.0]).1, -6.0);
        assert_eq!(parse("1e5*c + c^1.5").eval(&[0.0, 0.0]), (0.0, 1e5));
        assert_eq!(parse("sqrt(c)").eval(&[0.0, 0.0]).1, f64::INFINITY);
        assert!(parse("log(c)").eval(&[-1.0, 0.0]).0.is_nan());
    }
}
