//! Bulk data of Nastran (`.bdf`, `.nas`) in a form that Gmsh 4.8 can read.
//!
//! Gmsh knows the basic system of coordinates alone. It takes a CHEXA or CPENTA for a linear one if its continuation fields are blank,
//! or if its fields are 16 characters wide. It knows no CPYRAM with mid-edge nodes. Blank fields move the ones behind them.

use super::frame::{Coordinates, LocalAxes, real};
use crate::error::{Error, Result};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::fmt::Write;
use std::ops::Range;
use std::path::Path;

/// Return the bulk data with all grid points in the basic system, and with cards of solids that Gmsh understands. All other lines are
/// those of the file, without empty ones.
///
/// # Errors
/// A card is malformed, or a point lies in a system that is not there or not known. Another file is to be included. The error names the
/// line.
pub fn readable(path: &Path, text: &str) -> Result<String> {
    let lines: Vec<&str> = text.lines().collect();
    let includes = |line: &&str| line.trim_start().get(..8).is_some_and(|word| word.eq_ignore_ascii_case("INCLUDE "));
    if let Some(at) = lines.iter().position(includes) {
        return Err(Error::mesh(path, Some(at + 1), "files that include others are not read")
            .help("put the files together into one"));
    }
    let cards = cards(path, &lines);
    let mut made: Vec<String> = lines.iter().map(|line| (*line).to_owned()).collect();
    to_basic(&cards, &mut made)?;
    to_small_fields(&cards, &mut made)?;
    made.retain(|line| !line.is_empty());
    Ok(made.join("\n") + "\n")
}

/// Cards of solids and facets with optional mid-edge nodes, with the numbers of vertices and of all nodes.
const SOLIDS: [(&str, usize, usize); 6] =
    [("CHEXA", 8, 20), ("CPENTA", 6, 15), ("CPYRAM", 5, 13), ("CTETRA", 4, 10), ("CQUAD8", 4, 8), ("CTRIA6", 3, 6)];

/// Return whether entries of this name are read: points, systems of coordinates, and solids.
fn is_read(name: &str) -> bool {
    matches!(name, "GRID" | "GRDSET") || name.starts_with("CORD") || SOLIDS.iter().any(|solid| solid.0 == name)
}

struct Card<'a> {
    /// The file, for messages.
    path: &'a Path,
    /// Its name in capitals, without the mark of wide fields.
    name: String,
    /// The fields behind the name: eight for each line, or four wide ones. Missing ones are empty.
    fields: Vec<String>,
    /// Its lines in the file, from 0.
    lines: Range<usize>,
}

impl Card<'_> {
    /// Return an error in the first line of the entry.
    fn refuse(&self, message: impl Into<String>) -> Error {
        Error::mesh(self.path, Some(self.lines.start + 1), message)
    }

    /// Return a field, which is empty if the entry ends before.
    fn field(&self, index: usize) -> &str {
        self.fields.get(index).map_or("", String::as_str)
    }

    /// Return a number of a point or system; none if the field is blank.
    fn tag(&self, index: usize) -> Result<Option<u64>> {
        match self.field(index) {
            "" => Ok(None),
            word => word.parse().map(Some).map_err(|_| self.refuse(format!("`{word}` is no whole number"))),
        }
    }

    /// Return three numbers. Blank ones are zero.
    fn point(&self, from: usize) -> Result<[f64; 3]> {
        let mut point = [0.0; 3];
        for (x, index) in point.iter_mut().zip(from..) {
            let word = self.field(index);
            let number = || real(word).ok_or_else(|| self.refuse(format!("`{word}` is no number")));
            *x = if word.is_empty() { 0.0 } else { number()? };
        }
        Ok(point)
    }

    /// Put a text in the place of the lines of the entry.
    fn replace(&self, made: &mut [String], text: String) {
        made[self.lines.clone()].iter_mut().for_each(|line| line.clear());
        made[self.lines.start] = text;
    }
}

/// Return the entries that are read.
fn cards<'a>(path: &'a Path, lines: &[&str]) -> Vec<Card<'a>> {
    let mut cards: Vec<Card> = Vec::new();
    let mut is_open = false;
    for (number, line) in lines.iter().enumerate() {
        let line = line.split('$').next().unwrap_or_default();
        if line.trim().is_empty() {
            continue;
        }
        let (name, fields) = fields(line);
        let continues = name.is_empty() || name.starts_with(['+', '*']);
        match cards.last_mut().filter(|_| continues && is_open) {
            Some(card) => {
                card.fields.extend(fields);
                card.lines.end = number + 1;
            }
            None => {
                let name = name.trim_end_matches('*').to_ascii_uppercase();
                is_open = !continues && is_read(&name);
                if is_open {
                    cards.push(Card { path, name, fields, lines: number..number + 1 });
                }
            }
        }
    }
    cards
}

/// Return the name of a line and its fields: eight, or four large ones. Missing ones are blank.
fn fields(line: &str) -> (String, Vec<String>) {
    let line = with_blanks(line);
    let cut = |from: usize, width: usize| line.chars().skip(from).take(width).collect::<String>().trim().to_owned();
    if line.contains(',') {
        let mut words = line.split(',').map(|word| word.trim().to_owned());
        let name = words.next().unwrap_or_default();
        let count = if name.ends_with('*') { 4 } else { 8 };
        return (name, words.chain(std::iter::repeat(String::new())).take(count).collect());
    }
    let name = cut(0, 8);
    let width = if name.contains('*') { 16 } else { 8 };
    let fields = (0..64 / width).map(|index| cut(8 + width * index, width)).collect();
    (name, fields)
}

/// Return a line with blanks in place of each tab, up to the next field.
fn with_blanks(line: &str) -> String {
    let mut text = String::with_capacity(line.len());
    for c in line.trim_end().chars() {
        match c {
            '\t' => text.extend(std::iter::repeat_n(' ', 8 - text.len() % 8)),
            c => text.push(c),
        }
    }
    text
}

/// Write solids in small fields, with all continuation fields.
///
/// # Errors
/// A field of such a card is no number, or an element has some of its mid-edge nodes only.
fn to_small_fields(cards: &[Card], made: &mut [String]) -> Result<()> {
    for card in cards {
        if let Some(&(name, vertices, all)) = SOLIDS.iter().find(|solid| solid.0 == card.name) {
            card.replace(made, written(card, name, vertices, all)?);
        }
    }
    Ok(())
}

/// Return the lines of a solid. The last one is a comment, since Gmsh takes other lines behind a card without continuation for one.
fn written(card: &Card, name: &str, vertices: usize, all: usize) -> Result<String> {
    let refuse = |message: String| card.refuse(format!("{}: {message}", card.name));
    let number = |at: usize| match card.field(at) {
        "" => Ok(0),
        word => word.parse().map_err(|_| refuse(format!("`{word}` is no number of an element or node"))),
    };
    // The numbers of the element and of its property, and the nodes.
    let mut fields = (0..2 + all).map(number).collect::<Result<Vec<u64>>>()?;
    let (middles, absent) = (&fields[2 + vertices..], |node: &u64| *node == 0);
    let is_linear = middles.iter().all(absent);
    if !is_linear && middles.iter().any(absent) {
        let tag = fields[0];
        return Err(refuse(format!("element {tag} has some of its mid-edge nodes: give all of them, or none")));
    }
    let mut name = name;
    if is_linear {
        fields.truncate(2 + vertices);
        name = if name == "CQUAD8" { "CQUAD4" } else { name };
        name = if name == "CTRIA6" { "CTRIA3" } else { name };
    } else if name == "CPYRAM" {
        // A quadratic pyramid is the hexahedron whose upper face was drawn into the apex.
        let apex = fields[6];
        (name, fields) = ("CHEXA", [&fields[..6], &[apex; 4], &fields[7..], &[apex; 4]].concat());
    }
    let mut text = String::new();
    for (row, part) in fields.chunks(8).enumerate() {
        let _ = write!(text, "{:<8}", if row == 0 { name } else { "+" });
        part.iter().for_each(|field| {
            let _ = write!(text, "{field:<8}");
        });
        text.push_str(if (row + 1) * 8 < fields.len() { "+\n" } else { "\n" });
    }
    Ok(text + "$")
}

/// Replace the grid points that are not in the basic system.
///
/// # Errors
/// A point is in a system that is not there or not known, or that depends on itself.
fn to_basic(cards: &[Card], made: &mut [String]) -> Result<()> {
    let default = cards.iter().find(|card| card.name == "GRDSET").map_or(Ok(None), |card| card.tag(1))?.unwrap_or(0);
    let mut model = NastranModel::default();
    cards.iter().try_for_each(|card| model.read(card, default))?;
    let local: Vec<(u64, &Card)> =
        model.grids.iter().filter(|(_, grid)| grid.system != 0).map(|(tag, grid)| (*tag, grid.card)).collect();
    for (tag, card) in local {
        card.replace(made, large(tag, model.place(tag, card)?));
    }
    Ok(())
}

/// Return a grid point in large fields, with as many digits as these hold.
fn large(tag: u64, x: [f64; 3]) -> String {
    let [x, y, z] = x.map(sixteen);
    format!("GRID*   {tag:>16}{:>16}{x:>16}{y:>16}\n*       {z:>16}", 0)
}

/// Return a number in at most 16 characters.
fn sixteen(x: f64) -> String {
    let shorter = (0..=14).rev().map(|digits: usize| format!("{x:.digits$e}"));
    std::iter::once(format!("{x:?}")).chain(shorter).find(|text| text.len() <= 16).unwrap_or_default()
}

#[derive(Clone, Copy)]
struct CoordinateSystem<'a> {
    kind: Coordinates,
    definition: Definition,
    card: &'a Card<'a>,
}

#[derive(Clone, Copy)]
enum Definition {
    /// Three points in the system with a number.
    Points { reference: u64, points: [[f64; 3]; 3] },
    /// Three grid points.
    Grids([u64; 3]),
    /// An entry that this program does not know.
    Unknown,
}

/// A grid point: its system, and its coordinates there.
#[derive(Clone, Copy)]
struct GridPoint<'a> {
    system: u64,
    x: [f64; 3],
    card: &'a Card<'a>,
}

/// The points and systems of a file.
#[derive(Default)]
struct NastranModel<'a> {
    grids: BTreeMap<u64, GridPoint<'a>>,
    systems: HashMap<u64, CoordinateSystem<'a>>,
    frames: HashMap<u64, (Coordinates, LocalAxes)>,
    /// Systems whose axes are being found.
    open: BTreeSet<u64>,
}

impl<'a> NastranModel<'a> {
    /// Read an entry. Points without a system are in `default`.
    fn read(&mut self, card: &'a Card, default: u64) -> Result<()> {
        let kind = match card.name.chars().last() {
            Some('C') => Coordinates::Cylindrical,
            Some('S') => Coordinates::Spherical,
            _ => Coordinates::Rectangular,
        };
        let mut add =
            |tag: Option<u64>, definition: Definition| {
                let other = tag.and_then(|tag| self.systems.insert(tag, CoordinateSystem { kind, definition, card }));
                match (tag, other) {
                    (Some(tag), Some(other)) => Err(card
                        .refuse(format!("the system {tag} stands twice, also in line {}", other.card.lines.start + 1))),
                    _ => Ok(()),
                }
            };
        match card.name.as_str() {
            "GRID" => {
                let tag = card.tag(0)?.ok_or_else(|| card.refuse("a GRID has no number"))?;
                let system = card.tag(1)?.unwrap_or(default);
                self.grids.insert(tag, GridPoint { system, x: card.point(2)?, card });
            }
            "CORD1R" | "CORD1C" | "CORD1S" => {
                for from in [0, 4].into_iter().filter(|from| !card.field(*from).is_empty()) {
                    let mut grids = [0; 3];
                    for (grid, index) in grids.iter_mut().zip(from + 1..) {
                        let missing = || card.refuse("a system of coordinates needs three points");
                        *grid = card.tag(index)?.ok_or_else(missing)?;
                    }
                    add(card.tag(from)?, Definition::Grids(grids))?;
                }
            }
            "CORD2R" | "CORD2C" | "CORD2S" => {
                let points = [card.point(2)?, card.point(5)?, card.point(8)?];
                let reference = card.tag(1)?.unwrap_or(0);
                add(card.tag(0)?, Definition::Points { reference, points })?;
            }
            name if name.starts_with("CORD") => add(card.tag(0).unwrap_or(None), Definition::Unknown)?,
            _ => {}
        }
        Ok(())
    }

    /// Return the basic coordinates of a grid point to which the entry `by` refers.
    fn place(&mut self, tag: u64, by: &Card) -> Result<[f64; 3]> {
        let missing = || by.refuse(format!("the grid point {tag} is not there"));
        let GridPoint { system, x, .. } = *self.grids.get(&tag).ok_or_else(missing)?;
        let (kind, frame) = self.frame(system, by)?;
        Ok(frame.place(kind.rectangular(x)))
    }

    /// Return the kind and the axes of a system to which the entry `by` refers.
    fn frame(&mut self, tag: u64, by: &Card) -> Result<(Coordinates, LocalAxes)> {
        if tag == 0 {
            return Ok((Coordinates::Rectangular, LocalAxes::default()));
        }
        if let Some(known) = self.frames.get(&tag) {
            return Ok(*known);
        }
        let missing = || by.refuse(format!("the system of coordinates {tag} is not there"));
        let CoordinateSystem { kind, definition, card } = *self.systems.get(&tag).ok_or_else(missing)?;
        if !self.open.insert(tag) {
            return Err(card.refuse(format!("the system of coordinates {tag} depends on itself")));
        }
        let mut points = [[0.0; 3]; 3];
        match definition {
            Definition::Points { reference, points: given } => {
                let (kind, frame) = self.frame(reference, card)?;
                points = given.map(|x| frame.place(kind.rectangular(x)));
            }
            Definition::Grids(grids) => {
                for (point, grid) in points.iter_mut().zip(grids) {
                    *point = self.place(grid, card)?;
                }
            }
            Definition::Unknown => {
                let name = &card.name;
                return Err(
                    card.refuse(format!("points are in the system {tag}, and {name} is not read: write CORD2R"))
                );
            }
        }
        let [origin, axis, plane] = points;
        let frame = LocalAxes::by_third_axis(origin, axis, plane);
        let frame = frame.ok_or_else(|| card.refuse(format!("the points of the system {tag} lie on a line")))?;
        self.open.remove(&tag);
        self.frames.insert(tag, (kind, frame));
        Ok((kind, frame))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
