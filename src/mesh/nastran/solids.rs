//! Cards of solids in bulk data of Nastran (`.bdf`) in a form that Gmsh 4.8 can read.
//!
//! This Gmsh takes a CHEXA or CPENTA for a linear one if its continuation fields are blank, or if its fields are 16 characters
//! wide. It knows no CPYRAM with mid-edge nodes. Blank fields move the ones behind them.

use crate::error::{Error, Result};
use std::fmt::Write;
use std::path::Path;

/// Cards of elements with optional mid-edge nodes, with the numbers of vertices and of all nodes.
const CARDS: [(&str, usize, usize); 6] =
    [("CHEXA", 8, 20), ("CPENTA", 6, 15), ("CPYRAM", 5, 13), ("CTETRA", 4, 10), ("CQUAD8", 4, 8), ("CTRIA6", 3, 6)];

/// Return the bulk data with such cards in small fields, with all continuation fields.
///
/// # Errors
/// A field of such a card is no number, or an element has some of its mid-edge nodes only. The error names the line.
pub fn readable(path: &Path, text: &str) -> Result<String> {
    let lines: Vec<&str> = text.lines().collect();
    let mut made = String::with_capacity(text.len());
    let mut at = 0;
    while let Some(line) = lines.get(at) {
        let name = name(line);
        let Some(card) = CARDS.iter().find(|card| card.0 == name) else {
            made += line;
            made.push('\n');
            at += 1;
            continue;
        };
        let next = at + 1 + lines[at + 1..].iter().take_while(|line| is_continuation(line)).count();
        let element = element(*card, &lines[at..next]);
        let element = element.map_err(|message| Error::mesh(path, Some(at + 1), format!("{name}: {message}")))?;
        write_card(&element, &mut made);
        at = next;
    }
    Ok(made)
}

/// The fields of a card as it is written.
struct Card {
    name: &'static str,
    /// The numbers of the element and of its property, and the nodes.
    fields: Vec<u64>,
}

/// Return the name of the card that a line begins.
fn name(line: &str) -> &str {
    let field = line.split(',').next().unwrap_or_default();
    let end = field.char_indices().nth(8).map_or(field.len(), |(end, _)| end);
    field[..end].trim_end().trim_end_matches('*')
}

/// Return whether a line continues the card before it: its first field is blank or a mark.
fn is_continuation(line: &str) -> bool {
    !line.trim().is_empty() && line.starts_with([' ', ',', '+', '*', '\t'])
}

/// Return the fields of a line between the first one and the mark at its end: eight, or four that are wide.
fn fields(line: &str) -> Vec<String> {
    let is_wide = line.split(',').next().is_some_and(|first| first.chars().take(8).any(|c| c == '*'));
    let count = if is_wide { 4 } else { 8 };
    let mut fields: Vec<String> = match line.contains(',') {
        true => line.split(',').skip(1).take(count).map(|field| field.trim().to_owned()).collect(),
        false => {
            let all: Vec<char> = line.chars().skip(8).take(64).collect();
            all.chunks(64 / count).map(|field| field.iter().collect::<String>().trim().to_owned()).collect()
        }
    };
    fields.resize(count, String::new());
    fields
}

/// Return the element of a card that these lines hold.
fn element((name, vertices, all): (&'static str, usize, usize), lines: &[&str]) -> std::result::Result<Card, String> {
    let words = lines.iter().flat_map(|line| fields(line)).take(2 + all);
    let number = |word: String| match word.as_str() {
        "" => Ok(0),
        word => word.parse().map_err(|_| format!("`{word}` is no number of an element or node")),
    };
    let mut fields = words.map(number).collect::<std::result::Result<Vec<u64>, String>>()?;
    fields.resize(2 + all, 0);
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
    let card = Card { name, fields };
    Ok(if card.fields.len() == 15 && name == "CPYRAM" { as_hexahedron(&card.fields) } else { card })
}

/// Return a quadratic pyramid as the hexahedron whose upper face was drawn into the apex.
fn as_hexahedron(pyramid: &[u64]) -> Card {
    let (apex, middles) = (pyramid[6], &pyramid[7..]);
    let fields = [&pyramid[..6], &[apex; 4], middles, &[apex; 4]].concat();
    Card { name: "CHEXA", fields }
}

/// Write a card. A comment follows, since Gmsh takes other lines behind a card without continuation for one.
fn write_card(card: &Card, made: &mut String) {
    for (row, fields) in card.fields.chunks(8).enumerate() {
        let _ = write!(made, "{:<8}", if row == 0 { card.name } else { "+" });
        fields.iter().for_each(|field| {
            let _ = write!(made, "{field:<8}");
        });
        made.push_str(if (row + 1) * 8 < card.fields.len() { "+\n" } else { "\n" });
    }
    made.push_str("$\n");
}

#[cfg(test)]
mod tests {
    use super::readable;
    use std::path::Path;

    fn made(text: &str) -> String {
        readable(Path::new("a.bdf"), text).unwrap_or_else(|error| error.to_string())
    }

    /// The fields of a quadratic prism in each of the three forms, with and without marks.
    #[test]
    fn fields_are_found_in_all_forms() {
        let wide = |first: &str, fields: &[u32]| {
            format!("{first:<8}{}\n", fields.iter().map(|field| format!("{field:>16}")).collect::<String>())
        };
        let nodes: Vec<u32> = [7, 2].into_iter().chain(11..26).collect();
        let rows: Vec<String> =
            (0..5).map(|k| wide(["CPENTA*", "*"][usize::from(k > 0)], &nodes[4 * k..17.min(4 * k + 4)])).collect();
        let small = |mark: &str| {
            let row = |fields: &[u32]| fields.iter().map(|field| format!("{field:<8}")).collect::<String>();
            format!(
                "CPENTA  {}{mark}\n{mark:<8}{}{mark}\n{mark:<8}{}\n",
                row(&nodes[..8]),
                row(&nodes[8..16]),
                row(&nodes[16..])
            )
        };
        let expected = "CPENTA  7       2       11      12      13      14      15      16      +\n\
                        +       17      18      19      20      21      22      23      24      +\n\
                        +       25      \n$\n";
        for text in [
            rows.concat() + &wide("*", &[]),
            small("+A"),
            small(""),
            "CPENTA,7,2,11,12,13,14,15,16\n,17,18,19,20,21,22,23,24\n,25\n".to_owned(),
            "CPENTA,7,2,11,12,13,14,15,16,+P\n+P,17,18,19,20,21,22,23,24,+Q\n+Q,25\n".to_owned(),
        ] {
            assert_eq!(made(&format!("{text}GRID,1,,0.,0.,0.\n")), format!("{expected}GRID,1,,0.,0.,0.\n"), "{text}");
        }
    }

    #[test]
    fn elements_have_all_mid_edge_nodes_or_none() {
        assert!(
            made("$\nCTRIA6,1,1,1,2,3,4,,6\n").contains("a.bdf:2: CTRIA6: element 1 has some of its mid-edge nodes")
        );
        assert!(made("CTRIA6,1,1,1,2,3,4,x,6\n").contains("`x` is no number"));
        assert!(made("CTRIA6,1,1,1,2,3\n").starts_with("CTRIA3  1 "));
        assert!(made("CQUAD8,1,1,1,2,3,4,,\n,,,0.5\n").starts_with("CQUAD4  1 "));
        let pyramid = made("CPYRAM,1,1,1,2,3,4,5,6\n,7,8,9,10,11,12,13\n");
        let nodes: Vec<&str> = pyramid.split_whitespace().filter(|word| *word != "+").collect();
        assert_eq!(nodes.join(" "), "CHEXA 1 1 1 2 3 4 5 5 5 5 6 7 8 9 10 11 12 13 5 5 5 5 $");
    }
}
