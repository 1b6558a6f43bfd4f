//! Bulk data files (`.bdf`, `.nas`) with all grid points in the basic system of coordinates, which is the only one that Gmsh
//! knows. Points of other systems are transformed; all other lines are unchanged.

use super::super::fortran::real;
use super::super::frame::{Coordinates, Frame};
use crate::error::{Error, Result};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::fmt::Write;
use std::ops::Range;
use std::path::Path;

/// An entry: its name, and its fields behind the name.
struct Card {
    name: String,
    fields: Vec<String>,
    /// Its lines in the file, from 0.
    lines: Range<usize>,
}

type TextResult<T> = std::result::Result<T, String>;

/// What is wrong with a system of coordinates, with its line if it has one.
struct Flaw {
    line: Option<usize>,
    message: String,
}

impl Flaw {
    fn new(line: Option<usize>, message: String) -> Self {
        Self { line, message }
    }

    /// Return the flaw with this line if it has none.
    fn or_in(self, line: usize) -> Self {
        Self { line: self.line.or(Some(line)), ..self }
    }
}

impl Card {
    fn field(&self, index: usize) -> &str {
        self.fields.get(index).map_or("", String::as_str)
    }

    /// Return a number of a point or system; none if the field is blank.
    fn tag(&self, index: usize) -> TextResult<Option<u64>> {
        match self.field(index) {
            "" => Ok(None),
            word => word.parse().map(Some).map_err(|_| format!("`{word}` is no whole number")),
        }
    }

    /// Return three numbers. Blank ones are zero.
    fn point(&self, from: usize) -> TextResult<[f64; 3]> {
        let mut point = [0.0; 3];
        for (x, index) in point.iter_mut().zip(from..) {
            let word = self.field(index);
            *x = if word.is_empty() { 0.0 } else { real(word).ok_or_else(|| format!("`{word}` is no number"))? };
        }
        Ok(point)
    }
}

/// A system of coordinates as its entry defines it.
struct System {
    kind: Coordinates,
    definition: Definition,
    line: usize,
}

enum Definition {
    /// Three points in the system with a number.
    Points { reference: u64, points: [[f64; 3]; 3] },
    /// Three grid points.
    Grids([u64; 3]),
    /// An entry that this program does not know.
    Unknown(String),
}

/// A grid point: its system, and its coordinates there.
struct Grid {
    system: u64,
    x: [f64; 3],
    lines: Range<usize>,
}

/// The points and systems of a file.
#[derive(Default)]
struct Model {
    grids: BTreeMap<u64, Grid>,
    systems: HashMap<u64, System>,
    frames: HashMap<u64, (Coordinates, Frame)>,
    /// Systems whose axes are being found.
    open: BTreeSet<u64>,
}

/// Return the file with all grid points in the basic system.
///
/// # Errors
/// A point is in a system that is not there or not known, or that depends on itself. Another file is to be included. The error
/// names the line.
pub fn in_basic_system(path: &Path, text: &str) -> Result<String> {
    let refuse = |line: usize, message: String| Error::mesh(path, Some(line + 1), message);
    let lines: Vec<&str> = text.lines().collect();
    let cards = cards(&lines);
    if let Some(card) = cards.iter().find(|card| card.name == "INCLUDE") {
        let message = "files that include others are not read".to_owned();
        return Err(refuse(card.lines.start, message).help("put the files together into one"));
    }
    let mut model = Model::default();
    let default = cards.iter().find(|card| card.name == "GRDSET");
    let default = match default.map(|card| card.tag(1).map_err(|message| refuse(card.lines.start, message))) {
        Some(system) => system?.unwrap_or(0),
        None => 0,
    };
    for card in &cards {
        model.read(card, default).map_err(|message| refuse(card.lines.start, message))?;
    }
    let mut made = Vec::from_iter(lines.iter().map(|line| (*line).to_owned()));
    let local: Vec<u64> = model.grids.iter().filter(|(_, grid)| grid.system != 0).map(|(tag, _)| *tag).collect();
    for tag in &local {
        let (x, lines) = (model.place(*tag), model.grids[tag].lines.clone());
        let x = x.map_err(|flaw| refuse(flaw.line.unwrap_or(lines.start), flaw.message))?;
        made[lines.clone()].iter_mut().for_each(|line| *line = "$".to_owned());
        made[lines.start] = large(*tag, x);
    }
    Ok(if local.is_empty() { text.to_owned() } else { made.join("\n") + "\n" })
}

/// Return a grid point in large fields, with as many digits as these hold.
fn large(tag: u64, x: [f64; 3]) -> String {
    let [x, y, z] = x.map(sixteen);
    let mut text = String::new();
    let _ = write!(text, "GRID*   {tag:>16}{:>16}{x:>16}{y:>16}\n*       {z:>16}", 0);
    text
}

/// Return a number in at most 16 characters.
fn sixteen(x: f64) -> String {
    let shorter = (0..=14).rev().map(|digits: usize| format!("{x:.digits$e}"));
    std::iter::once(format!("{x:?}")).chain(shorter).find(|text| text.len() <= 16).unwrap_or_default()
}

/// Return the entries of the bulk data that define points or systems.
fn cards(lines: &[&str]) -> Vec<Card> {
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
                is_open = !continues && (matches!(name.as_str(), "GRID" | "GRDSET") || name.starts_with("CORD"));
                if is_open || line.trim().to_ascii_uppercase().starts_with("INCLUDE ") {
                    let name = if is_open { name } else { "INCLUDE".to_owned() };
                    cards.push(Card { name, fields, lines: number..number + 1 });
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

impl Model {
    /// Read an entry. Points without a system are in `default`.
    fn read(&mut self, card: &Card, default: u64) -> TextResult<()> {
        let line = card.lines.start;
        let kind = match card.name.chars().last() {
            Some('C') => Coordinates::Cylindrical,
            Some('S') => Coordinates::Spherical,
            _ => Coordinates::Rectangular,
        };
        match card.name.as_str() {
            "GRID" => {
                let tag = card.tag(0)?.ok_or("a GRID has no number")?;
                let system = card.tag(1)?.unwrap_or(default);
                let grid = Grid { system, x: card.point(2)?, lines: card.lines.clone() };
                self.grids.insert(tag, grid);
            }
            "CORD1R" | "CORD1C" | "CORD1S" => {
                for from in [0, 4].into_iter().filter(|from| !card.field(*from).is_empty()) {
                    let mut grids = [0; 3];
                    for (grid, index) in grids.iter_mut().zip(from + 1..) {
                        *grid = card.tag(index)?.ok_or("a system of coordinates needs three points")?;
                    }
                    self.add(card.tag(from)?, System { kind, definition: Definition::Grids(grids), line })?;
                }
            }
            "CORD2R" | "CORD2C" | "CORD2S" => {
                let points = [card.point(2)?, card.point(5)?, card.point(8)?];
                let definition = Definition::Points { reference: card.tag(1)?.unwrap_or(0), points };
                self.add(card.tag(0)?, System { kind, definition, line })?;
            }
            name if name.starts_with("CORD") => {
                self.add(
                    card.tag(0).unwrap_or(None),
                    System { kind, definition: Definition::Unknown(name.to_owned()), line },
                )?;
            }
            _ => {}
        }
        Ok(())
    }

    fn add(&mut self, tag: Option<u64>, system: System) -> TextResult<()> {
        let Some(tag) = tag else { return Ok(()) };
        match self.systems.insert(tag, system) {
            Some(other) => Err(format!("the system {tag} stands twice, also in line {}", other.line + 1)),
            None => Ok(()),
        }
    }

    /// Return the basic coordinates of a grid point.
    fn place(&mut self, tag: u64) -> std::result::Result<[f64; 3], Flaw> {
        let grid = self.grids.get(&tag).ok_or_else(|| Flaw::new(None, format!("the grid point {tag} is not there")))?;
        let (system, x) = (grid.system, grid.x);
        let (kind, frame) = self.frame(system)?;
        Ok(frame.place(kind.rectangular(x)))
    }

    /// Return the kind and the axes of a system.
    fn frame(&mut self, tag: u64) -> std::result::Result<(Coordinates, Frame), Flaw> {
        if tag == 0 {
            return Ok((Coordinates::Rectangular, Frame::default()));
        }
        if let Some(known) = self.frames.get(&tag) {
            return Ok(*known);
        }
        let system = self.systems.get(&tag);
        let system = system.ok_or_else(|| Flaw::new(None, format!("the system of coordinates {tag} is not there")))?;
        let (kind, line) = (system.kind, system.line);
        let refuse = |message: String| Flaw::new(Some(line), message);
        if !self.open.insert(tag) {
            return Err(refuse(format!("the system of coordinates {tag} depends on itself")));
        }
        let points = match system.definition {
            Definition::Points { reference, points } => {
                let (kind, frame) = self.frame(reference).map_err(|flaw| flaw.or_in(line))?;
                points.map(|x| frame.place(kind.rectangular(x)))
            }
            Definition::Grids(grids) => {
                let mut points = [[0.0; 3]; 3];
                for (point, grid) in points.iter_mut().zip(grids) {
                    *point = self.place(grid).map_err(|flaw| flaw.or_in(line))?;
                }
                points
            }
            Definition::Unknown(ref name) => {
                return Err(refuse(format!("points are in the system {tag}, and {name} is not read: write CORD2R")));
            }
        };
        let [origin, axis, plane] = points;
        let frame = Frame::by_third_axis(origin, axis, plane);
        let frame = frame.ok_or_else(|| refuse(format!("the points of the system {tag} lie on a line")))?;
        self.open.remove(&tag);
        self.frames.insert(tag, (kind, frame));
        Ok((kind, frame))
    }
}
