//! Elastic constants of bodies and regions, and the axes that they refer to.

use super::pattern::pattern;
use crate::error::{Located, Place, Result};
use crate::expression::Field;
use crate::setting::{Context, Entries, Keys, Node, Setting, TableShape, Value, ValueKind, entries, keys, words};
use serde_json::Value as Json;

/// The elastic constants of a body, or of one of its regions, and their axes.
#[derive(Debug, Clone)]
pub struct ElasticitySpec {
    /// The constants.
    pub constants: Constants,
    /// Axes 1, 2, 3 of the material; x, y, z if `None`.
    pub axes: Option<AxesSpec>,
    /// Place of the constants.
    pub place: Place,
}

/// The elastic constants, each a number or an expression. Moduli are stresses; Poisson's ratios have no unit.
#[derive(Debug, Clone)]
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

/// The directions of the material's axes.
#[derive(Debug, Clone)]
pub enum AxesSpec {
    /// A direction along axis 1, and one towards axis 2.
    Directions {
        /// Direction of axis 1.
        first: [Field; 3],
        /// A vector in the plane of axes 1 and 2, on the side of axis 2. Without it, in plane problems, axis 2 is at a right angle to the
        /// left of axis 1.
        second: Option<[Field; 3]>,
    },
    /// The axes x, y, z, turned about an axis.
    Angle {
        /// The angle, in radians.
        angle: Field,
        /// The axis; z in plane problems.
        axis: [Field; 3],
    },
}

keys! {
    /// A part of a body with constants of its own.
    #[derive(Debug, Clone)]
    pub struct RegionSpec "[[body.region]]" {
        required {
            /// group of its cells
            pub on: Located<String> => pattern,
        }
        besides {
            /// The constants of this part.
            pub elasticity: ElasticitySpec,
        }
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
        match &self.axes {
            Some(AxesSpec::Directions { first, second }) => {
                fields.extend(first.iter().map(|field| ("`first`", field)));
                fields.extend(second.iter().flatten().map(|field| ("`second`", field)));
            }
            Some(AxesSpec::Angle { angle, axis }) => {
                fields.push(("angle", angle));
                fields.extend(axis.iter().map(|field| ("`axis`", field)));
            }
            None => {}
        }
        fields
    }

    /// Return whether no constant and no direction depends on the coordinates.
    pub fn is_constant(&self) -> bool {
        self.fields().iter().all(|(_, field)| field.is_constant())
    }
}

words! {
    /// What a plane problem stands for.
    pub enum Plane "plane" {
        /// No out-of-plane strain.
        Strain = "strain",
        /// No out-of-plane stress.
        Stress = "stress",
        /// A meridian of bodies of revolution: x is the radius, y runs along the axis.
        Axisymmetric = "axisymmetric",
    }
}

/// Add the keys of the elastic constants, which bodies and regions have, behind the first key.
pub(super) fn with_constants(mut table: TableShape) -> TableShape {
    use ValueKind::Field;
    let others = table.keys.split_off(1);
    let mut table = table
        .optional("young", Field, "Young's modulus, > 0")
        .optional("poisson", Field, "Poisson's ratio, between -1 and 0.5")
        .optional("orthotropic", orthotropic_shape(), "orthotropic = { E1 = ..., E2 = ..., E3 = ..., nu12 = ..., ... }")
        .optional("anisotropic", Field.list(), UPPER)
        .optional("axes", axes_shape(), AXES)
        .at_most_one(&["young", "orthotropic", "anisotropic"])
        .not_both(&["poisson"], &["orthotropic", "anisotropic"]);
    table.keys.extend(others);
    table
}

const UPPER: &str = "C11, C12, ..., C16, C22, ..., C66: the upper triangle by rows, in the order 11 22 33 23 13 12";
const AXES: &str = "write first = [1, 1, 0] and second = [-1, 1, 0], or angle = \"pi/6\" and axis = [0, 0, 1]";

fn orthotropic_shape() -> TableShape {
    use ValueKind::Field;
    let table = TableShape::new("the orthotropic material");
    Constants::ORTHOTROPIC.iter().fold(table, |table, name| table.required(name, Field, "a constant of the material"))
}

fn axes_shape() -> TableShape {
    use ValueKind::Field;
    TableShape::new("the axes")
        .optional("first", Field.list(), "direction of axis 1")
        .optional("second", Field.list(), "direction on the side of axis 2")
        .optional("angle", Field, "angle (radian) by which x, y, z are turned")
        .optional("axis", Field.list(), "axis of the turn; z in the plane")
        .not_both(&["first", "second"], &["angle"])
        .at_most_one(&["first", "axis"])
}

impl ElasticitySpec {
    /// Return the elastic constants among the keys of a body or a region.
    pub(super) fn among(keys: &Keys, context: &Context) -> Result<Self> {
        let (constants, place) = if let Some(node) = keys.get("orthotropic") {
            (orthotropic(node, context)?, &node.place)
        } else if let Some(node) = keys.get("anisotropic") {
            (anisotropic(node, context)?, &node.place)
        } else {
            const OTHERS: &str =
                "a material is young and poisson, orthotropic = { E1 = ... } or anisotropic = [C11, ...]";
            let young = keys.require("young").map_err(|error| error.help(OTHERS))?;
            let poisson = keys.require("poisson")?;
            let constants =
                Constants::Isotropic { young: Field::read(young, context)?, poisson: Field::read(poisson, context)? };
            (constants, &young.place)
        };
        let axes = keys.read("axes", |node| axes(node, context))?;
        Ok(Self { constants, axes, place: place.clone() })
    }

    /// Return the echo of the keys of the constants and axes.
    pub(super) fn entries(&self, dimension: usize) -> Entries {
        let constants = match &self.constants {
            Constants::Isotropic { young, poisson } => {
                vec![("young", young.echo(dimension)), ("poisson", poisson.echo(dimension))]
            }
            Constants::Orthotropic(fields) => {
                let named = Constants::ORTHOTROPIC.iter().zip(fields.iter());
                let table: Entries = named.map(|(name, value)| (name.to_string(), value.echo(dimension))).collect();
                vec![("orthotropic", table.into())]
            }
            Constants::Anisotropic(fields) => {
                vec![("anisotropic", fields.iter().map(|field| field.echo(dimension)).collect())]
            }
        };
        let axes = self.axes.iter().map(|axes| ("axes", axes.entries().into()));
        constants.into_iter().chain(axes).map(|(key, value)| (key.to_owned(), value)).collect()
    }
}

impl AxesSpec {
    /// Return the echo; directions have three components in the plane, too.
    fn entries(&self) -> Entries {
        match self {
            Self::Directions { first, second } => entries([("first", first.echo(3)), ("second", second.echo(3))]),
            Self::Angle { angle, axis } => entries([("angle", angle.echo(3)), ("axis", axis.echo(3))]),
        }
    }
}

impl Setting for RegionSpec {
    fn kind() -> ValueKind {
        with_constants(Self::shape()).into()
    }

    fn read(node: &Node, context: &Context) -> Result<Self> {
        let keys = Keys::open(node, &with_constants(Self::shape()))?;
        Self::decode(&keys, context, ElasticitySpec::among(&keys, context)?)
    }

    fn echo(&self, dimension: usize) -> Json {
        let mut entries = self.entries(dimension);
        entries.extend(self.elasticity.entries(dimension));
        entries.into()
    }
}

fn orthotropic(node: &Node, context: &Context) -> Result<Constants> {
    let keys = Keys::open(node, &orthotropic_shape())?;
    let mut fields = [const { Field::Constant(0.0) }; 9];
    for (field, name) in fields.iter_mut().zip(Constants::ORTHOTROPIC) {
        *field = Field::read(keys.require(name)?, context)?;
    }
    Ok(Constants::Orthotropic(Box::new(fields)))
}

fn anisotropic(node: &Node, context: &Context) -> Result<Constants> {
    let items = node.list()?;
    let mut fields = Box::new([const { Field::Constant(0.0) }; 21]);
    if items.len() != fields.len() {
        return Err(node.refuse(format!("an anisotropic material has 21 constants, not {}", items.len())).help(UPPER));
    }
    for (field, item) in fields.iter_mut().zip(items) {
        *field = Field::read(item, context)?;
    }
    Ok(Constants::Anisotropic(fields))
}

fn axes(node: &Node, context: &Context) -> Result<AxesSpec> {
    let keys = Keys::open(node, &axes_shape())?;
    if let Some(angle) = keys.get("angle") {
        let axis = match (keys.get("axis"), context.dimension) {
            (None, 2) => [0.0, 0.0, 1.0].map(Field::Constant),
            (None, _) => direction(keys.require("axis")?, context)?,
            (Some(axis), _) => direction(axis, context)?,
        };
        return Ok(AxesSpec::Angle { angle: Field::read(angle, context)?, axis });
    }
    let first = direction(keys.require("first").map_err(|error| error.help(AXES))?, context)?;
    let second = match (keys.get("second"), context.dimension) {
        (None, 2) => None,
        (None, _) => Some(direction(keys.require("second").map_err(|error| error.help(AXES))?, context)?),
        (Some(second), _) => Some(direction(second, context)?),
    };
    Ok(AxesSpec::Directions { first, second })
}

/// Return a direction in space. In plane problems the third component may be left out.
fn direction(node: &Node, context: &Context) -> Result<[Field; 3]> {
    match &node.value {
        Value::List(items) if context.dimension == 2 && items.len() == 3 => {
            let [x, y, z] = [0, 1, 2].map(|i| Field::read(&items[i], context));
            Ok([x?, y?, z?])
        }
        _ => <[Field; 3]>::read(node, context),
    }
}
