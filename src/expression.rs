//! Numbers that the user may write as expressions in the coordinates: gaps, loads, zones, laws of layers.

mod dual;
mod grammar;
mod operators;
mod program;
mod scope;
#[cfg(test)]
mod tests;
mod text;
mod token;

pub use scope::Scope;

use crate::data::{Data, Library};
use crate::error::{Error, Place, Result};
use dual::Dual;
use program::{MOST_VARIABLES, Program, Step, Values};
use std::fmt;
use std::rc::Rc;
use std::sync::Arc;
use text::Text;

/// An expression such as `5e-4 * max(0, 1 - (x - 4)^2)^1.5`, parsed once and cheap to clone.
///
/// It knows + - * / ^, comparisons, && || !, `pi`, and the functions of docs/scene-file.md. -x^2 is -(x^2), and
/// a^b^c is a^(b^c). Comparisons give 1 or 0. A value outside the domain of a function is NaN and stays one.
#[derive(Clone)]
pub struct Expression {
    program: Arc<Program>,
    variables: Arc<[&'static str]>,
    text: Arc<str>,
    place: Place,
}

/// What a [`Field`] can depend on, in the order of its values.
const COORDINATES: [&str; 4] = ["x", "y", "z", "k"];

impl Expression {
    /// Parses `text`, which stands at `place` (with or without the quotes of a TOML string). Refuses what the scope has not, pointing at
    /// the word that is wrong; files of data are read when the first expression asks for them.
    ///
    /// # Errors
    /// Texts that are no expression, and data that cannot be read.
    pub fn parse(text: &str, place: &Place, scope: Scope) -> Result<Self> {
        Self::made(text, place, scope, |slot| slot)
    }

    /// The same; `slot` says which value each variable of the scope takes.
    fn made(text: &str, place: &Place, scope: Scope, slot: impl Fn(usize) -> usize) -> Result<Self> {
        debug_assert!(scope.variables.len() <= MOST_VARIABLES);
        let mut code = grammar::parse(Text { text, place }, scope)?;
        for step in &mut code {
            if let Step::Variable(variable) = step {
                *variable = slot(*variable);
            }
        }
        let program = Arc::new(Program::new(code));
        Ok(Self { program, variables: scope.variables.into(), text: text.into(), place: place.clone() })
    }

    /// Value for the values of the variables, in the order given to [`Expression::parse`]; NaN where it is not
    /// defined. Values beyond the variables are not used.
    pub fn eval(&self, values: &[f64]) -> f64 {
        self.program.eval(&full(values))
    }

    /// The same with the derivative by the variable of this number.
    pub fn eval_by(&self, variable: usize, values: &[f64]) -> (f64, f64) {
        let values = full(values);
        let dual = |slot| Dual { value: values[slot], slope: if slot == variable { 1.0 } else { 0.0 } };
        let Dual { value, slope } = self.program.eval(&std::array::from_fn(dual));
        (value, slope)
    }

    /// Whether the expression uses no variable.
    pub fn is_constant(&self) -> bool {
        self.program.variables().next().is_none()
    }

    /// Whether it depends on no variable but the first.
    pub fn uses_only_first(&self) -> bool {
        self.program.variables().all(|slot| slot == 0)
    }

    /// The data that it asks.
    pub fn data(&self) -> impl Iterator<Item = &Arc<Data>> {
        self.program.data()
    }

    /// The refusal of values outside of data, if that is why there is none; `what` names the quantity.
    pub fn outside(&self, what: &str, values: &[f64]) -> Option<Error> {
        let (data, place) = self.program.outside(&full(values))?;
        Some(data.outside(&self.place, what, &place))
    }

    /// The text as the user wrote it.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Where it stands.
    pub fn place(&self) -> &Place {
        &self.place
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
    /// The same everywhere; always finite when it comes from a scene.
    Constant(f64),
    /// Depends on the place, or on k.
    Expression(Expression),
    /// Depends on the place (x, y, z); no scene file has it.
    Function(Rc<dyn Fn([f64; 3]) -> f64>),
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
    /// Parses an expression in x, y, in space also z, and with `iteration` also k; see [`Expression::parse`]. One
    /// without variables becomes a constant, and is refused if that is not finite.
    pub fn parse(text: &str, place: &Place, dimension: usize, iteration: bool, data: &Library) -> Result<Self> {
        let names: Vec<_> = COORDINATES
            .into_iter()
            .filter(|name| match *name {
                "z" => dimension == 3,
                "k" => iteration,
                _ => true,
            })
            .collect();
        let slot = |variable: usize| coordinate(names[variable]).unwrap_or(variable);
        let expression = Expression::made(text, place, Scope { variables: &names, data }, slot)?;
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

    /// Value at a point (z = 0 in plane problems); NaN or infinite where the expression is not defined, or if it
    /// uses k.
    pub fn eval(&self, x: [f64; 3]) -> f64 {
        match self {
            Field::Constant(value) => *value,
            Field::Expression(expression) => expression.eval(&[x[0], x[1], x[2], f64::NAN]),
            Field::Function(function) => function(x),
        }
    }

    /// Value at a point in iteration `k`.
    pub fn eval_at(&self, x: [f64; 3], k: usize) -> f64 {
        match self {
            Field::Constant(value) => *value,
            Field::Expression(expression) => expression.eval(&[x[0], x[1], x[2], k as f64]),
            Field::Function(function) => function(x),
        }
    }

    /// Whether it is the same everywhere.
    pub fn is_constant(&self) -> bool {
        matches!(self, Field::Constant(_))
    }

    /// Value at a point, refused if it is not finite; `what` names the quantity in the message ("gap").
    pub fn eval_finite(&self, what: &str, x: [f64; 3]) -> Result<f64> {
        let value = self.eval(x);
        if value.is_finite() { Ok(value) } else { Err(self.refuse(what, &x, value)) }
    }

    /// Whether it holds at a point in iteration `k`: true, or a number > 0. Refused where it is not defined; `what` names it in
    /// the message ("psi").
    pub fn is_true_at(&self, what: &str, x: [f64; 3], k: usize) -> Result<bool> {
        let value = self.eval_at(x, k);
        if value.is_nan() { Err(self.refuse(what, &[x[0], x[1], x[2], k as f64], value)) } else { Ok(value > 0.0) }
    }

    /// The data that it asks.
    pub fn data(&self) -> impl Iterator<Item = &Arc<Data>> {
        match self {
            Field::Expression(expression) => Some(expression.data()),
            _ => None,
        }
        .into_iter()
        .flatten()
    }

    /// Whether it is the constant zero.
    pub fn is_zero(&self) -> bool {
        matches!(self, Field::Constant(0.0))
    }

    /// The number, the expression as written, or the word `function`.
    pub fn text(&self) -> String {
        match self {
            Field::Constant(value) => value.to_string(),
            Field::Expression(expression) => expression.text().to_owned(),
            Field::Function(_) => "function".to_owned(),
        }
    }

    /// Where the expression stands, if it is one.
    pub fn place(&self) -> Option<&Place> {
        match self {
            Field::Expression(expression) => Some(expression.place()),
            _ => None,
        }
    }

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
        Error::scene(&expression.place, format!("{what} is not a finite number at {}", point.join(", ")))
            .label(format!("gives {value} there"))
            .help("keep roots, logarithms and fractional powers to where they are defined, say with max(0, ...)")
    }
}

fn coordinate(name: &str) -> Option<usize> {
    COORDINATES.iter().position(|known| *known == name)
}

fn full(values: &[f64]) -> Values<f64> {
    std::array::from_fn(|slot| values.get(slot).copied().unwrap_or(f64::NAN))
}

/// Names that have a meaning in every expression.
pub fn names() -> impl Iterator<Item = &'static str> {
    // c is the compression in a layer's law
    operators::functions().chain(COORDINATES).chain(["c", "pi"])
}
