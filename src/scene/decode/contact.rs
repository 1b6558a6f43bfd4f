//! `[[contact]]`: two surfaces, the gap and the layer between them.

use super::{Decoder, choose};
use crate::error::{Error, Located, Result};
use crate::expression::Field;
use crate::problem::contact::{ANGLE, AutoContact, ContactSpec, Overlap};
use crate::scene::read::{Keys, Node, Value};
use std::collections::HashSet;

impl Decoder<'_> {
    /// The pairs of contact surfaces, and how to find further ones; there may be none.
    pub(super) fn contacts(&self, keys: &Keys) -> Result<(Vec<ContactSpec>, Option<AutoContact>)> {
        let Some(list) = keys.get("contact") else {
            return Ok((Vec::new(), None));
        };
        let mut contacts: Vec<ContactSpec> = Vec::new();
        let mut auto: Option<AutoContact> = None;
        let mut known = HashSet::new();
        for item in list.list().map_err(|error| error.help("a contact starts with the line [[contact]]"))? {
            let (contact, distance) = self.contact(item)?;
            if let Some(distance) = distance {
                if auto.replace(AutoContact { distance, contact }).is_some() {
                    return Err(item
                        .refuse("a second contact between \"auto\"")
                        .help("one finds all pairs that no other contact names"));
                }
                continue;
            }
            let mut names = contact.between.each_ref().map(|name| name.value.clone());
            names.sort();
            if !known.insert(names) {
                let [a, b] = &contact.between;
                return Err(Error::scene(&a.place, format!("a second contact of `{}` and `{}`", a.value, b.value))
                    .help("remove one of the two"));
            }
            contacts.push(contact);
        }
        Ok((contacts, auto))
    }

    /// A contact, and the distance within which pairs are looked for if it is `between = "auto"`.
    fn contact(&self, node: &Node) -> Result<(ContactSpec, Option<f64>)> {
        const KEYS: &[&str] = &["between", "distance", "gap", "angle", "touching", "overlap", "layer", "reference"];
        let keys = Keys::open(node, "[[contact]]", KEYS)?;
        let (between, distance) = between(&keys)?;
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
        };
        Ok((contact, distance))
    }
}

/// The largest angle between the normals of facets that face each other, in degrees.
fn angle(node: &Node) -> Result<f64> {
    match node.positive("the angle")? {
        angle if angle <= 90.0 => Ok(angle),
        angle => Err(node.refuse(format!("the angle is {angle} degrees")).label("must be at most 90")),
    }
}

/// The two surfaces; or twice the word "auto", with the distance.
fn between(keys: &Keys) -> Result<([Located<String>; 2], Option<f64>)> {
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
        return Ok((names, Some(distance.positive("the distance")?)));
    }
    if let Some(entry) = keys.entry("distance") {
        return Err(Error::scene(&entry.key_place, "`distance` for surfaces with names")
            .help("it says how far to look with between = \"auto\""));
    }
    let [a, b] = between.list()? else {
        return Err(between.refuse("a contact is between two surfaces").help(EXAMPLE));
    };
    let (first, second) = (a.name()?, b.name()?);
    if first.value == second.value {
        return Err(b
            .refuse(format!("a contact between `{}` and itself", second.value))
            .help("name one surface of each of two bodies"));
    }
    Ok(([first, second], None))
}
