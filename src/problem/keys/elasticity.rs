//! Elastic constants of bodies and regions.

use crate::error::Result;
use crate::expression::Field;
use crate::problem::elasticity::{AxesSpec, Constants, ElasticitySpec, RegionSpec};
use crate::setting::{Context, Entries, Keys, Node, Setting, TableShape, Value, ValueKind, entries};
use serde_json::Value as Json;

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
            let constants = Constants::Isotropic { young: context.field(young)?, poisson: context.field(poisson)? };
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
        *field = context.field(keys.require(name)?)?;
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
        *field = context.field(item)?;
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
        return Ok(AxesSpec::Angle { angle: context.field(angle)?, axis });
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
            let [x, y, z] = [0, 1, 2].map(|i| context.field(&items[i]));
            Ok([x?, y?, z?])
        }
        _ => context.vector(node),
    }
}
