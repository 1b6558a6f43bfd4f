//! `solver`: a preset, and PETSc options.

use crate::error::Result;
use crate::problem::{Preset, SolverSpec};
use crate::setting::{Context, Keys, Node, Setting, TableShape, Value, ValueKind, entries};
use crate::solver::options;
use serde_json::{Value as Json, json};

impl Setting for SolverSpec {
    fn kind() -> ValueKind {
        ValueKind::Either(vec![Preset::kind(), shape().into()])
    }

    fn read(node: &Node, context: &Context) -> Result<Self> {
        if let Value::String(_) = node.value {
            return Ok(Self { preset: Some(Preset::read(node, context)?), options: Vec::new() });
        }
        let keys = Keys::open(node, &shape())?;
        let options = keys.read("options", petsc_options)?.unwrap_or_default();
        Ok(Self { preset: keys.read("preset", |node| Preset::read(node, context))?, options })
    }

    fn echo(&self, dimension: usize) -> Json {
        entries([("preset", self.preset.echo(dimension)), ("options", json!(self.options.join(" ")))]).into()
    }
}

fn shape() -> TableShape {
    TableShape::new("the solver").optional("preset", Preset::kind(), "the inner solver of all bodies").optional(
        "options",
        ValueKind::Text,
        "PETSc options that choose solvers and set their parameters: \"-ksp_rtol 1e-10\"",
    )
}

/// Return the words of PETSc options that choose solvers and set their parameters. Options that do anything else are refused.
fn petsc_options(node: &Node) -> Result<Vec<String>> {
    let words: Vec<String> = node.string()?.split_whitespace().map(str::to_owned).collect();
    for (name, value) in options::pairs(&words).map_err(|error| error.at(&node.place))? {
        options::check_of_scene(name, value).map_err(|error| error.at(&node.place_of_word(name)))?;
    }
    Ok(words)
}
