//! Elastic constants of bodies and regions.

use super::{Decoder, Keys, Node, TableShape, Value, ValueKind, pattern};
use crate::error::Result;
use crate::expression::Field;
use crate::problem::elasticity::{AxesSpec, Constants, ElasticitySpec, RegionSpec};

/// Add the keys of the elastic constants, which bodies and regions have.
pub(super) fn with_constants(table: TableShape) -> TableShape {
    use ValueKind::Field;
    table
        .optional("young", Field, "Young's modulus, > 0")
        .optional("poisson", Field, "Poisson's ratio, between -1 and 0.5")
        .optional("orthotropic", orthotropic_shape(), "orthotropic = { E1 = ..., E2 = ..., E3 = ..., nu12 = ..., ... }")
        .optional("anisotropic", Field.list(), UPPER)
        .optional("axes", axes_shape(), AXES)
        .at_most_one(&["young", "orthotropic", "anisotropic"])
        .not_both(&["poisson"], &["orthotropic", "anisotropic"])
}

/// Return the shape of `[[body.region]]`.
pub(super) fn region_shape() -> TableShape {
    use ValueKind::Text;
    with_constants(TableShape::new("[[body.region]]").required("on", Text, "group of its cells"))
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

impl Decoder<'_> {
    /// Return the elastic constants among the keys of a body or a region.
    pub(super) fn elasticity(&self, keys: &Keys) -> Result<ElasticitySpec> {
        let (constants, place) = if let Some(node) = keys.get("orthotropic") {
            (self.orthotropic(node)?, &node.place)
        } else if let Some(node) = keys.get("anisotropic") {
            (self.anisotropic(node)?, &node.place)
        } else {
            const OTHERS: &str =
                "a material is young and poisson, orthotropic = { E1 = ... } or anisotropic = [C11, ...]";
            let young = keys.require("young").map_err(|error| error.help(OTHERS))?;
            let poisson = keys.require("poisson")?;
            let constants = Constants::Isotropic { young: self.field(young)?, poisson: self.field(poisson)? };
            (constants, &young.place)
        };
        let axes = keys.read("axes", |node| self.axes(node))?;
        Ok(ElasticitySpec { constants, axes, place: place.clone() })
    }

    /// Return a part of a body with constants of its own.
    pub(super) fn region(&self, node: &Node) -> Result<RegionSpec> {
        let keys = Keys::open(node, &region_shape())?;
        Ok(RegionSpec { on: pattern(keys.require("on")?)?, elasticity: self.elasticity(&keys)? })
    }

    fn orthotropic(&self, node: &Node) -> Result<Constants> {
        let keys = Keys::open(node, &orthotropic_shape())?;
        let mut fields = [const { Field::Constant(0.0) }; 9];
        for (field, name) in fields.iter_mut().zip(Constants::ORTHOTROPIC) {
            *field = self.field(keys.require(name)?)?;
        }
        Ok(Constants::Orthotropic(Box::new(fields)))
    }

    fn anisotropic(&self, node: &Node) -> Result<Constants> {
        let items = node.list()?;
        let mut fields = Box::new([const { Field::Constant(0.0) }; 21]);
        if items.len() != fields.len() {
            return Err(node
                .refuse(format!("an anisotropic material has 21 constants, not {}", items.len()))
                .help(UPPER));
        }
        for (field, item) in fields.iter_mut().zip(items) {
            *field = self.field(item)?;
        }
        Ok(Constants::Anisotropic(fields))
    }

    fn axes(&self, node: &Node) -> Result<AxesSpec> {
        let keys = Keys::open(node, &axes_shape())?;
        if let Some(angle) = keys.get("angle") {
            let axis = match (keys.get("axis"), self.dimension) {
                (None, 2) => [0.0, 0.0, 1.0].map(Field::Constant),
                (None, _) => self.direction(keys.require("axis")?)?,
                (Some(axis), _) => self.direction(axis)?,
            };
            return Ok(AxesSpec::Angle { angle: self.field(angle)?, axis });
        }
        let first = self.direction(keys.require("first").map_err(|error| error.help(AXES))?)?;
        let second = match (keys.get("second"), self.dimension) {
            (None, 2) => None,
            (None, _) => Some(self.direction(keys.require("second").map_err(|error| error.help(AXES))?)?),
            (Some(second), _) => Some(self.direction(second)?),
        };
        Ok(AxesSpec::Directions { first, second })
    }

    /// Return a direction in space. In plane problems the third component may be left out.
    fn direction(&self, node: &Node) -> Result<[Field; 3]> {
        match &node.value {
            Value::List(items) if self.dimension == 2 && items.len() == 3 => {
                let [x, y, z] = [0, 1, 2].map(|i| self.field(&items[i]));
                Ok([x?, y?, z?])
            }
            _ => self.vector(node),
        }
    }
}
