//! Expressions in the coordinates, with which the user gives gaps, loads, zones and laws of layers.

mod grammar;
mod program;
#[cfg(test)]
mod tests;

pub use grammar::KnownNames;

use crate::data::Data;
use crate::error::{Error, Place, Result};
use grammar::Text;
use program::{Dual, MOST_VARIABLES, Operation, Program, Values};
use schemars::JsonSchema;
use std::fmt;
use std::rc::Rc;
use std::sync::Arc;

/// An expression such as `5e-4 * max(0, 1 - (x - 4)^2)^1.5`, parsed once and cheap to clone.
///
/// It may have + - * / ^, comparisons, && || !, `pi`, and the functions of docs/scene-file.md. -x^2 is -(x^2), and
/// a^b^c is a^(b^c). Comparisons give 1 or 0. A value outside the domain of a function is NaN and stays NaN.
#[derive(Clone, JsonSchema)]
#[schemars(with = "Field")]
pub struct Expression {
    program: Arc<Program>,
    /// Names of the variables of its scope.
    variables: Arc<[&'static str]>,
    /// The text as the user wrote it.
    text: Arc<str>,
    /// The place of the text in the scene.
    place: Place,
}

/// The variables of a [`Field`], in the order of their values: coordinates and the iteration.
const COORDINATES: [&str; 4] = ["x", "y", "z", "k"];

impl Expression {
    /// Return an expression that is not parsed yet; its value is NaN. `place` is that of [`Expression::parse`].
    pub fn uncompiled(text: &str, place: Place) -> Self {
        let program = Arc::new(Program::new(vec![Operation::Number(f64::NAN)]));
        Self { program, variables: [].into(), text: text.into(), place }
    }

    /// Parse a text, which stands at `place` with or without the quotes of a TOML string.
    ///
    /// A name that is not in the scope is refused, with a caret at the name. Files of data are read when the first
    /// expression uses them.
    ///
    /// # Errors
    /// Texts that are no expression, and data that cannot be read.
    pub fn parse(text: &str, place: &Place, scope: KnownNames) -> Result<Self> {
        Self::parse_with(text, place, scope, |slot| slot)
    }

    /// Parse a text; `slot` returns the index of the value for each variable of the scope.
    fn parse_with(text: &str, place: &Place, scope: KnownNames, slot: impl Fn(usize) -> usize) -> Result<Self> {
        debug_assert!(scope.variables.len() <= MOST_VARIABLES);
        let mut code = grammar::parse(Text { text, place }, scope)?;
        for step in &mut code {
            if let Operation::Variable(variable) = step {
                *variable = slot(*variable);
            }
        }
        let program = Arc::new(Program::new(code));
        Ok(Self { program, variables: scope.variables.into(), text: text.into(), place: place.clone() })
    }

    /// Return the value for given values of the variables, in the order of the scope; NaN where it is not defined.
    /// Values beyond the variables are not used.
    pub fn eval(&self, values: &[f64]) -> f64 {
        self.program.eval(&full(values))
    }

    /// Return the value and the derivative by the variable with the index `variable`.
    pub fn eval_by(&self, variable: usize, values: &[f64]) -> (f64, f64) {
        let values = full(values);
        let dual = |slot| Dual { value: values[slot], slope: if slot == variable { 1.0 } else { 0.0 } };
        let Dual { value, slope } = self.program.eval(&std::array::from_fn(dual));
        (value, slope)
    }

    /// Return whether the expression uses no variable.
    pub fn is_constant(&self) -> bool {
        self.program.variables().next().is_none() && self.program.factors().next().is_none()
    }

    /// Return whether it depends on no variable except the first.
    pub fn uses_only_first(&self) -> bool {
        self.program.variables().all(|slot| slot == 0)
    }

    /// Return the data that it uses.
    pub fn data(&self) -> impl Iterator<Item = &Arc<Data>> {
        self.program.data()
    }

    /// Return the refusal of values for which data are needed at a place where they have no value; none if there is no
    /// such place. `what` is the quantity in the message.
    pub fn outside(&self, what: &str, values: &[f64]) -> Option<Error> {
        let (data, place) = self.program.outside(&full(values))?;
        Some(data.outside(&self.place, what, &place))
    }

    /// Return the text as the user wrote it.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Return its place in the scene.
    pub fn place(&self) -> &Place {
        &self.place
    }
}

/// Expressions are equal if they are computed alike, wherever they stand.
impl PartialEq for Expression {
    fn eq(&self, other: &Self) -> bool {
        self.program == other.program
    }
}

impl fmt::Debug for Expression {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Expression({:?})", self.text)
    }
}

/// A number, an expression in x, y, z (and for zones the iteration k), or a function of a Rust program.
#[derive(Clone)]
pub enum Field {
    /// A number, always finite if it comes from a scene.
    Constant(f64),
    /// An expression that depends on the place or on k.
    Expression(Expression),
    /// A function of the place (x, y, z). Scene files have none.
    Function(Rc<dyn Fn([f64; 3]) -> f64>),
}

impl PartialEq for Field {
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Constant(a), Self::Constant(b)) => a == b,
            (Self::Expression(a), Self::Expression(b)) => a == b,
            (Self::Function(a), Self::Function(b)) => Rc::ptr_eq(a, b),
            _ => false,
        }
    }
}

impl From<f64> for Field {
    fn from(value: f64) -> Self {
        Field::Constant(value)
    }
}

impl<F: Fn([f64; 3]) -> f64 + 'static> From<F> for Field {
    fn from(function: F) -> Self {
        Field::Function(Rc::new(function))
    }
}

impl fmt::Debug for Field {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Field({})", self.text())
    }
}

impl Field {
    /// Parse an expression whose variables are coordinates and the iteration: see `Expression::parse`. An expression
    /// without variables becomes a constant.
    ///
    /// # Errors
    /// Those of `Expression::parse`, and a constant that is not finite.
    pub fn parse(text: &str, place: &Place, scope: KnownNames) -> Result<Self> {
        let slot = |variable: usize| coordinate(scope.variables[variable]).unwrap_or(variable);
        let expression = Expression::parse_with(text, place, scope, slot)?;
        if !expression.is_constant() {
            return Ok(Field::Expression(expression));
        }
        match expression.eval(&[]) {
            value if value.is_finite() => Ok(Field::Constant(value)),
            value => Err(expression
                .outside("the expression", &[])
                .unwrap_or_else(|| Error::scene(place, format!("the expression is not a finite number but {value}")))),
        }
    }

    /// Return the value at a point (z = 0 in plane problems), with NaN for k. It is NaN or infinite where the
    /// expression is not defined.
    pub fn eval(&self, x: [f64; 3]) -> f64 {
        self.eval_at(x, f64::NAN)
    }

    /// Return the value of a field that depends on nothing; NaN of any other.
    pub fn number(&self) -> f64 {
        self.eval([f64::NAN; 3])
    }

    /// Return the value at a point in iteration `k`.
    fn eval_at(&self, x: [f64; 3], k: f64) -> f64 {
        match self {
            Field::Constant(value) => *value,
            Field::Expression(expression) => expression.eval(&[x[0], x[1], x[2], k]),
            Field::Function(function) => function(x),
        }
    }

    /// Return the value in iteration `k`, for an expression that depends on nothing else.
    pub fn in_iteration(&self, k: usize) -> f64 {
        self.eval_at([f64::NAN; 3], k as f64)
    }

    /// Return the field of a load step with these factors.
    pub fn in_step(&self, factors: &[f64]) -> Self {
        match self {
            Field::Expression(expression) if self.factors().next().is_some() => {
                let program = Arc::new(expression.program.in_step(factors));
                Field::Expression(Expression { program, ..expression.clone() })
            }
            other => other.clone(),
        }
    }

    /// Return the indices of the factors of load steps that it uses.
    pub fn factors(&self) -> impl Iterator<Item = usize> {
        self.expression().into_iter().flat_map(|expression| expression.program.factors())
    }

    /// Return whether it is a number, the same everywhere.
    pub fn is_constant(&self) -> bool {
        matches!(self, Field::Constant(_))
    }

    /// Return the value at a point. `what` is the quantity in a message ("gap").
    ///
    /// # Errors
    /// A value that is not finite.
    pub fn eval_finite(&self, what: &str, x: [f64; 3]) -> Result<f64> {
        let value = self.eval(x);
        if value.is_finite() { Ok(value) } else { Err(self.refuse(what, &x, value)) }
    }

    /// Return whether it is true, which is a number > 0, at a point in iteration `k`. Messages call it psi.
    ///
    /// # Errors
    /// A point where it is not defined.
    pub fn is_true_at(&self, x: [f64; 3], k: usize) -> Result<bool> {
        let value = self.eval_at(x, k as f64);
        if value.is_nan() { Err(self.refuse("psi", &[x[0], x[1], x[2], k as f64], value)) } else { Ok(value > 0.0) }
    }

    /// Return the data that it uses.
    pub fn data(&self) -> impl Iterator<Item = &Arc<Data>> {
        self.expression().into_iter().flat_map(Expression::data)
    }

    fn expression(&self) -> Option<&Expression> {
        match self {
            Field::Expression(expression) => Some(expression),
            _ => None,
        }
    }

    /// Return whether it is the constant zero.
    pub fn is_zero(&self) -> bool {
        matches!(self, Field::Constant(0.0))
    }

    /// Return the number, the expression as the user wrote it, or the word `function`.
    pub fn text(&self) -> String {
        match self {
            Field::Constant(value) => value.to_string(),
            Field::Expression(expression) => expression.text().to_owned(),
            Field::Function(_) => "function".to_owned(),
        }
    }

    /// Return the place of the expression in the scene, if it is one.
    pub fn place(&self) -> Option<&Place> {
        self.expression().map(Expression::place)
    }

    /// Return the refusal of a value at a point. `values` are those of the coordinates, and of the iteration if it
    /// counts.
    fn refuse(&self, what: &str, values: &[f64], value: f64) -> Error {
        let Field::Expression(expression) = self else {
            let at: Vec<String> = values.iter().map(f64::to_string).collect();
            return Error::new(crate::error::Kind::Scene, format!("{what} is {value} at ({})", at.join(", ")));
        };
        if let Some(error) = expression.outside(what, values) {
            return error;
        }
        let given = |name: &&str| Some(format!("{name} = {}", values.get(coordinate(name)?)?));
        let point: Vec<_> = expression.variables.iter().filter_map(given).collect();
        let at = if point.is_empty() { String::new() } else { format!(" at {}", point.join(", ")) };
        Error::scene(&expression.place, format!("{what} is not a finite number{at}"))
            .label(format!("gives {value} there"))
            .help("keep roots, logarithms and fractional powers to where they are defined, say with max(0, ...)")
    }
}

/// Return the names of the coordinates, and of the `iteration` if it counts.
pub fn coordinates(dimension: usize, iteration: bool) -> Vec<&'static str> {
    let is_known = |name: &&str| match *name {
        "z" => dimension == 3,
        "k" => iteration,
        _ => true,
    };
    COORDINATES.into_iter().filter(is_known).collect()
}

/// Return the index of a variable of a field.
fn coordinate(name: &str) -> Option<usize> {
    COORDINATES.iter().position(|known| *known == name)
}

/// Return as many values as a program takes, NaN for those that are missing.
fn full(values: &[f64]) -> Values<f64> {
    std::array::from_fn(|slot| values.get(slot).copied().unwrap_or(f64::NAN))
}

/// Return the names that have a meaning in some expression, which data must not have.
pub fn names() -> impl Iterator<Item = &'static str> {
    // c is the compression in a layer's law
    program::functions().chain(COORDINATES).chain(["c", "pi"])
}
