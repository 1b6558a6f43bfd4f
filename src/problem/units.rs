//! Names of the units of a scene, which are words for labels. Nothing is converted.

use crate::error::{Result as Checked, suggestion};
use crate::setting::{Context, Node, Setting, ValueKind};
use serde_json::Value as Json;

/// A name, and the power of ten by which the unit is larger than m or Pa; `None` for units of the inch's system.
type Unit = (&'static str, Option<i32>);

const LENGTHS: [Unit; 7] = [
    ("m", Some(0)),
    ("cm", Some(-2)),
    ("mm", Some(-3)),
    ("um", Some(-6)),
    ("µm", Some(-6)),
    ("nm", Some(-9)),
    ("in", None),
];

const STRESSES: [Unit; 8] = [
    ("Pa", Some(0)),
    ("kPa", Some(3)),
    ("MPa", Some(6)),
    ("N/mm2", Some(6)),
    ("N/mm²", Some(6)),
    ("GPa", Some(9)),
    ("psi", None),
    ("ksi", None),
];

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
        let all = || LENGTHS.iter().chain(&STRESSES).map(|(name, _)| *name);
        if let Some(name) = [first, second].into_iter().find(|name| all().all(|known| known != *name)) {
            let list = || format!("known are {}", all().collect::<Vec<_>>().join(", "));
            return Err((format!("no unit is called `{name}`"), suggestion(name, all()).unwrap_or_else(list)));
        }
        let find = |units: &[Unit]| units.iter().find(|(name, _)| [first, second].contains(name)).copied();
        let (length, stress) = match (find(&LENGTHS), find(&STRESSES)) {
            (Some(length), Some(stress)) => (length, stress),
            (length, _) => {
                let what = if length.is_some() { "lengths" } else { "stresses" };
                return Err((format!("`{first}` and `{second}` are both {what}"), example()));
            }
        };
        let force = force(length, stress).ok_or_else(|| {
            let message = format!("`{}` and `{}` are of different systems of units", length.0, stress.0);
            (message, "for example \"mm, MPa\" or \"in, psi\"".to_owned())
        })?;
        Ok(Self { length: length.0, stress: stress.0, force })
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
fn force((length, length_power): Unit, (stress, stress_power): Unit) -> Option<String> {
    let name = match (length_power, stress_power) {
        (Some(length_power), Some(stress_power)) => match stress_power + 2 * length_power {
            -6 => "µN",
            -3 => "mN",
            0 => "N",
            3 => "kN",
            6 => "MN",
            9 => "GN",
            _ => return Some(format!("{stress}·{length}²")),
        },
        (None, None) if stress == "psi" => "lbf",
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
