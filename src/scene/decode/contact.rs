//! `[[contact]]`: two surfaces, or a rule that finds such, the gap and the layer between them.

use super::{Decoder, Form, Keys, Node, Table, Value, choose, layer, pattern, word};
use crate::error::{Error, Located, Result};
use crate::expression::Field;
use crate::problem::contact::{ANGLE, AutoContact, ContactSpec, Overlap};

/// The shape of `[[contact]]`.
pub(super) fn table() -> Table {
    use Form::{Either, Field, Flag, Number, Text};
    Table::new("[[contact]]")
        .must("between", Either(vec![Text, Text.list()]), EXAMPLE)
        .key("of", Text.list(), "bodies of pairs found by \"auto\", or patterns: of = [\"one_*\", \"other_*\"]")
        .key("distance", Number, "how far apart facets of a pair found by \"auto\" may be")
        .key("gap", Field, "gap besides the distance of the meshes; 0")
        .key("angle", Number, "largest angle in degrees between normals that face each other; 60")
        .key("touching", Flag, "whether the distance of the meshes counts as zero; false")
        .key("overlap", word(&Overlap::ALL), "what to do where bodies overlap before loading; \"compress\"")
        .must("layer", layer::table().form(), layer::EXAMPLE)
        .key("reference", Field, "known contact pressure to draw and to compare with")
}

const EXAMPLE: &str = "write between = [\"one\", \"other\"], or between = \"auto\" with a distance";

impl Decoder<'_> {
    /// The pairs of contact surfaces, and rules that find further ones; there may be none.
    pub(super) fn contacts(&self, keys: &Keys) -> Result<(Vec<ContactSpec>, Vec<AutoContact>)> {
        let (mut contacts, mut auto) = (Vec::new(), Vec::new());
        for (table, item) in keys.get("contact").map_or(Ok(&[][..]), Node::list)?.iter().enumerate() {
            match self.contact(item, table)? {
                (contact, Some((distance, of))) => auto.push(AutoContact { distance, of, contact }),
                (contact, None) => contacts.push(contact),
            }
        }
        Ok((contacts, auto))
    }

    /// A contact, table number `table`, and the rule that finds its pairs if it is `between = "auto"`.
    fn contact(&self, node: &Node, table: usize) -> Result<(ContactSpec, Option<Rule>)> {
        let keys = Keys::open(node, &self::table())?;
        let (between, rule) = between(&keys)?;
        let contact = ContactSpec {
            between,
            gap: keys.get("gap").map_or(Ok(Field::Constant(0.0)), |gap| self.field(gap))?,
            layer: self.layer(keys.require("layer")?)?,
            angle: keys.get("angle").map_or(Ok(ANGLE), Node::number)?,
            touching: keys.flag("touching", false)?,
            overlap: keys
                .get("overlap")
                .map_or(Ok(Overlap::Compress), |word| choose(word, "overlap", &Overlap::ALL))?,
            reference: keys.get("reference").map(|reference| self.field(reference)).transpose()?,
            table,
        };
        Ok((contact, rule))
    }
}

/// How far apart facets of a pair may be, and the bodies of the pairs; all if `None`.
type Rule = (f64, Option<[Located<String>; 2]>);

/// The two surfaces; or twice the word "auto", with a rule.
fn between(keys: &Keys) -> Result<([Located<String>; 2], Option<Rule>)> {
    let between = keys.require("between")?;
    if let Value::String(word) = &between.value {
        if word != "auto" {
            return Err(between.refuse(format!("a contact between `{word}` alone")).help(EXAMPLE));
        }
        let distance = keys.require("distance").map_err(|error| {
            error.help("facets of different bodies that face each other at most that far apart form pairs")
        })?;
        let names = [between.name()?, between.name()?];
        return Ok((names, Some((distance.number()?, keys.get("of").map(of).transpose()?))));
    }
    for (key, what) in [("distance", "how far to look"), ("of", "which bodies form pairs")] {
        if let Some(entry) = keys.entry(key) {
            return Err(Error::scene(&entry.key_place, format!("`{key}` for surfaces with names"))
                .help(format!("it says {what} with between = \"auto\"")));
        }
    }
    let [a, b] = between.list()? else {
        return Err(between.refuse("a contact is between two surfaces").help(EXAMPLE));
    };
    Ok(([a.name()?, b.name()?], None))
}

/// Two bodies, or patterns of such.
fn of(node: &Node) -> Result<[Located<String>; 2]> {
    let [a, b] = node.list()? else {
        return Err(node.refuse("pairs are of two bodies").help("write of = [\"one_*\", \"other_*\"]"));
    };
    Ok([pattern(a)?, pattern(b)?])
}
