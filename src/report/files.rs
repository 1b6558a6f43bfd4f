//! The files of a run, checked against its checksums when they are read: tables, and bodies and contact surfaces as triangles from `.vtu` files,
//! which are XML with arrays in base64, compressed by zlib or not.
//!
//! The reader trusts no file. Sizes and counts must agree with each other before memory is allocated for them, and blocks must agree with
//! their checksums.

use crate::error::{Error, Kind, Result};
use crate::fem::length;
use crate::linalg::bounds;
use crate::output::{Checksums, folder};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::read::ZlibDecoder;
use serde::Deserialize;
use std::collections::HashMap;
use std::io::Read;
use std::path::{Path, PathBuf};

/// A row of a table: values by the names of their columns.
pub type TableRow = HashMap<String, String>;

/// A folder of results.
pub struct ResultFolder {
    folder: PathBuf,
    sums: Option<Checksums>,
}

impl ResultFolder {
    /// Open a folder.
    pub fn open(folder: &Path) -> Result<Self> {
        let path = folder.join(folder::SUMS);
        // a killed run or one of an earlier version has no list
        let sums = match path.symlink_metadata() {
            Ok(_) => Some(Checksums::parse(&path, &crate::file::read(&path)?)?),
            Err(_) => None,
        };
        Ok(Self { folder: folder.to_owned(), sums })
    }

    /// Return the path of a file.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    /// Read a file.
    pub fn read(&self, name: &str) -> Result<Vec<u8>> {
        let bytes = crate::file::read(&self.path(name))?;
        self.sums.as_ref().map_or(Ok(()), |sums| sums.check(&self.folder, name, &bytes))?;
        Ok(bytes)
    }

    /// Return the rows of a table, none if there is no such file.
    pub fn rows(&self, name: &str) -> Result<Vec<TableRow>> {
        if !self.path(name).exists() {
            return Ok(Vec::new());
        }
        let bytes = self.read(name)?;
        let mut table = csv::Reader::from_reader(bytes.as_slice());
        table.deserialize().collect::<std::result::Result<_, csv::Error>>().map_err(|cause| {
            Error::new(Kind::File, format!("{} is no table", self.path(name).display())).because(cause.to_string())
        })
    }
}

/// Return a number of a row, NaN if the column has none.
pub fn value(row: &TableRow, column: &str) -> f64 {
    row.get(column).and_then(|text| text.parse().ok()).unwrap_or(f64::NAN)
}

/// A body or a contact surface as triangles.
pub struct TriangleMesh {
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

impl TriangleMesh {
    /// Read a `.vtu` file with the array `value` at its points, as float32 or float64, compressed or not, or all files that a
    /// `.pvtu` file joins.
    ///
    /// # Errors
    /// [`Kind::File`] when a file is not there, is damaged, is no VTU file or lacks the array.
    pub fn read(files: &ResultFolder, file: &str, name: &str, value: &str) -> Result<Self> {
        let refuse = |file: &str, cause: String| {
            Error::new(Kind::File, format!("{} cannot be read as VTU", files.path(file).display()))
                .because(cause)
                .help("solve the scene again with --vtu")
        };
        let open = |file: &str| document(&files.read(file)?).map_err(|cause| refuse(file, cause));
        let mut points = BodyPoints::default();
        let mut add =
            |file: &str, document: &Document| points.add(document, value).map_err(|cause| refuse(file, cause));
        let whole = open(file)?;
        for PieceSource { file } in &whole.joined.pieces {
            // the parts are in the same folder
            let part = Path::new(file).file_name().unwrap_or_default().to_string_lossy();
            add(&part, &open(&part)?)?;
        }
        if whole.joined.pieces.is_empty() {
            add(file, &whole)?;
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
        self.displacement.iter().map(|&u| length(u)).collect()
    }
}

/// A cell: its type in VTK and its point numbers.
type Cell = (u8, Vec<usize>);

/// The points and cells of a body, joined from the files of its ranks.
#[derive(Default)]
struct BodyPoints {
    points: Vec<[f64; 3]>,
    displacement: Vec<[f64; 3]>,
    value: Vec<f64>,
    cells: Vec<Cell>,
    /// Numbers of the points by the bits of their coordinates.
    numbers: HashMap<[u64; 3], usize>,
}

impl BodyPoints {
    /// Add the pieces of a file, with the array `name` at their points.
    fn add(&mut self, document: &Document, name: &str) -> Parsed<()> {
        let encoding = document.encoding()?;
        match &document.grid.pieces[..] {
            [] => Err("it has no piece of an unstructured grid".to_owned()),
            pieces => pieces.iter().try_for_each(|piece| self.add_piece(piece, encoding, name)),
        }
    }

    /// Add the piece of a rank. A point with the coordinates of one in an earlier piece is the same point.
    fn add_piece(&mut self, piece: &VtuPiece, encoding: ArrayEncoding, name: &str) -> Parsed<()> {
        let points = piece.coordinates(encoding)?;
        let mut arrays = piece.at_points(encoding)?;
        let mut array = |name: &str, components: usize| {
            arrays.remove(name).filter(|values| values.len() == components * points.len())
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
        let cells = piece.cells(encoding)?.into_iter();
        self.cells.extend(cells.map(|(kind, nodes)| (kind, nodes.into_iter().map(|node| number[node]).collect())));
        Ok(())
    }

    fn part(self, name: &str) -> TriangleMesh {
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
        let part = TriangleMesh { name: name.to_owned(), points, triangles: Vec::new(), displacement, value, is_solid };
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
pub fn magnification(parts: &[TriangleMesh]) -> f64 {
    let [low, high] = bounds(parts.iter().flat_map(|part| &part.points).copied());
    let size = (0..3).map(|k| (high[k] - low[k]).powi(2)).sum::<f64>().sqrt();
    let most = parts.iter().flat_map(TriangleMesh::travel).fold(0.0, f64::max);
    let wish = 0.05 * size / most;
    if !wish.is_finite() || wish <= 1.0 {
        return 1.0;
    }
    let unit = 10f64.powf(wish.log10().floor());
    unit * [5.0, 2.0].into_iter().find(|factor| factor * unit <= wish).unwrap_or(1.0)
}

/// A value, or a description of what is wrong with the file.
type Parsed<T> = std::result::Result<T, String>;

/// A file as its elements and their attributes.
#[derive(Deserialize)]
struct Document {
    /// Type of the sizes in front of arrays. A `.pvtu` has no arrays.
    #[serde(rename = "@header_type", default)]
    size_type: String,
    #[serde(rename = "@compressor", default)]
    compressor: String,
    #[serde(rename = "@byte_order", default)]
    byte_order: String,
    #[serde(rename = "UnstructuredGrid", default)]
    grid: Pieces<VtuPiece>,
    #[serde(rename = "PUnstructuredGrid", default)]
    joined: Pieces<PieceSource>,
}

#[derive(Deserialize)]
struct Pieces<T> {
    #[serde(rename = "Piece", default = "Vec::new")]
    pieces: Vec<T>,
}

impl<T> Default for Pieces<T> {
    fn default() -> Self {
        Self { pieces: Vec::new() }
    }
}

#[derive(Deserialize)]
struct PieceSource {
    #[serde(rename = "@Source")]
    file: String,
}

#[derive(Deserialize)]
struct VtuPiece {
    #[serde(rename = "@NumberOfPoints")]
    points: usize,
    #[serde(rename = "@NumberOfCells")]
    cells: usize,
    #[serde(rename = "Points", default)]
    coordinates: Arrays,
    #[serde(rename = "Cells", default)]
    lists: Arrays,
    #[serde(rename = "PointData", default)]
    at_points: Arrays,
}

#[derive(Default, Deserialize)]
struct Arrays {
    #[serde(rename = "DataArray", default)]
    arrays: Vec<Array>,
}

#[derive(Deserialize)]
struct Array {
    #[serde(rename = "@Name", default)]
    name: String,
    #[serde(rename = "@type", default)]
    kind: String,
    #[serde(rename = "@format", default)]
    format: String,
    #[serde(rename = "$text", default)]
    data: String,
}

/// The encoding of the arrays of a file.
#[derive(Clone, Copy)]
struct ArrayEncoding {
    is_big: bool,
    is_compressed: bool,
}

/// Read a `.vtu` or `.pvtu` file.
fn document(bytes: &[u8]) -> Parsed<Document> {
    let text = std::str::from_utf8(bytes).map_err(|_| "it is no text")?;
    quick_xml::de::from_str(text).map_err(|cause| cause.to_string())
}

impl Document {
    fn encoding(&self) -> Parsed<ArrayEncoding> {
        if !matches!(self.size_type.as_str(), "UInt64" | "") {
            return Err(format!("sizes are of the type `{}`", self.size_type));
        }
        let is_compressed = match self.compressor.as_str() {
            "" => false,
            "vtkZLibDataCompressor" => true,
            other => return Err(format!("it is compressed by `{other}`, which is not read")),
        };
        let is_big = match self.byte_order.as_str() {
            "LittleEndian" => false,
            "BigEndian" => true,
            other => return Err(format!("its order of bytes is `{other}`")),
        };
        Ok(ArrayEncoding { is_big, is_compressed })
    }
}

impl VtuPiece {
    /// Return the points, as many as the piece says.
    fn coordinates(&self, encoding: ArrayEncoding) -> Parsed<Vec<[f64; 3]>> {
        let all = self.coordinates.arrays.first().map_or(Ok(Vec::new()), |array| array.reals(encoding))?;
        if Some(all.len()) != self.points.checked_mul(3) {
            return Err(format!("it has not the {} points that it says", self.points));
        }
        match all.iter().all(|x| x.is_finite()) {
            true => Ok(all.as_chunks().0.to_vec()),
            false => Err("a coordinate is not finite".to_owned()),
        }
    }

    /// Return the values of all arrays at the points, by name; all components of a point stand together.
    fn at_points(&self, encoding: ArrayEncoding) -> Parsed<HashMap<&str, Vec<f64>>> {
        let (mut found, count) = (HashMap::new(), self.points);
        for array in &self.at_points.arrays {
            let (name, values) = (array.name.as_str(), array.reals(encoding)?);
            if count == 0 || !values.len().is_multiple_of(count) || values.is_empty() {
                return Err(format!("array `{name}` has {} values for {count} points", values.len()));
            }
            if values.iter().any(|value| value.is_infinite()) {
                return Err(format!("array `{name}` has a value that is not finite"));
            }
            found.insert(name, values);
        }
        Ok(found)
    }

    /// Return the cells, as many as the piece says.
    fn cells(&self, encoding: ArrayEncoding) -> Parsed<Vec<Cell>> {
        let list = |name: &str| {
            let array = self.lists.arrays.iter().find(|array| array.name == name);
            array.ok_or_else(|| format!("it has no {name} of cells"))?.wholes(encoding)
        };
        let (nodes, ends, kinds) = (list("connectivity")?, list("offsets")?, list("types")?);
        let count = self.cells;
        if ends.len() != count || kinds.len() != count || ends.last().copied().unwrap_or(0) != nodes.len() as u64 {
            return Err(format!("it has not the {count} cells that it says"));
        }
        let (mut start, mut cells) = (0, Vec::new());
        for (&kind, &end) in kinds.iter().zip(&ends) {
            let nodes = nodes.get(start..end as usize).ok_or("a cell ends before it begins")?;
            let is_point = |&node: &usize| node < self.points;
            let cell: Option<Vec<usize>> =
                nodes.iter().map(|&node| usize::try_from(node).ok().filter(is_point)).collect();
            cells.push((kind as u8, cell.ok_or("a cell has a point that is not there")?));
            start = end as usize;
        }
        Ok(cells)
    }
}

impl Array {
    /// Return the numbers of an array of floating-point numbers.
    fn reals(&self, encoding: ArrayEncoding) -> Parsed<Vec<f64>> {
        let numbers = |size: usize| self.numbers(size, encoding);
        match self.kind.as_str() {
            "Float64" => Ok(numbers(8)?.into_iter().map(f64::from_bits).collect()),
            "Float32" => Ok(numbers(4)?.into_iter().map(|bits| f64::from(f32::from_bits(bits as u32))).collect()),
            other => Err(self.wrong(format!("its numbers are of the type `{other}`"))),
        }
    }

    /// Return the numbers of an array of whole numbers.
    fn wholes(&self, encoding: ArrayEncoding) -> Parsed<Vec<u64>> {
        match self.kind.as_str() {
            "UInt8" => self.numbers(1, encoding),
            "UInt64" => self.numbers(SIZE, encoding),
            other => Err(self.wrong(format!("its numbers are of the type `{other}`"))),
        }
    }

    /// Return the bits of all numbers, which have `size` bytes each.
    fn numbers(&self, size: usize, encoding: ArrayEncoding) -> Parsed<Vec<u64>> {
        if self.format != "binary" {
            return Err(self.wrong(format!("its format is `{}`, not `binary`", self.format)));
        }
        let bytes = bytes(self.data.trim_ascii().as_bytes(), encoding);
        bytes.and_then(|bytes| split(&bytes, size, encoding)).map_err(|what| self.wrong(what))
    }

    /// Say which array is wrong.
    fn wrong(&self, what: String) -> String {
        format!("array `{}`: {what}", self.name)
    }
}

/// Split bytes into numbers of `size` bytes each.
fn split(bytes: &[u8], size: usize, encoding: ArrayEncoding) -> Parsed<Vec<u64>> {
    if !bytes.len().is_multiple_of(size) {
        return Err("it ends within a number".to_owned());
    }
    let value = |chunk: &[u8]| {
        let join = |all: u64, byte: &u8| all << 8 | u64::from(*byte);
        if encoding.is_big { chunk.iter().fold(0, join) } else { chunk.iter().rev().fold(0, join) }
    };
    Ok(bytes.chunks_exact(size).map(value).collect())
}

/// Bytes of a size in front of the data of an array.
const SIZE: usize = 8;

/// Decode the bytes of an array, which follow their sizes.
fn bytes(data: &[u8], encoding: ArrayEncoding) -> Parsed<Vec<u8>> {
    let decode = |text: &[u8]| STANDARD.decode(text).map_err(|cause| format!("no base64: {cause}"));
    let short = || "it is shorter than it says".to_owned();
    if !encoding.is_compressed {
        let all = decode(data)?;
        let (head, rest) = all.split_at_checked(SIZE).ok_or_else(short)?;
        return match split(head, SIZE, encoding)?[0] == rest.len() as u64 {
            true => Ok(rest.to_vec()),
            false => Err("it has not as many bytes as it says".to_owned()),
        };
    }
    // The data begins with at least three sizes, which are encoded separately. The first size is the number of blocks, and
    // it tells how long the encoded sizes are.
    let encoded = |bytes: usize| bytes.div_ceil(3).checked_mul(4);
    let first = encoded(SIZE).and_then(|length| data.get(..length)).ok_or_else(short)?;
    let count = split(decode(first)?.get(..SIZE).ok_or_else(short)?, SIZE, encoding)?[0];
    let head = usize::try_from(count).ok().and_then(|count| count.checked_add(3)?.checked_mul(SIZE));
    let head_length = head.and_then(encoded).filter(|&length| length <= data.len()).ok_or_else(short)?;
    let sizes = split(&decode(&data[..head_length])?, SIZE, encoding)?;
    let [_, block, last, compressed @ ..] = &sizes[..] else { return Err(short()) };
    inflate(&decode(&data[head_length..])?, compressed, *block, *last)
}

/// Decompress blocks with these compressed lengths. Each has `block` bytes, and the last one has `last`, or `block` if that is 0.
fn inflate(packed: &[u8], lengths: &[u64], block: u64, last: u64) -> Parsed<Vec<u8>> {
    let (mut rest, mut all) = (packed, Vec::new());
    for (k, &length) in lengths.iter().enumerate() {
        let (packed, after) = usize::try_from(length)
            .ok()
            .and_then(|length| rest.split_at_checked(length))
            .ok_or("it is shorter than it says")?;
        let before = all.len() as u64;
        // at most one byte more than a block is read, whatever the block claims
        let mut blocks = ZlibDecoder::new(packed).take(block.saturating_add(1));
        blocks.read_to_end(&mut all).map_err(|cause| format!("a block is damaged: {cause}"))?;
        let found = all.len() as u64 - before;
        let is_last = k + 1 == lengths.len();
        let fits = if is_last { found == last || (last == 0 && found == block) } else { found == block };
        if !fits || blocks.into_inner().total_in() != length {
            return Err("a block has not as many bytes as it says".to_owned());
        }
        rest = after;
    }
    if rest.is_empty() { Ok(all) } else { Err("it is longer than it says".to_owned()) }
}
