//! Files for ParaView: `.vtu` with the numbers behind the XML as raw bytes, `.pvtu`, which joins the parts of ranks, and `.pvd`, a collection over time.

use super::fields::{BodyField, FieldArray, UnstructuredGrid};
use std::io::{self, Write};

/// The numbers of an array as they stand in a file. A block begins with the number of its bytes, eight bytes of its own.
enum Block<'a> {
    Reals {
        values: &'a [f64],
        single: bool,
    },
    Points(&'a [u32]),
    /// Ends of cells with this number of points each.
    Ends {
        cells: usize,
        stride: usize,
    },
    Kinds {
        cells: usize,
        kind: u8,
    },
}

impl Block<'_> {
    /// Return the name of the type of the numbers, and the number of bytes of all.
    fn format(&self) -> (&'static str, usize) {
        match *self {
            Block::Reals { values, single: false } => ("Float64", 8 * values.len()),
            Block::Reals { values, single: true } => ("Float32", 4 * values.len()),
            Block::Points(points) => ("UInt32", 4 * points.len()),
            Block::Ends { cells, .. } => ("Int64", 8 * cells),
            Block::Kinds { cells, .. } => ("UInt8", cells),
        }
    }

    fn write(&self, out: &mut dyn Write) -> io::Result<()> {
        out.write_all(&(self.format().1 as u64).to_le_bytes())?;
        match *self {
            Block::Reals { values, single: false } => values.iter().try_for_each(|x| out.write_all(&x.to_le_bytes())),
            Block::Reals { values, single: true } => {
                values.iter().try_for_each(|&x| out.write_all(&(x as f32).to_le_bytes()))
            }
            Block::Points(points) => points.iter().try_for_each(|point| out.write_all(&point.to_le_bytes())),
            Block::Ends { cells, stride } => {
                (1..=cells).try_for_each(|cell| out.write_all(&((cell * stride) as i64).to_le_bytes()))
            }
            Block::Kinds { cells, kind } => out.write_all(&vec![kind; cells]),
        }
    }
}

/// The XML of a file, whose arrays point to blocks that follow it.
struct Document<'a> {
    out: &'a mut dyn Write,
    blocks: Vec<Block<'a>>,
    /// Place of the next block behind the first.
    offset: usize,
}

impl<'a> Document<'a> {
    fn array(&mut self, name: &str, components: usize, block: Block<'a>) -> io::Result<()> {
        let (kind, bytes) = block.format();
        let offset = self.offset;
        let attributes = attributes(name, components);
        writeln!(self.out, r#"<DataArray type="{kind}"{attributes} format="appended" offset="{offset}"/>"#)?;
        self.offset += 8 + bytes;
        self.blocks.push(block);
        Ok(())
    }

    fn arrays(&mut self, element: &str, arrays: &'a [FieldArray], single: bool) -> io::Result<()> {
        writeln!(self.out, "<{element}>")?;
        for FieldArray { name, components, values } in arrays {
            self.array(name, *components, Block::Reals { values, single })?;
        }
        writeln!(self.out, "</{element}>")
    }
}

impl UnstructuredGrid {
    /// Write the grid for ParaView, with four bytes a number if `single` and eight otherwise. Arrays must fit the points and cells.
    pub fn write(&self, single: bool, out: &mut dyn Write) -> io::Result<()> {
        let (stride, cells) = (self.cell.stride(), self.connectivity.len() / self.cell.stride());
        let points = self.points.len();
        begin("UnstructuredGrid", out)?;
        writeln!(out, "<UnstructuredGrid>\n<Piece NumberOfPoints=\"{points}\" NumberOfCells=\"{cells}\">\n<Points>")?;
        let mut document = Document { out, blocks: Vec::new(), offset: 0 };
        document.array("Points", 3, Block::Reals { values: self.points.as_flattened(), single })?;
        writeln!(document.out, "</Points>\n<Cells>")?;
        document.array("connectivity", 1, Block::Points(&self.connectivity))?;
        document.array("offsets", 1, Block::Ends { cells, stride })?;
        document.array("types", 1, Block::Kinds { cells, kind: self.cell.vtk() })?;
        writeln!(document.out, "</Cells>")?;
        document.arrays("PointData", &self.at_points, single)?;
        document.arrays("CellData", &self.at_cells, single)?;
        let Document { out, blocks, .. } = document;
        write!(out, "</Piece>\n</UnstructuredGrid>\n<AppendedData encoding=\"raw\">\n_")?;
        blocks.iter().try_for_each(|block| block.write(out))?;
        writeln!(out, "\n</AppendedData>\n</VTKFile>")
    }
}

/// Write the `.pvtu` file that joins the parts of a body in `files` of the same folder.
pub fn join(files: &[String], single: bool, out: &mut dyn Write) -> io::Result<()> {
    let kind = if single { "Float32" } else { "Float64" };
    begin("PUnstructuredGrid", out)?;
    writeln!(out, "<PUnstructuredGrid GhostLevel=\"0\">\n<PPointData>")?;
    for (name, components) in BodyField::ARRAYS {
        writeln!(out, r#"<PDataArray type="{kind}"{}/>"#, attributes(name, components))?;
    }
    writeln!(out, "</PPointData>\n<PPoints>\n<PDataArray type=\"{kind}\"{}/>\n</PPoints>", attributes("Points", 3))?;
    for file in files {
        writeln!(out, "<Piece Source=\"{}\"/>", escape(file))?;
    }
    writeln!(out, "</PUnstructuredGrid>\n</VTKFile>")
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
    begin("Collection", out)?;
    writeln!(out, "  <Collection>")?;
    for CollectionEntry { time, part, name, file } in entries {
        let (file, name) = (escape(file), escape(name));
        writeln!(out, r#"    <DataSet timestep="{time}" group="" part="{part}" name="{name}" file="{file}"/>"#)?;
    }
    writeln!(out, "  </Collection>\n</VTKFile>")
}

fn begin(kind: &str, out: &mut dyn Write) -> io::Result<()> {
    let format = r#"version="1.0" byte_order="LittleEndian" header_type="UInt64""#;
    writeln!(out, "<?xml version=\"1.0\"?>\n<VTKFile type=\"{kind}\" {format}>")
}

/// Return the attributes of an array: its name, the number of its components and their names.
fn attributes(name: &str, components: usize) -> String {
    let names: &[&str] = match name {
        "displacement" | "normal" => &["x", "y", "z"],
        "stress" => &["xx", "yy", "zz", "xy", "yz", "xz"],
        "principal" => &["first", "second", "third"],
        _ => &[],
    };
    let names: String = names.iter().enumerate().map(|(i, name)| format!(" ComponentName{i}=\"{name}\"")).collect();
    format!(" Name=\"{}\" NumberOfComponents=\"{components}\"{names}", escape(name))
}

/// Escape a text for the value of an XML attribute.
fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::CellKind;

    #[test]
    fn arrays_lie_where_their_offsets_say() {
        let grid = UnstructuredGrid {
            title: String::new(),
            points: vec![[0.5, 1.0, 0.0], [2.0, 3.0, 0.25]],
            cell: CellKind::Line,
            connectivity: vec![1, 0],
            at_points: vec![FieldArray::new("stress", 6, (0..12).map(f64::from).collect())],
            at_cells: Vec::new(),
        };
        for (single, width) in [(false, 8), (true, 4)] {
            let mut bytes = Vec::new();
            grid.write(single, &mut bytes).unwrap();
            let marker = b"\"raw\">\n_";
            let begin = bytes.windows(marker.len()).position(|part| part == marker).unwrap() + marker.len();
            let text = String::from_utf8_lossy(&bytes[..begin]);
            let tag = text.lines().find(|line| line.contains("\"stress\"")).unwrap();
            assert!(tag.contains(" ComponentName3=\"xy\""), "{tag}");
            let offset: usize = tag.split("offset=\"").nth(1).unwrap().split('"').next().unwrap().parse().unwrap();
            let block = &bytes[begin + offset..];
            assert_eq!(block[..8], (12 * width as u64).to_le_bytes());
            let last = &block[8 + 11 * width..8 + 12 * width];
            assert_eq!(last, if single { 11f32.to_le_bytes().to_vec() } else { 11f64.to_le_bytes().to_vec() });
            assert!(block[8 + 12 * width..].starts_with(b"\n</AppendedData>"));
        }
    }

    #[test]
    fn the_collection_names_every_body() {
        let mut bytes = Vec::new();
        write_pvd(&[CollectionEntry { time: 0.5, part: 1, name: "a<b", file: "a_b.vtu".into() }], &mut bytes).unwrap();
        let text = String::from_utf8(bytes).unwrap();
        assert!(text.contains(r#"timestep="0.5" group="" part="1" name="a&lt;b" file="a_b.vtu""#), "{text}");
    }
}
