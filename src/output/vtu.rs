//! `<body>.vtu` and the `.pvd` that gathers them, for ParaView.

use super::folder::safe_name;
use std::io::{self, Write};
use vtkio::model::{
    Attribute, Attributes, ByteOrder, CellType, Cells, DataArray, DataSet, ElementType, UnstructuredGridPiece, Version,
    VertexNumbers, Vtk,
};

/// Kind of the cells of a body; local numbering of the points is VTK's.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
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
    /// Kind of the simplices of a dimension (2 or 3) and order (1 or 2).
    pub fn simplex(dimension: usize, order: usize) -> Self {
        match (dimension, order) {
            (2, 1) => CellKind::Triangle,
            (2, _) => CellKind::QuadraticTriangle,
            (_, 1) => CellKind::Tetra,
            (_, _) => CellKind::QuadraticTetra,
        }
    }

    /// Points per cell.
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
    /// Writes VTK's XML format with binary (base64) data: point arrays `displacement` (3 components), `stress` (6),
    /// `von_mises` (1) and `principal` (3).
    ///
    /// # Errors
    /// Those of `out`, and `InvalidInput` when the arrays do not fit each other.
    pub fn write(self, out: &mut dyn Write) -> io::Result<()> {
        self.check().map_err(|what| io::Error::new(io::ErrorKind::InvalidInput, what))?;
        let grid = Grid {
            title: self.name,
            points: self.points,
            cell: self.cell,
            connectivity: self.connectivity,
            at_points: vec![
                ("displacement".to_owned(), 3, self.displacement.into_flattened()),
                ("stress".to_owned(), 6, self.stress.into_flattened()),
                ("von_mises".to_owned(), 1, self.von_mises),
                ("principal".to_owned(), 3, self.principal.into_flattened()),
            ],
            at_cells: Vec::new(),
        };
        grid.write(out)
    }

    /// Says what does not fit: ParaView would crash on it, or show another body's values.
    fn check(&self) -> Result<(), String> {
        let points = self.points.len();
        let lengths = [self.displacement.len(), self.stress.len(), self.von_mises.len(), self.principal.len()];
        if lengths != [points; 4] {
            return Err(format!("body `{}`: {points} points, {lengths:?} values", self.name));
        }
        if !self.connectivity.len().is_multiple_of(self.cell.stride()) {
            return Err(format!("body `{}`: the last cell is not complete", self.name));
        }
        match self.connectivity.iter().max() {
            Some(&last) if last as usize >= points => {
                Err(format!("body `{}`: a cell has point {last} of {points}", self.name))
            }
            _ => Ok(()),
        }
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
    /// Writes VTK's XML format with binary (base64) data. Arrays must fit the points and cells.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn write(self, out: &mut dyn Write) -> io::Result<()> {
        let stride = self.cell.stride();
        let cells = self.connectivity.len() / stride;
        let arrays = |list: Vec<(String, u32, Vec<f64>)>| {
            let array = |(name, components, data): (String, u32, Vec<f64>)| {
                Attribute::DataArray(DataArray { name, elem: ElementType::Generic(components), data: data.into() })
            };
            list.into_iter().map(array).collect()
        };
        let piece = UnstructuredGridPiece {
            points: self.points.into_flattened().into(),
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
        let mut whole = Whole { out, failure: None };
        let written = vtk.write_xml(&mut whole);
        match whole.failure {
            Some(failure) => Err(failure),
            None => written.map_err(io::Error::other),
        }
    }
}

/// Passes all bytes on and keeps the first failure: vtkio 0.7.0-rc2 ignores short writes, and failures of its last
/// flush, which on a full disk would leave half a file without a word.
struct Whole<'a> {
    out: &'a mut dyn Write,
    failure: Option<io::Error>,
}

impl Write for Whole<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.failure.is_none() {
            self.failure = self.out.write_all(bytes).err();
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

/// `<title>.pvd`, safe as a file name; `bodies.pvd` without a title.
pub fn pvd_name(title: &str) -> String {
    let title = title.trim();
    format!("{}.pvd", if title.is_empty() { "bodies".into() } else { safe_name(title) })
}

/// A file of a collection: a body or a contact surface at a time.
pub struct Entry<'a> {
    /// Time.
    pub time: f64,
    /// Number of the body or surface.
    pub part: usize,
    /// Its name.
    pub name: &'a str,
    /// File, relative to the collection.
    pub file: String,
}

/// Writes the collection that opens the `.vtu` files of all bodies and contact surfaces at once, over time.
///
/// # Errors
/// Those of `out`.
pub fn write_pvd(entries: &[Entry], out: &mut dyn Write) -> io::Result<()> {
    writeln!(out, r#"<?xml version="1.0"?>"#)?;
    writeln!(out, r#"<VTKFile type="Collection" version="1.0">"#)?;
    writeln!(out, "  <Collection>")?;
    for Entry { time, part, name, file } in entries {
        let (file, name) = (escape(file), escape(name));
        writeln!(out, r#"    <DataSet timestep="{time}" group="" part="{part}" name="{name}" file="{file}"/>"#)?;
    }
    writeln!(out, "  </Collection>")?;
    writeln!(out, "</VTKFile>")
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;
    use vtkio::model::{IOBuffer, Piece};

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
            let body = body(cell);
            let mut bytes = Vec::new();
            body.clone().write(&mut bytes).unwrap();
            let DataSet::UnstructuredGrid { pieces, .. } = Vtk::parse_xml(bytes.as_slice()).unwrap().data else {
                panic!("not an unstructured grid")
            };
            let [Piece::Inline(piece)] = &pieces[..] else { panic!("not one piece") };
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

    #[test]
    fn arrays_that_do_not_fit_are_refused() {
        let mut short = body(CellKind::Tetra);
        short.stress.pop();
        let mut cut = body(CellKind::Tetra);
        cut.connectivity.pop();
        let mut wild = body(CellKind::Tetra);
        wild.connectivity[2] = 4;
        let mut few = body(CellKind::Tetra);
        few.principal.pop();
        for bad in [short, cut, wild, few] {
            let error = bad.write(&mut Vec::new()).unwrap_err();
            assert_eq!(error.kind(), io::ErrorKind::InvalidInput);
        }
    }

    /// Takes a few bytes at a time, and no more than it has room for.
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
        body(CellKind::Tetra).write(&mut bytes).unwrap();
        for room in [0, 50, bytes.len() / 2, bytes.len() - 1] {
            let error = body(CellKind::Tetra).write(&mut Disk(room)).unwrap_err();
            assert_eq!(error.kind(), io::ErrorKind::StorageFull, "{room} of {}", bytes.len());
        }
        body(CellKind::Tetra).write(&mut Disk(bytes.len())).unwrap();
    }

    #[test]
    fn the_collection_names_every_body() {
        let mut bytes = Vec::new();
        let piece =
            |(part, name, file): (usize, &'static str, &str)| Entry { time: 0.5, part, name, file: file.into() };
        let entries: Vec<_> = [(0, "upper", "upper.vtu"), (1, "a<b", "a_b.vtu")].into_iter().map(piece).collect();
        write_pvd(&entries, &mut bytes).unwrap();
        let text = String::from_utf8(bytes).unwrap();
        assert!(text.contains(r#"timestep="0.5" group="" part="0" name="upper" file="upper.vtu""#));
        assert!(text.contains(r#"part="1" name="a&lt;b" file="a_b.vtu""#), "{text}");
        assert_eq!(pvd_name("Two blocks / a"), "Two_blocks___a.pvd");
        assert_eq!(pvd_name(" "), "bodies.pvd");
    }
}
