//! Meshes with fields: for ParaView (`.vtu`, with names of components, and the `.pvd` collection over time), and for Gmsh (`.msh` 4.1, binary).

use serde::{Deserialize, Serialize};
use std::io::{self, Write};
use vtkio::model::{
    Attribute, Attributes, ByteOrder, CellType, Cells, DataArray, DataSet, ElementType, IOBuffer,
    UnstructuredGridPiece, Version, VertexNumbers, Vtk,
};
use vtkio::xml::Compressor;

/// The kind of the cells of a body. The local numbering of the points is that of VTK.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum CellKind {
    /// Two ends.
    Line,
    /// Two ends, then the middle.
    QuadraticLine,
    /// Three vertices.
    Triangle,
    /// Three vertices, then mid-edges 01 12 02.
    QuadraticTriangle,
    /// Four vertices.
    Tetra,
    /// Four vertices, then mid-edges 01 12 02 03 13 23.
    QuadraticTetra,
}

impl CellKind {
    /// Return the kind of the simplices of a dimension (2 or 3) and order (1 or 2).
    pub fn simplex(dimension: usize, order: usize) -> Self {
        match (dimension, order) {
            (2, 1) => CellKind::Triangle,
            (2, _) => CellKind::QuadraticTriangle,
            (_, 1) => CellKind::Tetra,
            (_, _) => CellKind::QuadraticTetra,
        }
    }

    /// Return the number of points per cell.
    pub fn stride(self) -> usize {
        self.facts().0
    }

    /// Return the number of points, the type in VTK, the dimension, and the type in Gmsh of a cell.
    fn facts(self) -> (usize, CellType, i32, i32) {
        match self {
            CellKind::Line => (2, CellType::Line, 1, 1),
            CellKind::QuadraticLine => (3, CellType::QuadraticEdge, 1, 8),
            CellKind::Triangle => (3, CellType::Triangle, 2, 2),
            CellKind::QuadraticTriangle => (6, CellType::QuadraticTriangle, 2, 9),
            CellKind::Tetra => (4, CellType::Tetra, 3, 4),
            CellKind::QuadraticTetra => (10, CellType::QuadraticTetra, 3, 11),
        }
    }
}

/// The format of the numbers in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Encoding {
    /// Whether numbers have four bytes instead of eight.
    pub single: bool,
    /// Whether they are compressed (zlib).
    pub compress: bool,
}

impl Default for Encoding {
    fn default() -> Self {
        Self { single: false, compress: true }
    }
}

/// Level of zlib from 1, fast, to 9. Levels above 1 take four times as long for some per cent, as the last digits of numbers are
/// random.
const LEVEL: u32 = 1;

/// The mesh of one body and the fields at its points.
#[derive(Debug, Clone, PartialEq)]
pub struct BodyField {
    /// Name of the body.
    pub name: String,
    /// Points, before deformation.
    pub points: Vec<[f64; 3]>,
    /// Kind of all cells.
    pub cell: CellKind,
    /// Point numbers, as many for each cell as its kind has.
    pub connectivity: Vec<u32>,
    /// Displacement at each point.
    pub displacement: Vec<[f64; 3]>,
    /// Stress at each point in ParaView's order XX YY ZZ XY YZ XZ.
    pub stress: Vec<[f64; 6]>,
    /// Von Mises stress at each point.
    pub von_mises: Vec<f64>,
    /// Where it is largest; none without points.
    pub largest: Option<LargestStress>,
    /// Principal stresses at each point, the largest first.
    pub principal: Vec<[f64; 3]>,
}

/// The largest von Mises stress at the points of a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LargestStress {
    /// Its point.
    pub point: usize,
    /// Relative change of the stress from there to the middles of the cells around it, the largest.
    pub change: f64,
}

impl BodyField {
    /// Names of the arrays at the points and numbers of their components, in the order of the files.
    const ARRAYS: [(&'static str, u32); 4] = [("displacement", 3), ("stress", 6), ("von_mises", 1), ("principal", 3)];

    /// Write VTK's XML format with binary (base64) data and the point arrays `displacement` (3 components), `stress` (6),
    /// `von_mises` (1) and `principal` (3).
    pub fn write(self, encoding: Encoding, out: &mut dyn Write) -> io::Result<()> {
        self.into_grid().write(encoding, out)
    }

    /// Return the field as a grid with the arrays that [`Self::write`] names.
    pub fn into_grid(self) -> UnstructuredGrid {
        let (displacement, stress) = (self.displacement.into_flattened(), self.stress.into_flattened());
        let values = [displacement, stress, self.von_mises, self.principal.into_flattened()];
        let arrays = Self::ARRAYS.into_iter().zip(values);
        UnstructuredGrid {
            title: self.name,
            points: self.points,
            cell: self.cell,
            connectivity: self.connectivity,
            at_points: arrays.map(|((name, components), values)| (name.to_owned(), components, values)).collect(),
            at_cells: Vec::new(),
        }
    }

    /// Write the `.pvtu` file that joins the parts of a body in `files` of the same folder.
    pub fn join(files: &[String], encoding: Encoding, out: &mut dyn Write) -> io::Result<()> {
        let kind = if encoding.single { "Float32" } else { "Float64" };
        let mut out = TagWriter::new(out);
        let order = if cfg!(target_endian = "big") { "BigEndian" } else { "LittleEndian" };
        writeln!(out, "<?xml version=\"1.0\"?>")?;
        writeln!(out, "<VTKFile type=\"PUnstructuredGrid\" version=\"1.0\" byte_order=\"{order}\">")?;
        writeln!(out, "  <PUnstructuredGrid GhostLevel=\"0\">\n    <PPointData>")?;
        for (name, components) in Self::ARRAYS {
            writeln!(out, "      <PDataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\"/>")?;
        }
        writeln!(out, "    </PPointData>\n    <PPoints>")?;
        writeln!(out, "      <PDataArray type=\"{kind}\" NumberOfComponents=\"3\"/>\n    </PPoints>")?;
        for file in files {
            writeln!(out, "    <Piece Source=\"{}\"/>", escape(file))?;
        }
        writeln!(out, "  </PUnstructuredGrid>\n</VTKFile>")
    }
}

/// A grid of cells of one kind with values at points and cells.
pub struct UnstructuredGrid {
    /// Title in the file.
    pub title: String,
    /// Points.
    pub points: Vec<[f64; 3]>,
    /// Kind of all cells.
    pub cell: CellKind,
    /// Point numbers, as many for each cell as its kind has.
    pub connectivity: Vec<u32>,
    /// Arrays at the points: name, components, values.
    pub at_points: Vec<(String, u32, Vec<f64>)>,
    /// Arrays at the cells: name, components, values.
    pub at_cells: Vec<(String, u32, Vec<f64>)>,
}

impl UnstructuredGrid {
    /// Write VTK's XML format with binary (base64) data. Arrays must fit the points and cells.
    pub fn write(self, encoding: Encoding, out: &mut dyn Write) -> io::Result<()> {
        let numbers = |data: Vec<f64>| -> IOBuffer {
            if encoding.single { data.into_iter().map(|x| x as f32).collect::<Vec<_>>().into() } else { data.into() }
        };
        let stride = self.cell.stride();
        let cells = self.connectivity.len() / stride;
        let arrays = |list: Vec<(String, u32, Vec<f64>)>| {
            let array = |(name, components, data): (String, u32, Vec<f64>)| {
                Attribute::DataArray(DataArray { name, elem: ElementType::Generic(components), data: numbers(data) })
            };
            list.into_iter().map(array).collect()
        };
        let piece = UnstructuredGridPiece {
            points: numbers(self.points.into_flattened()),
            cells: Cells {
                cell_verts: VertexNumbers::XML {
                    connectivity: self.connectivity.into_iter().map(u64::from).collect(),
                    offsets: (1..=cells).map(|cell| (cell * stride) as u64).collect(),
                },
                types: vec![self.cell.facts().1; cells],
            },
            data: Attributes { point: arrays(self.at_points), cell: arrays(self.at_cells) },
        };
        let vtk = Vtk {
            version: Version::new_xml(1, 0),
            title: self.title,
            byte_order: ByteOrder::native(),
            data: DataSet::inline(piece),
            file_path: None,
        };
        writeln!(out, r#"<?xml version="1.0"?>"#)?;
        let mut out = TagWriter::new(out);
        let compressor = if encoding.compress { Compressor::ZLib } else { Compressor::None };
        let written = vtk.try_into_xml_format(compressor, LEVEL).and_then(|file| file.write(&mut out));
        match out.failure() {
            Some(failure) => Err(failure),
            None => written.map_err(io::Error::other),
        }
    }
}

/// An entry of a collection: the file of a body or a contact surface at a time.
pub struct CollectionEntry<'a> {
    /// Time.
    pub time: f64,
    /// Number of the body or surface.
    pub part: usize,
    /// Name of the body or surface.
    pub name: &'a str,
    /// File, relative to the collection.
    pub file: String,
}

/// Write the collection that opens the `.vtu` files of all bodies and contact surfaces at once, over time.
pub fn write_pvd(entries: &[CollectionEntry], out: &mut dyn Write) -> io::Result<()> {
    writeln!(out, r#"<?xml version="1.0"?>"#)?;
    writeln!(out, r#"<VTKFile type="Collection" version="1.0">"#)?;
    writeln!(out, "  <Collection>")?;
    for CollectionEntry { time, part, name, file } in entries {
        let (file, name) = (escape(file), escape(name));
        writeln!(out, r#"    <DataSet timestep="{time}" group="" part="{part}" name="{name}" file="{file}"/>"#)?;
    }
    writeln!(out, "  </Collection>")?;
    writeln!(out, "</VTKFile>")
}

/// Escape a text for the value of an XML attribute.
fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
}

/// Names of the components of arrays that have several.
const COMPONENTS: [(&str, &[&str]); 4] = [
    ("displacement", &["x", "y", "z"]),
    ("stress", &["xx", "yy", "zz", "xy", "yz", "xz"]),
    ("principal", &["first", "second", "third"]),
    ("normal", &["x", "y", "z"]),
];

/// A writer that passes all bytes on, adds the names of components to the tags of arrays, and keeps the first failure.
///
/// vtkio 0.7.0-rc2 writes no such names. It also ignores short writes and failures of its last flush, which on a full disk would
/// leave half a file without an error.
struct TagWriter<'a> {
    out: &'a mut dyn Write,
    /// Bytes of the current tag from its `<` on, none outside of tags.
    tag: Option<Vec<u8>>,
    failure: Option<io::Error>,
}

impl<'a> TagWriter<'a> {
    /// Return a writer that passes its bytes on to `out`.
    pub fn new(out: &'a mut dyn Write) -> Self {
        Self { out, tag: None, failure: None }
    }

    /// Return the first failure.
    pub fn failure(self) -> Option<io::Error> {
        self.failure
    }

    /// Pass bytes on, with names in the tags. Base64 has no `<`, so every `<` begins a tag that ends at the next `>`.
    fn pass(&mut self, mut bytes: &[u8]) -> io::Result<()> {
        while !bytes.is_empty() {
            let end = if self.tag.is_some() { b'>' } else { b'<' };
            let at = bytes.iter().position(|&byte| byte == end);
            let (head, rest) = bytes.split_at(at.unwrap_or(bytes.len()));
            bytes = rest;
            match &mut self.tag {
                Some(tag) => tag.extend_from_slice(head),
                None => self.out.write_all(head)?,
            }
            match (at, self.tag.take()) {
                (Some(_), None) => self.tag = Some(Vec::new()),
                (Some(_), Some(tag)) => self.out.write_all(&with_component_names(&tag))?,
                (None, tag) => self.tag = tag,
            }
        }
        Ok(())
    }
}

/// Return a tag; that of an array gets the names of its components after the name of the array.
fn with_component_names(tag: &[u8]) -> Vec<u8> {
    let mut text = String::from_utf8_lossy(tag).into_owned();
    for (array, components) in COMPONENTS {
        let name = format!(" Name=\"{array}\"");
        let is_array = text.starts_with("<DataArray ") || text.starts_with("<PDataArray ");
        if let Some(at) = text.find(&name).filter(|_| is_array) {
            let names =
                components.iter().enumerate().map(|(i, component)| format!(" ComponentName{i}=\"{component}\""));
            text.insert_str(at + name.len(), &names.collect::<String>());
        }
    }
    text.into_bytes()
}

impl Write for TagWriter<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.failure.is_none() {
            self.failure = self.pass(bytes).err();
        }
        match &self.failure {
            None => Ok(bytes.len()),
            Some(failure) => Err(failure.kind().into()),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}

/// The entities, points and cells of earlier files. Tags go on from there, so that Gmsh can open the files of a run together.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Tags {
    /// Files before this one.
    pub entity: usize,
    /// Points in them.
    pub points: usize,
    /// Cells in them.
    pub cells: usize,
}

impl UnstructuredGrid {
    /// Write the grid as `.msh`. Its cells are a physical group with the title as name, and each array at its points becomes a
    /// view `title: name`. Symmetric tensors become full ones. Nodes with a NaN are left out of a view.
    pub fn write_msh(&self, tags: Tags, out: &mut dyn Write) -> io::Result<()> {
        let (_, _, dimension, _) = self.cell.facts();
        let tag = tags.entity as i32 + 1;
        let name = self.title.replace('"', "'");
        write!(out, "$MeshFormat\n4.1 1 8\n")?;
        write_i32(out, &[1])?;
        write!(out, "\n$EndMeshFormat\n$PhysicalNames\n1\n{dimension} {tag} \"{name}\"\n$EndPhysicalNames\n")?;
        self.write_entity(tag, out)?;
        self.write_nodes(tag, tags, out)?;
        self.write_elements(tag, tags, out)?;
        // principal stresses are no vector
        for (array, components, values) in self.at_points.iter().filter(|(array, ..)| array != "principal") {
            write_view(&format!("{name}: {array}"), *components as usize, values, tags.points + 1, out)?;
        }
        Ok(())
    }

    /// Write the one entity that has all cells, with its bounding box and its physical group.
    fn write_entity(&self, tag: i32, out: &mut dyn Write) -> io::Result<()> {
        let (_, _, dimension, _) = self.cell.facts();
        let corner = |pick: fn(f64, f64) -> f64| -> [f64; 3] {
            std::array::from_fn(|k| self.points.iter().map(|x| x[k]).reduce(pick).unwrap_or(0.0))
        };
        writeln!(out, "$Entities")?;
        write_u64(out, &[0, 1, 2, 3].map(|other| usize::from(other == dimension)))?;
        write_i32(out, &[tag])?;
        write_f64(out, [corner(f64::min), corner(f64::max)].as_flattened())?;
        write_u64(out, &[1])?;
        write_i32(out, &[tag])?;
        write_u64(out, &[0])?;
        write!(out, "\n$EndEntities\n")
    }

    fn write_nodes(&self, tag: i32, tags: Tags, out: &mut dyn Write) -> io::Result<()> {
        let (_, _, dimension, _) = self.cell.facts();
        let (count, first) = (self.points.len(), tags.points + 1);
        writeln!(out, "$Nodes")?;
        write_u64(out, &[1, count, first, tags.points + count])?;
        write_i32(out, &[dimension, tag, 0])?;
        write_u64(out, &[count])?;
        write_u64(out, &(first..first + count).collect::<Vec<_>>())?;
        write_f64(out, self.points.as_flattened())?;
        write!(out, "\n$EndNodes\n")
    }

    fn write_elements(&self, tag: i32, tags: Tags, out: &mut dyn Write) -> io::Result<()> {
        let (_, _, dimension, kind) = self.cell.facts();
        let cells = self.connectivity.chunks_exact(self.cell.stride());
        writeln!(out, "$Elements")?;
        write_u64(out, &[1, cells.len(), tags.cells + 1, tags.cells + cells.len()])?;
        write_i32(out, &[dimension, tag, kind])?;
        write_u64(out, &[cells.len()])?;
        for (number, cell) in cells.enumerate() {
            let mut line = vec![tags.cells + 1 + number];
            line.extend(cell.iter().map(|&point| tags.points + 1 + point as usize));
            if self.cell == CellKind::QuadraticTetra {
                // Gmsh has the mid-edge 23 before 13
                line.swap(9, 10);
            }
            write_u64(out, &line)?;
        }
        write!(out, "\n$EndElements\n")
    }
}

/// Write a view of the values at the points, `components` per point; the first point has the tag `first`.
fn write_view(name: &str, components: usize, values: &[f64], first: usize, out: &mut dyn Write) -> io::Result<()> {
    // xx yy zz xy yz xz to the rows of a tensor
    const TENSOR: [usize; 9] = [0, 3, 5, 3, 1, 4, 5, 4, 2];
    let width = if components == 6 { TENSOR.len() } else { components };
    let has_value = |(_, value): &(usize, &[f64])| value.iter().all(|x| !x.is_nan());
    let points = || values.chunks_exact(components).enumerate().filter(has_value);
    write!(out, "$NodeData\n1\n\"{name}\"\n1\n0\n3\n0\n{width}\n{}\n", points().count())?;
    for (point, value) in points() {
        write_i32(out, &[(first + point) as i32])?;
        match components {
            6 => write_f64(out, &TENSOR.map(|place| value[place]))?,
            _ => write_f64(out, value)?,
        }
    }
    write!(out, "\n$EndNodeData\n")
}

fn write_i32(out: &mut dyn Write, numbers: &[i32]) -> io::Result<()> {
    numbers.iter().try_for_each(|number| out.write_all(&number.to_ne_bytes()))
}

/// Write sizes and tags, which have 8 bytes in the format.
fn write_u64(out: &mut dyn Write, numbers: &[usize]) -> io::Result<()> {
    numbers.iter().try_for_each(|number| out.write_all(&(*number as u64).to_ne_bytes()))
}

fn write_f64(out: &mut dyn Write, numbers: &[f64]) -> io::Result<()> {
    numbers.iter().try_for_each(|number| out.write_all(&number.to_ne_bytes()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use vtkio::model::Piece;

    /// One cell of a kind, with a different value in every place.
    fn body(cell: CellKind) -> BodyField {
        let n = cell.stride();
        let number = |base: f64, i: usize, c: usize| base + i as f64 + c as f64 / 7.0;
        BodyField {
            name: "upper".into(),
            points: (0..n).map(|i| std::array::from_fn(|c| number(0.0, i, c))).collect(),
            cell,
            connectivity: (0..n as u32).rev().collect(),
            displacement: (0..n).map(|i| std::array::from_fn(|c| number(-100.0, i, c))).collect(),
            stress: (0..n).map(|i| std::array::from_fn(|c| number(1e9, i, c))).collect(),
            von_mises: (0..n).map(|i| number(1e-9, i, 0)).collect(),
            largest: None,
            principal: (0..n).map(|i| std::array::from_fn(|c| number(-1e9, i, c))).collect(),
        }
    }

    /// The grid of a file.
    fn read(bytes: &[u8]) -> UnstructuredGridPiece {
        let DataSet::UnstructuredGrid { mut pieces, .. } = Vtk::parse_xml(bytes).unwrap().data else {
            panic!("not an unstructured grid")
        };
        let (Some(Piece::Inline(piece)), true) = (pieces.pop(), pieces.is_empty()) else { panic!("not one piece") };
        *piece
    }

    #[test]
    fn every_value_reads_back() {
        for (cell, code) in [
            (CellKind::Line, CellType::Line),
            (CellKind::QuadraticLine, CellType::QuadraticEdge),
            (CellKind::Triangle, CellType::Triangle),
            (CellKind::QuadraticTriangle, CellType::QuadraticTriangle),
            (CellKind::Tetra, CellType::Tetra),
            (CellKind::QuadraticTetra, CellType::QuadraticTetra),
        ] {
            let encoding = Encoding { single: false, compress: cell.stride() % 2 == 0 };
            let body = body(cell);
            let mut bytes = Vec::new();
            body.clone().write(encoding, &mut bytes).unwrap();
            let piece = read(&bytes);
            let points: IOBuffer = body.points.into_flattened().into();
            assert_eq!(piece.points, points);
            assert_eq!(piece.cells.types, [code]);
            let (connectivity, offsets) = piece.cells.cell_verts.clone().into_xml();
            let expected: Vec<u64> = body.connectivity.iter().map(|&p| p.into()).collect();
            assert_eq!(connectivity, expected);
            assert_eq!(offsets, [cell.stride() as u64]);
            let read: Vec<_> = piece
                .data
                .point
                .iter()
                .map(|attribute| match attribute {
                    Attribute::DataArray(array) => {
                        (array.name.as_str(), array.num_comp(), array.data.cast_into::<f64>())
                    }
                    Attribute::Field { .. } => panic!("a field"),
                })
                .collect();
            assert_eq!(
                read,
                [
                    ("displacement", 3, Some(body.displacement.into_flattened())),
                    ("stress", 6, Some(body.stress.into_flattened())),
                    ("von_mises", 1, Some(body.von_mises)),
                    ("principal", 3, Some(body.principal.into_flattened())),
                ]
            );
        }
    }

    /// Blocks of 32 KiB, full ones among them, in both precisions; other programs have read such files.
    #[test]
    fn long_arrays_read_back_whatever_their_encoding() {
        for points in [4096, 5000, 8192] {
            let value = |i: usize| (i as f64).sin();
            let grid = || UnstructuredGrid {
                title: String::new(),
                points: (0..points).map(|i| [value(i), value(i + 1), 0.0]).collect(),
                cell: CellKind::Line,
                connectivity: (0..points as u32).collect(),
                at_points: vec![("stress".to_owned(), 6, (0..6 * points).map(value).collect())],
                at_cells: Vec::new(),
            };
            let mut sizes = Vec::new();
            for (single, compress) in [(false, false), (false, true), (true, false), (true, true)] {
                let mut bytes = Vec::new();
                grid().write(Encoding { single, compress }, &mut bytes).unwrap();
                sizes.push(bytes.len());
                let text = String::from_utf8_lossy(&bytes);
                assert_eq!(text.contains("vtkZLibDataCompressor"), compress);
                let tag = text.split("<DataArray ").find(|tag| tag.contains("\"stress\"")).unwrap();
                let tag = tag.split('>').next().unwrap();
                for (i, name) in ["xx", "yy", "zz", "xy", "yz", "xz"].iter().enumerate() {
                    assert!(tag.contains(&format!(" ComponentName{i}=\"{name}\"")), "{tag}");
                }
                let piece = read(&bytes);
                let Attribute::DataArray(stress) = &piece.data.point[0] else { panic!("a field") };
                assert_eq!((stress.num_comp(), matches!(stress.data, IOBuffer::F32(_))), (6, single));
                let read: Vec<f64> = stress.data.cast_into().unwrap();
                let size = if single { 1e-7 } else { 0.0 };
                assert!(read.iter().enumerate().all(|(i, x)| (x - value(i)).abs() <= size) && read.len() == 6 * points);
            }
            assert!(sizes[1] < sizes[0] && sizes[3] < sizes[2] && sizes[2] < sizes[1], "{sizes:?}");
        }
    }

    /// A writer that takes a few bytes at a time, and no more than it has room for.
    struct Disk(usize);

    impl Write for Disk {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            if self.0 == 0 {
                return Err(io::ErrorKind::StorageFull.into());
            }
            let taken = bytes.len().min(7).min(self.0);
            self.0 -= taken;
            Ok(taken)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_full_disk_is_an_error() {
        let mut bytes = Vec::new();
        body(CellKind::Tetra).write(Encoding::default(), &mut bytes).unwrap();
        for room in [0, 50, bytes.len() / 2, bytes.len() - 1] {
            let error = body(CellKind::Tetra).write(Encoding::default(), &mut Disk(room)).unwrap_err();
            assert_eq!(error.kind(), io::ErrorKind::StorageFull, "{room} of {}", bytes.len());
        }
        body(CellKind::Tetra).write(Encoding::default(), &mut Disk(bytes.len())).unwrap();
    }

    #[test]
    fn the_collection_names_every_body() {
        let mut bytes = Vec::new();
        let piece = |(part, name, file): (usize, &'static str, &str)| CollectionEntry {
            time: 0.5,
            part,
            name,
            file: file.into(),
        };
        let entries: Vec<_> = [(0, "upper", "upper.vtu"), (1, "a<b", "a_b.vtu")].into_iter().map(piece).collect();
        write_pvd(&entries, &mut bytes).unwrap();
        let text = String::from_utf8(bytes).unwrap();
        assert!(text.contains(r#"timestep="0.5" group="" part="0" name="upper" file="upper.vtu""#));
        assert!(text.contains(r#"part="1" name="a&lt;b" file="a_b.vtu""#), "{text}");
    }
}
