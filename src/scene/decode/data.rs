//! `[data.NAME]`: files whose numbers are functions for expressions.

use super::{Decoder, Form, Keys, Node, Table, Value, choose, file, word};
use crate::data::{Data, DataSpec, Interpolation, Library, Outside};
use crate::error::{Error, Result};
use crate::expression::names;
use crate::scene::read::Entry;
use std::borrow::Cow;
use std::path::Path;
use std::sync::Arc;

/// The shape of `[data.NAME]`.
pub(super) fn table(what: impl Into<Cow<'static, str>>) -> Table {
    use Form::{Either, Flag, Number, Text};
    let pair = || Either(vec![Number, Number.list()]);
    Table::new(what)
        .must("file", Text, "a table of numbers, or .npy")
        .key("points", Flag, "whether each row is a place and its height; false")
        .key("origin", pair(), "place of the first height; 0")
        .key("spacing", pair(), "distance of the heights along a row and from row to row")
        .key("unit", Number, "what a height of 1 in the file is; 1")
        .key("interpolate", word(&Interpolation::ALL), "what is between the heights; \"linear\"")
        .key("outside", word(&Outside::ALL), "what is beyond them; \"error\"")
}

impl Decoder<'_> {
    /// The data of a scene. Files are looked for, not read.
    pub(super) fn library(&self, node: Option<&Node>) -> Result<Library> {
        const EXAMPLE: &str = "write [data.rough] and below it file = \"surface.csv\"";
        let Some(node) = node else { return Ok(Library::new()) };
        let Value::Table(entries) = &node.value else { return Err(node.expected("a table", EXAMPLE)) };
        if let Some(Entry { key, key_place, .. }) =
            entries.iter().find(|entry| !matches!(entry.node.value, Value::Table(_)))
        {
            return Err(Error::scene(key_place, format!("`{key}` in data without a name")).help(EXAMPLE));
        }
        entries.iter().map(|entry| Ok((entry.key.clone(), Arc::new(Data::new(spec(entry, self.folder)?))))).collect()
    }
}

fn spec(entry: &Entry, folder: &Path) -> Result<DataSpec> {
    let Entry { key: name, key_place, node } = entry;
    if !name.starts_with(|c: char| c.is_alphabetic()) || name.contains(|c: char| !c.is_alphanumeric() && c != '_') {
        return Err(Error::scene(key_place, format!("data cannot be called `{name}`"))
            .help("a name that expressions can use has letters, digits and _, a letter first"));
    }
    if names().any(|known| known == name) {
        return Err(Error::scene(key_place, format!("data cannot be called `{name}`"))
            .label("expressions have this name already"));
    }
    let keys = Keys::open(node, &table(format!("[data.{name}]")))?;
    let path = file(folder, keys.require("file")?)?;
    let points = keys.flag("points", false)?;
    let spacing = match keys.get("spacing") {
        Some(node) => pair(node, |node| node.positive("the spacing"))?,
        None if points => [1.0; 2],
        None => {
            return Err(keys.require("spacing").err().unwrap_or_else(|| node.refuse("no spacing")).help(
                "spacing = d or [d1, d2] is the distance of the heights along a row and from row to row; or points = true, if each row is a \
                 place and its height",
            ));
        }
    };
    Ok(DataSpec {
        name: name.clone(),
        file: path.value,
        place: path.place,
        points,
        origin: keys.get("origin").map_or(Ok([0.0; 2]), |node| pair(node, Node::number))?,
        spacing,
        unit: keys.get("unit").map_or(Ok(1.0), |node| match node.number()? {
            0.0 => Err(node.refuse("the unit is 0").label("all heights would be 0")),
            unit => Ok(unit),
        })?,
        interpolation: keys
            .get("interpolate")
            .map_or(Ok(Interpolation::Linear), |node| choose(node, "interpolation", &Interpolation::ALL))?,
        outside: keys.get("outside").map_or(Ok(Outside::Error), |node| choose(node, "`outside`", &Outside::ALL))?,
    })
}

/// Two numbers, or one for both.
fn pair(node: &Node, number: impl Fn(&Node) -> Result<f64>) -> Result<[f64; 2]> {
    match &node.value {
        Value::List(items) => match &items[..] {
            [a, b] => Ok([number(a)?, number(b)?]),
            _ => Err(node.refuse(format!("{} numbers", items.len())).label("one number, or two in a list")),
        },
        _ => number(node).map(|both| [both; 2]),
    }
}
