//! `[[body]]`: supports, loads.

use super::{Decoder, elasticity, pattern};
use crate::error::{Error, Located, Result};
use crate::expression::Field;
use crate::problem::body::{BodySpec, Load, LoadKind, SPELLING, SpringKind, SpringSpec, Support, fault, is_in_name};
use crate::problem::elasticity::Plane;
use crate::problem::order::Order;
use crate::problem::pattern::is_pattern;
use crate::scene::read::{Keys, Node, Value};
use std::collections::HashSet;

/// Names of components, for supports.
const AXES: [&str; 3] = ["x", "y", "z"];

impl Decoder<'_> {
    /// The bodies: at least one, with different names.
    pub(super) fn bodies(&self, keys: &Keys) -> Result<Vec<BodySpec>> {
        let list = keys.require("body").map_err(|error| error.help("a body starts with the line [[body]]"))?;
        let items = list.list().map_err(|error| error.help("a body starts with the line [[body]]"))?;
        if items.is_empty() {
            return Err(list.refuse("the scene has no body").help("a body starts with the line [[body]]"));
        }
        let mut bodies: Vec<BodySpec> = Vec::new();
        let mut names = HashSet::new();
        for item in items {
            let body = self.body(item)?;
            if !names.insert(body.name.value.clone()) {
                let message = format!("two bodies are called `{}`", body.name.value);
                return Err(Error::scene(&body.name.place, message)
                    .label("taken by an earlier body")
                    .help("names of bodies are those of physical groups of cells, one for each"));
            }
            bodies.push(body);
        }
        Ok(bodies)
    }

    fn body(&self, node: &Node) -> Result<BodySpec> {
        let own = ["name", "order", "fix", "load", "spring", "force", "exact", "region"];
        let keys = Keys::open(node, "[[body]]", &[&own[..1], &elasticity::KEYS, &own[1..]].concat())?;
        let items = |key: &str| keys.get(key).map_or(Ok(&[][..]), Node::list);
        Ok(BodySpec {
            name: name(keys.require("name")?)?,
            elasticity: self.elasticity(&keys)?,
            regions: self.regions(&keys)?,
            order: keys.get("order").map_or(Ok(Order::P1), order)?,
            fix: items("fix")?.iter().map(|item| self.support(item)).collect::<Result<_>>()?,
            load: items("load")?.iter().map(|item| self.load(item)).collect::<Result<_>>()?,
            spring: items("spring")?.iter().map(|item| self.spring(item)).collect::<Result<_>>()?,
            force: keys.get("force").map(|force| self.vector(force)).transpose()?,
            force_factor: 1.0,
            exact: keys.get("exact").map(|exact| self.smooth_vector(exact)).transpose()?,
        })
    }

    fn support(&self, node: &Node) -> Result<Support> {
        let keys = Keys::open(node, "a support", &["on", "x", "y", "z", "normal", "symmetry", "path"])?;
        for axis in AXES {
            keys.exclude(axis, "normal")?;
            keys.exclude(axis, "symmetry")?;
        }
        keys.exclude("normal", "symmetry")?;
        let on = pattern(keys.require("on")?)?;
        if let (2, Some(entry)) = (self.dimension, keys.entry("z")) {
            return Err(Error::scene(&entry.key_place, "a support in `z` in a plane problem")
                .label("there is no z")
                .help("remove it, or set dimension = 3"));
        }
        let mut value = [const { None }; 3];
        for (value, axis) in value.iter_mut().zip(AXES) {
            *value = keys.get(axis).map(|node| self.field(node)).transpose()?;
        }
        let normal = match keys.get("symmetry") {
            Some(node) if node.boolean()? => Some(Field::Constant(0.0)),
            Some(node) => return Err(node.refuse("`symmetry = false` holds nothing").help("remove this support")),
            None => keys.get("normal").map(|node| self.field(node)).transpose()?,
        };
        if value.iter().all(Option::is_none) && normal.is_none() {
            let axes = &AXES[..self.dimension];
            return Err(node
                .refuse(format!("the support on `{}` holds no component", on.value))
                .help(format!("give the displacement in some of {}: x = 0; or symmetry = true", axes.join(", "))));
        }
        let path = keys.get("path").map(Node::name).transpose()?;
        Ok(Support { on, value, normal, path, factor: 1.0 })
    }

    fn spring(&self, node: &Node) -> Result<SpringSpec> {
        let keys = Keys::open(node, "a spring", &["on", "stiffness", "normal"])?;
        let on = pattern(keys.require("on")?)?;
        keys.exclude("stiffness", "normal")?;
        let kind = match (keys.get("stiffness"), keys.get("normal")) {
            (Some(node), _) if matches!(node.value, Value::List(_)) => {
                let fields = self.vector(node)?;
                if fields.iter().all(Field::is_zero) {
                    return Err(node
                        .refuse("the spring has no stiffness")
                        .label("some component must be greater than 0"));
                }
                SpringKind::Vector(fields)
            }
            (Some(node), _) => {
                let field = self.positive_field(node, "the stiffness")?;
                SpringKind::Vector([field.clone(), field.clone(), field])
            }
            (None, Some(node)) => SpringKind::Normal(self.positive_field(node, "the stiffness")?),
            (None, None) => {
                return Err(node
                    .refuse(format!("the spring on `{}` has no stiffness", on.value))
                    .help("give stiffness = k, one for each component, or normal = k along the normal alone"));
            }
        };
        Ok(SpringSpec { on, kind })
    }

    fn load(&self, node: &Node) -> Result<Load> {
        let keys = Keys::open(node, "a load", &["on", "pressure", "traction", "force", "rigid", "path"])?;
        let on = pattern(keys.require("on")?)?;
        for (one, other) in [("pressure", "traction"), ("pressure", "force"), ("traction", "force")] {
            keys.exclude(one, other)?;
        }
        let rigid = keys.get("rigid").map_or(Ok(false), Node::boolean)?;
        if let (Some(entry), None) = (keys.entry("rigid"), keys.get("force")) {
            return Err(Error::scene(&entry.key_place, "`rigid` without a force")
                .help("a rigid surface moves as one under a total force: force = [0, -10], rigid = true"));
        }
        let kind = match (keys.get("pressure"), keys.get("traction"), keys.get("force")) {
            (Some(pressure), ..) => LoadKind::Pressure(self.field(pressure)?),
            (_, Some(traction), _) => LoadKind::Traction(self.vector(traction)?),
            (.., Some(force)) => LoadKind::Force { total: self.total(force)?, rigid },
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
    /// A force on a whole boundary.
    fn total(&self, node: &Node) -> Result<[f64; 3]> {
        let total = self.numbers(node)?;
        if self.plane == Plane::Axisymmetric && total[0] != 0.0 {
            return Err(node
                .refuse("a total force across the axis in an axisymmetric scene")
                .label("radial forces cancel all around: the first component must be 0")
                .help("for a radial load give pressure = p or traction = [tr, ta]"));
        }
        Ok(total)
    }

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

/// The name of a body, or a pattern of such names.
pub(super) fn name(node: &Node) -> Result<Located<String>> {
    let name = pattern(node)?;
    let fault = match is_pattern(&name.value) {
        true => name.value.chars().any(|c| !is_in_name(c) && !"*?[]!-".contains(c)).then_some(SPELLING),
        false => fault(&name.value),
    };
    fault.map_or(Ok(name.clone()), |[label, help]| {
        Err(node.refuse(format!("`{}` cannot be the name of a body", name.value)).label(label).help(help))
    })
}

fn order(node: &Node) -> Result<Order> {
    match node.whole()? {
        1 => Ok(Order::P1),
        2 => Ok(Order::P2),
        other => Err(node.refuse(format!("the order is {other}")).label("must be 1 or 2")),
    }
}
