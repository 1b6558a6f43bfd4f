//! The shape of each table of a scene: which keys it may have, which kinds of value they take, and what they mean.
//!
//! [`Keys::open`](super::read::Keys::open) refuses a table that does not fit its shape, and the [JSON schema](crate::scene::schema) is
//! made of the same shapes.

use serde_json::Value as Json;
use std::borrow::Cow;

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
    /// A whole number >= 0.
    NonNegativeInteger,
    /// A whole number >= 1.
    PositiveInteger,
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
            Self::NonNegativeInteger | Self::PositiveInteger | Self::OneOf(_) => "a whole number".to_owned(),
            Self::Field => "a number or an expression".to_owned(),
            Self::List(_) => "a list".to_owned(),
            Self::Table(_) | Self::Map(_) => "a table".to_owned(),
            Self::Either(kinds) => kinds.iter().map(Self::words).collect::<Vec<_>>().join(" or "),
        }
    }
}
