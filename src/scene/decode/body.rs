//! `[[body]]`, with its supports, springs and loads.

use super::{Decoder, Keys, Node, TableShape, Value, ValueKind, body_name, elasticity, pattern};
use crate::error::{Error, Result};
use crate::expression::Field;
use crate::problem::{BodySpec, Load, LoadKind, Order, SpringKind, SpringSpec, Support};

/// Names of components, for supports.
const AXES: [&str; 3] = ["x", "y", "z"];

/// Return the kind of value that is a number or an expression, or a list with one for each component.
fn one_or_components() -> ValueKind {
    ValueKind::Either(vec![ValueKind::Field, ValueKind::Field.list()])
}

/// Return the shape of `[[body]]`.
pub(super) fn shape() -> TableShape {
    use ValueKind::{Field, Flag, OneOf, Text};
    elasticity::with_constants(TableShape::new("[[body]]").required(
        "name",
        Text,
        "group of cells, or a pattern such as \"brick_*\" for many bodies",
    ))
    .optional("split", Flag, "whether each connected part of the group is a body, NAME_1, NAME_2, ...; false")
    .optional("order", OneOf(&[1, 2]), "linear or quadratic elements; 1")
    .optional("fix", support_shape().list(), "supports: fix = [{ on = \"base\", x = 0, y = 0 }]")
    .optional("load", load_shape().list(), "loads: load = [{ on = \"top\", pressure = 10 }]")
    .optional("spring", spring_shape().list(), "springs to the ground: spring = [{ on = \"base\", stiffness = 100 }]")
    .optional("force", Field.list(), "force density, one number or expression for each component")
    .optional("exact", Field.list(), "known displacement to compare with")
    .optional("region", elasticity::region_shape().list(), "a region starts with the line [[body.region]]")
}

fn support_shape() -> TableShape {
    use ValueKind::{Field, Flag, Text};
    TableShape::new("a support")
        .required("on", Text, "boundary or points, or a pattern of such")
        .optional("x", Field, "displacement along x")
        .optional("y", Field, "displacement along y")
        .optional("z", Field, "displacement along z, in space")
        .optional("normal", Field, "displacement along the outer normal of a plane surface")
        .optional("symmetry", Flag, "whether a plane surface slides in its plane: normal = 0")
        .optional("path", Text, "column of the table of load steps with its factor")
        .not_both(&["x", "y", "z"], &["normal", "symmetry"])
        .at_most_one(&["normal", "symmetry"])
}

fn spring_shape() -> TableShape {
    use ValueKind::{Field, Text};
    TableShape::new("a spring")
        .required("on", Text, "boundary (stiffness per area) or points")
        .optional("stiffness", one_or_components(), "stiffness, one for all or one for each component")
        .optional("normal", Field, "stiffness along the normal alone")
        .at_most_one(&["stiffness", "normal"])
}

fn load_shape() -> TableShape {
    use ValueKind::{Field, Flag, Text};
    TableShape::new("a load")
        .required("on", Text, "boundary, or a pattern of such")
        .optional("pressure", Field, "pressure against the outer normal")
        .optional("traction", Field.list(), "force per area, one for each component")
        .optional("force", Field.list(), "total force on the whole boundary, numbers: [FX, FY], in space [FX, FY, FZ]")
        .optional(
            "moment",
            one_or_components(),
            "moment about the centre of the boundary, a number: M, in space [MX, MY, MZ]",
        )
        .optional(
            "rigid",
            Flag,
            "whether the boundary moves as a rigid body under the force, without a turn, or with a turn under a moment; false",
        )
        .optional("path", Text, "column of the table of load steps with its factor")
        .at_most_one(&["pressure", "traction", "force"])
        .not_both(&["moment"], &["pressure", "traction"])
}

impl Decoder<'_> {
    /// Return the bodies in the order of the file.
    pub(super) fn bodies(&self, keys: &Keys) -> Result<Vec<BodySpec>> {
        keys.items("body")?.iter().map(|item| self.body(item)).collect()
    }

    fn body(&self, node: &Node) -> Result<BodySpec> {
        let keys = Keys::open(node, &shape())?;
        Ok(BodySpec {
            name: body_name(keys.require("name")?)?,
            split: keys.flag("split", false)?,
            elasticity: self.elasticity(&keys)?,
            regions: keys.items("region")?.iter().map(|item| self.region(item)).collect::<Result<_>>()?,
            order: if keys.read("order", Node::count)? == Some(2) { Order::P2 } else { Order::P1 },
            fix: keys.items("fix")?.iter().map(|item| self.support(item)).collect::<Result<_>>()?,
            load: keys.items("load")?.iter().map(|item| self.load(item)).collect::<Result<_>>()?,
            spring: keys.items("spring")?.iter().map(|item| self.spring(item)).collect::<Result<_>>()?,
            force: keys.read("force", |node| self.vector(node))?,
            force_factor: 1.0,
            exact: keys.read("exact", |node| self.expressions(node))?,
        })
    }

    fn support(&self, node: &Node) -> Result<Support> {
        let keys = Keys::open(node, &support_shape())?;
        let on = pattern(keys.require("on")?)?;
        let mut value = [const { None }; 3];
        for (value, axis) in value.iter_mut().zip(AXES) {
            *value = keys.read(axis, |node| self.field(node))?;
        }
        let normal = match keys.get("symmetry") {
            Some(node) if node.boolean()? => Some(Field::Constant(0.0)),
            Some(node) => return Err(node.refuse("`symmetry = false` holds nothing").help("remove this support")),
            None => keys.read("normal", |node| self.field(node))?,
        };
        Ok(Support { on, value, normal, path: keys.read("path", Node::name)?, factor: 1.0 })
    }

    fn spring(&self, node: &Node) -> Result<SpringSpec> {
        let keys = Keys::open(node, &spring_shape())?;
        let on = pattern(keys.require("on")?)?;
        let kind = match (keys.get("stiffness"), keys.get("normal")) {
            (Some(node), _) if matches!(node.value, Value::List(_)) => SpringKind::Vector(self.vector(node)?),
            (Some(node), _) => {
                let field = self.field(node)?;
                SpringKind::Vector([field.clone(), field.clone(), field])
            }
            (None, Some(node)) => SpringKind::Normal(self.field(node)?),
            (None, None) => {
                return Err(node
                    .refuse(format!("the spring on `{}` has no stiffness", on.value))
                    .help("give stiffness = k, one for each component, or normal = k along the normal alone"));
            }
        };
        Ok(SpringSpec { on, kind })
    }

    fn load(&self, node: &Node) -> Result<Load> {
        let keys = Keys::open(node, &load_shape())?;
        let on = pattern(keys.require("on")?)?;
        let rigid = keys.flag("rigid", false)?;
        let [force, moment] = ["force", "moment"].map(|key| keys.get(key));
        if let (Some(entry), None) = (keys.entry("rigid"), force.or(moment)) {
            return Err(Error::scene(&entry.key_place, "`rigid` without a force or a moment")
                .help("a rigid surface moves as one under a total force: force = [0, -10], rigid = true"));
        }
        let kind = match [keys.get("pressure"), keys.get("traction"), force, moment] {
            [Some(pressure), ..] => LoadKind::Pressure(self.field(pressure)?),
            [_, Some(traction), ..] => LoadKind::Traction(self.vector(traction)?),
            [.., force, Some(moment)] if rigid => {
                let force = force.map_or(Ok([0.0; 3]), |force| self.numbers(force))?;
                LoadKind::Turning { force, moment: self.moment(moment)? }
            }
            [.., Some(_), Some(moment)] => {
                return Err(moment
                    .refuse("a load has both `force` and `moment`")
                    .help("give two loads, or rigid = true for a surface that moves and turns as a rigid body"));
            }
            [.., Some(force), None] => LoadKind::Force { total: self.numbers(force)?, rigid },
            [.., Some(moment)] => LoadKind::Moment(self.moment(moment)?),
            [None, None, None, None] => {
                let components = &["tx", "ty", "tz"][..self.dimension];
                let advice = format!(
                    "give pressure = p, traction = [{}], or a total force = [...] or moment",
                    components.join(", ")
                );
                return Err(node.refuse(format!("the load on `{}` has no component", on.value)).help(advice));
            }
        };
        Ok(Load { on, kind, path: keys.read("path", Node::name)?, factor: 1.0 })
    }

    /// Return a moment (x, y, z).
    fn moment(&self, node: &Node) -> Result<[f64; 3]> {
        if self.dimension == 2 { Ok([0.0, 0.0, node.number()?]) } else { self.numbers(node) }
    }

    /// Return a vector of numbers; expressions in the coordinates are refused.
    fn numbers(&self, node: &Node) -> Result<[f64; 3]> {
        let mut numbers = [0.0; 3];
        for (number, field) in numbers.iter_mut().zip(self.vector(node)?) {
            match field {
                Field::Constant(value) => *number = value,
                field => {
                    let place = field.place().unwrap_or(&node.place);
                    return Err(Error::scene(place, "a total force or moment does not depend on the place")
                        .help("give numbers, or a traction with expressions"));
                }
            }
        }
        Ok(numbers)
    }
}
