//! Elastic constants of bodies and regions, and the axes that they refer to.

use super::check::{Check, Fault, positive};
use super::compile::compile;
use super::geometry::Geometry;
use super::pattern;
use super::read::{OneOrVector, Vector, located, only_one, place};
use crate::error::{Located, Place, shown};
use crate::expression::Field;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The elastic constants of a body, or of one of its regions, and their axes.
#[derive(Debug, Clone)]
pub struct ElasticitySpec {
    /// The constants.
    pub constants: Constants,
    /// Axes 1, 2, 3 of the material; x, y, z if `None`.
    pub axes: Option<AxesSpec>,
    /// Thermal expansion a degree, along all directions or along each axis.
    pub expansion: Option<OneOrVector>,
    /// Place of the constants.
    pub place: Place,
}

/// Constants are equal wherever they stand. An expansion is a load, and no part of the stiffness.
impl PartialEq for ElasticitySpec {
    fn eq(&self, other: &Self) -> bool {
        (&self.constants, &self.axes) == (&other.constants, &other.axes)
    }
}

/// The elastic constants, each a number or an expression. Moduli are stresses; Poisson's ratios have no unit.
#[derive(Debug, Clone, PartialEq)]
pub enum Constants {
    /// Young's modulus and Poisson's ratio.
    Isotropic {
        /// Young's modulus, > 0.
        young: Field,
        /// Poisson's ratio, in (-1, 0.5).
        poisson: Field,
    },
    /// E1 E2 E3 nu12 nu13 nu23 G12 G13 G23: nu12 is the contraction along axis 2 under tension along axis 1.
    Orthotropic(Box<[Field; 9]>),
    /// C11 C12 ... C16 C22 ... C66: the upper triangle of C by rows, in Voigt's order 11 22 33 23 13 12.
    Anisotropic(Box<[Field; 21]>),
}

/// The axes of a material: a direction along axis 1 and one towards axis 2, or x, y, z turned about an axis.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AxesSpec {
    /// direction of axis 1
    pub first: Option<Located<Vector>>,
    /// direction on the side of axis 2
    ///
    /// Without it, in plane problems, axis 2 is at a right angle to the left of axis 1.
    pub second: Option<Located<Vector>>,
    /// angle (radian) by which x, y, z are turned
    pub angle: Option<Located<Field>>,
    /// axis of the turn; z in the plane
    pub axis: Option<Located<Vector>>,
}

compile!(AxesSpec { first, second, angle, axis } else {});

/// A part of a body with constants of its own.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RegionSpec {
    /// group of its cells
    pub on: Located<String>,
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
    /// thermal expansion a degree, one value or one along each axis, for the `temperature` of the body
    pub expansion: Option<Located<OneOrVector>>,
}

compile!(RegionSpec { on, young, poisson, orthotropic, anisotropic, axes, expansion } else {});

impl RegionSpec {
    /// Return the elastic constants and their axes.
    pub fn elasticity(&self) -> ElasticitySpec {
        self.material().elasticity(&self.on.place)
    }

    /// Return the keys of the elasticity.
    fn material(&self) -> Material<'_> {
        Material::of([&self.young, &self.poisson], &self.orthotropic, &self.anisotropic, &self.axes, &self.expansion)
    }
}

impl Check for RegionSpec {
    fn check(&self, geometry: Geometry) -> Result<(), Fault> {
        pattern::check(&self.on)?;
        self.material().check("[[body.region]]", geometry)
    }
}

/// The nine constants of an orthotropic material.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Orthotropic {
    /// Young's modulus along axis 1
    #[serde(rename = "E1")]
    pub e1: Field,
    /// Young's modulus along axis 2
    #[serde(rename = "E2")]
    pub e2: Field,
    /// Young's modulus along axis 3
    #[serde(rename = "E3")]
    pub e3: Field,
    /// contraction along axis 2 under tension along axis 1
    pub nu12: Field,
    /// contraction along axis 3 under tension along axis 1
    pub nu13: Field,
    /// contraction along axis 3 under tension along axis 2
    pub nu23: Field,
    /// shear modulus of axes 1 and 2
    #[serde(rename = "G12")]
    pub g12: Field,
    /// shear modulus of axes 1 and 3
    #[serde(rename = "G13")]
    pub g13: Field,
    /// shear modulus of axes 2 and 3
    #[serde(rename = "G23")]
    pub g23: Field,
}

compile!(Orthotropic { e1, e2, e3, nu12, nu13, nu23, g12, g13, g23 } else {});

impl AxesSpec {
    fn check(&self, geometry: Geometry) -> Result<(), Fault> {
        let Self { first, second, angle, axis } = self;
        for [a, b] in [
            [("first", place(first)), ("angle", place(angle))],
            [("second", place(second)), ("angle", place(angle))],
            [("first", place(first)), ("axis", place(axis))],
        ] {
            only_one("the axes", &[a, b])?;
        }
        for (key, direction) in [("first", first), ("second", second), ("axis", axis)] {
            // in the plane the third component may be left out
            let short = direction.as_ref().filter(|vector| !vector.is_in_space());
            short.map_or(Ok(()), |vector| vector.check(&format!("axes.{key}"), geometry))?;
        }
        let missing = match (angle, first) {
            (Some(_), _) if axis.is_none() && !geometry.is_plane() => "axis",
            (None, None) => "first",
            (None, Some(_)) if second.is_none() && !geometry.is_plane() => "second",
            _ => return Ok(()),
        };
        Err(Fault::new("axes", format!("the axes have no `{missing}`"), &format!("`{missing}` is missing"), AXES))
    }
}

impl Constants {
    /// The names of the orthotropic constants.
    pub const ORTHOTROPIC: [&'static str; 9] = ["E1", "E2", "E3", "nu12", "nu13", "nu23", "G12", "G13", "G23"];
}

impl ElasticitySpec {
    /// Return all constants and directions, with their names in messages.
    pub fn fields(&self) -> Vec<(&'static str, &Field)> {
        let mut fields: Vec<(&str, &Field)> = match &self.constants {
            Constants::Isotropic { young, poisson } => vec![("young", young), ("poisson", poisson)],
            Constants::Orthotropic(fields) => Constants::ORTHOTROPIC.into_iter().zip(fields.iter()).collect(),
            Constants::Anisotropic(fields) => fields.iter().map(|field| ("an elastic constant", field)).collect(),
        };
        if let Some(AxesSpec { first, second, angle, axis }) = &self.axes {
            for (name, direction) in [("`first`", first), ("`second`", second), ("`axis`", axis)] {
                fields.extend(direction.iter().flat_map(|vector| vector.iter()).map(|field| (name, field)));
            }
            fields.extend(angle.iter().map(|angle| ("angle", &angle.value)));
        }
        fields
    }

    /// Return whether no constant and no direction depends on the coordinates.
    pub fn is_constant(&self) -> bool {
        self.fields().iter().all(|(_, field)| field.is_constant())
    }
}

/// The keys of the elasticity of a body or a region.
pub(super) struct Material<'a> {
    young: Option<&'a Located<Field>>,
    poisson: Option<&'a Located<Field>>,
    orthotropic: Option<&'a Located<Orthotropic>>,
    anisotropic: Option<&'a Located<Vec<Field>>>,
    axes: Option<&'a Located<AxesSpec>>,
    expansion: Option<&'a Located<OneOrVector>>,
}

/// Advice for the constants of an anisotropic material.
const UPPER: &str = "C11, C12, ..., C16, C22, ..., C66: the upper triangle by rows, in the order 11 22 33 23 13 12";

/// Advice for axes.
const AXES: &str = "write first = [1, 1, 0] and second = [-1, 1, 0], or angle = \"pi/6\" and axis = [0, 0, 1]";

impl<'a> Material<'a> {
    /// Collect the keys.
    pub fn of(
        [young, poisson]: [&'a Option<Located<Field>>; 2],
        orthotropic: &'a Option<Located<Orthotropic>>,
        anisotropic: &'a Option<Located<Vec<Field>>>,
        axes: &'a Option<Located<AxesSpec>>,
        expansion: &'a Option<Located<OneOrVector>>,
    ) -> Self {
        let (young, poisson, axes) = (young.as_ref(), poisson.as_ref(), axes.as_ref());
        let (orthotropic, anisotropic) = (orthotropic.as_ref(), anisotropic.as_ref());
        Self { young, poisson, orthotropic, anisotropic, axes, expansion: expansion.as_ref() }
    }

    /// Check the keys; `table` is the name of their table in messages.
    pub fn check(&self, table: &str, geometry: Geometry) -> Result<(), Fault> {
        let Self { young, poisson, orthotropic, anisotropic, axes, expansion } = *self;
        let has_directions = match expansion.map(|expansion| &expansion.value) {
            Some(OneOrVector::Vector(vector)) if !vector.is_in_space() => {
                let help = "one value for all directions, or three along the axes 1, 2, 3, also in the plane";
                return Err(Fault::new("expansion", "an expansion has one value or three", "", help));
            }
            expansion => matches!(expansion, Some(OneOrVector::Vector(_))),
        };
        let [tensor, matrix] =
            [("orthotropic", orthotropic.map(|all| &all.place)), ("anisotropic", anisotropic.map(|all| &all.place))];
        for (key, value) in [("young", young), ("poisson", poisson)] {
            only_one(table, &[(key, value.map(|value| &value.place)), tensor, matrix])?;
        }
        if let Some(constants) = anisotropic.filter(|constants| constants.len() != 21) {
            let message = format!("an anisotropic material has 21 constants, not {}", constants.len());
            return Err(Fault::new("anisotropic", message, "", UPPER));
        }
        if tensor.1.or(matrix.1).is_some() {
            return axes.map_or(Ok(()), |axes| axes.check(geometry));
        }
        let others = "a material is young and poisson, orthotropic = { E1 = ... } or anisotropic = [C11, ...]";
        for (key, value) in [("young", young), ("poisson", poisson)] {
            if value.is_none() {
                return Err(Fault::new("", format!("{table} has no `{key}`"), &format!("`{key}` is missing"), others));
            }
        }
        check_isotropic(young.map(|young| &young.value), poisson.map(|poisson| &poisson.value))?;
        match axes {
            None => Ok(()),
            Some(axes) if has_directions => axes.check(geometry),
            Some(_) => Err(Fault::new(
                "axes",
                "axes of an isotropic material",
                "all directions are alike",
                "remove them, or give orthotropic or anisotropic constants",
            )),
        }
    }

    /// Return the elastic constants; `near` is their place if they have none.
    pub fn elasticity(&self, near: &Place) -> ElasticitySpec {
        let (constants, place) = match (self.orthotropic, self.anisotropic) {
            (Some(Located { value, place }), _) => {
                let Orthotropic { e1, e2, e3, nu12, nu13, nu23, g12, g13, g23 } = value.clone();
                (Constants::Orthotropic(Box::new([e1, e2, e3, nu12, nu13, nu23, g12, g13, g23])), place)
            }
            (None, Some(Located { value, place })) => {
                let at = |k: usize| value.get(k).cloned().unwrap_or(Field::Constant(0.0));
                (Constants::Anisotropic(Box::new(std::array::from_fn(at))), place)
            }
            (None, None) => {
                let value =
                    |field: Option<&Located<Field>>| field.map_or(Field::Constant(0.0), |field| field.value.clone());
                let constants = Constants::Isotropic { young: value(self.young), poisson: value(self.poisson) };
                (constants, self.young.map_or(near, |young| &young.place))
            }
        };
        let (axes, expansion) = (self.axes.map(|axes| axes.value.clone()), self.expansion.map(|all| all.value.clone()));
        ElasticitySpec { constants, axes, expansion, place: place.clone() }
    }
}

fn check_isotropic(young: Option<&Field>, poisson: Option<&Field>) -> Result<(), Fault> {
    if let Some(Field::Constant(young)) = young {
        positive("young", "Young's modulus", *young)?;
    }
    match poisson {
        Some(&Field::Constant(value)) if !(value > -1.0 && value < 0.5) => {
            let help = "incompressible bodies are not possible; take 0.4999 and order = 2, say";
            let message = format!("Poisson's ratio is {}", shown(value));
            let help = if value == 0.5 { help } else { "" };
            Err(Fault::new("poisson", message, "must lie between -1 and 0.5", help))
        }
        _ => Ok(()),
    }
}
