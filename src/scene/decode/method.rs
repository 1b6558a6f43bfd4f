//! `[method]`: the outer iteration.

use super::{Decoder, Form, Keys, Node, Table, Value, choose, history, word};
use crate::error::Result;
use crate::expression::Field;
use crate::problem::{Gamma, Linear, MethodName, MethodSpec, RobinRule, Start, StopRule, Zone};

/// The shape of `[method]`.
pub(super) fn table() -> Table {
    use Form::{Count, Either, Flag, Number, Text};
    Table::new("[method]")
        .key("name", word(&MethodName::ALL), "the method; \"auto\"")
        .key("psi", Text, "Robin zone: \"none\", \"full\", \"active\" (which it is without this key) or a condition")
        .key(
            "gamma",
            Either(vec![Number, Number.list(), word(&Gamma::NAMED)]),
            "relaxation of `robin`: a number, a list, a rule; 0.6",
        )
        .key("robin", Either(vec![word(&COEFFICIENTS), floor_table().form()]), "Robin coefficient on the zone")
        .key("interval", Flag, "whether `robin` finds the interval of gamma at the end; false")
        .key("depth", Count, "earlier steps that `anderson` mixes; 5")
        .key("linear", word(&Linear::ALL), "how linear steps are solved; chosen by the program without it")
        .key(
            "start",
            Either(vec![word(&STARTS), start_table().form()]),
            "it is \"auto\", \"zero\", \"nested\" or { normal = 1e-4 }",
        )
        .key(
            "steps",
            Either(vec![Count, Number.list(), history::table().form()]),
            "load steps: a number, shares that end with 1, or a table",
        )
        .key("stop", stop_table().form(), "when to stop: stop = { residual = 1e-8 }")
}

fn start_table() -> Table {
    Table::new("the start").must("normal", Form::Field, "outer normal displacement on every contact surface")
}

fn floor_table() -> Table {
    Table::new("the Robin coefficient").must("floor", Form::Number, "least coefficient everywhere on the contact")
}

fn stop_table() -> Table {
    Table::new("the stop rule")
        .key("residual", Form::Number, "relative residual, or error of Newton's method; 1e-8")
        .key("increment", Form::Number, "the paper's rule on the increment")
        .key("balanced", Form::Flag, "whether a tenth of the mesh's error is enough; false")
        .key("iterations", Form::Count, "most iterations; 2000")
}

/// Robin coefficients by name.
const COEFFICIENTS: [(&str, RobinRule); 3] =
    [("tangent", RobinRule::Tangent), ("frozen", RobinRule::Frozen), ("auto", RobinRule::Auto)];

/// Starts by name.
const STARTS: [(&str, Start); 3] = [("auto", Start::Auto), ("zero", Start::Zero), ("nested", Start::Nested)];

impl Decoder<'_> {
    /// The method, defaults where nothing is said.
    pub(super) fn method(&self, node: Option<&Node>) -> Result<MethodSpec> {
        let default = MethodSpec::default();
        let Some(node) = node else { return Ok(default) };
        let keys = Keys::open(node, &table())?;
        let name = match keys.get("name") {
            Some(name) => choose(name, "method", &MethodName::ALL)?,
            None => {
                let says = |key: &str| keys.get(key).is_some();
                let rule = keys.get("stop").is_some_and(|stop| stop.holds("increment"));
                if says("psi") || says("gamma") || says("robin") || rule { MethodName::Robin } else { default.name }
            }
        };
        let default = MethodSpec::new(name);
        Ok(MethodSpec {
            name,
            psi: keys.get("psi").map_or(Ok(default.psi), |psi| self.zone(psi))?,
            robin: keys.get("robin").map_or(Ok(default.robin), robin)?,
            gamma: keys.get("gamma").map_or(Ok(default.gamma), gamma)?,
            interval: keys.flag("interval", false)?,
            depth: keys.get("depth").map_or(Ok(default.depth), Node::count)?,
            linear: keys.get("linear").map(|way| choose(way, "way to solve linear steps", &Linear::ALL)).transpose()?,
            start: keys.get("start").map_or(Ok(default.start), |start| self.start(start))?,
            steps: keys.get("steps").map_or(Ok(default.steps), |steps| self.history(steps))?,
            stop: keys.get("stop").map_or(Ok(default.stop), stop)?,
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
        // A lone long word is a slip of one of the three, not of a variable.
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
        let keys = Keys::open(node, &start_table())?;
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
    let keys = Keys::open(node, &floor_table())?;
    keys.require("floor")?.number().map(RobinRule::Floor)
}

fn stop(node: &Node) -> Result<StopRule> {
    let default = StopRule::default();
    let keys = Keys::open(node, &stop_table())?;
    let tolerance = |key: &str| keys.get(key).map(Node::number).transpose();
    let increment = tolerance("increment")?;
    Ok(StopRule {
        residual: tolerance("residual")?.or(default.residual.filter(|_| increment.is_none())),
        increment,
        balanced: keys.flag("balanced", false)?,
        iterations: keys.get("iterations").map_or(Ok(default.iterations), Node::count)?,
    })
}
