//! What the toml crate and serde refuse, put into words for a user: the place, what is wrong there, and what to do
//! about it. Descriptions of keys are those of the JSON schema.

use super::gone;
use super::spec::schema;
use crate::error::{Error, Source, nearest};
use crate::problem::compile::Sources;
use serde_json::Value as Json;
use std::ops::Range;
use std::sync::Arc;
use toml::Spanned;
use toml::de::DeValue;

/// A value of a document.
pub type Node<'i> = Spanned<DeValue<'i>>;

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

/// Return the refusal of an error of serde for the document `root`.
pub fn refuse(root: &Node<'_>, sources: &Sources, error: &toml::de::Error) -> Error {
    let span = error.span().unwrap_or(0..0);
    if let Some((error, own)) = Error::unpacked(error.message()) {
        let span = own.unwrap_or(span);
        let about = Found::of(root, &span, false).map_or(String::new(), |found| about(&found.path));
        let is_explained = error.advice().is_some() || about.is_empty() || !error.message().starts_with("expected ");
        let error = error.at(&sources.place(span));
        return if is_explained { error } else { error.help(about) };
    }
    let refusal = |message: String| Error::scene(&sources.place(span.clone()), message);
    let message = error.message();
    let found = Found::of(root, &span, message.starts_with("missing")).unwrap_or(Found::root(root));
    let words: Vec<&str> = message.split('`').collect();
    let known = || words.iter().skip(3).step_by(2).copied();
    match words[..] {
        ["unknown field ", name, ..] => unknown_key(refusal, name, &found, known().collect()),
        ["missing field ", name, ..] => {
            let about = about(&[&found.path[..], &[name.to_owned()]].concat());
            refusal(format!("{} has no `{name}`", title(&found.path)))
                .label(format!("`{name}` is missing"))
                .help(format!("{name}: {about}"))
        }
        ["unknown variant ", word, ..] => {
            let key = found.path.join(".");
            let error = refusal(format!("unknown word `{word}` for `{key}`"));
            match gone::advice_in(word, &key) {
                Some(advice) => error.help(advice),
                None => {
                    error.suggest(word, known(), || format!("it is one of {}", known().collect::<Vec<_>>().join(", ")))
                }
            }
        }
        _ => wrong_value(refusal, &found, message),
    }
}

/// A value of a scene that was found by its span.
struct Found<'t, 'i> {
    /// The value.
    node: &'t Node<'i>,
    /// The keys that lead to it. Numbers stand for items of lists.
    path: Vec<String>,
}

impl<'t, 'i> Found<'t, 'i> {
    fn root(node: &'t Node<'i>) -> Self {
        Self { node, path: Vec::new() }
    }

    /// Find the value that has a span, or whose key has it. A list that is written `[[body]]` has the span of an item;
    /// `innermost` asks for the item.
    fn of(node: &'t Node<'i>, span: &Range<usize>, innermost: bool) -> Option<Self> {
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
    let title = title(table);
    let synonym = SYNONYMS.iter().find(|(other, own)| *other == name && known.contains(own));
    let near = synonym.map(|(_, own)| *own).or_else(|| nearest(name, known.iter().copied()));
    let help = match (gone::advice_in(name, &title), near) {
        (Some(advice), _) => advice.to_owned(),
        (None, Some(near)) => format!("did you mean `{near}`?"),
        (None, None) if TOP_LEVEL.contains(&name) => {
            format!("`{name}` belongs to the whole scene: write it above the first line in [brackets]")
        }
        (None, None) => format!("its keys are {}", known.join(", ")),
    };
    refusal(format!("unknown key `{name}` in {title}")).label("unknown key").help(help)
}

/// Return the refusal of a value of the wrong kind or out of its range.
fn wrong_value(refusal: impl Fn(String) -> Error, found: &Found<'_, '_>, message: &str) -> Error {
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
    let what = match message.rsplit_once("expected ").map(|(_, what)| what) {
        Some("usize" | "u64" | "i64") => "a whole number",
        Some("f64") => "a number",
        Some("a boolean") => "true or false",
        Some("a sequence") => "a list",
        Some(what) => what,
        None if message.starts_with("wanted string") => "a string",
        // the message tells what is wrong
        None => "",
    };
    match number {
        Some(Ok(number)) if ["", "a whole number"].contains(&what) => {
            let key = found.path.last().map_or("", String::as_str);
            let label = if what.is_empty() { message } else { "must be 0 or more" };
            return refusal(format!("`{key}` is {number}")).label(label);
        }
        _ if what.is_empty() => return refusal(format!("`{}`: {message}", found.path.join("."))),
        _ => {}
    }
    let error = refusal(format!("expected {what}, found {given}")).label(format!("not {what}"));
    let about = about(&found.path);
    match value {
        DeValue::String(text) if what.contains("number") && text.parse::<f64>().is_ok() => {
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

/// Return what the JSON schema says about the value at a path: the first paragraph of its description, and the default.
fn about(path: &[String]) -> String {
    let schema = schema();
    let schemas = path.iter().fold(forms(&schema), |schemas, key| below(&schemas, key));
    let Some(schema) = schemas.iter().find(|schema| schema["description"].is_string()) else { return String::new() };
    let text = schema["description"].as_str().unwrap_or_default();
    let paragraph = text.split("\n\n").next().unwrap_or_default().replace('\n', " ");
    match &schema["default"] {
        default @ (Json::Number(_) | Json::Bool(_) | Json::String(_)) => format!("{paragraph}; {default}"),
        _ => paragraph,
    }
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
