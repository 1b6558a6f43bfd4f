//! Keys of `[method]` whose values have several forms, and defaults that depend on other keys.

use crate::error::Result;
use crate::expression::Field;
use crate::problem::{Gamma, MethodName, MethodSpec, RobinRule, Start, Zone, name_of};
use crate::setting::{Context, Keys, Node, Setting, TableShape, Value, ValueKind, choose, word};
use serde_json::{Value as Json, json};

/// A table without a name, but with `psi`, `gamma`, `robin` or `stop.increment`, is the method `robin`.
impl Setting for MethodSpec {
    fn kind() -> ValueKind {
        Self::shape().into()
    }

    fn read(node: &Node, context: &Context) -> Result<Self> {
        let mut method = Self::decode(&Keys::open(node, &Self::shape())?, context)?;
        let is_paper_rule = method.stop.increment.is_some();
        if !node.has_key("name") && (is_paper_rule || ["psi", "gamma", "robin"].iter().any(|key| node.has_key(key))) {
            method.name = MethodName::Robin;
        }
        if !node.has_key("robin") {
            method.robin = Self::new(method.name).robin;
        }
        Ok(method)
    }

    /// Leave out keys of other methods, which change nothing.
    fn echo(&self, dimension: usize) -> Json {
        let mut entries = self.entries(dimension);
        let is_robin = self.name == MethodName::Robin;
        entries.retain(|key, _| match key.as_str() {
            "gamma" => is_robin,
            "interval" => is_robin && self.interval,
            "depth" => self.name == MethodName::Anderson,
            _ => true,
        });
        entries.into()
    }
}

impl Setting for Gamma {
    fn kind() -> ValueKind {
        ValueKind::Either(vec![ValueKind::Number, ValueKind::Number.list(), word(&Self::NAMED)])
    }

    fn read(node: &Node, _: &Context) -> Result<Self> {
        match &node.value {
            Value::String(_) => choose(node, "rule for gamma", &Self::NAMED),
            Value::List(items) => items.iter().map(Node::number).collect::<Result<_>>().map(Self::Schedule),
            _ => node.number().map(Self::Stationary),
        }
    }

    fn echo(&self, _: usize) -> Json {
        match self {
            Self::Stationary(gamma) => json!(gamma),
            Self::Schedule(list) => json!(list),
            Self::Own(name) => json!({ "own": name }),
            rule => json!(name_of(&Self::NAMED, rule)),
        }
    }
}

/// Rules for the Robin coefficient by name.
const COEFFICIENTS: [(&str, RobinRule); 3] =
    [("tangent", RobinRule::Tangent), ("frozen", RobinRule::Frozen), ("auto", RobinRule::Auto)];

impl Setting for RobinRule {
    fn kind() -> ValueKind {
        ValueKind::Either(vec![word(&COEFFICIENTS), floor_shape().into()])
    }

    fn read(node: &Node, _: &Context) -> Result<Self> {
        if let Value::String(_) = node.value {
            return choose(node, "Robin coefficient", &COEFFICIENTS);
        }
        Keys::open(node, &floor_shape())?.require("floor")?.number().map(Self::Floor)
    }

    fn echo(&self, _: usize) -> Json {
        match self {
            Self::Floor(floor) => json!({ "floor": floor }),
            rule => json!(name_of(&COEFFICIENTS, rule)),
        }
    }
}

fn floor_shape() -> TableShape {
    let about = "least coefficient everywhere on the contact";
    TableShape::new("the Robin coefficient").required("floor", ValueKind::Number, about)
}

/// The echo is a text, as the key takes no number.
impl Setting for Zone {
    fn kind() -> ValueKind {
        ValueKind::Text
    }

    fn read(node: &Node, context: &Context) -> Result<Self> {
        let text = node.string()?;
        match text {
            "none" => return Ok(Self::None),
            "full" => return Ok(Self::Full),
            "active" => return Ok(Self::Active),
            _ => {}
        }
        // a single word of more than two letters is a slip of one of the three, not of a variable
        if text.len() > 2 && text.chars().all(char::is_alphabetic) {
            let otherwise = || "psi is none, full, active, or a condition such as \"x > 1 && k < 5\"".to_owned();
            let error = node.refuse(format!("unknown zone `{text}`"));
            return Err(error.suggest(text, ["none", "full", "active"], otherwise));
        }
        Field::parse(text, &node.place, context.dimension, true, &context.data).map(Self::Subset)
    }

    fn echo(&self, _: usize) -> Json {
        match self {
            Self::None => json!("none"),
            Self::Full => json!("full"),
            Self::Active => json!("active"),
            Self::Subset(condition) => json!(condition.text()),
        }
    }
}

impl Setting for Start {
    fn kind() -> ValueKind {
        ValueKind::Either(vec![ValueKind::Word(vec!["auto", "zero", "nested"]), start_shape().into()])
    }

    fn read(node: &Node, context: &Context) -> Result<Self> {
        if let Value::String(_) = node.value {
            let all = "it is \"auto\", \"zero\", \"nested\" or { normal = 1e-4 }";
            let starts = [("auto", Self::Auto), ("zero", Self::Zero), ("nested", Self::Nested)];
            return choose(node, "start", &starts).map_err(|error| error.help(all));
        }
        let keys = Keys::open(node, &start_shape())?;
        Field::read(keys.require("normal")?, context).map(Self::Normal)
    }

    fn echo(&self, dimension: usize) -> Json {
        match self {
            Self::Auto => json!("auto"),
            Self::Zero => json!("zero"),
            Self::Nested => json!("nested"),
            Self::Normal(normal) => json!({ "normal": normal.echo(dimension) }),
        }
    }
}

fn start_shape() -> TableShape {
    let about = "outer normal displacement on every contact surface";
    TableShape::new("the start").required("normal", ValueKind::Field, about)
}
