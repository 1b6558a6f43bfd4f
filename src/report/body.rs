//! Triangles of bodies and contact surfaces from `.vtu` files: all cells in the plane, and the surface in space.

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
    /// Point numbers of the corners of each triangle.
    pub triangles: Vec<[u32; 3]>,
    /// Displacement at each point, zero for contact surfaces.
    pub displacement: Vec<[f64; 3]>,
    /// Von Mises stress at each point, or the contact pressure; NaN where there is none.
    pub value: Vec<f64>,
    /// Whether the cells are tetrahedra, so that the triangles are their surface.
    pub is_solid: bool,
}

/// The array of the values on contact surfaces.
const SURFACE: &str = "pressure";

/// Numbers of cell types in VTK.
const TRIANGLE: u8 = 5;
const TETRA: u8 = 10;
const QUADRATIC_TRIANGLE: u8 = 22;
const QUADRATIC_TETRA: u8 = 24;

/// The four triangles of a quadratic triangle (corners, then mid-edges 01 12 02).
const QUADRATIC: [[usize; 3]; 4] = [[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]];
/// Faces of a tetrahedron, oriented as seen from outside, with the mid-edges of a quadratic one.
const FACES: [[usize; 6]; 4] = [[0, 2, 1, 6, 5, 4], [0, 1, 3, 4, 8, 7], [1, 2, 3, 5, 9, 8], [0, 3, 2, 7, 9, 6]];

impl Part {
    /// Read a `.vtu` file with the array `value` at its points, as float32 or float64, compressed or not, or all files that a
    /// `.pvtu` file joins.
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
                    // the parts are in the same folder
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

    /// Return the part with these triangles and only their points.
    fn restricted(self, triangles: &[[usize; 3]]) -> Self {
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

    /// Return the points after deformation, with displacements multiplied by `scale`.
    pub fn moved(&self, scale: f64) -> Vec<[f64; 3]> {
        let moved = |(x, u): (&[f64; 3], &[f64; 3])| std::array::from_fn(|k| x[k] + scale * u[k]);
        self.points.iter().zip(&self.displacement).map(moved).collect()
    }

    /// Return the length of the displacement at each point.
    pub fn travel(&self) -> Vec<f64> {
        self.displacement.iter().map(|u| u.iter().map(|u| u * u).sum::<f64>().sqrt()).collect()
    }
}

/// A cell: its type in VTK and its point numbers.
type Cell = (u8, Vec<usize>);

/// The points and cells of a body, joined from the files of its ranks.
#[derive(Default)]
struct Points {
    points: Vec<[f64; 3]>,
    displacement: Vec<[f64; 3]>,
    value: Vec<f64>,
    cells: Vec<Cell>,
    /// Numbers of the points by the bits of their coordinates.
    numbers: HashMap<[u64; 3], usize>,
}

impl Points {
    /// Add the piece of a rank. A point with the coordinates of one in an earlier piece is the same point.
    fn add(&mut self, mut piece: Piece, name: &str) -> std::result::Result<(), String> {
        let points = piece.points;
        let mut array = |name: &str, components: usize| {
            piece.at_points.remove(name).filter(|values| values.len() == components * points.len())
        };
        let value = array(name, 1).ok_or_else(|| format!("it has no array `{name}` with a number at each point"))?;
        let displacement = match array("displacement", 3) {
            Some(all) => all.as_chunks().0.to_vec(),
            // contact surfaces have no displacements
            None if name == SURFACE => vec![[0.0; 3]; points.len()],
            None => return Err("it has no array `displacement` with a vector at each point".to_owned()),
        };
        if displacement.iter().flatten().any(|u| u.is_nan()) {
            return Err("a displacement is not a number".to_owned());
        }
        let bits = |x: &[f64; 3]| x.map(f64::to_bits);
        let mut number = Vec::new();
        for (i, x) in points.iter().enumerate() {
            // points of the same piece stay separate
            let joined = self.numbers.get(&bits(x)).copied();
            number.push(joined.unwrap_or(self.points.len()));
            if joined.is_none() {
                self.points.push(*x);
                self.displacement.push(displacement[i]);
                self.value.push(value[i]);
            }
        }
        self.numbers.extend(points.iter().map(bits).zip(number.iter().copied()));
        let cells = piece.cells.into_iter();
        self.cells.extend(cells.map(|(kind, nodes)| (kind, nodes.into_iter().map(|node| number[node]).collect())));
        Ok(())
    }

    /// Return the part with its triangles.
    fn part(self, name: &str) -> Part {
        let Self { points, displacement, value, cells, .. } = self;
        let is_solid = cells.iter().any(|(kind, _)| matches!(*kind, TETRA | QUADRATIC_TETRA));
        let mut triangles: Vec<[usize; 3]> = Vec::new();
        for (kind, cell) in &cells {
            match (*kind, cell.len()) {
                (TRIANGLE, 3) | (QUADRATIC_TRIANGLE, 6) => add_triangles(cell, &mut triangles),
                // lines are contact surfaces of the plane
                _ => {}
            }
        }
        outer_faces(&cells).iter().for_each(|face| add_triangles(face, &mut triangles));
        let part = Part { name: name.to_owned(), points, triangles: Vec::new(), displacement, value, is_solid };
        part.restricted(&triangles)
    }
}

/// Add a face of three points, or the four triangles of a quadratic face with six.
fn add_triangles(face: &[usize], triangles: &mut Vec<[usize; 3]>) {
    match *face {
        [a, b, c] => triangles.push([a, b, c]),
        _ => triangles.extend(QUADRATIC.map(|corners| corners.map(|k| face[k]))),
    }
}

/// Return the sorted faces that belong to a single tetrahedron.
fn outer_faces(cells: &[Cell]) -> Vec<Vec<usize>> {
    let mut faces: HashMap<[usize; 3], Option<Vec<usize>>> = HashMap::new();
    for (kind, cell) in cells {
        let width = match (*kind, cell.len()) {
            (TETRA, 4) => 3,
            (QUADRATIC_TETRA, 10) => 6,
            _ => continue,
        };
        for face in FACES {
            let face: Vec<usize> = face[..width].iter().map(|&k| cell[k]).collect();
            let mut key = [face[0], face[1], face[2]];
            key.sort_unstable();
            // a face of two cells is inside
            faces.entry(key).and_modify(|found| *found = None).or_insert(Some(face));
        }
    }
    let mut outer: Vec<Vec<usize>> = faces.into_values().flatten().collect();
    outer.sort_unstable();
    outer
}

/// Return the factor by which displacements are multiplied in pictures: the largest of 1, 2, 5 times a power of ten so that no
/// displacement is longer than a twentieth of the diagonal of all bodies. It is 1 at least.
///
/// With such a factor motions are visible, and the bodies still look like themselves.
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
