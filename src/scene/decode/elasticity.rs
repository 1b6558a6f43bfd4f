//! Elastic constants of bodies and regions.

use super::Decoder;
use crate::error::{Error, Result, shown};
use crate::expression::Field;
use crate::problem::elasticity::{AxesSpec, Constants, ElasticitySpec, RegionSpec};
use crate::scene::read::{Keys, Node, Value};

/// Keys that say what a body is made of.
pub const KEYS: [&str; 5] = ["young", "poisson", "orthotropic", "anisotropic", "axes"];

impl Decoder<'_> {
    /// The constants among the keys of a body or a region.
    pub(super) fn elasticity(&self, keys: &Keys) -> Result<ElasticitySpec> {
        for (first, second) in [("young", "orthotropic"), ("young", "anisotropic"), ("orthotropic", "anisotropic")] {
            keys.exclude(first, second)?;
        }
        let (constants, place) = if let Some(node) = keys.get("orthotropic") {
            keys.exclude("poisson", "orthotropic")?;
            (self.orthotropic(node)?, &node.place)
        } else if let Some(node) = keys.get("anisotropic") {
            keys.exclude("poisson", "anisotropic")?;
            (self.anisotropic(node)?, &node.place)
        } else {
            const OTHERS: &str =
                "a material is young and poisson, orthotropic = { E1 = ... } or anisotropic = [C11, ...]";
            let young = keys.require("young").map_err(|error| error.help(OTHERS))?;
            let poisson = keys.require("poisson")?;
            let constants = Constants::Isotropic {
                young: self.positive_field(young, "Young's modulus")?,
                poisson: self.poisson(poisson)?,
            };
            (constants, &young.place)
        };
        let axes = match (keys.entry("axes"), &constants) {
            (Some(entry), Constants::Isotropic { .. }) => {
                return Err(Error::scene(&entry.key_place, "axes of an isotropic material")
                    .label("all directions are alike")
                    .help("remove them, or give orthotropic or anisotropic constants"));
            }
            (entry, _) => entry.map(|entry| self.axes(&entry.node)).transpose()?,
        };
        Ok(ElasticitySpec { constants, axes, place: place.clone() })
    }

    /// Parts of a body with other constants.
    pub(super) fn regions(&self, keys: &Keys) -> Result<Vec<RegionSpec>> {
        let Some(list) = keys.get("region") else { return Ok(Vec::new()) };
        let items = list.list().map_err(|error| error.help("a region starts with the line [[body.region]]"))?;
        let region = |node: &Node| {
            let keys = Keys::open(node, "[[body.region]]", &[&["on"], &KEYS[..]].concat())?;
            Ok(RegionSpec { on: super::pattern(keys.require("on")?)?, elasticity: self.elasticity(&keys)? })
        };
        items.iter().map(region).collect()
    }

    fn poisson(&self, node: &Node) -> Result<Field> {
        match self.field(node)? {
            Field::Constant(value) if !(value > -1.0 && value < 0.5) => {
                let error =
                    node.refuse(format!("Poisson's ratio is {}", shown(value))).label("must lie between -1 and 0.5");
                Err(match value == 0.5 {
                    true => error.help("incompressible bodies are not possible; take 0.4999 and order = 2, say"),
                    false => error,
                })
            }
            field => Ok(field),
        }
    }

    fn orthotropic(&self, node: &Node) -> Result<Constants> {
        let keys = Keys::open(node, "the orthotropic material", &Constants::ORTHOTROPIC)?;
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
            return Err(node.refuse(format!("an anisotropic material has 21 constants, not {}", items.len())).help(
                "C11, C12, ..., C16, C22, ..., C66: the upper triangle by rows, in the order 11 22 33 23 13 12",
            ));
        }
        for (field, item) in fields.iter_mut().zip(items) {
            *field = self.field(item)?;
        }
        Ok(Constants::Anisotropic(fields))
    }

    fn axes(&self, node: &Node) -> Result<AxesSpec> {
        let keys = Keys::open(node, "the axes", &["first", "second", "angle", "axis"])?;
        keys.exclude("first", "angle")?;
        if let Some(angle) = keys.get("angle") {
            keys.exclude("angle", "second")?;
            let axis = match (keys.get("axis"), self.dimension) {
                (None, 2) => [0.0, 0.0, 1.0].map(Field::Constant),
                (None, _) => self.direction(keys.require("axis")?)?,
                (Some(axis), _) => self.direction(axis)?,
            };
            return Ok(AxesSpec::Angle { angle: self.field(angle)?, axis });
        }
        keys.exclude("first", "axis")?;
        const EXAMPLE: &str =
            "write first = [1, 1, 0] and second = [-1, 1, 0], or angle = \"pi/6\" and axis = [0, 0, 1]";
        let first = self.direction(keys.require("first").map_err(|error| error.help(EXAMPLE))?)?;
        let second = match (keys.get("second"), self.dimension) {
            (None, 2) => None,
            (None, _) => Some(self.direction(keys.require("second").map_err(|error| error.help(EXAMPLE))?)?),
            (Some(second), _) => Some(self.direction(second)?),
        };
        Ok(AxesSpec::Directions { first, second })
    }

    /// A direction in space; in plane problems the third component may be left out.
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
