//! `[[contact]]`: two surfaces, or a rule that finds pairs of surfaces.

use crate::error::{Error, Located, Result};
use crate::problem::body::body_name;
use crate::problem::contact::{AutoContact, ContactSpec};
use crate::setting::{Context, Keys, Node, Setting, TableShape, Value, ValueKind};
use serde_json::{Value as Json, json};

/// Return the shape of `[[contact]]`.
pub fn shape() -> TableShape {
    let about = "bodies of pairs found by \"auto\", or patterns: of = [\"one_*\", \"other_*\"]";
    ContactSpec::shape().optional("of", ValueKind::Text.list(), about)
}

/// Read the pairs of contact surfaces that a scene names, and the rules that find further pairs.
///
/// # Errors
/// Tables and values that are no contact.
pub fn read(items: &[Node], context: &Context) -> Result<(Vec<ContactSpec>, Vec<AutoContact>)> {
    let (mut contacts, mut auto) = (Vec::new(), Vec::new());
    for (table, item) in items.iter().enumerate() {
        let keys = Keys::open(item, &shape())?;
        let is_rule = is_rule(&keys)?;
        let of = keys.read("of", |node| of(node, context))?;
        let contact = ContactSpec { table, ..ContactSpec::decode(&keys, context)? };
        match is_rule {
            true => auto.push(AutoContact { of, contact }),
            false => contacts.push(contact),
        }
    }
    Ok((contacts, auto))
}

/// Return the echo of named pairs and of rules, in the order of the file.
pub fn echo(contacts: &[ContactSpec], rules: &[AutoContact], dimension: usize) -> Json {
    let named = contacts.iter().map(|contact| (contact.table, contact.entries(dimension)));
    let found = rules.iter().map(|AutoContact { of, contact }| {
        let mut entries = contact.entries(dimension);
        if let Some(of) = of {
            entries.insert("of".to_owned(), of.each_ref().map(|name| name.value.as_str()).into_iter().collect());
        }
        (contact.table, entries)
    });
    let mut tables: Vec<_> = named.chain(found).collect();
    tables.sort_by_key(|(table, _)| *table);
    tables.into_iter().map(|(_, entries)| Json::from(entries)).collect()
}

/// Return whether an open table is a rule that finds pairs: `between = "auto"`.
fn is_rule(keys: &Keys) -> Result<bool> {
    let is_rule = matches!(keys.require("between")?.value, Value::String(_));
    if let (Some(entry), false) = (keys.entry("of"), is_rule) {
        return Err(Error::scene(&entry.key_place, "`of` for surfaces with names")
            .help("it says which bodies form pairs with between = \"auto\""));
    }
    if is_rule && keys.require("between")?.string()? == AUTO {
        keys.require("distance").map_err(|error| {
            error.help("facets of different bodies that face each other at most that far apart form pairs")
        })?;
    }
    Ok(is_rule)
}

/// The value of `between` in rules that find pairs, and the name of both surfaces there.
const AUTO: &str = "auto";

const EXAMPLE: &str = "write between = [\"one\", \"other\"], or between = \"auto\" with a distance";

/// The two surfaces of a contact. With `between = "auto"` both are the word "auto".
impl Setting for [Located<String>; 2] {
    fn kind() -> ValueKind {
        ValueKind::Either(vec![ValueKind::Text, ValueKind::Text.list()])
    }

    fn read(node: &Node, _: &Context) -> Result<Self> {
        match &node.value {
            Value::String(word) if word == AUTO => Ok([node.name()?, node.name()?]),
            Value::String(word) => Err(node.refuse(format!("a contact between `{word}` alone")).help(EXAMPLE)),
            _ => match node.list()? {
                [a, b] => Ok([a.name()?, b.name()?]),
                _ => Err(node.refuse("a contact is between two surfaces").help(EXAMPLE)),
            },
        }
    }

    fn echo(&self, _: usize) -> Json {
        match self.each_ref().map(|name| name.value.as_str()) {
            [AUTO, AUTO] => json!(AUTO),
            names => json!(names),
        }
    }
}

/// Return two names of bodies, or patterns of names.
fn of(node: &Node, context: &Context) -> Result<[Located<String>; 2]> {
    let [a, b] = node.list()? else {
        return Err(node.refuse("pairs are of two bodies").help("write of = [\"one_*\", \"other_*\"]"));
    };
    Ok([body_name(a, context)?, body_name(b, context)?])
}
