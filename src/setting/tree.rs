//! TOML as a tree of values with their places, and the shapes of tables: which keys a table may have, which kinds of value they take, and what
//! they mean. [`Keys::open`] refuses a table that does not fit its shape. Getters refuse a wrong value with its place and advice.
//! The [JSON schema](crate::scene::schema) is made of the same shapes.

use crate::error::{Error, Located, Place, Result, Source, nearest, shown};
use serde_json::Value as Json;
use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;
use toml::de::{DeTable, DeValue};

/// A TOML value and its place.
#[derive(Debug, Clone)]
pub struct Node {
    pub place: Place,
    pub value: Value,
}

/// A TOML value.
#[derive(Debug, Clone)]
pub enum Value {
    String(String),
    Integer(i64),
    Float(f64),
    Boolean(bool),
    Date,
    List(Vec<Node>),
    /// The entries in the order of the text.
    Table(Vec<TableEntry>),
}

/// A key of a table and its value.
#[derive(Debug, Clone)]
pub struct TableEntry {
    pub key: String,
    pub key_place: Place,
    pub node: Node,
}

/// Parse the text of a scene file into a table.
///
/// # Errors
/// A text that is not TOML, and numbers that are too large to hold.
pub fn document(source: &Arc<Source>) -> Result<Node> {
    let table = DeTable::parse(&source.text).map_err(|error| syntax(source, 0, &error))?;
    let convert = Convert { source, offset: 0 };
    let value = Value::Table(convert.entries(table.get_ref())?);
    Ok(Node { place: convert.place(table.span()), value })
}

/// Parse the value that reaches from byte `offset` of the source to its end.
pub fn value(source: &Arc<Source>, offset: usize) -> Result<Node> {
    let value = DeValue::parse(&source.text[offset..]).map_err(|error| syntax(source, offset, &error))?;
    Convert { source, offset }.node(&value)
}

/// Turn an error of the `toml` crate into a refusal, with advice for common slips.
fn syntax(source: &Arc<Source>, offset: usize, error: &toml::de::Error) -> Error {
    let place = Convert { source, offset }.place(error.span().unwrap_or(0..0));
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

/// The conversion of the `toml` crate's values, whose spans count from `offset` of the source.
struct Convert<'a> {
    source: &'a Arc<Source>,
    offset: usize,
}

impl Convert<'_> {
    /// Return the place of a span, moved into the text and onto character boundaries.
    fn place(&self, span: Range<usize>) -> Place {
        let text = &self.source.text;
        let boundary =
            |from: usize| (0..=from.min(text.len())).rev().find(|at| text.is_char_boundary(*at)).unwrap_or(0);
        let start = boundary(span.start + self.offset);
        let end = boundary(span.end + self.offset).max(start);
        Place { source: self.source.clone(), span: start..end }
    }

    fn entries(&self, table: &DeTable<'_>) -> Result<Vec<TableEntry>> {
        let entry = |(key, value): (&toml::Spanned<_>, &_)| {
            let key: &toml::Spanned<toml::de::DeString<'_>> = key;
            let node = self.node(value)?;
            Ok(TableEntry { key: key.get_ref().to_string(), key_place: self.place(key.span()), node })
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
    /// Return the refusal of a value that is not of the kind `what`. `advice` says what belongs there; it may be empty.
    pub fn expected(&self, what: &str, advice: &str) -> Error {
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
            _ if advice.is_empty() => error,
            _ => error.help(advice),
        }
    }

    /// Return a refusal that points at this value.
    pub fn refuse(&self, message: impl Into<String>) -> Error {
        Error::scene(&self.place, message)
    }

    /// Return the place of the value at a dotted path, or of the innermost value around it that is there.
    pub fn place_of(&self, path: &str) -> &Place {
        let mut node = self;
        for key in path.split('.') {
            let below = match &node.value {
                Value::Table(entries) => entries.iter().find(|entry| entry.key == key).map(|entry| &entry.node),
                Value::List(items) => key.parse().ok().and_then(|index: usize| items.get(index)),
                _ => None,
            };
            let Some(below) = below else { break };
            node = below;
        }
        &node.place
    }

    /// Return whether this is a table with this key.
    pub fn has_key(&self, key: &str) -> bool {
        matches!(&self.value, Value::Table(entries) if entries.iter().any(|entry| entry.key == key))
    }

    /// Return the text of the key `name` of this table, if there is one.
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

    /// Return a text that is not empty, with its place.
    pub fn name(&self) -> Result<Located<String>> {
        match self.string()? {
            "" => Err(self.refuse("the name is empty")),
            name => Ok(Located::new(name.to_owned(), self.place.clone())),
        }
    }

    /// Return a finite number.
    pub fn number(&self) -> Result<f64> {
        match self.value {
            Value::Integer(value) => Ok(value as f64),
            Value::Float(value) if value.is_finite() => Ok(value),
            Value::Float(_) => Err(self.refuse("the number is not finite")),
            _ => Err(self.expected("a number", "")),
        }
    }

    /// Return a finite number > 0; `what` names it in the message.
    pub fn positive(&self, what: &str) -> Result<f64> {
        match self.number()? {
            value if value > 0.0 => Ok(value),
            value => Err(self.refuse(format!("{what} is {}", shown(value))).label("must be greater than 0")),
        }
    }

    /// Return a whole number >= 0.
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

impl ValueKind {
    /// Return whether a value is of this kind. The items of lists and the entries of tables are not looked at.
    fn admits(&self, value: &Value) -> bool {
        match self {
            Self::Text | Self::Word(_) => matches!(value, Value::String(_)),
            Self::Flag => matches!(value, Value::Boolean(_)),
            Self::Number => matches!(value, Value::Integer(_) | Value::Float(_)),
            Self::Integer(_) | Self::OneOf(_) => matches!(value, Value::Integer(_)),
            Self::Field => matches!(value, Value::Integer(_) | Value::Float(_) | Value::String(_)),
            Self::List(_) => matches!(value, Value::List(_)),
            Self::Table(_) | Self::Map(_) => matches!(value, Value::Table(_)),
            Self::Either(kinds) => kinds.iter().any(|kind| kind.admits(value)),
        }
    }

    /// Return what a whole number must be instead; `None` if it is in range.
    fn breach(&self, number: i64) -> Option<String> {
        match self {
            Self::Integer(least) if number < *least => Some(format!("must be {least} or more")),
            Self::OneOf(known) if !known.contains(&number) => {
                let known: Vec<String> = known.iter().map(i64::to_string).collect();
                Some(format!("must be {}", known.join(" or ")))
            }
            Self::Either(kinds) => kinds.iter().find_map(|kind| kind.breach(number)),
            _ => None,
        }
    }
}

/// Names that other programs give to keys, and the names of the keys here.
const SYNONYMS: [(&str, &str); 6] =
    [("nu", "poisson"), ("E", "young"), ("e", "young"), ("modulus", "young"), ("dim", "dimension"), ("bc", "fix")];

/// Keys of the whole scene that are values. Below a line in brackets TOML gives them to that table instead.
const TOP_LEVEL: [&str; 8] = ["title", "dimension", "plane", "units", "mesh", "solver", "estimate", "adapt"];

/// A table that fits its shape: all its keys are known, and their values are of the right kind.
pub struct Keys<'a> {
    /// The table itself.
    pub node: &'a Node,
    entries: &'a [TableEntry],
    /// Name of the table in messages.
    name: String,
}

impl<'a> Keys<'a> {
    /// Open a table of this shape.
    ///
    /// # Errors
    /// A value that is no table, unknown keys, values of the wrong kind, keys that exclude each other, and missing keys.
    pub fn open(node: &'a Node, shape: &TableShape) -> Result<Self> {
        let Value::Table(entries) = &node.value else { return Err(node.expected("a table", &key_list(shape))) };
        let keys = Self { node, entries, name: shape.name.to_string() };
        for TableEntry { key: name, key_place, node } in entries {
            let Some(key) = shape.keys.iter().find(|key| key.name == name) else {
                return Err(unknown_key(name, key_place, shape));
            };
            if !key.kind.admits(&node.value) {
                return Err(node.expected(&key.kind.words(), &key.description));
            }
            if let Value::Integer(number) = node.value
                && let Some(breach) = key.kind.breach(number)
            {
                return Err(node.refuse(format!("`{name}` is {number}")).label(breach));
            }
        }
        shape.exclusive.iter().try_for_each(|[first, second]| keys.exclude(first, second))?;
        for key in shape.keys.iter().filter(|key| key.required) {
            keys.require(key.name).map_err(|error| error.help(format!("{}: {}", key.name, key.description)))?;
        }
        Ok(keys)
    }

    /// Return the key and its value, if the key is given.
    pub fn entry(&self, key: &str) -> Option<&'a TableEntry> {
        self.entries.iter().find(|entry| entry.key == key)
    }

    /// Return the value of a key, if the key is given.
    pub fn get(&self, key: &str) -> Option<&'a Node> {
        self.entry(key).map(|entry| &entry.node)
    }

    /// Read the value of a key by `read`, if the key is given.
    pub fn read<T>(&self, key: &str, read: impl FnOnce(&'a Node) -> Result<T>) -> Result<Option<T>> {
        self.get(key).map(read).transpose()
    }

    /// Return the items of a list; there are none without the key.
    pub fn items(&self, key: &str) -> Result<&'a [Node]> {
        Ok(self.read(key, Node::list)?.unwrap_or_default())
    }

    /// Return true or false, or `default` without the key.
    pub fn flag(&self, key: &str, default: bool) -> Result<bool> {
        Ok(self.read(key, Node::boolean)?.unwrap_or(default))
    }

    /// Return the value of a key that must be there.
    pub fn require(&self, key: &str) -> Result<&'a Node> {
        self.get(key).ok_or_else(|| {
            Error::scene(&self.node.place, format!("{} has no `{key}`", self.name)).label(format!("`{key}` is missing"))
        })
    }

    /// Refuse a table that has both keys. The caret marks the later one; an override comes later than what the scene file has.
    fn exclude(&self, first: &str, second: &str) -> Result<()> {
        let mut both = self.entries.iter().filter(|entry| entry.key == first || entry.key == second);
        let Some(TableEntry { key_place, .. }) = both.nth(1) else { return Ok(()) };
        Err(Error::scene(key_place, format!("{} has both `{first}` and `{second}`", self.name))
            .label("only one of them can hold")
            .help(format!("remove `{first}` or `{second}`")))
    }
}

/// Return the refusal of a key that the table does not have, with the key that was probably meant.
fn unknown_key(name: &str, place: &Place, shape: &TableShape) -> Error {
    let known = || shape.documented().map(|key| key.name);
    let synonym = SYNONYMS.iter().find(|(other, own)| *other == name && known().any(|key| key == *own));
    let help = match synonym.map(|(_, own)| *own).or_else(|| nearest(name, known())) {
        Some(near) => format!("did you mean `{near}`?"),
        None if TOP_LEVEL.contains(&name) => {
            format!("`{name}` belongs to the whole scene: write it above the first line in [brackets]")
        }
        None => key_list(shape),
    };
    Error::scene(place, format!("unknown key `{name}` in {}", shape.name)).label("unknown key").help(help)
}

/// Return the advice that lists the keys of a table.
fn key_list(shape: &TableShape) -> String {
    let names: Vec<&str> = shape.documented().map(|key| key.name).collect();
    format!("its keys are {}", names.join(", "))
}

/// The shape of a table.
pub struct TableShape {
    /// Name of the table in messages.
    pub name: Cow<'static, str>,
    /// The keys, in the order in which messages list them.
    pub keys: Vec<KeyShape>,
    /// Pairs of keys that exclude each other.
    pub exclusive: Vec<[&'static str; 2]>,
}

/// The shape of a key.
pub struct KeyShape {
    /// Name of the key.
    pub name: &'static str,
    /// The kind of value that it takes.
    pub kind: ValueKind,
    /// What the key means, and its default. It is the description in the JSON schema, and the advice where a value is of the wrong
    /// kind. A key without a description is set by the command line only, so that neither messages nor the schema mention it.
    pub description: Cow<'static, str>,
    /// Whether the table must have the key.
    pub required: bool,
}

/// A kind of value.
pub enum ValueKind {
    /// A text.
    Text,
    /// True or false.
    Flag,
    /// A number.
    Number,
    /// A whole number that is at least this.
    Integer(i64),
    /// One of these whole numbers.
    OneOf(&'static [i64]),
    /// A number, or an expression in the coordinates.
    Field,
    /// One of these words. The check of the kind accepts any text; the decoder looks the word up and suggests the nearest one.
    Word(Vec<&'static str>),
    /// A list of values of one kind.
    List(Box<ValueKind>),
    /// A table of a known shape.
    Table(TableShape),
    /// A table whose keys are names that the user chooses.
    Map(Box<ValueKind>),
    /// A value of any of these kinds.
    Either(Vec<ValueKind>),
}

impl TableShape {
    /// Return the shape of a table without keys.
    pub fn new(name: impl Into<Cow<'static, str>>) -> Self {
        Self { name: name.into(), keys: Vec::new(), exclusive: Vec::new() }
    }

    /// Add a key that may be left out; `about` is its description.
    pub fn optional(self, name: &'static str, kind: impl Into<ValueKind>, about: impl Into<Cow<'static, str>>) -> Self {
        self.with(KeyShape { name, kind: kind.into(), description: about.into(), required: false })
    }

    /// Add a key that must be there; `about` is its description.
    pub fn required(self, name: &'static str, kind: impl Into<ValueKind>, about: impl Into<Cow<'static, str>>) -> Self {
        self.with(KeyShape { name, kind: kind.into(), description: about.into(), required: true })
    }

    /// Add a key whose description is the first paragraph of its doc comment, with the default behind it. A key without a default must
    /// be there.
    pub fn key(self, name: &'static str, doc: &[&str], kind: ValueKind, default: Option<Json>) -> Self {
        let paragraph: Vec<&str> = doc.iter().map(|line| line.trim()).take_while(|line| !line.is_empty()).collect();
        let required = default.is_none();
        let default = match default {
            Some(Json::Number(number)) => format!("; {}", number.to_string().trim_end_matches(".0")),
            Some(scalar @ (Json::Bool(_) | Json::String(_))) => format!("; {scalar}"),
            _ => String::new(),
        };
        let description = format!("{}{default}", paragraph.join(" ")).into();
        self.with(KeyShape { name, kind, description, required })
    }

    fn with(mut self, key: KeyShape) -> Self {
        self.keys.push(key);
        self
    }

    /// Add all keys of another table.
    pub fn and(mut self, other: Self) -> Self {
        self.keys.extend(other.keys);
        self
    }

    /// Let at most one of these keys be given.
    pub fn at_most_one(self, names: &[&'static str]) -> Self {
        (1..names.len()).fold(self, |table, end| table.not_both(&names[end - 1..end], &names[end..]))
    }

    /// Let each key of `some` exclude each key of `others`.
    pub fn not_both(mut self, some: &[&'static str], others: &[&'static str]) -> Self {
        self.exclusive.extend(some.iter().flat_map(|one| others.iter().map(|other| [*one, *other])));
        self
    }

    /// Iterate over the keys that a scene file may have.
    pub fn documented(&self) -> impl Iterator<Item = &KeyShape> {
        self.keys.iter().filter(|key| !key.description.is_empty())
    }

    /// Return the kind of value that is a list of tables of this shape.
    pub fn list(self) -> ValueKind {
        ValueKind::Table(self).list()
    }
}

impl From<TableShape> for ValueKind {
    fn from(shape: TableShape) -> Self {
        Self::Table(shape)
    }
}

/// Return the kind of value that is one word of a list of choices.
pub fn word<T>(choices: &[(&'static str, T)]) -> ValueKind {
    ValueKind::Word(choices.iter().map(|(name, _)| *name).collect())
}

impl ValueKind {
    /// Return the kind of value that is a list of values of this kind.
    pub fn list(self) -> Self {
        Self::List(Box::new(self))
    }

    /// Return what this kind is called in messages.
    pub fn words(&self) -> String {
        match self {
            Self::Text | Self::Word(_) => "a string".to_owned(),
            Self::Flag => "true or false".to_owned(),
            Self::Number => "a number".to_owned(),
            Self::Integer(_) | Self::OneOf(_) => "a whole number".to_owned(),
            Self::Field => "a number or an expression".to_owned(),
            Self::List(_) => "a list".to_owned(),
            Self::Table(_) | Self::Map(_) => "a table".to_owned(),
            Self::Either(kinds) => kinds.iter().map(Self::words).collect::<Vec<_>>().join(" or "),
        }
    }
}
