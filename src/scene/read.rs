//! TOML as a tree of values that know where they stand, with getters that refuse in words.

use super::shape::{Form, Table};
use crate::error::{Error, Located, Place, Result, Source, nearest, shown};
use std::ops::Range;
use std::sync::Arc;
use toml::de::{DeTable, DeValue};

/// A value and its place.
#[derive(Debug, Clone)]
pub(super) struct Node {
    pub place: Place,
    pub value: Value,
}

/// Kinds of TOML value.
#[derive(Debug, Clone)]
pub(super) enum Value {
    String(String),
    Integer(i64),
    Float(f64),
    Boolean(bool),
    Date,
    List(Vec<Node>),
    /// In the order of the text.
    Table(Vec<Entry>),
}

/// A key of a table and its value.
#[derive(Debug, Clone)]
pub(super) struct Entry {
    pub key: String,
    pub key_place: Place,
    pub node: Node,
}

/// Parses a whole scene; the result is a table.
pub(super) fn document(source: &Arc<Source>) -> Result<Node> {
    let table = DeTable::parse(&source.text).map_err(|error| syntax(source, 0, &error))?;
    let convert = Convert { source, offset: 0 };
    let value = Value::Table(convert.entries(table.get_ref())?);
    Ok(Node { place: convert.place(table.span()), value })
}

/// Parses the value that stands at `offset` of the source up to its end.
pub(super) fn value(source: &Arc<Source>, offset: usize) -> Result<Node> {
    let value = DeValue::parse(&source.text[offset..]).map_err(|error| syntax(source, offset, &error))?;
    Convert { source, offset }.node(&value)
}

/// Turns an error of the `toml` crate into ours.
fn syntax(source: &Arc<Source>, offset: usize, error: &toml::de::Error) -> Error {
    let span = error.span().unwrap_or(0..0);
    let place = Convert { source, offset }.place(span);
    let marked = &source.text[place.span.clone()];
    let refusal = Error::scene(&place, format!("this is not TOML: {}", error.message()));
    let quotable = !marked.is_empty() && !marked.contains(['"', '\'', '\n', '=', '[', '{']);
    let before = source.text[..place.span.start].trim_end();
    let repeats = matches!(marked, "body" | "contact") && before.lines().next_back().is_some_and(|line| line == "[");
    if repeats {
        refusal.help(format!("each {marked} begins with two brackets: [[{marked}]]"))
    } else if source.name.ends_with(".geo") {
        refusal.help("a scene is a TOML file that names its script: mesh = \"part.geo\"; `winkler new` writes both")
    } else if quotable && before.ends_with(['=', '[', ',']) {
        refusal.help(format!("texts and expressions need quotes: \"{marked}\""))
    } else {
        refusal
    }
}

struct Convert<'a> {
    source: &'a Arc<Source>,
    offset: usize,
}

impl Convert<'_> {
    /// A place, kept inside the text and on character borders.
    fn place(&self, span: Range<usize>) -> Place {
        let text = &self.source.text;
        let border = |from: usize| (0..=from.min(text.len())).rev().find(|at| text.is_char_boundary(*at)).unwrap_or(0);
        let start = border(span.start + self.offset);
        let end = border(span.end + self.offset).max(start);
        Place { source: self.source.clone(), span: start..end }
    }

    fn entries(&self, table: &DeTable<'_>) -> Result<Vec<Entry>> {
        let entry = |(key, value): (&toml::Spanned<_>, &_)| {
            let key: &toml::Spanned<toml::de::DeString<'_>> = key;
            let node = self.node(value)?;
            Ok(Entry { key: key.get_ref().to_string(), key_place: self.place(key.span()), node })
        };
        let mut entries = table.iter().map(entry).collect::<Result<Vec<_>>>()?;
        entries.sort_by_key(|entry| entry.key_place.span.start);
        Ok(entries)
    }

    fn node(&self, value: &toml::Spanned<DeValue<'_>>) -> Result<Node> {
        let place = self.place(value.span());
        let value = match value.get_ref() {
            DeValue::String(text) => Value::String(text.to_string()),
            DeValue::Integer(digits) => match i64::from_str_radix(digits.as_str(), digits.radix()) {
                Ok(value) => Value::Integer(value),
                Err(_) => return Err(Error::scene(&place, "the number is too large")),
            },
            DeValue::Float(digits) => match digits.as_str().parse() {
                Ok(value) => Value::Float(value),
                Err(_) => return Err(Error::scene(&place, "not a number")),
            },
            DeValue::Boolean(value) => Value::Boolean(*value),
            DeValue::Datetime(_) => Value::Date,
            DeValue::Array(items) => Value::List(items.iter().map(|item| self.node(item)).collect::<Result<_>>()?),
            DeValue::Table(table) => Value::Table(self.entries(table)?),
        };
        Ok(Node { place, value })
    }
}

impl Node {
    /// Refusal of a value of the wrong kind; `about` says what belongs there.
    pub fn expected(&self, what: &str, about: &str) -> Error {
        let found = match &self.value {
            Value::String(_) => "a string",
            Value::Integer(_) => "a whole number",
            Value::Float(_) => "a number",
            Value::Boolean(_) => "true or false",
            Value::Date => "a date",
            Value::List(_) => "a list",
            Value::Table(_) => "a table",
        };
        let error = Error::scene(&self.place, format!("expected {what}, found {found}")).label(format!("not {what}"));
        match &self.value {
            Value::String(text) if text.parse::<f64>().is_ok() => error.help("write the number without quotes"),
            Value::Integer(_) | Value::Float(_) | Value::Boolean(_) if what == "a string" => {
                error.help("write it in quotes")
            }
            _ if about.is_empty() => error,
            _ => error.help(about),
        }
    }

    /// Refusal of a value of the right kind.
    pub fn refuse(&self, message: impl Into<String>) -> Error {
        Error::scene(&self.place, message)
    }

    /// The place of the first such word in a text, or of the whole where it is not written as it reads.
    pub fn place_of_word(&self, word: &str) -> Place {
        let Place { source, span } = &self.place;
        let found = source.text[span.clone()].find(word).map(|at| span.start + at);
        Place { source: source.clone(), span: found.map_or(span.clone(), |at| at..at + word.len()) }
    }

    /// The place of the value at a dotted path, or of the nearest one around it.
    pub fn place_of(&self, path: &str) -> &Place {
        let mut node = self;
        for key in path.split('.') {
            let below = match &node.value {
                Value::Table(entries) => entries.iter().find(|entry| entry.key == key).map(|entry| &entry.node),
                Value::List(items) => key.parse().ok().and_then(|place: usize| items.get(place)),
                _ => None,
            };
            let Some(below) = below else { break };
            node = below;
        }
        &node.place
    }

    /// Whether it is a table with this key.
    pub fn holds(&self, key: &str) -> bool {
        matches!(&self.value, Value::Table(entries) if entries.iter().any(|entry| entry.key == key))
    }

    /// The name of a table that has one.
    pub fn name_in(&self) -> Option<&str> {
        let Value::Table(entries) = &self.value else { return None };
        entries.iter().find(|entry| entry.key == "name").and_then(|entry| entry.node.string().ok())
    }

    pub fn string(&self) -> Result<&str> {
        match &self.value {
            Value::String(text) => Ok(text),
            _ => Err(self.expected("a string", "")),
        }
    }

    /// A string that is a name: not empty.
    pub fn name(&self) -> Result<Located<String>> {
        match self.string()? {
            "" => Err(self.refuse("the name is empty")),
            name => Ok(Located::new(name.to_owned(), self.place.clone())),
        }
    }

    /// A finite number.
    pub fn number(&self) -> Result<f64> {
        match self.value {
            Value::Integer(value) => Ok(value as f64),
            Value::Float(value) if value.is_finite() => Ok(value),
            Value::Float(_) => Err(self.refuse("the number is not finite")),
            _ => Err(self.expected("a number", "")),
        }
    }

    /// A finite number > 0; `what` names it in the message.
    pub fn positive(&self, what: &str) -> Result<f64> {
        match self.number()? {
            value if value > 0.0 => Ok(value),
            value => Err(self.refuse(format!("{what} is {}", shown(value))).label("must be greater than 0")),
        }
    }

    /// A whole number, not negative; a fraction is refused.
    pub fn count(&self) -> Result<usize> {
        match self.value {
            Value::Integer(value) => usize::try_from(value).map_err(|_| self.refuse("the number is below 0")),
            _ => Err(self.expected("a whole number", "")),
        }
    }

    pub fn boolean(&self) -> Result<bool> {
        match self.value {
            Value::Boolean(value) => Ok(value),
            _ => Err(self.expected("true or false", "")),
        }
    }

    pub fn list(&self) -> Result<&[Node]> {
        match &self.value {
            Value::List(items) => Ok(items),
            _ => Err(self.expected("a list", "")),
        }
    }
}

impl Form {
    /// Whether a value is of this kind, whatever is in it.
    fn admits(&self, value: &Value) -> bool {
        match self {
            Self::Text | Self::Word(_) => matches!(value, Value::String(_)),
            Self::Flag => matches!(value, Value::Boolean(_)),
            Self::Number => matches!(value, Value::Integer(_) | Value::Float(_)),
            Self::Whole | Self::Count | Self::Among(_) => matches!(value, Value::Integer(_)),
            Self::Field => matches!(value, Value::Integer(_) | Value::Float(_) | Value::String(_)),
            Self::List(_) => matches!(value, Value::List(_)),
            Self::Table(_) | Self::Named(_) => matches!(value, Value::Table(_)),
            Self::Either(forms) => forms.iter().any(|form| form.admits(value)),
        }
    }

    /// Why a whole number is refused; none if it is not.
    fn breach(&self, value: &Value) -> Option<String> {
        match (self, value) {
            (Self::Whole, Value::Integer(..0)) => Some("must be 0 or more".to_owned()),
            (Self::Count, Value::Integer(..1)) => Some("must be 1 or more".to_owned()),
            (Self::Among(known), Value::Integer(number)) if !known.contains(number) => {
                let known: Vec<String> = known.iter().map(i64::to_string).collect();
                Some(format!("must be {}", known.join(" or ")))
            }
            (Self::Either(forms), _) => {
                forms.iter().filter(|form| form.admits(value)).find_map(|form| form.breach(value))
            }
            _ => None,
        }
    }
}

/// Names that others give to keys.
const USUAL: [(&str, &str); 6] =
    [("nu", "poisson"), ("E", "young"), ("e", "young"), ("modulus", "young"), ("dim", "dimension"), ("bc", "fix")];

/// Keys of the whole scene that are values, which TOML gives to the table before them.
const TOP: [&str; 8] = ["title", "dimension", "plane", "units", "mesh", "solver", "estimate", "adapt"];

/// A table whose keys are all known, with values of the right kind.
pub(super) struct Keys<'a> {
    /// The table itself.
    pub node: &'a Node,
    entries: &'a [Entry],
    what: String,
}

impl<'a> Keys<'a> {
    /// Opens a table; what does not fit its shape is refused.
    pub fn open(node: &'a Node, shape: &Table) -> Result<Self> {
        let names = || shape.keys.iter().filter(|key| !key.about.is_empty()).map(|key| key.name);
        let all = || format!("its keys are {}", names().collect::<Vec<_>>().join(", "));
        let Value::Table(entries) = &node.value else { return Err(node.expected("a table", &all())) };
        let keys = Self { node, entries, what: shape.what.to_string() };
        for Entry { key: name, key_place, node } in entries {
            let Some(key) = shape.keys.iter().find(|key| key.name == name) else {
                let error = Error::scene(key_place, format!("unknown key `{name}` in {}", keys.what));
                let other = USUAL.iter().find(|(usual, own)| usual == name && names().any(|key| key == *own));
                return Err(error.label("unknown key").help(
                    match other.map(|(_, own)| *own).or_else(|| nearest(name, names())) {
                        Some(near) => format!("did you mean `{near}`?"),
                        None if TOP.contains(&name.as_str()) => {
                            format!("`{name}` belongs to the whole scene: write it above the first line in [brackets]")
                        }
                        None => all(),
                    },
                ));
            };
            if !key.form.admits(&node.value) {
                return Err(node.expected(&key.form.words(), &key.about));
            }
            if let (Some(breach), Value::Integer(number)) = (key.form.breach(&node.value), &node.value) {
                return Err(node.refuse(format!("`{name}` is {number}")).label(breach));
            }
        }
        shape.apart.iter().try_for_each(|[first, second]| keys.exclude(first, second))?;
        for key in shape.keys.iter().filter(|key| key.must) {
            keys.require(key.name).map_err(|error| error.help(format!("{}: {}", key.name, key.about)))?;
        }
        Ok(keys)
    }

    pub fn entry(&self, key: &str) -> Option<&'a Entry> {
        self.entries.iter().find(|entry| entry.key == key)
    }

    pub fn get(&self, key: &str) -> Option<&'a Node> {
        self.entry(key).map(|entry| &entry.node)
    }

    /// True or false, or what holds without the key.
    pub fn flag(&self, key: &str, usual: bool) -> Result<bool> {
        self.get(key).map_or(Ok(usual), Node::boolean)
    }

    /// The value of a key that must be there.
    pub fn require(&self, key: &str) -> Result<&'a Node> {
        self.get(key).ok_or_else(|| {
            Error::scene(&self.node.place, format!("{} has no `{key}`", self.what)).label(format!("`{key}` is missing"))
        })
    }

    /// Refuses a table with two keys of which only one can hold; points at the later one, or the overriding one.
    fn exclude(&self, first: &str, second: &str) -> Result<()> {
        let mut both = self.entries.iter().filter(|entry| entry.key == first || entry.key == second).skip(1);
        match both.next() {
            None => Ok(()),
            Some(Entry { key_place, .. }) => {
                Err(Error::scene(key_place, format!("{} has both `{first}` and `{second}`", self.what))
                    .label("only one of them can hold")
                    .help(format!("remove `{first}` or `{second}`")))
            }
        }
    }
}
