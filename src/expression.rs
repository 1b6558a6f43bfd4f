//! Numbers that the user may write as expressions in the coordinates: gaps, loads, zones, laws of layers.

mod dual;
mod grammar;
mod operators;
mod slip;
#[cfg(test)]
mod tests;
mod token;

pub use dual::Differentiable;

use crate::error::{Error, Place, Result};
use exmex::{Express, FlatEx, NumberMatcher};
use operators::Operators;
use slip::Slip;
use std::fmt;
use std::sync::Arc;

/// An expression such as `5e-4 * max(0, 1 - (x - 4)^2)^1.5`, parsed once and cheap to clone.
///
/// It knows + - * / ^, comparisons, && || !, `pi`, and the functions of docs/scene-file.md. -x^2 is -(x^2), and
/// a^b^c is a^(b^c). Comparisons give 1 or 0. A value outside the domain of a function is NaN and stays one.
#[derive(Clone)]
pub struct Expression {
    flat: Arc<FlatEx<f64, Operators, NumberMatcher>>,
    /// Which entry of the values each variable of `flat` takes.
    slots: Arc<[usize]>,
    variables: Arc<[&'static str]>,
    text: Arc<str>,
    place: Place,
}

/// What a [`Field`] can depend on, in the order of its values.
const COORDINATES: [&str; 4] = ["x", "y", "z", "k"];
/// Most variables that an expression can use at once.
const MOST_VARIABLES: usize = 4;

impl Expression {
    /// Parses `text`, which stands at `place` (with or without the quotes of a TOML string) and may use up to four
    /// `variables`. Refuses anything else, pointing at the word that is wrong.
    pub fn parse(text: &str, place: &Place, variables: &[&'static str]) -> Result<Self> {
        debug_assert!(variables.len() <= MOST_VARIABLES);
        let refuse = |slip: Slip| slip.into_error(text, place);
        let explicit = grammar::parse(text, variables).map_err(refuse)?;
        let flat = FlatEx::<f64, Operators, NumberMatcher>::parse(&explicit)
            .map_err(|error| refuse(Slip::new(0..text.len(), error.to_string())))?;
        let slot = |name: &String| variables.iter().position(|known| *known == name.as_str());
        Ok(Self {
            slots: flat.var_names().iter().filter_map(slot).collect(),
            flat: Arc::new(flat),
            variables: variables.into(),
            text: text.into(),
            place: place.clone(),
        })
    }

    /// Value for the values of the variables, in the order given to [`Expression::parse`]; NaN where it is not
    /// defined. Values beyond the variables are not used.
    pub fn eval(&self, values: &[f64]) -> f64 {
        let mut used = [f64::NAN; MOST_VARIABLES];
        for (used, slot) in used.iter_mut().zip(self.slots.iter()) {
            *used = values.get(*slot).copied().unwrap_or(f64::NAN);
        }
        self.flat.eval(&used[..self.slots.len()]).unwrap_or(f64::NAN)
    }

    /// Whether the expression uses no variable.
    pub fn is_constant(&self) -> bool {
        self.slots.is_empty()
    }

    /// Whether it depends on no variable but the first.
    pub fn uses_only_first(&self) -> bool {
        self.slots.iter().all(|&slot| slot == 0)
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

/// A number, or an expression in x, y, z (and for zones the iteration k).
#[derive(Debug, Clone)]
pub enum Field {
    /// The same everywhere; always finite when it comes from a scene.
    Constant(f64),
    /// Depends on the place, or on k.
    Expression(Expression),
}

impl Field {
    /// Parses an expression in x, y, in space also z, and with `iteration` also k; see [`Expression::parse`]. One
    /// without variables becomes a constant, and is refused if that is not finite.
    pub fn parse(text: &str, place: &Place, dimension: usize, iteration: bool) -> Result<Self> {
        let names: Vec<_> = COORDINATES
            .into_iter()
            .filter(|name| match *name {
                "z" => dimension == 3,
                "k" => iteration,
                _ => true,
            })
            .collect();
        let mut expression = Expression::parse(text, place, &names)?;
        if expression.is_constant() {
            let value = expression.eval(&[]);
            return match value.is_finite() {
                true => Ok(Field::Constant(value)),
                false => Err(Error::scene(place, format!("the expression is not a finite number but {value}"))),
            };
        }
        expression.slots = expression.flat.var_names().iter().filter_map(|name| coordinate(name)).collect();
        Ok(Field::Expression(expression))
    }

    /// Value at a point (z = 0 in plane problems); NaN or infinite where the expression is not defined, or if it
    /// uses k.
    pub fn eval(&self, x: [f64; 3]) -> f64 {
        match self {
            Field::Constant(value) => *value,
            Field::Expression(expression) => expression.eval(&[x[0], x[1], x[2], f64::NAN]),
        }
    }

    /// Value at a point in iteration `k`.
    pub fn eval_at(&self, x: [f64; 3], k: usize) -> f64 {
        match self {
            Field::Constant(value) => *value,
            Field::Expression(expression) => expression.eval(&[x[0], x[1], x[2], k as f64]),
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

    /// Whether it is the constant zero.
    pub fn is_zero(&self) -> bool {
        matches!(self, Field::Constant(0.0))
    }

    /// The number, or the expression as written.
    pub fn text(&self) -> String {
        match self {
            Field::Constant(value) => value.to_string(),
            Field::Expression(expression) => expression.text().to_owned(),
        }
    }

    /// Where the expression stands; constants do not remember it.
    pub fn place(&self) -> Option<&Place> {
        match self {
            Field::Constant(_) => None,
            Field::Expression(expression) => Some(expression.place()),
        }
    }

    fn refuse(&self, what: &str, values: &[f64], value: f64) -> Error {
        let Field::Expression(expression) = self else {
            return Error::new(crate::error::Kind::Scene, format!("{what} is {value}"));
        };
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
