//! Files for ParaView: `.vtu` with the numbers behind the XML as raw bytes, `.pvtu`, which joins the parts of ranks,
//! and `.pvd`, a collection over time.

use super::escape;
use super::fields::{BodyField, FieldArray, UnstructuredGrid};
use super::folder::MARK;
use std::io::{self, Write};

/// A function that writes to a file.
type Writing<'a> = dyn Fn(&mut dyn Write) -> io::Result<()> + 'a;

/// The numbers of an array as they stand in a file: the name of their type, the number of their bytes, and how they are
/// written.
struct Block<'a> {
    kind: &'static str,
    bytes: usize,
    write: Box<Writing<'a>>,
}

/// Return a block of so many numbers, given by their bytes.
fn block<'a, const N: usize>(kind: &'static str, count: usize, number: impl Fn(usize) -> [u8; N] + 'a) -> Block<'a> {
    let write = move |out: &mut dyn Write| (0..count).try_for_each(|k| out.write_all(&number(k)));
    Block { kind, bytes: N * count, write: Box::new(write) }
}

/// Return a block of real numbers, with four bytes a number if `single`.
fn reals(values: &[f64], single: bool) -> Block<'_> {
    if single {
        block("Float32", values.len(), move |k| (values[k] as f32).to_le_bytes())
    } else {
        block("Float64", values.len(), move |k| values[k].to_le_bytes())
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
        let (kind, offset, attributes) = (block.kind, self.offset, attributes(name, components));
        writeln!(self.out, r#"<DataArray type="{kind}"{attributes} format="appended" offset="{offset}"/>"#)?;
        // a block begins with the number of its bytes, eight bytes of its own
        self.offset += 8 + block.bytes;
        self.blocks.push(block);
        Ok(())
    }

    fn arrays(&mut self, element: &str, arrays: &'a [FieldArray], single: bool) -> io::Result<()> {
        writeln!(self.out, "<{element}>")?;
        for FieldArray { name, components, values } in arrays {
            self.array(name, *components, reals(values, single))?;
        }
        writeln!(self.out, "</{element}>")
    }
}

impl UnstructuredGrid {
    /// Write the grid for ParaView, with four bytes a number if `single` and eight otherwise. Arrays must fit the
    /// points and cells.
    pub fn write(&self, single: bool, out: &mut dyn Write) -> io::Result<()> {
        let (stride, cells) = (self.cell.stride(), self.connectivity.len() / self.cell.stride());
        let points = self.points.len();
        begin("UnstructuredGrid", out)?;
        writeln!(out, "<UnstructuredGrid>\n<Piece NumberOfPoints=\"{points}\" NumberOfCells=\"{cells}\">\n<Points>")?;
        let mut document = Document { out, blocks: Vec::new(), offset: 0 };
        document.array("Points", 3, reals(self.points.as_flattened(), single))?;
        writeln!(document.out, "</Points>\n<Cells>")?;
        let nodes = &self.connectivity;
        document.array("connectivity", 1, block("UInt32", nodes.len(), |k| nodes[k].to_le_bytes()))?;
        document.array("offsets", 1, block("Int64", cells, move |k| ((k + 1) * stride).to_le_bytes()))?;
        document.array("types", 1, block("UInt8", cells, |_| [self.cell.vtk()]))?;
        writeln!(document.out, "</Cells>")?;
        document.arrays("PointData", &self.at_points, single)?;
        document.arrays("CellData", &self.at_cells, single)?;
        let Document { out, blocks, .. } = document;
        write!(out, "</Piece>\n</UnstructuredGrid>\n<AppendedData encoding=\"raw\">\n_")?;
        for Block { bytes, write, .. } in &blocks {
            out.write_all(&(*bytes as u64).to_le_bytes())?;
            write(out)?;
        }
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
    writeln!(out, "<?xml version=\"1.0\"?>\n<!-- {MARK} -->\n<VTKFile type=\"{kind}\" {format}>")
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::CellKind;

    #[test]
    fn arrays_lie_where_their_offsets_say() {
        let grid = UnstructuredGrid {
            title: String::new(),
            points: vec![[0.5, 1.0, 0.0], [2.0, 3.0, 0.25]],
            cell: CellKind { dimension: 1, order: 1 },
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
