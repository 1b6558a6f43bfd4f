//! `[[body]]`: supports, loads.

use super::{Decoder, Form, Keys, Node, Table, Value, elasticity, pattern};
use crate::error::{Error, Result};
use crate::expression::Field;
use crate::problem::{BodySpec, Load, LoadKind, Order, SpringKind, SpringSpec, Support};

/// Names of components, for supports.
const AXES: [&str; 3] = ["x", "y", "z"];

/// A number or an expression, or one for each component.
fn components() -> Form {
    Form::Either(vec![Form::Field, Form::Field.list()])
}

/// The shape of `[[body]]`.
pub(super) fn table() -> Table {
    elasticity::keys(Table::new("[[body]]").must(
        "name",
        Form::Text,
        "group of cells, or a pattern such as \"brick_*\" for many bodies",
    ))
    .key("order", Form::Among(&[1, 2]), "linear or quadratic elements; 1")
    .key("fix", support().form().list(), "supports: fix = [{ on = \"base\", x = 0, y = 0 }]")
    .key("load", load().form().list(), "loads: load = [{ on = \"top\", pressure = 10 }]")
    .key("spring", spring().form().list(), "springs to the ground: spring = [{ on = \"base\", stiffness = 100 }]")
    .key("force", Form::Field.list(), "force density, one number or expression for each component")
    .key("exact", Form::Field.list(), "known displacement to compare with")
    .key("region", elasticity::region().form().list(), "a region starts with the line [[body.region]]")
}

fn support() -> Table {
    Table::new("a support")
        .must("on", Form::Text, "boundary or points, or a pattern of such")
        .key("x", Form::Field, "displacement along x")
        .key("y", Form::Field, "displacement along y")
        .key("z", Form::Field, "displacement along z, in space")
        .key("normal", Form::Field, "displacement along the outer normal of a plane surface")
        .key("symmetry", Form::Flag, "whether a plane surface slides in its plane: normal = 0")
        .key("path", Form::Text, "column of the table of load steps with its factor")
        .against(&["x", "y", "z"], &["normal", "symmetry"])
        .apart(&["normal", "symmetry"])
}

fn spring() -> Table {
    Table::new("a spring")
        .must("on", Form::Text, "boundary (stiffness per area) or points")
        .key("stiffness", components(), "stiffness, one for all or one for each component")
        .key("normal", Form::Field, "stiffness along the normal alone")
        .apart(&["stiffness", "normal"])
}

fn load() -> Table {
    Table::new("a load")
        .must("on", Form::Text, "boundary, or a pattern of such")
        .key("pressure", Form::Field, "pressure against the outer normal")
        .key("traction", Form::Field.list(), "force per area, one for each component")
        .key("force", Form::Field.list(), "total force on the whole boundary, numbers: [FX, FY], in space [FX, FY, FZ]")
        .key("rigid", Form::Flag, "whether the boundary moves as one under the force; false")
        .key("path", Form::Text, "column of the table of load steps with its factor")
        .apart(&["pressure", "traction", "force"])
}

impl Decoder<'_> {
    /// The bodies in the order of the file.
    pub(super) fn bodies(&self, keys: &Keys) -> Result<Vec<BodySpec>> {
        keys.require("body")?.list()?.iter().map(|item| self.body(item)).collect()
    }

    fn body(&self, node: &Node) -> Result<BodySpec> {
        let keys = Keys::open(node, &table())?;
        let items = |key: &str| keys.get(key).map_or(Ok(&[][..]), Node::list);
        Ok(BodySpec {
            name: pattern(keys.require("name")?)?,
            elasticity: self.elasticity(&keys)?,
            regions: self.regions(&keys)?,
            order: if keys.get("order").map_or(Ok(1), Node::count)? == 2 { Order::P2 } else { Order::P1 },
            fix: items("fix")?.iter().map(|item| self.support(item)).collect::<Result<_>>()?,
            load: items("load")?.iter().map(|item| self.load(item)).collect::<Result<_>>()?,
            spring: items("spring")?.iter().map(|item| self.spring(item)).collect::<Result<_>>()?,
            force: keys.get("force").map(|force| self.vector(force)).transpose()?,
            force_factor: 1.0,
            exact: keys.get("exact").map(|exact| self.expressions(exact)).transpose()?,
        })
    }

    fn support(&self, node: &Node) -> Result<Support> {
        let keys = Keys::open(node, &support())?;
        let on = pattern(keys.require("on")?)?;
        let mut value = [const { None }; 3];
        for (value, axis) in value.iter_mut().zip(AXES) {
            *value = keys.get(axis).map(|node| self.field(node)).transpose()?;
        }
        let normal = match keys.get("symmetry") {
            Some(node) if node.boolean()? => Some(Field::Constant(0.0)),
            Some(node) => return Err(node.refuse("`symmetry = false` holds nothing").help("remove this support")),
            None => keys.get("normal").map(|node| self.field(node)).transpose()?,
        };
        let path = keys.get("path").map(Node::name).transpose()?;
        Ok(Support { on, value, normal, path, factor: 1.0 })
    }

    fn spring(&self, node: &Node) -> Result<SpringSpec> {
        let keys = Keys::open(node, &spring())?;
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
        let keys = Keys::open(node, &load())?;
        let on = pattern(keys.require("on")?)?;
        let rigid = keys.flag("rigid", false)?;
        if let (Some(entry), None) = (keys.entry("rigid"), keys.get("force")) {
            return Err(Error::scene(&entry.key_place, "`rigid` without a force")
                .help("a rigid surface moves as one under a total force: force = [0, -10], rigid = true"));
        }
        let kind = match (keys.get("pressure"), keys.get("traction"), keys.get("force")) {
            (Some(pressure), ..) => LoadKind::Pressure(self.field(pressure)?),
            (_, Some(traction), _) => LoadKind::Traction(self.vector(traction)?),
            (.., Some(force)) => LoadKind::Force { total: self.numbers(force)?, rigid },
            (None, None, None) => {
                let components = &["tx", "ty", "tz"][..self.dimension];
                let advice =
                    format!("give pressure = p, traction = [{}], or a total force = [...]", components.join(", "));
                return Err(node.refuse(format!("the load on `{}` has no component", on.value)).help(advice));
            }
        };
        let path = keys.get("path").map(Node::name).transpose()?;
        Ok(Load { on, kind, path, factor: 1.0 })
    }
}

impl Decoder<'_> {
    /// A vector of numbers.
    fn numbers(&self, node: &Node) -> Result<[f64; 3]> {
        let mut numbers = [0.0; 3];
        for (number, field) in numbers.iter_mut().zip(self.vector(node)?) {
            match field {
                Field::Constant(value) => *number = value,
                field => {
                    let place = field.place().unwrap_or(&node.place);
                    return Err(Error::scene(place, "a total force does not depend on the place")
                        .help("give numbers, or a traction with expressions"));
                }
            }
        }
        Ok(numbers)
    }
}
