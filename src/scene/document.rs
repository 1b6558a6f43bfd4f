//! A scene file as a TOML document, and the options of the command line that change it.
//!
//! An option is `KEY=VALUE`. KEY is a dotted path. Items of lists are numbered from 0 (`contact.0.layer.power.a`); a
//! table with a name also goes by its name (`body.upper.order`). VALUE is TOML, or a bare text. Spans of new keys and
//! values lie in the text of the option, so that later refusals point there.

use super::refuse::{Node, refuse, syntax};
use crate::error::{Error, Kind, Place, Result, Source, few};
use crate::problem::compile::Sources;
use serde::Deserialize;
use std::ops::Range;
use std::sync::Arc;
use toml::Spanned;
use toml::de::{DeTable, DeValue, ValueDeserializer};

/// A document, and the texts that its spans point into.
pub struct Document<'i> {
    /// The table of the whole scene.
    pub root: Node<'i>,
    /// The texts.
    pub sources: Sources,
}

impl<'i> Document<'i> {
    /// Parse the text of a scene file, and change it by options.
    ///
    /// # Errors
    /// What is no TOML, and options without a value or with a key that the scene does not have.
    pub fn new(file: &'i Arc<Source>, options: &'i [Arc<Source>]) -> Result<Self> {
        let mut sources = Sources::default();
        sources.add(file.clone());
        let table = DeTable::parse(&file.text).map_err(|error| syntax(file, 0, &error))?;
        let mut root = Spanned::new(table.span(), DeValue::Table(table.into_inner()));
        for source in options {
            Override { source, begin: sources.add(source.clone()) }.apply(&mut root)?;
        }
        Ok(Self { root, sources })
    }

    /// Read the document.
    ///
    /// # Errors
    /// The first refusal.
    pub fn read<T: Deserialize<'i>>(&self) -> Result<T> {
        T::deserialize(ValueDeserializer::from(self.root.clone()))
            .map_err(|error| refuse(&self.root, &self.sources, &error))
    }

    /// Return the place of the value at a path such as `body.0.young`, if it is there.
    pub fn find(&self, path: &str) -> Option<Place> {
        let mut node = &self.root;
        for part in path.split('.') {
            node = match (node.get_ref(), part.parse::<usize>()) {
                (DeValue::Array(items), Ok(index)) => items.get(index)?,
                (value, _) => value.get(part)?,
            };
        }
        Some(self.sources.place(node.span()))
    }
}

/// An option as typed: its name, such as `--set`, a blank, and `KEY=VALUE`.
struct Override<'i> {
    source: &'i Arc<Source>,
    /// Where its spans begin among those of the scene.
    begin: usize,
}

impl<'i> Override<'i> {
    /// Change a scene as the option says. Tables that are missing on the way are made.
    fn apply(&self, root: &mut Node<'i>) -> Result<()> {
        let Source { name, text } = &**self.source;
        let start = name.len() + 1;
        let Some(equals) = text.get(start..).and_then(|typed| typed.find('=')).map(|equals| start + equals) else {
            return Err(Error::new(Kind::Usage, format!("{name} without `=`"))
                .at(&self.place(0..text.len()))
                .help(format!("write {name} KEY=VALUE, such as {name} contact.0.layer.power.a=0.3")));
        };
        let value = self.value(equals + 1)?;
        let (mut node, mut before) = (root, start..start);
        for key in keys(text, start..equals) {
            if key.is_empty() {
                return Err(Error::scene(&self.place(start..equals), "this is not a key of the scene")
                    .help("a key is names and numbers joined by points: body.1.young"));
            }
            node = self.below(node, key.clone(), before)?;
            before = key;
        }
        *node = value;
        Ok(())
    }

    /// Return the place of a span of the option.
    fn place(&self, span: Range<usize>) -> Place {
        Place { source: self.source.clone(), span }
    }

    /// Return a value of the scene with a span of the option.
    fn node(&self, span: &Range<usize>, value: DeValue<'i>) -> Node<'i> {
        Spanned::new(self.begin + span.start..self.begin + span.end, value)
    }

    /// Return the value that begins at byte `offset`: TOML, or a bare text.
    fn value(&self, offset: usize) -> Result<Node<'i>> {
        let text: &'i str = &self.source.text;
        let bare = text[offset..].trim_start();
        let start = text.len() - bare.len();
        if bare.is_empty() {
            return Err(
                Error::scene(&self.place(start..start), "the value is missing").help("an empty text is written \"\"")
            );
        }
        match DeValue::parse(bare) {
            Ok(value) => Ok(moved(value, self.begin + start)),
            // this was meant as TOML: a table, a list, a quoted text
            Err(error) if bare.starts_with(['{', '[', '"', '\'']) || bare.parse::<f64>().is_ok() => {
                Err(syntax(self.source, start, &error))
            }
            Err(_) => Ok(self.node(&(start..text.len()), DeValue::String(bare.into()))),
        }
    }

    /// Return the value below a value to which a key leads; `before` is the key before it. A value that has nothing
    /// below it becomes an empty table.
    fn below<'t>(&self, node: &'t mut Node<'i>, key: Range<usize>, before: Range<usize>) -> Result<&'t mut Node<'i>> {
        let text: &'i str = &self.source.text;
        let name = &text[key.clone()];
        if !node.get_ref().is_array() && !node.get_ref().is_table() {
            *node = self.node(&key, DeValue::Table(DeTable::new()));
        }
        match node.get_mut() {
            DeValue::Array(items) => {
                let index = self.index(items, key, before)?;
                Ok(&mut (**items)[index])
            }
            DeValue::Table(_) if is_number(name) && !before.is_empty() => {
                let message = format!("`{}` has no items to choose from", &text[before.clone()]);
                Err(Error::scene(&self.place(before), message).help("the scene has no such list"))
            }
            DeValue::Table(table) => {
                let empty = self.node(&key, DeValue::Table(DeTable::new()));
                Ok(table.entry(Spanned::new(empty.span(), name.into())).or_insert(empty))
            }
            _ => Err(Error::scene(&self.place(key), "there is nothing below this")),
        }
    }

    /// Return the index of the item that a key names by its number, or by the name of its table.
    fn index(&self, items: &[Node<'_>], key: Range<usize>, before: Range<usize>) -> Result<usize> {
        let text = &self.source.text;
        let (name, list) = (&text[key.clone()], text[self.source.name.len() + 1..before.end].trim_start());
        let name_of = |item| -> Option<&str> { Node::get_ref(item).get("name")?.get_ref().as_str() };
        let found = match name.parse() {
            Ok(index) => Some(index).filter(|index| *index < items.len()),
            Err(_) => items.iter().position(|item| name_of(item) == Some(name)),
        };
        found.ok_or_else(|| {
            let count = format!("{} item{}", items.len(), if items.len() == 1 { "" } else { "s" });
            let message = if is_number(name) {
                format!("`{list}` has {count}, there is no number {name}")
            } else {
                format!("`{list}` is a list of {count}; `{name}` is no number")
            };
            let error = Error::scene(&self.place(key), message);
            let known: Vec<&str> = items.iter().filter_map(name_of).collect();
            match items.len() {
                _ if !is_number(name) && !known.is_empty() => {
                    error.help(format!("their names: {}", few(known).join(", ")))
                }
                0 => error,
                1 => error.help("the only item is number 0"),
                count => error.help(format!("they are numbered 0 to {}", count - 1)),
            }
        })
    }
}

/// Return a value with its spans moved by `begin`.
fn moved(value: Node<'_>, begin: usize) -> Node<'_> {
    let at = |span: Range<usize>| span.start + begin..span.end + begin;
    let span = at(value.span());
    let value = match value.into_inner() {
        DeValue::Array(items) => DeValue::Array(items.into_iter().map(|item| moved(item, begin)).collect()),
        DeValue::Table(table) => {
            let entries = table.into_iter().map(|(key, value)| {
                let place = at(key.span());
                (Spanned::new(place, key.into_inner()), moved(value, begin))
            });
            DeValue::Table(entries.collect())
        }
        other => other,
    };
    Spanned::new(span, value)
}

/// Return the byte range of each key of a dotted path, without the spaces around it.
fn keys(text: &str, path: Range<usize>) -> Vec<Range<usize>> {
    let mut start = path.start;
    let key = |part: &str| {
        let from = start + part.len() - part.trim_start().len();
        start += part.len() + 1;
        from..from + part.trim().len()
    };
    text[path].split('.').map(key).collect()
}

fn is_number(text: &str) -> bool {
    !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit())
}
