//! Cards of solids in bulk data of Nastran (`.bdf`) in a form that Gmsh 4.8 can read.
//!
//! This Gmsh takes a CHEXA or CPENTA for a linear one if its continuation fields are blank, or if its fields are 16 characters
//! wide. It knows no CPYRAM with mid-edge nodes. Blank fields move the ones behind them.

use super::cards::{Card, replace};
use crate::error::{Error, Result};
use std::fmt::Write;
use std::path::Path;

/// Cards of elements with optional mid-edge nodes, with the numbers of vertices and of all nodes.
const CARDS: [(&str, usize, usize); 6] =
    [("CHEXA", 8, 20), ("CPENTA", 6, 15), ("CPYRAM", 5, 13), ("CTETRA", 4, 10), ("CQUAD8", 4, 8), ("CTRIA6", 3, 6)];

/// Return whether entries of this name are such cards.
pub fn is_ours(name: &str) -> bool {
    CARDS.iter().any(|card| card.0 == name)
}

/// Write such cards in small fields, with all continuation fields. `made` has the lines of the file at `path`, and `cards` the entries
/// for which [`is_ours`] holds.
///
/// # Errors
/// A field of such a card is no number, or an element has some of its mid-edge nodes only. The error names the line.
pub fn to_small_fields(path: &Path, cards: &[&Card], made: &mut [String]) -> Result<()> {
    for (card, known) in
        cards.iter().flat_map(|card| CARDS.iter().filter(|known| known.0 == card.name).map(move |known| (card, known)))
    {
        let element = element(*known, card);
        let refuse = |message| Error::mesh(path, Some(card.lines.start + 1), format!("{}: {message}", card.name));
        replace(made, card.lines.clone(), element.map_err(refuse)?.written());
    }
    Ok(())
}

/// An element as it is written.
struct Element {
    name: &'static str,
    /// The numbers of the element and of its property, and the nodes.
    fields: Vec<u64>,
}

/// Return the element of a card.
fn element((name, vertices, all): (&'static str, usize, usize), card: &Card) -> std::result::Result<Element, String> {
    let number = |at: usize| match card.field(at) {
        "" => Ok(0),
        word => word.parse().map_err(|_| format!("`{word}` is no number of an element or node")),
    };
    let mut fields = (0..2 + all).map(number).collect::<std::result::Result<Vec<u64>, String>>()?;
    let (middles, absent) = (&fields[2 + vertices..], |node: &u64| *node == 0);
    let name = match name {
        _ if !middles.iter().all(absent) => {
            if middles.iter().any(absent) {
                let tag = fields[0];
                return Err(format!("element {tag} has some of its mid-edge nodes: give all of them, or none"));
            }
            name
        }
        linear => {
            fields.truncate(2 + vertices);
            [("CQUAD8", "CQUAD4"), ("CTRIA6", "CTRIA3")]
                .into_iter()
                .find(|(own, _)| *own == linear)
                .map_or(linear, |(_, other)| other)
        }
    };
    let is_pyramid = fields.len() == 15 && name == "CPYRAM";
    Ok(if is_pyramid { as_hexahedron(&fields) } else { Element { name, fields } })
}

/// Return a quadratic pyramid as the hexahedron whose upper face was drawn into the apex.
fn as_hexahedron(pyramid: &[u64]) -> Element {
    let (apex, middles) = (pyramid[6], &pyramid[7..]);
    let fields = [&pyramid[..6], &[apex; 4], middles, &[apex; 4]].concat();
    Element { name: "CHEXA", fields }
}

impl Element {
    /// Return the lines. The last one is a comment, since Gmsh takes other lines behind a card without continuation for one.
    fn written(&self) -> String {
        let mut text = String::new();
        for (row, fields) in self.fields.chunks(8).enumerate() {
            let _ = write!(text, "{:<8}", if row == 0 { self.name } else { "+" });
            fields.iter().for_each(|field| {
                let _ = write!(text, "{field:<8}");
            });
            text.push_str(if (row + 1) * 8 < self.fields.len() { "+\n" } else { "\n" });
        }
        text + "$"
    }
}
