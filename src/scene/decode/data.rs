//! `[data.NAME]`: files whose numbers are functions for expressions.

use crate::data::{Data, DataSpec, Detrend, Fill, Interpolation, Library, Missing, Outside, has_header};
use crate::error::{Error, Place, Result};
use crate::expression::names;
use crate::problem::name_of;
use crate::setting::{Entries, Entry, Keys, Node, TableShape, Value, ValueKind, choose, entries, file, word};
use serde_json::{Value as Json, json};
use std::borrow::Cow;
use std::path::Path;
use std::sync::Arc;

/// Return the shape of `[data.NAME]`; `name` is its name in messages.
pub fn shape(name: impl Into<Cow<'static, str>>) -> TableShape {
    use ValueKind::{Either, Flag, Number, Text};
    let one_or_two = || Either(vec![Number, Number.list()]);
    let number_or_word = || Either(vec![Number, Text]);
    let number_or_word_or_list = || Either(vec![Number, Text, number_or_word().list()]);
    TableShape::new(name)
        .required("file", Text, "a table of numbers, .npy, or a grid .asc or .grd")
        .optional("points", Flag, "whether each row is a place and its height; false")
        .optional("origin", one_or_two(), "place of the first height; 0")
        .optional("spacing", one_or_two(), "distance of the heights along a row and from row to row")
        .optional("unit", Number, "what a height of 1 in the file is; 1")
        .optional("missing", number_or_word_or_list(), "what stands for a point without a height; NaN always does")
        .optional("fill", word(&Fill::ALL), "what such points get; \"error\"")
        .optional("detrend", word(&Detrend::ALL), "what is subtracted from the heights; \"none\"")
        .optional("interpolate", word(&Interpolation::ALL), "what is between the heights; \"linear\"")
        .optional("outside", word(&Outside::ALL), "what is beyond them; \"error\"")
}

/// Advice for heights on a grid without a spacing.
const SPACING: &str = "spacing = d or [d1, d2] is the distance of the heights along a row and from row to row; or points = true, if each row \
                       is a place and its height";

/// Return the data of a scene by name. Their files must exist; they are not read.
pub fn library(node: Option<&Node>, folder: &Path) -> Result<Library> {
    const EXAMPLE: &str = "write [data.rough] and below it file = \"surface.csv\"";
    let Some(node) = node else { return Ok(Library::new()) };
    let Value::Table(entries) = &node.value else { return Err(node.expected("a table", EXAMPLE)) };
    let is_table = |entry: &&Entry| matches!(entry.node.value, Value::Table(_));
    if let Some(Entry { key, key_place, .. }) = entries.iter().find(|entry| !is_table(entry)) {
        return Err(Error::scene(key_place, format!("`{key}` in data without a name")).help(EXAMPLE));
    }
    entries.iter().map(|entry| Ok((entry.key.clone(), Arc::new(Data::new(spec(entry, folder)?))))).collect()
}

/// Refuse names that expressions cannot use, or use for something else.
fn check_name(name: &str, place: &Place) -> Result<()> {
    if !name.starts_with(|c: char| c.is_alphabetic()) || name.contains(|c: char| !c.is_alphanumeric() && c != '_') {
        return Err(Error::scene(place, format!("data cannot be called `{name}`"))
            .help("a name that expressions can use has letters, digits and _, a letter first"));
    }
    if names().any(|known| known == name) {
        return Err(
            Error::scene(place, format!("data cannot be called `{name}`")).label("expressions have this name already")
        );
    }
    Ok(())
}

fn spec(entry: &Entry, folder: &Path) -> Result<DataSpec> {
    let Entry { key: name, key_place, node } = entry;
    check_name(name, key_place)?;
    let keys = Keys::open(node, &shape(format!("[data.{name}]")))?;
    let path = file(folder, keys.require("file")?)?;
    let points = keys.flag("points", false)?;
    let spacing = match keys.get("spacing") {
        None if points || has_header(&path.value) => [1.0; 2],
        _ => {
            let node = keys.require("spacing").map_err(|error| error.help(SPACING))?;
            pair(node, |node| node.positive("the spacing"))?
        }
    };
    Ok(DataSpec {
        name: name.clone(),
        file: path.value,
        place: path.place,
        points,
        origin: keys.read("origin", |node| pair(node, Node::number))?.unwrap_or_default(),
        spacing,
        unit: keys.read("unit", unit)?.unwrap_or(1.0),
        missing: keys.read("missing", missing)?,
        fill: keys.read("fill", |node| choose(node, "`fill`", &Fill::ALL))?.unwrap_or(Fill::Error),
        detrend: keys.read("detrend", |node| choose(node, "`detrend`", &Detrend::ALL))?.unwrap_or(Detrend::None),
        interpolation: keys
            .read("interpolate", |node| choose(node, "interpolation", &Interpolation::ALL))?
            .unwrap_or(Interpolation::Linear),
        outside: keys.read("outside", |node| choose(node, "`outside`", &Outside::ALL))?.unwrap_or(Outside::Error),
    })
}

/// Return the echo of data by name; null without data.
pub fn echo(data: &Library) -> Json {
    match data.is_empty() {
        true => Json::Null,
        false => data.values().map(|data| (data.spec.name.clone(), of_spec(&data.spec))).collect::<Entries>().into(),
    }
}

fn of_spec(spec: &DataSpec) -> Json {
    #[rustfmt::skip]
    let DataSpec {
        name: _, file, place: _, points, origin, spacing, unit, missing, fill, detrend, interpolation, outside,
    } = spec;
    let missing = missing.as_ref().map(|Missing { numbers, words }| {
        numbers.iter().map(|number| json!(number)).chain(words.iter().map(|word| json!(word))).collect::<Json>()
    });
    entries([
        ("file", json!(file.display().to_string())),
        ("points", json!(points)),
        ("origin", json!(origin)),
        ("spacing", json!(spacing)),
        ("unit", json!(unit)),
        ("missing", json!(missing)),
        ("fill", json!(name_of(&Fill::ALL, fill))),
        ("detrend", json!(name_of(&Detrend::ALL, detrend))),
        ("interpolate", json!(name_of(&Interpolation::ALL, interpolation))),
        ("outside", json!(name_of(&Outside::ALL, outside))),
    ])
    .into()
}

/// Return a number that is not 0.
fn unit(node: &Node) -> Result<f64> {
    match node.number()? {
        0.0 => Err(node.refuse("the unit is 0").label("all heights would be 0")),
        unit => Ok(unit),
    }
}

/// Return what stands for points without a height: a number, a word, or a list of these.
fn missing(node: &Node) -> Result<Missing> {
    let one = [node];
    let items: Vec<&Node> = match &node.value {
        Value::List(items) => items.iter().collect(),
        _ => one.to_vec(),
    };
    let mut missing = Missing::default();
    for item in items {
        match &item.value {
            Value::String(word) => missing.words.push(word.clone()),
            _ => missing.numbers.push(item.number()?),
        }
    }
    Ok(missing)
}

/// Return two numbers, each read by `number`; a single number stands for both.
fn pair(node: &Node, number: impl Fn(&Node) -> Result<f64>) -> Result<[f64; 2]> {
    match &node.value {
        Value::List(items) => match &items[..] {
            [a, b] => Ok([number(a)?, number(b)?]),
            _ => Err(node.refuse(format!("{} numbers", items.len())).label("one number, or two in a list")),
        },
        _ => number(node).map(|both| [both; 2]),
    }
}
