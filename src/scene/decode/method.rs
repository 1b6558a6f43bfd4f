//! `[method]`: the outer iteration.

use super::{Decoder, choose};
use crate::error::{Result, nearest};
use crate::expression::Field;
use crate::problem::method::{Gamma, Linear, MethodName, MethodSpec, Start};
use crate::problem::robin::{RobinRule, Zone};
use crate::problem::stop::StopRule;
use crate::scene::read::{Keys, Node, Value};

impl Decoder<'_> {
    /// The method, defaults where nothing is said.
    pub(super) fn method(&self, node: Option<&Node>) -> Result<MethodSpec> {
        let default = MethodSpec::default();
        let Some(node) = node else { return Ok(default) };
        let keys = Keys::open(
            node,
            "[method]",
            &["name", "psi", "gamma", "robin", "interval", "depth", "linear", "start", "steps", "stop"],
        )?;
        let name = match keys.get("name") {
            Some(name) => choose(name, "method", &MethodName::ALL)?,
            None => {
                let says = |key: &str| keys.get(key).is_some();
                let rule = keys.get("stop").is_some_and(|stop| stop.holds("increment"));
                if says("psi") || says("gamma") || says("robin") || rule { MethodName::Robin } else { default.name }
            }
        };
        let default = MethodSpec::new(name);
        let start = keys.get("start").map_or(Ok(default.start), |start| self.start(start))?;
        let steps = keys.get("steps");
        if let (Some(steps), Start::Nested) = (steps, &start) {
            return Err(steps
                .refuse("load steps after a start from a coarser mesh")
                .help("each step starts from the one before: leave `start = \"nested\"` away"));
        }
        Ok(MethodSpec {
            name,
            psi: keys.get("psi").map_or(Ok(default.psi), |psi| self.zone(psi))?,
            robin: keys.get("robin").map_or(Ok(default.robin), robin)?,
            gamma: keys.get("gamma").map_or(Ok(default.gamma), gamma)?,
            interval: self.interval(&keys, name)?,
            depth: keys.get("depth").map_or(Ok(default.depth), depth)?,
            linear: keys.get("linear").map(|linear| self.linear(linear, name)).transpose()?,
            start,
            steps: steps.map_or(Ok(default.steps), |steps| self.history(steps))?,
            stop: keys.get("stop").map_or(Ok(default.stop), stop)?,
        })
    }

    fn linear(&self, node: &Node, name: MethodName) -> Result<Linear> {
        if !matches!(name, MethodName::Auto | MethodName::Newton) {
            return Err(node
                .refuse("only Newton's method has linear steps of all bodies")
                .help("name = \"newton\", or leave `linear` away"));
        }
        choose(node, "way to solve linear steps", &Linear::ALL)
    }

    fn interval(&self, keys: &Keys, name: MethodName) -> Result<bool> {
        let Some(node) = keys.get("interval") else { return Ok(false) };
        if node.boolean()? && name != MethodName::Robin {
            return Err(node
                .refuse("only the method `robin` has an interval of gamma")
                .help("name = \"robin\", or leave `interval` away"));
        }
        node.boolean()
    }

    fn zone(&self, node: &Node) -> Result<Zone> {
        const WORDS: [&str; 3] = ["none", "full", "active"];
        let text = node.string()?;
        match text {
            "none" => return Ok(Zone::None),
            "full" => return Ok(Zone::Full),
            "active" => return Ok(Zone::Active),
            _ => {}
        }
        // A lone long word is a slip of one of the three, not of a variable.
        if text.len() > 2 && text.chars().all(char::is_alphabetic) {
            let error = node.refuse(format!("unknown zone `{text}`"));
            return Err(match nearest(text, WORDS) {
                Some(near) => error.help(format!("did you mean `{near}`?")),
                None => error.help("psi is none, full, active, or a condition such as \"x > 1 && k < 5\""),
            });
        }
        Field::parse(text, &node.place, self.dimension, true, &self.data).map(Zone::Subset)
    }

    fn start(&self, node: &Node) -> Result<Start> {
        if let Value::String(_) = node.value {
            let words = [("auto", Start::Auto), ("zero", Start::Zero), ("nested", Start::Nested)];
            let all = "it is \"auto\", \"zero\", \"nested\" or { normal = 1e-4 }";
            return choose(node, "start", &words).map_err(|error| error.help(all));
        }
        let keys = Keys::open(node, "the start", &["normal"])?;
        Ok(Start::Normal(self.field(keys.require("normal")?)?))
    }
}

fn gamma(node: &Node) -> Result<Gamma> {
    match &node.value {
        Value::String(_) => choose(node, "rule for gamma", &Gamma::NAMED),
        Value::List(items) if items.is_empty() => {
            Err(node.refuse("gamma has no value").help("write a number, a list of numbers, or the name of a rule"))
        }
        Value::List(items) => {
            items.iter().map(|item| item.positive("gamma")).collect::<Result<_>>().map(Gamma::Schedule)
        }
        _ => node.positive("gamma").map(Gamma::Stationary),
    }
}

fn robin(node: &Node) -> Result<RobinRule> {
    if let Value::String(_) = node.value {
        let words = [("tangent", RobinRule::Tangent), ("frozen", RobinRule::Frozen), ("auto", RobinRule::Auto)];
        return choose(node, "Robin coefficient", &words);
    }
    let keys = Keys::open(node, "the Robin coefficient", &["floor"])?;
    keys.require("floor")?.positive("the floor").map(RobinRule::Floor)
}

fn depth(node: &Node) -> Result<usize> {
    match usize::try_from(node.whole()?) {
        Ok(depth) if (1..=50).contains(&depth) => Ok(depth),
        _ => Err(node.refuse("the depth must lie between 1 and 50")),
    }
}

fn stop(node: &Node) -> Result<StopRule> {
    let default = StopRule::default();
    let keys = Keys::open(node, "the stop rule", &["residual", "increment", "balanced", "iterations"])?;
    let tolerance = |key: &str| keys.get(key).map(|node| node.positive("the tolerance")).transpose();
    let increment = tolerance("increment")?;
    let iterations = match keys.get("iterations") {
        None => default.iterations,
        Some(node) => match usize::try_from(node.whole()?) {
            Ok(count) if count > 0 => count,
            _ => {
                return Err(node.refuse("no iteration is allowed").label("must be 1 or more"));
            }
        },
    };
    let residual = match (tolerance("residual")?, increment) {
        (None, None) => default.residual,
        (given, _) => given,
    };
    let balanced = keys.get("balanced").map_or(Ok(false), Node::boolean)?;
    Ok(StopRule { residual, increment, balanced, iterations })
}
