//! Grid points of bulk data in the basic system of coordinates, which is the only one that Gmsh knows.

use super::super::fortran::real;
use super::super::frame::{Coordinates, Frame};
use super::cards::{Card, replace};
use crate::error::{Error, Result};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::fmt::Write;
use std::ops::Range;
use std::path::Path;

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

/// Return whether entries of this name define points or systems.
pub fn is_ours(name: &str) -> bool {
    matches!(name, "GRID" | "GRDSET") || name.starts_with("CORD")
}

/// Replace the grid points that are not in the basic system. `made` has the lines of the file at `path`, and `cards` the entries for
/// which [`is_ours`] holds.
///
/// # Errors
/// A point is in a system that is not there or not known, or that depends on itself. The error names the line.
pub fn to_basic(path: &Path, cards: &[&Card], made: &mut [String]) -> Result<()> {
    let refuse = |line: usize, message: String| Error::mesh(path, Some(line + 1), message);
    let mut model = Model::default();
    let default = cards.iter().find(|card| card.name == "GRDSET");
    let default = match default.map(|card| card.tag(1).map_err(|message| refuse(card.lines.start, message))) {
        Some(system) => system?.unwrap_or(0),
        None => 0,
    };
    for card in cards {
        model.read(card, default).map_err(|message| refuse(card.lines.start, message))?;
    }
    let local: Vec<u64> = model.grids.iter().filter(|(_, grid)| grid.system != 0).map(|(tag, _)| *tag).collect();
    for tag in local {
        let (x, lines) = (model.place(tag), model.grids[&tag].lines.clone());
        let x = x.map_err(|flaw| refuse(flaw.line.unwrap_or(lines.start), flaw.message))?;
        replace(made, lines, large(tag, x));
    }
    Ok(())
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
