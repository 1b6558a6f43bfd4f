//! Names of the units of a scene, which are words for labels. Nothing is converted.

use super::read::refused;
use crate::error::{Error, Located};
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize};

/// The units of a scene, which it has as a text: `mm, MPa`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(into = "String")]
#[schemars(with = "String")]
pub struct Units {
    /// Unit of coordinates and displacements.
    pub length: String,
    /// Unit of stresses, pressures and moduli.
    pub stress: String,
    /// Unit of forces: stress times length squared, in the plane per length of thickness.
    pub force: String,
}

impl Units {
    /// Return the units of a length and a stress. The force is in newtons where these two make it so.
    fn new(length: &str, stress: &str) -> Self {
        let force = if is_newton(length, stress) { "N".to_owned() } else { format!("{stress} {length}²") };
        Self { length: length.to_owned(), stress: stress.to_owned(), force }
    }

    /// Return the units for plane bodies, whose forces are per length of thickness.
    pub fn per_thickness(self) -> Self {
        let Self { length, stress, .. } = &self;
        let force = if is_newton(length, stress) { format!("N/{length}") } else { format!("{stress} {length}") };
        Self { force, ..self }
    }
}

/// Whether the product of this stress and the square of this length is a newton.
fn is_newton(length: &str, stress: &str) -> bool {
    [("mm", "MPa"), ("m", "Pa")].contains(&(length, stress))
}

impl From<Units> for String {
    fn from(units: Units) -> Self {
        format!("{}, {}", units.length, units.stress)
    }
}

impl<'de> Deserialize<'de> for Units {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = Located::<String>::deserialize(deserializer)?;
        let refuse = |message: &str| refused(Error::scene(&text.place, message).help("for example \"mm, MPa\""));
        let [length, stress] = text.split(',').map(str::trim).collect::<Vec<_>>()[..] else {
            return Err(refuse("expected a length and a stress, with a comma between"));
        };
        if [length, stress].contains(&"") || length == stress {
            return Err(refuse("a length and a stress have different names"));
        }
        if length.contains("Pa") || ["psi", "ksi"].contains(&length) {
            return Err(refuse("the length comes before the stress"));
        }
        Ok(Self::new(length, stress))
    }
}

/// Return a label with its unit, if there is one.
pub fn label(what: &str, unit: Option<&str>) -> String {
    unit.map_or_else(|| what.to_owned(), |unit| format!("{what}, {unit}"))
}
