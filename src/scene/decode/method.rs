//! `[method]`: the outer iteration.

use super::{Decoder, choose};
use crate::error::{Result, nearest};
use crate::scene::expression::Field;
use crate::scene::read::{Keys, Node, Value};
use crate::scene::{MethodSpec, Start, StopSpec, Zone};

impl Decoder<'_> {
    /// The method, defaults where nothing is said.
    pub(super) fn method(&self, node: Option<&Node>) -> Result<MethodSpec> {
        let default = MethodSpec::default();
        let Some(node) = node else { return Ok(default) };
        let keys = Keys::open(node, "[method]", &["psi", "gamma", "start", "stop"])?;
        Ok(MethodSpec {
            psi: keys.get("psi").map_or(Ok(default.psi), |psi| self.zone(psi))?,
            gamma: keys.get("gamma").map_or(Ok(default.gamma), |gamma| gamma.positive("gamma"))?,
            start: keys.get("start").map_or(Ok(default.start), |start| self.start(start))?,
            stop: keys.get("stop").map_or(Ok(default.stop), stop)?,
        })
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
        Field::parse(text, &node.place, self.dimension, true).map(Zone::Subset)
    }

    fn start(&self, node: &Node) -> Result<Start> {
        if let Value::String(_) = node.value {
            return choose(node, "start", &[("zero", Start::Zero)])
                .map_err(|error| error.help("it is \"zero\" or { normal = 1e-4 }"));
        }
        let keys = Keys::open(node, "the start", &["normal"])?;
        Ok(Start::Normal(self.field(keys.require("normal")?)?))
    }
}

fn stop(node: &Node) -> Result<StopSpec> {
    let default = StopSpec::default();
    let keys = Keys::open(node, "the stop rule", &["residual", "increment", "iterations"])?;
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
    Ok(StopSpec { residual, increment, iterations })
}
