//! Names of the units of a scene, which are words for labels. Nothing is converted.

use crate::error::{Result as Checked, suggestion};
use crate::setting::{Context, Node, Setting, ValueKind};
use serde_json::Value as Json;

/// The quantity that a unit measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Quantity {
    Length,
    Stress,
}

/// A known unit.
struct Unit {
    name: &'static str,
    quantity: Quantity,
    /// Power of ten by which it is larger than m or Pa; `None` for units of the inch's system.
    power: Option<i32>,
}

const fn unit(name: &'static str, quantity: Quantity, power: Option<i32>) -> Unit {
    Unit { name, quantity, power }
}

/// The known units: of the SI, and of the inch's system.
static KNOWN: [Unit; 15] = [
    unit("m", Quantity::Length, Some(0)),
    unit("cm", Quantity::Length, Some(-2)),
    unit("mm", Quantity::Length, Some(-3)),
    unit("um", Quantity::Length, Some(-6)),
    unit("µm", Quantity::Length, Some(-6)),
    unit("nm", Quantity::Length, Some(-9)),
    unit("in", Quantity::Length, None),
    unit("Pa", Quantity::Stress, Some(0)),
    unit("kPa", Quantity::Stress, Some(3)),
    unit("MPa", Quantity::Stress, Some(6)),
    unit("N/mm2", Quantity::Stress, Some(6)),
    unit("N/mm²", Quantity::Stress, Some(6)),
    unit("GPa", Quantity::Stress, Some(9)),
    unit("psi", Quantity::Stress, None),
    unit("ksi", Quantity::Stress, None),
];

impl Unit {
    /// Return the unit of a name, or a message and advice.
    fn named(name: &str) -> Result<&'static Self, (String, String)> {
        KNOWN.iter().find(|unit| unit.name == name).ok_or_else(|| {
            let all: Vec<&str> = KNOWN.iter().map(|unit| unit.name).collect();
            let advice =
                suggestion(name, all.iter().copied()).unwrap_or_else(|| format!("known are {}", all.join(", ")));
            (format!("no unit is called `{name}`"), advice)
        })
    }
}

/// The units of a scene.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Units {
    /// Unit of coordinates and displacements.
    pub length: &'static str,
    /// Unit of stresses, pressures and moduli.
    pub stress: &'static str,
    /// Unit of forces: stress times length squared, in the plane per length of thickness.
    pub force: String,
}

impl Units {
    /// Read a length and a stress in any order: `mm, MPa`.
    ///
    /// # Errors
    /// A message and advice, for an unknown name, two units of one quantity, or units of different systems.
    pub fn parse(text: &str) -> Result<Self, (String, String)> {
        let example = || "for example \"mm, MPa\"".to_owned();
        let names: Vec<&str> = text.split(',').map(str::trim).collect();
        let [first, second] = names[..] else {
            return Err(("expected a length and a stress, with a comma between".to_owned(), example()));
        };
        let (first, second) = (Unit::named(first)?, Unit::named(second)?);
        let (length, stress) = match (first.quantity, second.quantity) {
            (Quantity::Length, Quantity::Stress) => (first, second),
            (Quantity::Stress, Quantity::Length) => (second, first),
            (both, _) => {
                let what = if both == Quantity::Length { "lengths" } else { "stresses" };
                return Err((format!("`{}` and `{}` are both {what}", first.name, second.name), example()));
            }
        };
        let force = force(length, stress).ok_or_else(|| {
            let message = format!("`{}` and `{}` are of different systems of units", length.name, stress.name);
            (message, "for example \"mm, MPa\" or \"in, psi\"".to_owned())
        })?;
        Ok(Self { length: length.name, stress: stress.name, force })
    }

    /// Return the units for plane bodies, whose forces are per length of thickness.
    pub fn per_thickness(self) -> Self {
        Self { force: format!("{}/{}", self.force, self.length), ..self }
    }

    /// Return the text that a scene has for these units.
    pub fn text(&self) -> String {
        format!("{}, {}", self.length, self.stress)
    }
}

impl Setting for Units {
    fn kind() -> ValueKind {
        ValueKind::Text
    }

    fn read(node: &Node, _: &Context) -> Checked<Self> {
        Self::parse(node.string()?).map_err(|(message, advice)| node.refuse(message).help(advice))
    }

    fn echo(&self, _: usize) -> Json {
        self.text().into()
    }
}

/// Return the unit of force that belongs to a length and a stress; `None` for units of different systems.
fn force(length: &Unit, stress: &Unit) -> Option<String> {
    let name = match (length.power, stress.power) {
        (Some(length_power), Some(stress_power)) => match stress_power + 2 * length_power {
            -6 => "µN",
            -3 => "mN",
            0 => "N",
            3 => "kN",
            6 => "MN",
            9 => "GN",
            _ => return Some(format!("{}·{}²", stress.name, length.name)),
        },
        (None, None) if stress.name == "psi" => "lbf",
        (None, None) => "kip",
        _ => return None,
    };
    Some(name.to_owned())
}

/// Return the labels of an approach and a contact force.
pub fn force_labels(units: Option<&Units>) -> [String; 2] {
    let (length, force) = units.map(|units| (units.length, units.force.as_str())).unzip();
    [label("approach", length), label("contact force", force)]
}

/// Return a label with its unit, if there is one.
pub fn label(what: &str, unit: Option<&str>) -> String {
    unit.map_or_else(|| what.to_owned(), |unit| format!("{what}, {unit}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forces_follow_from_lengths_and_stresses() {
        for (text, force) in
            [("mm, MPa", "N"), ("Pa,m", "N"), ("m, MPa", "MN"), ("in, psi", "lbf"), ("cm, kPa", "kPa·cm²")]
        {
            assert_eq!(Units::parse(text).expect(text).force, force, "{text}");
        }
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        for (text, words) in [
            ("mm", "expected a length and a stress"),
            ("", "expected a length and a stress"),
            ("mm, MPa, N", "expected a length and a stress"),
            ("mm, m", "both lengths"),
            ("Pa, MPa", "both stresses"),
            ("mm, mpa", "`mpa`"),
            ("mm,", "no unit is called ``"),
            ("in, MPa", "different systems"),
            ("psi, mm", "different systems"),
        ] {
            let (message, advice) = Units::parse(text).expect_err(text);
            assert!(message.contains(words) && !advice.is_empty(), "{text}: {message}, {advice}");
        }
        assert!(Units::parse("mm, mpa").unwrap_err().1.contains("MPa"));
    }
}
