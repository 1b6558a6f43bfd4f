//! `<body>.vtu`: meshes and fields for ParaView.

use super::collection::escape;
use super::tags::TagWriter;
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
        match self {
            CellKind::Line => 2,
            CellKind::QuadraticLine => 3,
            CellKind::Triangle => 3,
            CellKind::QuadraticTriangle => 6,
            CellKind::Tetra => 4,
            CellKind::QuadraticTetra => 10,
        }
    }

    /// Return the type of a cell in VTK.
    fn vtk(self) -> CellType {
        match self {
            CellKind::Line => CellType::Line,
            CellKind::QuadraticLine => CellType::QuadraticEdge,
            CellKind::Triangle => CellType::Triangle,
            CellKind::QuadraticTriangle => CellType::QuadraticTriangle,
            CellKind::Tetra => CellType::Tetra,
            CellKind::QuadraticTetra => CellType::QuadraticTetra,
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
    /// Point numbers, [`CellKind::stride`] per cell.
    pub connectivity: Vec<u32>,
    /// Displacement at each point.
    pub displacement: Vec<[f64; 3]>,
    /// Stress at each point in ParaView's order XX YY ZZ XY YZ XZ.
    pub stress: Vec<[f64; 6]>,
    /// Von Mises stress at each point.
    pub von_mises: Vec<f64>,
    /// Principal stresses at each point, the largest first.
    pub principal: Vec<[f64; 3]>,
}

impl BodyField {
    /// Names of the arrays at the points and numbers of their components, in the order of the files.
    const ARRAYS: [(&'static str, u32); 4] = [("displacement", 3), ("stress", 6), ("von_mises", 1), ("principal", 3)];

    /// Write VTK's XML format with binary (base64) data and the point arrays `displacement` (3 components), `stress` (6),
    /// `von_mises` (1) and `principal` (3).
    ///
    /// # Errors
    /// Those of `out`.
    pub fn write(self, encoding: Encoding, out: &mut dyn Write) -> io::Result<()> {
        self.into_grid().write(encoding, out)
    }

    /// Return the field as a grid with the arrays that [`Self::write`] names.
    pub fn into_grid(self) -> Grid {
        let (displacement, stress) = (self.displacement.into_flattened(), self.stress.into_flattened());
        let values = [displacement, stress, self.von_mises, self.principal.into_flattened()];
        let arrays = Self::ARRAYS.into_iter().zip(values);
        Grid {
            title: self.name,
            points: self.points,
            cell: self.cell,
            connectivity: self.connectivity,
            at_points: arrays.map(|((name, components), values)| (name.to_owned(), components, values)).collect(),
            at_cells: Vec::new(),
        }
    }

    /// Write the `.pvtu` file that joins the parts of a body in `files` of the same folder.
    ///
    /// # Errors
    /// Those of `out`.
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
pub struct Grid {
    /// Title in the file.
    pub title: String,
    /// Points.
    pub points: Vec<[f64; 3]>,
    /// Kind of all cells.
    pub cell: CellKind,
    /// Point numbers, [`CellKind::stride`] per cell.
    pub connectivity: Vec<u32>,
    /// Arrays at the points: name, components, values.
    pub at_points: Vec<(String, u32, Vec<f64>)>,
    /// Arrays at the cells: name, components, values.
    pub at_cells: Vec<(String, u32, Vec<f64>)>,
}

impl Grid {
    /// Write VTK's XML format with binary (base64) data. Arrays must fit the points and cells.
    ///
    /// # Errors
    /// Those of `out`.
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
                types: vec![self.cell.vtk(); cells],
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
            let grid = || Grid {
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
}
