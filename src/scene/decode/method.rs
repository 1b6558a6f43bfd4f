//! `[method]`: the outer iteration, its start, and when it stops.

use super::{Decoder, Keys, Node, TableShape, Value, ValueKind, choose, history, word};
use crate::error::Result;
use crate::expression::Field;
use crate::problem::{Gamma, Linear, MethodName, MethodSpec, RobinRule, Start, StopRule, Zone};

/// Return the shape of `[method]`.
pub(super) fn shape() -> TableShape {
    use ValueKind::{Either, Flag, Number, PositiveInteger, Text};
    TableShape::new("[method]")
        .optional("name", word(&MethodName::ALL), "the method; \"auto\"")
        .optional(
            "psi",
            Text,
            "Robin zone: \"none\", \"full\", \"active\" (which it is without this key) or a condition",
        )
        .optional(
            "gamma",
            Either(vec![Number, Number.list(), word(&Gamma::NAMED)]),
            "relaxation of `robin`: a number, a list, a rule; 0.6",
        )
        .optional("robin", Either(vec![word(&COEFFICIENTS), floor_shape().into()]), "Robin coefficient on the zone")
        .optional("interval", Flag, "whether `robin` finds the interval of gamma at the end; false")
        .optional("depth", PositiveInteger, "earlier steps that `anderson` mixes; 5")
        .optional("linear", word(&Linear::ALL), "how linear steps are solved; chosen by the program without it")
        .optional(
            "start",
            Either(vec![word(&STARTS), start_shape().into()]),
            "it is \"auto\", \"zero\", \"nested\" or { normal = 1e-4 }",
        )
        .optional(
            "steps",
            Either(vec![PositiveInteger, Number.list(), history::shape().into()]),
            "load steps: a number, shares that end with 1, or a table",
        )
        .optional("stop", stop_shape(), "when to stop: stop = { residual = 1e-8 }")
}

fn start_shape() -> TableShape {
    use ValueKind::Field;
    TableShape::new("the start").required("normal", Field, "outer normal displacement on every contact surface")
}

fn floor_shape() -> TableShape {
    use ValueKind::Number;
    TableShape::new("the Robin coefficient").required("floor", Number, "least coefficient everywhere on the contact")
}

fn stop_shape() -> TableShape {
    use ValueKind::{Flag, Number, PositiveInteger};
    TableShape::new("the stop rule")
        .optional("residual", Number, "relative residual, or error of Newton's method; 1e-8")
        .optional("increment", Number, "the paper's rule on the increment")
        .optional("balanced", Flag, "whether a tenth of the mesh's error is enough; false")
        .optional("iterations", PositiveInteger, "most iterations; 2000")
}

/// Rules for the Robin coefficient by name.
const COEFFICIENTS: [(&str, RobinRule); 3] =
    [("tangent", RobinRule::Tangent), ("frozen", RobinRule::Frozen), ("auto", RobinRule::Auto)];

/// Starts by name.
const STARTS: [(&str, Start); 3] = [("auto", Start::Auto), ("zero", Start::Zero), ("nested", Start::Nested)];

impl Decoder<'_> {
    /// Return the method, with defaults for keys that are not given. A table without a name, but with `psi`, `gamma`, `robin` or
    /// `stop.increment`, is the method `robin`.
    pub(super) fn method(&self, node: Option<&Node>) -> Result<MethodSpec> {
        let default = MethodSpec::default();
        let Some(node) = node else { return Ok(default) };
        let keys = Keys::open(node, &shape())?;
        let name = match keys.get("name") {
            Some(name) => choose(name, "method", &MethodName::ALL)?,
            None => {
                let is_paper_rule = keys.get("stop").is_some_and(|stop| stop.has_key("increment"));
                let is_robin = is_paper_rule || ["psi", "gamma", "robin"].iter().any(|key| keys.get(key).is_some());
                if is_robin { MethodName::Robin } else { default.name }
            }
        };
        let default = MethodSpec::new(name);
        Ok(MethodSpec {
            name,
            psi: keys.read("psi", |node| self.zone(node))?.unwrap_or(default.psi),
            robin: keys.read("robin", robin)?.unwrap_or(default.robin),
            gamma: keys.read("gamma", gamma)?.unwrap_or(default.gamma),
            interval: keys.flag("interval", default.interval)?,
            depth: keys.read("depth", Node::count)?.unwrap_or(default.depth),
            linear: keys.read("linear", |node| choose(node, "way to solve linear steps", &Linear::ALL))?,
            start: keys.read("start", |node| self.start(node))?.unwrap_or(default.start),
            steps: keys.read("steps", |node| self.history(node))?.unwrap_or(default.steps),
            stop: keys.read("stop", stop)?.unwrap_or(default.stop),
        })
    }

    fn zone(&self, node: &Node) -> Result<Zone> {
        let text = node.string()?;
        match text {
            "none" => return Ok(Zone::None),
            "full" => return Ok(Zone::Full),
            "active" => return Ok(Zone::Active),
            _ => {}
        }
        // a single word of more than two letters is a slip of one of the three, not of a variable
        if text.len() > 2 && text.chars().all(char::is_alphabetic) {
            let otherwise = || "psi is none, full, active, or a condition such as \"x > 1 && k < 5\"".to_owned();
            let error = node.refuse(format!("unknown zone `{text}`"));
            return Err(error.suggest(text, ["none", "full", "active"], otherwise));
        }
        Field::parse(text, &node.place, self.dimension, true, &self.data).map(Zone::Subset)
    }

    fn start(&self, node: &Node) -> Result<Start> {
        if let Value::String(_) = node.value {
            let all = "it is \"auto\", \"zero\", \"nested\" or { normal = 1e-4 }";
            return choose(node, "start", &STARTS).map_err(|error| error.help(all));
        }
        let keys = Keys::open(node, &start_shape())?;
        Ok(Start::Normal(self.field(keys.require("normal")?)?))
    }
}

fn gamma(node: &Node) -> Result<Gamma> {
    match &node.value {
        Value::String(_) => choose(node, "rule for gamma", &Gamma::NAMED),
        Value::List(items) => items.iter().map(Node::number).collect::<Result<_>>().map(Gamma::Schedule),
        _ => node.number().map(Gamma::Stationary),
    }
}

fn robin(node: &Node) -> Result<RobinRule> {
    if let Value::String(_) = node.value {
        return choose(node, "Robin coefficient", &COEFFICIENTS);
    }
    let keys = Keys::open(node, &floor_shape())?;
    keys.require("floor")?.number().map(RobinRule::Floor)
}

fn stop(node: &Node) -> Result<StopRule> {
    let default = StopRule::default();
    let keys = Keys::open(node, &stop_shape())?;
    let increment = keys.read("increment", Node::number)?;
    Ok(StopRule {
        residual: keys.read("residual", Node::number)?.or(default.residual.filter(|_| increment.is_none())),
        increment,
        balanced: keys.flag("balanced", default.balanced)?,
        iterations: keys.read("iterations", Node::count)?.unwrap_or(default.iterations),
    })
}
