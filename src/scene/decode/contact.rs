//! `[[contact]]`: two surfaces, or a rule that finds such, the gap and the layer between them.

use super::{Decoder, body, choose};
use crate::error::{Error, Located, Result};
use crate::expression::Field;
use crate::problem::contact::{ANGLE, AutoContact, ContactSpec, Overlap};
use crate::scene::read::{Keys, Node, Value};
use std::collections::HashSet;

impl Decoder<'_> {
    /// The pairs of contact surfaces, and rules that find further ones; there may be none.
    pub(super) fn contacts(&self, keys: &Keys) -> Result<(Vec<ContactSpec>, Vec<AutoContact>)> {
        let Some(list) = keys.get("contact") else {
            return Ok((Vec::new(), Vec::new()));
        };
        let mut contacts: Vec<ContactSpec> = Vec::new();
        let mut auto: Vec<AutoContact> = Vec::new();
        let (mut known, mut ruled) = (HashSet::new(), HashSet::new());
        let items = list.list().map_err(|error| error.help("a contact starts with the line [[contact]]"))?;
        for (table, item) in items.iter().enumerate() {
            let (contact, rule) = self.contact(item, table)?;
            if let Some((distance, of)) = rule {
                let names = of.as_ref().map(|of| sorted(of.each_ref()));
                if !ruled.insert(names) {
                    return Err(match &of {
                        None => item
                            .refuse("a second contact between \"auto\" of all bodies")
                            .help("name the bodies of each: of = [\"one_*\", \"other_*\"]"),
                        Some([a, b]) => Error::scene(
                            &a.place,
                            format!("a second contact between \"auto\" of `{}` and `{}`", a.value, b.value),
                        )
                        .help("remove one of the two"),
                    });
                }
                auto.push(AutoContact { distance, of, contact });
                continue;
            }
            if !known.insert(sorted(contact.between.each_ref())) {
                let [a, b] = &contact.between;
                return Err(Error::scene(&a.place, format!("a second contact of `{}` and `{}`", a.value, b.value))
                    .help("remove one of the two"));
            }
            contacts.push(contact);
        }
        Ok((contacts, auto))
    }

    /// A contact, table number `table`, and the rule that finds its pairs if it is `between = "auto"`.
    fn contact(&self, node: &Node, table: usize) -> Result<(ContactSpec, Option<Rule>)> {
        const KEYS: &[&str] =
            &["between", "of", "distance", "gap", "angle", "touching", "overlap", "layer", "reference"];
        let keys = Keys::open(node, "[[contact]]", KEYS)?;
        let (between, rule) = between(&keys)?;
        let contact = ContactSpec {
            between,
            gap: keys.get("gap").map_or(Ok(Field::Constant(0.0)), |gap| self.field(gap))?,
            layer: self.layer(keys.require("layer")?)?,
            angle: keys.get("angle").map_or(Ok(ANGLE), angle)?,
            touching: keys.get("touching").map_or(Ok(false), Node::boolean)?,
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

/// Two names whose order does not matter.
fn sorted(names: [&Located<String>; 2]) -> [String; 2] {
    let mut names = names.map(|name| name.value.clone());
    names.sort();
    names
}

/// The largest angle between the normals of facets that face each other, in degrees.
fn angle(node: &Node) -> Result<f64> {
    match node.positive("the angle")? {
        angle if angle <= 90.0 => Ok(angle),
        angle => Err(node.refuse(format!("the angle is {angle} degrees")).label("must be at most 90")),
    }
}

/// The two surfaces; or twice the word "auto", with a rule.
fn between(keys: &Keys) -> Result<([Located<String>; 2], Option<Rule>)> {
    const EXAMPLE: &str = "write between = [\"one\", \"other\"], or between = \"auto\" with a distance";
    let between = keys.require("between")?;
    if let Value::String(word) = &between.value {
        if word != "auto" {
            return Err(between.refuse(format!("a contact between `{word}` alone")).help(EXAMPLE));
        }
        let distance = keys.require("distance").map_err(|error| {
            error.help("facets of different bodies that face each other at most that far apart form pairs")
        })?;
        let names = [between.name()?, between.name()?];
        return Ok((names, Some((distance.positive("the distance")?, keys.get("of").map(of).transpose()?))));
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
    let (first, second) = (a.name()?, b.name()?);
    if let Some(plural) = [&first, &second].into_iter().find(|name| name.value.contains(['*', '?'])) {
        return Err(Error::scene(&plural.place, format!("the pattern `{}` for one surface", plural.value))
            .label("one name belongs here")
            .help(
                "many pairs are found between bodies: between = \"auto\", of = [\"one_*\", \"other_*\"], distance = D",
            ));
    }
    if first.value == second.value {
        return Err(b
            .refuse(format!("a contact between `{}` and itself", second.value))
            .help("name one surface of each of two bodies"));
    }
    Ok(([first, second], None))
}

/// Two bodies, or patterns of such.
fn of(node: &Node) -> Result<[Located<String>; 2]> {
    let [a, b] = node.list()? else {
        return Err(node.refuse("pairs are of two bodies").help("write of = [\"one_*\", \"other_*\"]"));
    };
    Ok([body::name(a)?, body::name(b)?])
}
