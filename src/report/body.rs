//! Triangles of bodies and contact surfaces from `.vtu` files: all cells in the plane, the surface in space.

use super::files::Files;
use super::vtu::{self, Content, Piece};
use crate::error::{Error, Kind, Result};
use crate::linalg::bounds;
use std::collections::HashMap;
use std::path::Path;

/// A body or a contact surface as triangles.
pub struct Part {
    /// Name.
    pub name: String,
    /// Points before deformation.
    pub points: Vec<[f64; 3]>,
    /// Corners of the triangles, numbers of points.
    pub triangles: Vec<[u32; 3]>,
    /// Displacement at each point; zero for contact surfaces.
    pub displacement: Vec<[f64; 3]>,
    /// Von Mises stress at each point, or the contact pressure; NaN where there is none.
    pub value: Vec<f64>,
    /// Whether its cells fill space, so that the triangles are its surface.
    pub is_solid: bool,
}

/// The array of contact surfaces.
const SURFACE: &str = "pressure";

/// VTK's numbers of kinds of cells.
const TRIANGLE: u8 = 5;
const TETRA: u8 = 10;
const QUADRATIC_TRIANGLE: u8 = 22;
const QUADRATIC_TETRA: u8 = 24;

/// Parts of a quadratic triangle (corners, then mid-edges 01 12 02).
const QUADRATIC: [[usize; 3]; 4] = [[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]];
/// Faces of a tetrahedron, seen from outside, with the mid-edges that a quadratic one has.
const FACES: [[usize; 6]; 4] = [[0, 2, 1, 6, 5, 4], [0, 1, 3, 4, 8, 7], [1, 2, 3, 5, 9, 8], [0, 3, 2, 7, 9, 6]];

impl Part {
    /// Reads a file with the array `value` at its points, as float32 or float64, compressed or not; or those that a `.pvtu` joins.
    ///
    /// # Errors
    /// [`Kind::File`] when a file is not there, is damaged, is no VTU file or lacks the array.
    pub fn read(files: &Files, file: &str, name: &str, value: &str) -> Result<Self> {
        let refuse = |file: &str, cause: String| {
            Error::new(Kind::File, format!("{} cannot be read as VTU", files.path(file).display()))
                .because(cause)
                .help("solve the scene again with --vtu")
        };
        let content = |file: &str| vtu::read(&files.read(file)?).map_err(|cause| refuse(file, cause));
        let mut points = Points::default();
        let mut add = |file: &str, pieces: Vec<Piece>| {
            pieces.into_iter().try_for_each(|piece| points.add(piece, value)).map_err(|cause| refuse(file, cause))
        };
        match content(file)? {
            Content::Pieces(pieces) => add(file, pieces)?,
            Content::Sources(parts) => {
                for part in parts {
                    // beside this file
                    let part = Path::new(&part).file_name().unwrap_or_default().to_string_lossy();
                    let Content::Pieces(pieces) = content(&part)? else {
                        return Err(refuse(&part, "it has no piece".to_owned()));
                    };
                    add(&part, pieces)?;
                }
            }
        }
        Ok(points.part(name))
    }

    /// The part with these triangles and the points that they have.
    fn with(self, triangles: &[[usize; 3]]) -> Self {
        let mut number = vec![u32::MAX; self.points.len()];
        let mut kept = Vec::new();
        let mut renumber = |node: usize| {
            if number[node] == u32::MAX {
                number[node] = kept.len() as u32;
                kept.push(node);
            }
            number[node]
        };
        let triangles = triangles.iter().map(|corners| corners.map(&mut renumber)).collect();
        let points = kept.iter().map(|&node| self.points[node]).collect();
        let displacement = kept.iter().map(|&node| self.displacement[node]).collect();
        let value = kept.iter().map(|&node| self.value[node]).collect();
        Self { points, triangles, displacement, value, ..self }
    }

    /// Points moved by so many times the displacement.
    pub fn moved(&self, scale: f64) -> Vec<[f64; 3]> {
        let moved = |(x, u): (&[f64; 3], &[f64; 3])| std::array::from_fn(|k| x[k] + scale * u[k]);
        self.points.iter().zip(&self.displacement).map(moved).collect()
    }

    /// Length of the displacement at each point.
    pub fn travel(&self) -> Vec<f64> {
        self.displacement.iter().map(|u| u.iter().map(|u| u * u).sum::<f64>().sqrt()).collect()
    }
}

/// The points and cells of a body from the files of its parts.
#[derive(Default)]
struct Points {
    points: Vec<[f64; 3]>,
    displacement: Vec<[f64; 3]>,
    value: Vec<f64>,
    cells: Vec<(u8, Vec<usize>)>,
    /// Where these points lie.
    places: HashMap<[u64; 3], usize>,
}

impl Points {
    /// Adds a part; a point that lies where an earlier part has one is that point.
    fn add(&mut self, mut piece: Piece, name: &str) -> std::result::Result<(), String> {
        let points = piece.points;
        let mut array = |name: &str, components: usize| {
            piece.at_points.remove(name).filter(|values| values.len() == components * points.len())
        };
        let value = array(name, 1).ok_or_else(|| format!("it has no array `{name}` with a number at each point"))?;
        let displacement = match array("displacement", 3) {
            Some(all) => all.as_chunks().0.to_vec(),
            // surfaces of contact have none
            None if name == SURFACE => vec![[0.0; 3]; points.len()],
            None => return Err("it has no array `displacement` with a vector at each point".to_owned()),
        };
        if displacement.iter().flatten().any(|u| u.is_nan()) {
            return Err("a displacement is not a number".to_owned());
        }
        let bits = |x: &[f64; 3]| x.map(f64::to_bits);
        let mut number = Vec::new();
        for ((x, u), value) in points.iter().zip(&displacement).zip(&value) {
            number.push(self.places.get(&bits(x)).copied().unwrap_or(self.points.len()));
            if number.last() == Some(&self.points.len()) {
                self.points.push(*x);
                self.displacement.push(*u);
                self.value.push(*value);
            }
        }
        self.places.extend(points.iter().map(bits).zip(number.iter().copied()));
        let cells = piece.cells.into_iter();
        self.cells.extend(cells.map(|(kind, nodes)| (kind, nodes.into_iter().map(|node| number[node]).collect())));
        Ok(())
    }

    /// The triangles.
    fn part(self, name: &str) -> Part {
        let Self { points, displacement, value, cells, .. } = self;
        let is_solid = cells.iter().any(|(kind, _)| matches!(*kind, TETRA | QUADRATIC_TETRA));
        let mut triangles: Vec<[usize; 3]> = Vec::new();
        let mut faces: HashMap<[usize; 3], Option<Vec<usize>>> = HashMap::new();
        for (kind, cell) in &cells {
            match (*kind, cell.len()) {
                (TRIANGLE, 3) => triangles.push([cell[0], cell[1], cell[2]]),
                (QUADRATIC_TRIANGLE, 6) => triangles.extend(QUADRATIC.map(|corners| corners.map(|k| cell[k]))),
                (TETRA, 4) | (QUADRATIC_TETRA, 10) => {
                    for face in FACES {
                        let face: Vec<usize> =
                            face[..if cell.len() == 4 { 3 } else { 6 }].iter().map(|&k| cell[k]).collect();
                        let mut key = [face[0], face[1], face[2]];
                        key.sort_unstable();
                        // a face of two cells lies inside
                        faces.entry(key).and_modify(|known| *known = None).or_insert(Some(face));
                    }
                }
                // lines are contact surfaces of the plane
                _ => {}
            }
        }
        let mut outer: Vec<Vec<usize>> = faces.into_values().flatten().collect();
        outer.sort_unstable();
        for face in outer {
            match face[..] {
                [a, b, c] => triangles.push([a, b, c]),
                _ => triangles.extend(QUADRATIC.map(|corners| corners.map(|k| face[k]))),
            }
        }
        Part { name: name.to_owned(), points, triangles: Vec::new(), displacement, value, is_solid }.with(&triangles)
    }
}

/// The largest of 1, 2, 5 times a power of ten by which displacements can be multiplied so that none is longer than a
/// twentieth of the diagonal of all bodies: what is seen to move, and still looks like the bodies. At least 1.
pub fn magnification(parts: &[Part]) -> f64 {
    let [low, high] = bounds(parts.iter().flat_map(|part| &part.points).copied());
    let size = (0..3).map(|k| (high[k] - low[k]).powi(2)).sum::<f64>().sqrt();
    let most = parts.iter().flat_map(Part::travel).fold(0.0, f64::max);
    let wish = 0.05 * size / most;
    if !wish.is_finite() || wish <= 1.0 {
        return 1.0;
    }
    let unit = 10f64.powf(wish.log10().floor());
    unit * [5.0, 2.0].into_iter().find(|factor| factor * unit <= wish).unwrap_or(1.0)
}
