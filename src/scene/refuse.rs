//! What the toml crate and serde refuse, put into words for a user: the place, what is wrong there, and what to do
//! about it. Descriptions of keys are those of the JSON schema.

use super::spec::schema;
use crate::error::{Error, Result, Source, nearest};
use crate::problem::read::{Sources, refusal};
use serde::Deserialize;
use serde_json::Value as Json;
use std::ops::Range;
use std::sync::Arc;
use toml::Spanned;
use toml::de::{DeTable, DeValue, Deserializer};

/// Turn an error of the `toml` crate into a refusal, with advice for common slips. Its spans begin at byte `offset` of
/// the source.
pub fn syntax(source: &Arc<Source>, offset: usize, error: &toml::de::Error) -> Error {
    let span = error.span().unwrap_or(0..0);
    let mut one = Sources::default();
    one.add(source.clone());
    let place = one.place(span.start + offset..span.end + offset);
    let marked = &source.text[place.span.clone()];
    let before = source.text[..place.span.start].trim_end();
    let refusal = Error::scene(&place, format!("this is not TOML: {}", error.message()));
    let is_single_bracket =
        matches!(marked, "body" | "contact") && before.lines().next_back().is_some_and(|line| line == "[");
    let is_bare_text =
        !marked.is_empty() && !marked.contains(['"', '\'', '\n', '=', '[', '{']) && before.ends_with(['=', '[', ',']);
    if is_single_bracket {
        refusal.help(format!("each {marked} begins with two brackets: [[{marked}]]"))
    } else if source.name.ends_with(".geo") {
        refusal.help("a scene is a TOML file that names its script: mesh = \"part.geo\"; `winkler new` writes both")
    } else if is_bare_text {
        refusal.help(format!("texts and expressions need quotes: \"{marked}\""))
    } else {
        refusal
    }
}

/// The table of a scene, which may be read several times.
pub struct Reader<'i> {
    /// The table.
    pub table: Spanned<DeTable<'i>>,
    /// The texts that its spans point into.
    pub sources: Sources,
}

impl<'i> Reader<'i> {
    /// Read the table.
    ///
    /// # Errors
    /// The first refusal.
    pub fn read<T: Deserialize<'i>>(&self) -> Result<T> {
        T::deserialize(Deserializer::from(self.table.clone())).map_err(|error| self.refuse(&error))
    }

    /// Refuse lists where tables belong.
    ///
    /// # Errors
    /// The first such list.
    pub fn refuse_lists(&self) -> Result<()> {
        let tree = self.tree();
        let Some(span) = list_for_table(&tree, &forms(&schema())) else { return Ok(()) };
        let found = Found::of(&tree, &span, false).unwrap_or(Found::root(&tree));
        Err(wrong_value(|message| Error::scene(&self.sources.place(span.clone()), message), &found, ""))
    }

    fn tree(&self) -> Spanned<DeValue<'i>> {
        Spanned::new(self.table.span(), DeValue::Table(self.table.get_ref().clone()))
    }

    /// Return the refusal of an error of serde.
    fn refuse(&self, error: &toml::de::Error) -> Error {
        let tree = self.tree();
        let key_in = |table: &Range<usize>, key: &str| {
            let mut node = Found::of(&tree, table, true)?.node;
            for part in key.split('.') {
                node = match part.parse::<usize>() {
                    Ok(index) if node.get_ref().is_array() => node.get_ref().get(index)?,
                    _ => node.get_ref().get(part)?,
                };
            }
            Some(node.span())
        };
        if let Some(error) = refusal(&self.sources, error.span(), key_in) {
            return error;
        }
        let span = error.span().unwrap_or(0..0);
        let refusal = |message: String| Error::scene(&self.sources.place(span.clone()), message);
        let message = error.message();
        let found = Found::of(&tree, &span, message.starts_with("missing")).unwrap_or(Found::root(&tree));
        let words: Vec<&str> = message.split('`').collect();
        let known = || words.iter().skip(3).step_by(2).copied();
        match words[..] {
            ["unknown field ", name, ..] => unknown_key(refusal, name, &found, known().collect()),
            ["missing field ", name, ..] => {
                let schema = schema();
                let about = description(&at(&schema, found.path.iter().map(String::as_str).chain([name])));
                refusal(format!("{} has no `{name}`", title(&found.path)))
                    .label(format!("`{name}` is missing"))
                    .help(format!("{name}: {about}"))
            }
            ["unknown variant ", word, ..] => refusal(format!("unknown word `{word}` for `{}`", found.path.join(".")))
                .suggest(word, known(), || format!("it is one of {}", known().collect::<Vec<_>>().join(", "))),
            _ => wrong_value(refusal, &found, message),
        }
    }
}

/// A value of a scene that was found by its span.
struct Found<'t, 'i> {
    /// The value.
    node: &'t Spanned<DeValue<'i>>,
    /// The keys that lead to it. Numbers stand for items of lists.
    path: Vec<String>,
}

impl<'t, 'i> Found<'t, 'i> {
    fn root(node: &'t Spanned<DeValue<'i>>) -> Self {
        Self { node, path: Vec::new() }
    }

    /// Find the value that has a span, or whose key has it. A list that is written `[[body]]` has the span of an item;
    /// `innermost` asks for the item.
    fn of(node: &'t Spanned<DeValue<'i>>, span: &Range<usize>, innermost: bool) -> Option<Self> {
        let own = || (node.span() == *span).then(|| Self::root(node));
        let below = || match node.get_ref() {
            DeValue::Table(table) => table.iter().find_map(|(key, value)| {
                let own = if key.span() == *span { Some(Self::root(value)) } else { None };
                let found = own.or_else(|| Self::of(value, span, innermost));
                found.map(|found| found.below(key.get_ref().to_string()))
            }),
            DeValue::Array(items) => items
                .iter()
                .enumerate()
                .find_map(|(number, item)| Some(Self::of(item, span, innermost)?.below(number.to_string()))),
            _ => None,
        };
        if innermost { below().or_else(own) } else { own().or_else(below) }
    }

    fn below(mut self, key: String) -> Self {
        self.path.insert(0, key);
        self
    }
}

/// Names that other programs give to keys, and the names of the keys here.
const SYNONYMS: [(&str, &str); 6] =
    [("nu", "poisson"), ("E", "young"), ("e", "young"), ("modulus", "young"), ("dim", "dimension"), ("bc", "fix")];

/// Keys of the whole scene that are values. Below a line in brackets TOML gives them to that table instead.
const TOP_LEVEL: [&str; 8] = ["title", "dimension", "plane", "units", "mesh", "solver", "estimate", "adapt"];

/// Return the refusal of a key that the table does not have, with the key that was probably meant.
fn unknown_key(refusal: impl Fn(String) -> Error, name: &str, found: &Found<'_, '_>, known: Vec<&str>) -> Error {
    let table = &found.path[..found.path.len().saturating_sub(1)];
    let synonym = SYNONYMS.iter().find(|(other, own)| *other == name && known.contains(own));
    let help = match synonym.map(|(_, own)| *own).or_else(|| nearest(name, known.iter().copied())) {
        Some(near) => format!("did you mean `{near}`?"),
        None if TOP_LEVEL.contains(&name) => {
            format!("`{name}` belongs to the whole scene: write it above the first line in [brackets]")
        }
        None => format!("its keys are {}", known.join(", ")),
    };
    refusal(format!("unknown key `{name}` in {}", title(table))).label("unknown key").help(help)
}

/// Return the refusal of a value of the wrong kind or out of its range.
fn wrong_value(refusal: impl Fn(String) -> Error, found: &Found<'_, '_>, message: &str) -> Error {
    let schema = schema();
    let schemas = at(&schema, found.path.iter().map(String::as_str));
    let (kinds, about) = (kinds(&schemas), description(&schemas));
    let value = found.node.get_ref();
    let number = value.as_integer().map(|integer| i64::from_str_radix(integer.as_str(), integer.radix()));
    let is_too_large = |digits: &str| !digits.contains("inf") && digits.parse().is_ok_and(f64::is_infinite);
    if matches!(number, Some(Err(_))) || value.as_float().is_some_and(|float| is_too_large(float.as_str())) {
        return refusal("the number is too large".to_owned());
    }
    let given = match value {
        DeValue::String(_) => "a string",
        DeValue::Integer(_) => "a whole number",
        DeValue::Float(_) => "a number",
        DeValue::Boolean(_) => "true or false",
        DeValue::Datetime(_) => "a date",
        DeValue::Array(_) => "a list",
        DeValue::Table(_) => "a table",
    };
    let takes = |kind: &str| kinds.iter().any(|known| known.contains(kind));
    let least = schemas.iter().find_map(|schema| schema["minimum"].as_i64());
    if let Some(Ok(number)) = number
        && takes("number")
    {
        let label = match least {
            Some(least) if number < least => format!("must be {least} or more"),
            _ => message.to_owned(),
        };
        let key = found.path.last().map_or("", String::as_str);
        return refusal(format!("`{key}` is {number}")).label(label);
    }
    if kinds.contains(&given) {
        return refusal(format!("`{}`: {message}", found.path.join(".")));
    }
    let what = kinds.join(" or ");
    let error = refusal(format!("expected {what}, found {given}")).label(format!("not {what}"));
    match value {
        DeValue::String(text) if takes("number") && text.parse::<f64>().is_ok() => {
            error.help("write the number without quotes")
        }
        DeValue::Integer(_) | DeValue::Float(_) | DeValue::Boolean(_) if what == "a string" => {
            error.help("write it in quotes")
        }
        _ if about.is_empty() => error,
        _ => error.help(about),
    }
}

/// Return the name of a table in messages.
fn title(path: &[String]) -> String {
    let is_item = |key: &str| key.starts_with(|c: char| c.is_ascii_digit());
    let names: Vec<&str> = path.iter().map(String::as_str).filter(|key| !is_item(key)).collect();
    match (&names[..], path.last().is_some_and(|last| is_item(last))) {
        ([], _) => "the scene".to_owned(),
        (["body"] | ["contact"] | ["body", "region"], _) => format!("[[{}]]", names.join(".")),
        ([_, .., last], true) => format!("an item of `{last}`"),
        (["method" | "output"] | ["data", _], _) => format!("[{}]", names.join(".")),
        ([.., last], _) => format!("`{last}`"),
    }
}

/// Return the schemas of the value at a path, below that of a scene.
fn at<'s, 'p>(schema: &'s Json, path: impl Iterator<Item = &'p str>) -> Vec<&'s Json> {
    path.fold(forms(schema), |schemas, key| below(&schemas, key))
}

/// Return the schemas of the values of a key of a table, or of the items of a list.
fn below<'s>(schemas: &[&'s Json], key: &str) -> Vec<&'s Json> {
    let inner = |schema: &&'s Json| {
        let known = [schema["properties"].get(key), schema.get("additionalProperties"), schema.get("items")];
        known.into_iter().flatten().find(|schema| schema.is_object())
    };
    schemas.iter().filter_map(inner).flat_map(forms).collect()
}

/// Return a schema and those of the forms that its value may have.
fn forms(schema: &Json) -> Vec<&Json> {
    let inner = schema["anyOf"].as_array().into_iter().flatten().flat_map(forms);
    std::iter::once(schema).chain(inner).collect()
}

/// Return the span of the first list that stands where a table belongs. serde would take its items for the values of
/// the keys, in their order.
fn list_for_table(node: &Spanned<DeValue<'_>>, schemas: &[&Json]) -> Option<Range<usize>> {
    match node.get_ref() {
        DeValue::Array(_) if !schemas.is_empty() && schemas.iter().all(|schema| schema.get("items").is_none()) => {
            Some(node.span())
        }
        DeValue::Array(items) => {
            let schemas = below(schemas, "");
            items.iter().find_map(|item| list_for_table(item, &schemas))
        }
        DeValue::Table(table) => {
            // serde refuses a table where a list belongs
            let tables: Vec<&Json> = schemas.iter().copied().filter(|schema| schema.get("items").is_none()).collect();
            table.iter().find_map(|(key, value)| list_for_table(value, &below(&tables, key.get_ref())))
        }
        _ => None,
    }
}

/// Return the first paragraph of the description, with the default.
fn description(schemas: &[&Json]) -> String {
    let Some(schema) = schemas.iter().find(|schema| schema["description"].is_string()) else { return String::new() };
    let text = schema["description"].as_str().unwrap_or_default();
    let paragraph = text.split("\n\n").next().unwrap_or_default().replace('\n', " ");
    match &schema["default"] {
        default @ (Json::Number(_) | Json::Bool(_) | Json::String(_)) => format!("{paragraph}; {default}"),
        _ => paragraph,
    }
}

/// Return what the kinds of value are called in messages.
fn kinds(schemas: &[&Json]) -> Vec<&'static str> {
    let mut kinds = Vec::new();
    for schema in schemas {
        let types = match &schema["type"] {
            Json::String(_) => vec![schema["type"].clone()],
            Json::Array(types) => types.clone(),
            _ => Vec::new(),
        };
        for kind in types {
            let words = match kind.as_str().unwrap_or_default() {
                "string" if schema["format"] == "expression" => "an expression",
                "string" => "a string",
                "number" => "a number",
                "integer" => "a whole number",
                "boolean" => "true or false",
                "array" => "a list",
                _ => "a table",
            };
            if !kinds.contains(&words) {
                kinds.push(words);
            }
        }
    }
    kinds
}
