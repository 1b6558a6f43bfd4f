//! `[[contact]]`: two surfaces, the gap and the layer between them.

use super::Decoder;
use crate::error::{Error, Result};
use crate::scene::expression::Field;
use crate::scene::read::{Keys, Node};
use crate::scene::{ContactSpec, LayerSpec};

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
            layer: layer(keys.require("layer")?)?,
            reference: keys.get("reference").map(|reference| self.field(reference)).transpose()?,
        })
    }
}

fn layer(node: &Node) -> Result<LayerSpec> {
    const EXAMPLE: &str = "give power = { B = 2.5e-5, a = 0.5 } or linear = { stiffness = 1e5 }";
    let keys = Keys::open(node, "the layer", &["power", "linear"]).map_err(|error| match error.advice() {
        Some(advice) if advice.starts_with("did") => error,
        _ => error.help(EXAMPLE),
    })?;
    keys.exclude("power", "linear")?;
    if let Some(linear) = keys.get("linear") {
        let keys = Keys::open(linear, "the linear layer", &["stiffness"])?;
        return Ok(LayerSpec::Linear { stiffness: keys.require("stiffness")?.positive("the stiffness")? });
    }
    let Some(power) = keys.get("power") else {
        return Err(keys.node().refuse("the layer has no law").help(EXAMPLE));
    };
    let keys = Keys::open(power, "the power layer", &["B", "a"])?;
    let b = keys.require("B")?.positive("B")?;
    let exponent = keys.require("a")?;
    let a = exponent.positive("a")?;
    if a > 1.0 {
        return Err(exponent
            .refuse(format!("a is {a}"))
            .label("must not exceed 1")
            .help("p(c) = (c/B)^(1/a) with a > 1 is infinitely stiff at first touch, p'(0) = infinity"));
    }
    Ok(LayerSpec::Power { b, a })
}
