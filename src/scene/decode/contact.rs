//! `[[contact]]`: two surfaces, or a rule that finds pairs of surfaces, with the gap and the layer between them.

use super::{Decoder, Keys, Node, TableShape, Value, ValueKind, body_name, choose, layer, word};
use crate::error::{Error, Located, Result};
use crate::expression::Field;
use crate::problem::contact::{ANGLE, AutoContact, ContactSpec, EDGE, Overlap};

/// Return the shape of `[[contact]]`.
pub(super) fn shape() -> TableShape {
    use ValueKind::{Either, Field, Flag, Number, Text};
    TableShape::new("[[contact]]")
        .required("between", Either(vec![Text, Text.list()]), EXAMPLE)
        .optional("of", Text.list(), "bodies of pairs found by \"auto\", or patterns: of = [\"one_*\", \"other_*\"]")
        .optional("distance", Number, "how far apart facets of a pair may be; required with \"auto\"")
        .optional("gap", Field, "gap besides the distance of the meshes; 0")
        .optional("angle", Number, "largest angle in degrees between normals that face each other; 60")
        .optional("edge", Number, "angle in degrees beyond which facets meet at an edge that splits a surface; 40")
        .optional("touching", Flag, "whether the distance of the meshes counts as zero; false")
        .optional("overlap", word(&Overlap::ALL), "what to do where bodies overlap before loading; \"compress\"")
        .required("layer", layer::shape(), layer::EXAMPLE)
        .optional("reference", Field, "known contact pressure to draw and to compare with")
}

const EXAMPLE: &str = "write between = [\"one\", \"other\"], or between = \"auto\" with a distance";

impl Decoder<'_> {
    /// Return the pairs of contact surfaces that the scene names, and the rules that find further pairs.
    pub(super) fn contacts(&self, keys: &Keys) -> Result<(Vec<ContactSpec>, Vec<AutoContact>)> {
        let (mut contacts, mut auto) = (Vec::new(), Vec::new());
        for (table, item) in keys.items("contact")?.iter().enumerate() {
            match self.contact(item, table)? {
                (contact, Some(Rule { of })) => auto.push(AutoContact { of, contact }),
                (contact, None) => contacts.push(contact),
            }
        }
        Ok((contacts, auto))
    }

    /// Return the contact of table number `table`, with the rule that finds its pairs if it is `between = "auto"`.
    fn contact(&self, node: &Node, table: usize) -> Result<(ContactSpec, Option<Rule>)> {
        let keys = Keys::open(node, &shape())?;
        let (between, rule) = between(&keys)?;
        let contact = ContactSpec {
            between,
            gap: keys.read("gap", |node| self.field(node))?.unwrap_or(Field::Constant(0.0)),
            layer: self.layer(keys.require("layer")?)?,
            angle: keys.read("angle", Node::number)?.unwrap_or(ANGLE),
            edge: keys.read("edge", Node::number)?.unwrap_or(EDGE),
            distance: keys.read("distance", Node::number)?,
            touching: keys.flag("touching", false)?,
            overlap: keys.read("overlap", |node| choose(node, "overlap", &Overlap::ALL))?.unwrap_or(Overlap::Compress),
            reference: keys.read("reference", |node| self.field(node))?,
            table,
        };
        Ok((contact, rule))
    }
}

/// A rule that finds pairs.
struct Rule {
    /// The bodies of the pairs; all bodies if `None`.
    of: Option<[Located<String>; 2]>,
}

/// Return the names of the two surfaces. With `between = "auto"` both are the word "auto", and there is a rule.
fn between(keys: &Keys) -> Result<([Located<String>; 2], Option<Rule>)> {
    let between = keys.require("between")?;
    if let Value::String(word) = &between.value {
        if word != "auto" {
            return Err(between.refuse(format!("a contact between `{word}` alone")).help(EXAMPLE));
        }
        keys.require("distance").map_err(|error| {
            error.help("facets of different bodies that face each other at most that far apart form pairs")
        })?;
        let names = [between.name()?, between.name()?];
        return Ok((names, Some(Rule { of: keys.read("of", of)? })));
    }
    if let Some(entry) = keys.entry("of") {
        return Err(Error::scene(&entry.key_place, "`of` for surfaces with names")
            .help("it says which bodies form pairs with between = \"auto\""));
    }
    let [a, b] = between.list()? else {
        return Err(between.refuse("a contact is between two surfaces").help(EXAMPLE));
    };
    Ok(([a.name()?, b.name()?], None))
}

/// Return two names of bodies, or patterns of names.
fn of(node: &Node) -> Result<[Located<String>; 2]> {
    let [a, b] = node.list()? else {
        return Err(node.refuse("pairs are of two bodies").help("write of = [\"one_*\", \"other_*\"]"));
    };
    Ok([body_name(a)?, body_name(b)?])
}
