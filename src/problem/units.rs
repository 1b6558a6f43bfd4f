//! Names of the units of a scene: words for labels. Nothing is converted.

use crate::error::suggestion;

/// What a unit is of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Length,
    Stress,
}

/// Known units: of the SI with their power of ten of m or Pa, and those of the inch.
const KNOWN: [(&str, Kind, Option<i32>); 15] = [
    ("m", Kind::Length, Some(0)),
    ("cm", Kind::Length, Some(-2)),
    ("mm", Kind::Length, Some(-3)),
    ("um", Kind::Length, Some(-6)),
    ("µm", Kind::Length, Some(-6)),
    ("nm", Kind::Length, Some(-9)),
    ("in", Kind::Length, None),
    ("Pa", Kind::Stress, Some(0)),
    ("kPa", Kind::Stress, Some(3)),
    ("MPa", Kind::Stress, Some(6)),
    ("N/mm2", Kind::Stress, Some(6)),
    ("N/mm²", Kind::Stress, Some(6)),
    ("GPa", Kind::Stress, Some(9)),
    ("psi", Kind::Stress, None),
    ("ksi", Kind::Stress, None),
];

/// Units of a scene.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Units {
    /// Of coordinates and displacements.
    pub length: &'static str,
    /// Of stresses, pressures and moduli.
    pub stress: &'static str,
    /// Of forces: stress times length squared, in the plane per length of thickness.
    pub force: String,
}

impl Units {
    /// Reads a length and a stress in any order: `mm, MPa`.
    ///
    /// # Errors
    /// In words, with advice: a name that is not known, two of one kind, or a pair that does not fit.
    pub fn parse(text: &str) -> Result<Self, (String, String)> {
        let known = |name: &str| {
            KNOWN.iter().find(|unit| unit.0 == name).ok_or_else(|| {
                let all = KNOWN.map(|unit| unit.0);
                let advice = suggestion(name, all).unwrap_or_else(|| format!("known are {}", all.join(", ")));
                (format!("no unit is called `{name}`"), advice)
            })
        };
        let example = || "for example \"mm, MPa\"".to_owned();
        let names: Vec<&str> = text.split(',').map(str::trim).collect();
        let [first, second] = names[..] else {
            return Err(("expected a length and a stress, with a comma between".to_owned(), example()));
        };
        let (first, second) = (known(first)?, known(second)?);
        let (length, stress) = match (first.1, second.1) {
            (Kind::Length, Kind::Stress) => (first, second),
            (Kind::Stress, Kind::Length) => (second, first),
            (Kind::Length, _) => return Err((format!("`{}` and `{}` are both lengths", first.0, second.0), example())),
            _ => return Err((format!("`{}` and `{}` are both stresses", first.0, second.0), example())),
        };
        let force = match (length.2, stress.2) {
            (Some(length_power), Some(stress_power)) => match stress_power + 2 * length_power {
                -6 => "µN".to_owned(),
                -3 => "mN".to_owned(),
                0 => "N".to_owned(),
                3 => "kN".to_owned(),
                6 => "MN".to_owned(),
                9 => "GN".to_owned(),
                _ => format!("{}·{}²", stress.0, length.0),
            },
            (None, None) => if stress.0 == "psi" { "lbf" } else { "kip" }.to_owned(),
            _ => {
                let message = format!("`{}` and `{}` are of different systems of units", length.0, stress.0);
                return Err((message, "for example \"mm, MPa\" or \"in, psi\"".to_owned()));
            }
        };
        Ok(Self { length: length.0, stress: stress.0, force })
    }

    /// For bodies of the plane, whose forces are per length of thickness.
    pub fn per_thickness(self) -> Self {
        Self { force: format!("{}/{}", self.force, self.length), ..self }
    }

    /// As a scene has it.
    pub fn text(&self) -> String {
        format!("{}, {}", self.length, self.stress)
    }
}

/// Labels of an approach and a contact force.
pub fn force_labels(units: Option<&Units>) -> [String; 2] {
    let (length, force) = units.map(|units| (units.length, units.force.as_str())).unzip();
    [label("approach", length), label("contact force", force)]
}

/// A label with its unit, if there is one.
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
