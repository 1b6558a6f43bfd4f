//! What a table of a scene may have: its keys, the values that each takes, what they mean. [`Keys::open`](super::read::Keys::open)
//! refuses what does not fit, and the [JSON schema](super::schema) of scenes is made of the same tables.

use std::borrow::Cow;

/// A table: its name in messages, its keys, and pairs of keys of which only one can hold.
pub struct Table {
    /// Name in messages.
    pub what: Cow<'static, str>,
    /// The keys in the order in which messages list them.
    pub keys: Vec<Key>,
    /// Keys that exclude each other.
    pub apart: Vec<[&'static str; 2]>,
}

/// A key of a table.
pub struct Key {
    /// Its name.
    pub name: &'static str,
    /// The values that it takes.
    pub form: Form,
    /// What it is, with its default; the advice where its value is of the wrong kind. Without one the key is no part of a scene file.
    pub about: Cow<'static, str>,
    /// Whether a table must have it.
    pub must: bool,
}

/// Values of a key.
pub enum Form {
    /// A text.
    Text,
    /// True or false.
    Flag,
    /// A number.
    Number,
    /// A whole number from 0 on.
    Whole,
    /// A whole number from 1 on.
    Count,
    /// One of some whole numbers.
    Among(&'static [i64]),
    /// A number, or an expression in the coordinates.
    Field,
    /// One of some words, which the decoder looks up.
    Word(Vec<&'static str>),
    /// A list of such values.
    List(Box<Form>),
    /// A table with these keys.
    Table(Table),
    /// A table whose keys are names.
    Named(Box<Form>),
    /// One of several forms.
    Either(Vec<Form>),
}

impl Table {
    /// A table without keys.
    pub fn new(what: impl Into<Cow<'static, str>>) -> Self {
        Self { what: what.into(), keys: Vec::new(), apart: Vec::new() }
    }

    /// With a key that may be left out.
    pub fn key(self, name: &'static str, form: Form, about: impl Into<Cow<'static, str>>) -> Self {
        self.with(Key { name, form, about: about.into(), must: false })
    }

    /// With a key that must be there.
    pub fn must(self, name: &'static str, form: Form, about: impl Into<Cow<'static, str>>) -> Self {
        self.with(Key { name, form, about: about.into(), must: true })
    }

    fn with(mut self, key: Key) -> Self {
        self.keys.push(key);
        self
    }

    /// Of these keys only one can hold.
    pub fn apart(self, names: &[&'static str]) -> Self {
        (1..names.len()).fold(self, |table, end| table.against(&names[end - 1..end], &names[end..]))
    }

    /// Each of some keys excludes each of others.
    pub fn against(mut self, some: &[&'static str], others: &[&'static str]) -> Self {
        self.apart.extend(some.iter().flat_map(|one| others.iter().map(|other| [*one, *other])));
        self
    }

    /// This table as a value.
    pub fn form(self) -> Form {
        Form::Table(self)
    }
}

/// One of the words of a list of choices.
pub fn word<T>(choices: &[(&'static str, T)]) -> Form {
    Form::Word(choices.iter().map(|(name, _)| *name).collect())
}

impl Form {
    /// A list of such values.
    pub fn list(self) -> Self {
        Self::List(Box::new(self))
    }

    /// What it is in words.
    pub fn words(&self) -> String {
        match self {
            Self::Text | Self::Word(_) => "a string".to_owned(),
            Self::Flag => "true or false".to_owned(),
            Self::Number => "a number".to_owned(),
            Self::Whole | Self::Count | Self::Among(_) => "a whole number".to_owned(),
            Self::Field => "a number or an expression".to_owned(),
            Self::List(_) => "a list".to_owned(),
            Self::Table(_) | Self::Named(_) => "a table".to_owned(),
            Self::Either(forms) => forms.iter().map(Self::words).collect::<Vec<_>>().join(" or "),
        }
    }
}
