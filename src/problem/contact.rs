//! Pairs of contact surfaces: two that the scene names, or rules that find pairs.

use super::body::{check_name, plain_pattern};
use super::geometry::Geometry;
use super::layer::LayerSpec;
use super::pattern;
use super::read::{Check, Either, Flaw, Form, checked, kept, positive};
use crate::error::{Error, Located, shown};
use crate::expression::Field;
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// A pair of contact surfaces and the layer between them, or a rule that finds such pairs: contact of all bodies that lie near each other. A pair
/// of named surfaces of two bodies, and a later rule, take precedence.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ContactSpec {
    /// write between = ["one", "other"], or between = "auto" with a distance
    ///
    /// The two physical groups. In a rule that finds pairs both are the word "auto".
    #[serde(serialize_with = "write_between", deserialize_with = "between")]
    #[schemars(with = "Either<String, [String; 2]>")]
    pub between: [Located<String>; 2],
    /// bodies of pairs found by "auto", or patterns: of = ["one_*", "other_*"]
    ///
    /// A body that matches the first name and one that matches the second form a pair. All bodies if `None`.
    #[serde(default, deserialize_with = "of")]
    #[schemars(with = "Option<Vec<String>>")]
    pub of: Option<[Located<String>; 2]>,
    /// give power = { B = 2.5e-5, a = 0.5 } or linear = { stiffness = 1e5 }
    ///
    /// Law of the layer.
    #[serde(deserialize_with = "checked")]
    pub layer: LayerSpec,
    /// how far apart facets of a pair may be; required with "auto"
    ///
    /// Largest distance (a length, > 0) of facets that face each other; any distance if `None`.
    pub distance: Option<f64>,
    /// gap besides the distance of the meshes
    ///
    /// Gap (a length) that is added to the distance of the meshes.
    #[serde(default = "no_gap")]
    pub gap: Field,
    /// largest angle in degrees between normals that face each other
    ///
    /// Largest angle between the normal of one facet and minus that of the other, > 0 and at most 90.
    ///
    /// With the default a normal meets the other surface at most at twice its distance, and a facet covers at most twice its own
    /// area there. Both tend to infinity as the angle grows to a right one.
    #[serde(default = "angle")]
    pub angle: f64,
    /// angle in degrees beyond which facets meet at an edge, with a normal for each side
    ///
    /// It is > 0 and at most 180.
    ///
    /// Twelve chords of a circle, the coarsest mesh of a round part, turn by 30 degrees each. A chamfer turns by 45 degrees. The
    /// default is in between.
    #[serde(default = "edge")]
    pub edge: f64,
    /// whether the distance of the meshes counts as zero
    ///
    /// Then the surfaces are assumed to touch wherever they face each other, and only [`ContactSpec::gap`] counts.
    #[serde(default)]
    pub touching: bool,
    /// what to do where bodies overlap before loading
    #[serde(default)]
    pub overlap: Overlap,
    /// known contact pressure to draw and to compare with
    pub reference: Option<Field>,
    /// Number of the table in the scene, from 0.
    #[serde(skip)]
    pub table: usize,
}

fn no_gap() -> Field {
    Field::Constant(0.0)
}

fn angle() -> f64 {
    60.0
}

fn edge() -> f64 {
    40.0
}

impl ContactSpec {
    /// Return a pair of named surfaces of different bodies, with a layer between them. The gap is the distance of the meshes.
    #[track_caller]
    pub fn new(first: &str, second: &str, layer: LayerSpec) -> Self {
        Self {
            between: [Located::here(first), Located::here(second)],
            of: None,
            layer,
            distance: None,
            gap: Field::Constant(0.0),
            angle: angle(),
            edge: edge(),
            touching: false,
            overlap: Overlap::default(),
            reference: None,
            table: 0,
        }
    }

    /// Set the gap (a length) that is added to the distance of the meshes, a number or a function of the coordinates.
    pub fn gap(self, gap: impl Into<Field>) -> Self {
        Self { gap: gap.into(), ..self }
    }

    /// Return whether it is a rule that finds pairs, and names no surfaces: `between = "auto"`.
    pub fn is_rule(&self) -> bool {
        self.between.iter().all(|name| name.value == AUTO)
    }
}

/// Which of two surfaces carries the contact points of their pairs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Carrier {
    /// Number of the table of the contact in the scene.
    pub table: usize,
    /// Indices of the two bodies, in the order of the scene.
    pub bodies: [usize; 2],
    /// Whether it is the surface of the second body.
    pub is_second: bool,
}

/// What to do about surfaces that overlap before loading.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
pub enum Overlap {
    /// The overlap compresses the layer, and the run warns.
    #[default]
    #[serde(rename = "compress")]
    Compress,
    /// The scene is refused.
    #[serde(rename = "error")]
    Refuse,
}

impl Check for ContactSpec {
    /// Check all but the layer, which is checked by itself.
    fn check(&self, _: Geometry) -> Result<(), Flaw> {
        match self.is_rule() {
            true => self.check_rule()?,
            false => self.check_pair()?,
        }
        positive("angle", "the angle", self.angle)?;
        if self.angle > 90.0 {
            let message = format!("the angle is {} degrees", shown(self.angle));
            return Err(Flaw::new("angle", message, "must be at most 90", ""));
        }
        positive("edge", "the angle of edges", self.edge)?;
        if self.edge > 180.0 {
            let message = format!("the angle of edges is {} degrees", shown(self.edge));
            return Err(Flaw::new("edge", message, "must be at most 180", "at 180 no surface is split"));
        }
        self.distance.map_or(Ok(()), |distance| positive("distance", "the distance", distance))
    }
}

impl ContactSpec {
    /// Check a rule that finds pairs.
    fn check_rule(&self) -> Result<(), Flaw> {
        if self.distance.is_none() {
            let help = "facets of different bodies that face each other at most that far apart form pairs";
            return Err(Flaw::new("", "[[contact]] has no `distance`", "`distance` is missing", help));
        }
        self.of.iter().flatten().try_for_each(check_name)?;
        Ok(())
    }

    /// Check a pair of surfaces: two plain names.
    fn check_pair(&self) -> Result<(), Flaw> {
        let [a, b] = &self.between;
        if a == b {
            let error = Error::scene(&b.place, format!("a contact between `{}` and itself", b.value));
            return Err(error.help("name one surface of each of two bodies").into());
        }
        if self.of.is_some() {
            let help = "it says which bodies form pairs with between = \"auto\"";
            return Err(Flaw::new("of", "`of` for surfaces with names", "", help));
        }
        if let Some(name) = self.between.iter().find(|name| name.contains(['*', '?'])) {
            let help =
                "many pairs are found between bodies: between = \"auto\", of = [\"one_*\", \"other_*\"], distance = D";
            let error = Error::scene(&name.place, format!("the pattern `{}` for one surface", name.value));
            return Err(error.label("one name belongs here").help(help).into());
        }
        Ok(())
    }
}

/// The value of `between` in rules that find pairs, and the name of both surfaces there.
const AUTO: &str = "auto";

const EXAMPLE: &str = "write between = [\"one\", \"other\"], or between = \"auto\" with a distance";

/// Read the two surfaces of a contact. With `between = "auto"` both are the word "auto".
fn between<'de, D: Deserializer<'de>>(deserializer: D) -> Result<[Located<String>; 2], D::Error> {
    let Located { value, place } = Located::<Form<Located<String>>>::deserialize(deserializer)?;
    match value {
        Form::Text(word) if word == AUTO => Ok([(); 2].map(|()| Located::new(word.clone(), place.clone()))),
        Form::Text(word) => Err(kept(Error::scene(&place, format!("a contact between `{word}` alone")).help(EXAMPLE))),
        Form::List(names) => {
            names.iter().try_for_each(pattern::check).map_err(kept)?;
            let count = |_| kept(Error::scene(&place, "a contact is between two surfaces").help(EXAMPLE));
            names.try_into().map_err(count)
        }
        other => Err(other.unexpected()),
    }
}

fn write_between<S: Serializer>(between: &[Located<String>; 2], serializer: S) -> Result<S::Ok, S::Error> {
    match between.each_ref().map(|name| name.value.as_str()) {
        [AUTO, AUTO] => AUTO.serialize(serializer),
        names => names.serialize(serializer),
    }
}

/// Read two names of bodies, or patterns of names.
fn of<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<[Located<String>; 2]>, D::Error> {
    let Located { value: names, place } = Located::<Vec<Located<String>>>::deserialize(deserializer)?;
    let names: [Located<String>; 2] = names.try_into().map_err(|_| {
        kept(Error::scene(&place, "pairs are of two bodies").help("write of = [\"one_*\", \"other_*\"]"))
    })?;
    names.iter().try_for_each(pattern::check).map_err(kept)?;
    Ok(Some(names.map(|name| Located { value: plain_pattern(&name.value), ..name })))
}
