//! Bodies: their names, elements, and what acts on them.

use super::check::{Check, Fault};
use super::compile::{Compile, Names, compile};
use super::elasticity::{AxesSpec, ElasticitySpec, Material, Orthotropic, RegionSpec};
use super::geometry::Geometry;
use super::load::{Load, LoadKind, SpringSpec, Support, one};
use super::order::Order;
use super::pattern::{self, is_pattern};
use super::read::{OneOrVector, Vector, located, refused, tables};
use crate::error::{Error, Located, Place, Result as Checked};
use crate::expression::{Expression, Field};
use crate::petsc::{begins_options, is_family};
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize};

/// A body: a named group of cells with its elasticity, supports and loads. In a scene file the name may be a
/// pattern; the table then stands for all bodies whose names match.
#[derive(Debug, Clone, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BodySpec {
    /// group of cells, or a pattern such as "brick_*" for many bodies
    ///
    /// It has the form of `plain`. It is a prefix of PETSc options, without words of PETSc's own.
    #[serde(deserialize_with = "body_name")]
    pub name: Located<String>,
    /// Young's modulus, > 0
    pub young: Option<Located<Field>>,
    /// Poisson's ratio, between -1 and 0.5
    pub poisson: Option<Located<Field>>,
    /// orthotropic = { E1 = ..., E2 = ..., E3 = ..., nu12 = ..., ... }
    #[serde(default, deserialize_with = "located")]
    pub orthotropic: Option<Located<Orthotropic>>,
    /// C11, C12, ..., C16, C22, ..., C66: the upper triangle by rows, in the order 11 22 33 23 13 12
    pub anisotropic: Option<Located<Vec<Field>>>,
    /// write first = [1, 1, 0] and second = [-1, 1, 0], or angle = "pi/6" and axis = [0, 0, 1]
    #[serde(default, deserialize_with = "located")]
    pub axes: Option<Located<AxesSpec>>,
    /// whether each connected part of the group is a body, NAME_1, NAME_2, ...
    #[serde(default)]
    pub split: bool,
    /// order of the elements, in space 1 or 2; without it 2, and on a mesh file that of the file
    pub order: Option<Order>,
    /// supports: fix = [{ on = "base", x = 0, y = 0 }]
    ///
    /// They prescribe displacement components on named groups.
    #[serde(default, deserialize_with = "tables")]
    pub fix: Vec<Support>,
    /// loads: load = [{ on = "top", pressure = 10 }]
    #[serde(default, deserialize_with = "tables")]
    pub load: Vec<Load>,
    /// springs to the ground: spring = [{ on = "base", stiffness = 100 }]
    #[serde(default, deserialize_with = "tables")]
    pub spring: Vec<SpringSpec>,
    /// force density, one number or expression for each component
    pub force: Option<Vector>,
    /// thermal expansion a degree, one value or one along each axis
    pub expansion: Option<Located<OneOrVector>>,
    /// temperature above that of the stress-free body; it may use factors of load steps
    ///
    /// One that names no factor is multiplied by that of body forces.
    pub temperature: Option<Located<Field>>,
    /// known displacement to compare with, one number or expression for each component
    pub exact: Option<Vec<Expression>>,
    /// a region starts with the line [[body.region]]
    ///
    /// Parts of the body with other elastic constants.
    #[serde(default, rename = "region", deserialize_with = "tables")]
    pub regions: Vec<RegionSpec>,
    /// Factor of the body force at the present load step; 1 without load steps.
    #[serde(skip, default = "one")]
    pub force_factor: f64,
    /// Factor of the temperature at the present load step; 1 without load steps.
    #[serde(skip, default = "one")]
    pub heat_factor: f64,
}

compile!(BodySpec {
    name, young, poisson, orthotropic, anisotropic, axes, fix, load, spring, force, expansion, exact, regions
} else { temperature, split, order, force_factor, heat_factor } then compile_steps);

impl BodySpec {
    /// Compile what changes in load steps: the temperature has their factors as variables, beside the coordinates.
    fn compile_steps(&mut self, names: &Names<'_>) -> Checked<()> {
        self.temperature.compile(&names.in_steps())
    }

    /// Return an isotropic body on the group of cells `name`. Young's modulus (a stress, > 0) and
    /// Poisson's ratio (in (-1, 0.5)) are numbers or functions of the coordinates.
    #[track_caller]
    pub fn new(name: &str, young: impl Into<Field>, poisson: impl Into<Field>) -> Self {
        let place = Place::here("young, poisson");
        let [young, poisson] = [young.into(), poisson.into()].map(|field| Some(Located::new(field, place.clone())));
        let name = Located::here(&plain_pattern(name));
        Self { name, young, poisson, force_factor: 1.0, heat_factor: 1.0, ..Self::default() }
    }

    /// Let each connected part of the group be a body of its own: `NAME_1`, `NAME_2`, ...
    pub fn split(self) -> Self {
        Self { split: true, ..self }
    }

    /// Set the order of the elements, in which a script is meshed, too.
    pub fn order(self, order: Order) -> Self {
        Self { order: Some(order), ..self }
    }

    /// Prescribe displacements (x, y in the plane, x, y, z in space; lengths) on a boundary or at points. `None` leaves
    /// a component free.
    #[track_caller]
    pub fn fix<const N: usize>(mut self, on: &str, value: [Option<f64>; N]) -> Self {
        const { assert!(N <= 3, "displacements have three components at most") };
        let along = |c: usize| value.get(c).copied().flatten().map(|value| Field::Constant(value).into());
        let [x, y, z] = [0, 1, 2].map(along);
        self.fix.push(Support { on: Located::here(on), x, y, z, factor: 1.0, ..Support::default() });
        self
    }

    /// Let a plane surface slide in its plane, without displacement along its normal.
    #[track_caller]
    pub fn symmetry(mut self, on: &str) -> Self {
        let (on, symmetry) = (Located::here(on), Some(true.into()));
        self.fix.push(Support { on, symmetry, factor: 1.0, ..Support::default() });
        self
    }

    /// Add a load on a boundary: pressure or traction (stresses), or a total force.
    #[track_caller]
    pub fn load(mut self, on: &str, kind: LoadKind) -> Self {
        self.load.push(Load { on: Located::here(on), kind, path: None, factor: 1.0 });
        self
    }

    /// Add a traction (x, y in the plane, x, y, z in space; stresses); its components are numbers or functions of the
    /// coordinates.
    #[track_caller]
    pub fn traction<const N: usize>(self, on: &str, traction: [impl Into<Field>; N]) -> Self {
        self.load(on, LoadKind::Traction(traction.map(Into::into).into()))
    }

    /// Add a pressure against the outer normal (a stress, > 0 pushes), a number or a function of the coordinates.
    #[track_caller]
    pub fn pressure(self, on: &str, pressure: impl Into<Field>) -> Self {
        self.load(on, LoadKind::Pressure(pressure.into()))
    }

    /// Set the thermal expansion a degree, the same in all directions, and the temperature above that of the
    /// stress-free body, a number or a function of the coordinates.
    #[track_caller]
    pub fn heated(self, expansion: impl Into<Field>, temperature: impl Into<Field>) -> Self {
        let expansion = Some(Located::new(OneOrVector::One(expansion.into()), Place::here("expansion")));
        Self { expansion, temperature: Some(Located::new(temperature.into(), Place::here("temperature"))), ..self }
    }

    /// Return the elastic constants and their axes.
    pub fn elasticity(&self) -> ElasticitySpec {
        self.material().elasticity(&self.name.place)
    }

    /// Return the keys of the elasticity.
    fn material(&self) -> Material<'_> {
        Material::of([&self.young, &self.poisson], &self.orthotropic, &self.anisotropic, &self.axes, &self.expansion)
    }

    /// Check that the body and its regions all have an expansion where there is a temperature, and none without.
    fn check_heat(&self) -> Checked<()> {
        let of_regions = self.regions.iter().map(|region| (&region.on, &region.expansion));
        for (name, expansion) in std::iter::once((&self.name, &self.expansion)).chain(of_regions) {
            match (expansion, &self.temperature) {
                (Some(expansion), None) => {
                    let error = Error::scene(&expansion.place, "`expansion` in a body without `temperature`");
                    return Err(error.help("give the temperature above that of the stress-free body: temperature = 80"));
                }
                (None, Some(temperature)) => {
                    let message = format!("`temperature` of `{}`, which has no `expansion`", name.value);
                    let help = "a body and its regions have a thermal expansion a degree: expansion = 1.2e-5, or 0";
                    return Err(Error::scene(&temperature.place, message).help(help));
                }
                _ => {}
            }
        }
        Ok(())
    }
}

impl Check for BodySpec {
    /// Check the keys of the body itself. Regions, supports, springs and loads are checked by themselves.
    fn check(&self, geometry: Geometry) -> Result<(), Fault> {
        check_name(&self.name)?;
        self.material().check("[[body]]", geometry)?;
        self.check_heat()?;
        if let Some(order) = self.order.filter(|order| *order > Order::P2 && !geometry.is_plane()) {
            let help = "bodies in space are of order 1 or 2, in the plane from 1 to 8";
            return Err(Fault::new("order", format!("order {} in space", order.degree()), "", help));
        }
        if let Some(force) = &self.force {
            force.check("force", geometry)?;
            if geometry.is_plane() && !force[2].is_zero() {
                return Err(Fault::new("force", "a body force in z in a plane problem", "", ""));
            }
        }
        let count = self.exact.as_ref().map_or(geometry.dimension, Vec::len);
        if count != geometry.dimension {
            let message = format!("a vector has {} components here, not {count}", geometry.dimension);
            return Err(Fault::new("exact", message, "", "give one function for each component of the displacement"));
        }
        Ok(())
    }
}

/// Label and help for a name that is not spelt like the name of a body.
pub const SPELLING: [&str; 2] =
    ["", "it is a prefix of PETSc options: a small letter, then small letters, digits and _"];

/// Return the name of a body as the program writes it: small letters, digits and `_`, beginning with a letter. This is
/// the one rule for names in scenes and for names of groups of cells in mesh files of any format. Capitals become
/// small, other characters `_`, and `body_` stands before a name that begins with something else.
pub fn plain(name: &str) -> String {
    let word: String = name.trim().chars().map(plain_character).collect();
    if word.starts_with(|c: char| c.is_ascii_lowercase()) { word } else { format!("body_{word}") }
}

/// Return a pattern of names of bodies by the rule of `plain`. Signs of patterns stay.
pub fn plain_pattern(text: &str) -> String {
    let mut in_class = false;
    let mut write = |c: char| {
        let is_sign = matches!(c, '*' | '?' | '[' | ']') || in_class && matches!(c, '!' | '-');
        in_class = c == '[' || in_class && c != ']';
        if is_sign { c } else { plain_character(c) }
    };
    if is_pattern(text) { text.trim().chars().map(&mut write).collect() } else { plain(text) }
}

/// Read the name of a body, or a pattern of names, in the form of bodies.
///
/// # Errors
/// An empty text, and a pattern that is none.
pub(super) fn body_name<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Located<String>, D::Error> {
    let name = Located::<String>::deserialize(deserializer)?;
    pattern::check(&name).map_err(refused)?;
    Ok(Located { value: plain_pattern(&name.value), ..name })
}

/// Refuse what cannot be the name of a body, or a pattern of such names.
///
/// # Errors
/// The name, with what to do about it.
pub fn check_name(name: &Located<String>) -> Checked<()> {
    let fault = if is_pattern(name) {
        name.chars().any(|c| !is_in_name(c) && !"*?[]!-".contains(c)).then_some(SPELLING)
    } else {
        fault(name)
    };
    let Some([label, help]) = fault else { return Ok(()) };
    Err(Error::scene(&name.place, format!("`{}` cannot be the name of a body", name.value)).label(label).help(help))
}

fn plain_character(c: char) -> char {
    let small = c.to_ascii_lowercase();
    if is_in_name(small) { small } else { '_' }
}

/// Return whether names of bodies may have this character.
pub fn is_in_name(c: char) -> bool {
    c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_'
}

/// Return why a body cannot have this name and what to do about it, as label and help; `None` for a good name.
///
/// A body called like one of PETSc's own options could not have options of its own. A name in which such a word follows
/// another, as in `brick_sub`, would give the body the options of a solver inside the solver of `brick`
/// (`-brick_sub_ksp_type`).
pub fn fault(name: &str) -> Option<[&'static str; 2]> {
    if !name.starts_with(|c: char| c.is_ascii_lowercase()) || !name.chars().all(is_in_name) {
        return Some(SPELLING);
    }
    // `newton` is the prefix of the solver of all bodies together
    (begins_options(name) || name.split('_').any(is_family) || name == "newton")
        .then_some(["a word of PETSc's own options", "choose another name, also for the physical group in the mesh"])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_have_one_form() {
        for (given, name) in [
            ("lower", "lower"),
            ("Upper Part", "upper_part"),
            (" Part-2.1 ", "part_2_1"),
            ("2nd", "body_2nd"),
            ("Träger", "tr_ger"),
        ] {
            assert_eq!([plain(given), plain(&plain(given)), plain_pattern(given)], [name; 3]);
        }
        assert_eq!(plain_pattern("Part-*"), "part_*");
        assert_eq!(plain_pattern("*B?[!A-C]-[0-9]"), "*b?[!a-c]_[0-9]");
    }

    #[test]
    fn faults_of_names() {
        for name in
            ["ksp", "mg", "snes", "is", "log", "options", "help", "viewer", "mumps", "newton", "brick_sub", "a_pc_b"]
        {
            assert!(fault(name).is_some_and(|[label, _]| label.contains("PETSc")), "{name}");
        }
        for name in ["", "2up", "up-per", "üb", "a b", "Upper"] {
            assert_eq!(fault(name), Some(SPELLING), "{name}");
        }
        assert_eq!(["punch", "upper2", "brick_17", "subway_log", "b_1_22_3_4"].map(fault), [None; 5]);
    }
}
