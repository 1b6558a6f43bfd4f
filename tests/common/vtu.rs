//! Reading of `.vtu` files.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// A grid: points and arrays by their names, all numbers of a point or cell together.
pub struct Grid {
    pub points: Vec<f64>,
    pub arrays: BTreeMap<String, Vec<f64>>,
    /// Numbers of components of the arrays.
    pub components: BTreeMap<String, usize>,
    /// The point numbers of each cell.
    pub cells: Vec<Vec<usize>>,
    /// The types of the cells in VTK.
    pub types: Vec<u8>,
}

/// The value of an attribute of a tag.
pub fn attribute<'a>(tag: &'a str, name: &str) -> &'a str {
    tag.split(&format!(" {name}=\"")).nth(1).and_then(|rest| rest.split('"').next()).unwrap_or_default()
}

impl Grid {
    /// Reads a file with its arrays as raw bytes behind the XML.
    pub fn read(path: &Path) -> Self {
        let bytes = fs::read(path).unwrap_or_else(|cause| panic!("{}: {cause}", path.display()));
        let marker = b"<AppendedData encoding=\"raw\">\n_";
        let begin = bytes.windows(marker.len()).position(|part| part == marker).expect("appended data") + marker.len();
        let xml = std::str::from_utf8(&bytes[..begin]).expect("XML");
        assert!(bytes.ends_with(b"\n</AppendedData>\n</VTKFile>\n"), "{}", path.display());
        let mut grid = Grid {
            points: Vec::new(),
            arrays: BTreeMap::new(),
            components: BTreeMap::new(),
            cells: Vec::new(),
            types: Vec::new(),
        };
        let mut lists: BTreeMap<String, Vec<f64>> = BTreeMap::new();
        for tag in xml.split("<DataArray").skip(1).map(|rest| rest.split('>').next().unwrap_or_default()) {
            let offset: usize = attribute(tag, "offset").parse().expect("an offset");
            let block = &bytes[begin + offset..];
            let length = u64::from_le_bytes(block[..8].try_into().expect("eight bytes")) as usize;
            let (name, values) = (attribute(tag, "Name"), numbers(attribute(tag, "type"), &block[8..8 + length]));
            match name {
                "connectivity" | "offsets" | "types" | "Points" => {
                    lists.insert(name.to_owned(), values);
                }
                _ => {
                    grid.components
                        .insert(name.to_owned(), attribute(tag, "NumberOfComponents").parse().expect("a count"));
                    grid.arrays.insert(name.to_owned(), values);
                }
            }
        }
        grid.points = lists.remove("Points").expect("points");
        grid.types = lists["types"].iter().map(|kind| *kind as u8).collect();
        let mut start = 0;
        for end in lists["offsets"].iter().map(|end| *end as usize) {
            grid.cells.push(lists["connectivity"][start..end].iter().map(|node| *node as usize).collect());
            start = end;
        }
        grid
    }
}

/// The numbers in these bytes.
fn numbers(kind: &str, bytes: &[u8]) -> Vec<f64> {
    fn all<const N: usize>(bytes: &[u8], number: impl Fn([u8; N]) -> f64) -> Vec<f64> {
        bytes.chunks_exact(N).map(|chunk| number(chunk.try_into().expect("a number"))).collect()
    }
    match kind {
        "Float64" => all(bytes, f64::from_le_bytes),
        "Float32" => all(bytes, |chunk| f64::from(f32::from_le_bytes(chunk))),
        "UInt32" => all(bytes, |chunk| f64::from(u32::from_le_bytes(chunk))),
        "Int64" => all(bytes, |chunk| i64::from_le_bytes(chunk) as f64),
        "UInt8" => all(bytes, |[byte]: [u8; 1]| f64::from(byte)),
        _ => panic!("numbers of the type {kind}"),
    }
}
