//! `[[contact]]`: two surfaces, the gap and the layer between them.

use super::Decoder;
use crate::error::{Error, Result};
use crate::scene::ContactSpec;
use crate::scene::expression::Field;
use crate::scene::read::{Keys, Node};

impl Decoder<'_> {
    /// The pairs of contact surfaces; there may be none.
    pub(super) fn contacts(&self, keys: &Keys) -> Result<Vec<ContactSpec>> {
        let Some(list) = keys.get("contact") else {
            return Ok(Vec::new());
        };
        let mut contacts: Vec<ContactSpec> = Vec::new();
        for item in list.list().map_err(|error| error.help("a contact starts with the line [[contact]]"))? {
            let contact = self.contact(item)?;
            let names = |contact: &ContactSpec| {
                let mut names = contact.between.each_ref().map(|name| name.value.clone());
                names.sort();
                names
            };
            if contacts.iter().any(|other| names(other) == names(&contact)) {
                let [a, b] = &contact.between;
                return Err(Error::scene(&a.place, format!("a second contact of `{}` and `{}`", a.value, b.value))
                    .help("remove one of the two"));
            }
            contacts.push(contact);
        }
        Ok(contacts)
    }

    fn contact(&self, node: &Node) -> Result<ContactSpec> {
        let keys = Keys::open(node, "[[contact]]", &["between", "gap", "layer", "reference"])?;
        let between = keys.require("between")?;
        let [a, b] = between.list()? else {
            return Err(between
                .refuse("a contact is between two surfaces")
                .help("write between = [\"one\", \"other\"]"));
        };
        let (first, second) = (a.name()?, b.name()?);
        if first.value == second.value {
            return Err(b
                .refuse(format!("a contact between `{}` and itself", second.value))
                .help("name one surface of each of two bodies"));
        }
        Ok(ContactSpec {
            between: [first, second],
            gap: keys.get("gap").map_or(Ok(Field::Constant(0.0)), |gap| self.field(gap))?,
            layer: self.layer(keys.require("layer")?)?,
            reference: keys.get("reference").map(|reference| self.field(reference)).transpose()?,
        })
    }
}
