//! The `$Nodes` section: coordinates, and the map from Gmsh's node tags to our numbers.

use super::cursor::Cursor;
use crate::error::{Error, Result};
use std::collections::HashMap;

/// The nodes of a file, numbered 0, 1, ... in its order.
pub struct Nodes {
    /// Coordinates (x, y, z).
    pub points: Vec<[f64; 3]>,
    /// Largest |z| of a point that counts as in the plane z = 0: 1e-12 times the size of the mesh.
    pub flat: f64,
    numbers: Numbers,
    blocks: Vec<Block>,
}

/// A block of consecutive nodes, with the position of their coordinates in the file.
struct Block {
    first: usize,
    position: usize,
    bytes: usize,
}

/// A map from tags to numbers. Gmsh's tags are nearly contiguous; other programs may write any.
enum Numbers {
    Dense { least: u64, number: Vec<u32> },
    Sparse(HashMap<u64, u32>),
}

const NONE: u32 = u32::MAX;

impl Nodes {
    /// Read the contents of the section.
    ///
    /// # Errors
    /// The text is malformed, a coordinate is not a number, or a tag occurs twice.
    pub fn read(cursor: &mut Cursor) -> Result<Nodes> {
        cursor.begin();
        let start = cursor.position();
        let block_count = cursor.count(4, 20)?;
        let total = cursor.count(4, 32)?;
        cursor.size()?;
        cursor.size()?;
        cursor.end()?;
        if total >= NONE as usize {
            return Err(cursor.error_at(start, format!("{total} nodes are too many: 32-bit numbers count them")));
        }

        let mut tags = Vec::with_capacity(total);
        let mut points = Vec::with_capacity(total);
        let mut blocks = Vec::with_capacity(block_count);
        for _ in 0..block_count {
            cursor.begin();
            let dimension = cursor.int()?;
            cursor.int()?;
            let parameters = match (cursor.int()?, dimension) {
                (0, _) => 0,
                (1, 0..=3) => dimension as usize,
                _ => return Err(cursor.error("this is not the head of a block of nodes")),
            };
            let bytes = 8 * (3 + parameters);
            let count = cursor.count(4 + parameters, 8 + bytes)?;
            cursor.end()?;
            for _ in 0..count {
                cursor.begin();
                tags.push(cursor.size()?);
                cursor.end()?;
            }
            blocks.push(Block { first: points.len(), position: cursor.position(), bytes });
            for _ in 0..count {
                cursor.begin();
                points.push([cursor.real()?, cursor.real()?, cursor.real()?]);
                for _ in 0..parameters {
                    cursor.real()?;
                }
                cursor.end()?;
            }
        }
        if points.len() != total {
            let message = format!("$Nodes announces {total} nodes and holds {}", points.len());
            return Err(cursor.error_at(start, message));
        }
        let mut nodes = Nodes { flat: 1e-12 * size(&points), points, numbers: Numbers::empty(&tags), blocks };
        for (number, tag) in tags.iter().enumerate() {
            if nodes.numbers.insert(*tag, number as u32) {
                return Err(nodes.error_at(cursor, number, format!("node tag {tag} stands twice")));
            }
        }
        Ok(nodes)
    }

    /// Return our number of the node with this tag.
    pub fn number(&self, tag: u64) -> Option<u32> {
        match &self.numbers {
            Numbers::Dense { least, number } => {
                let slot = usize::try_from(tag.checked_sub(*least)?).ok()?;
                number.get(slot).copied().filter(|number| *number != NONE)
            }
            Numbers::Sparse(number) => number.get(&tag).copied(),
        }
    }

    /// Return an error that names the position of a node's coordinates in the file.
    pub fn error_at(&self, cursor: &mut Cursor, number: usize, message: String) -> Error {
        let block = &self.blocks[self.blocks.partition_point(|block| block.first <= number) - 1];
        cursor.enter("Nodes");
        cursor.rewind(block.position);
        if let Err(error) = cursor.skip_records(number - block.first, block.bytes) {
            return error;
        }
        cursor.begin();
        cursor.error(message)
    }
}

impl Numbers {
    /// Return a map without entries, in the form that suits these tags.
    fn empty(tags: &[u64]) -> Numbers {
        let least = tags.iter().copied().min().unwrap_or(0);
        let span = tags.iter().copied().max().unwrap_or(0) - least;
        // A table with at most four slots per node is faster and smaller than a map.
        if span < 4 * tags.len() as u64 + 1024 {
            Numbers::Dense { least, number: vec![NONE; span as usize + 1] }
        } else {
            Numbers::Sparse(HashMap::with_capacity(tags.len()))
        }
    }

    /// Set the number of a tag, one of those given to `empty`. Return whether it already had one.
    fn insert(&mut self, tag: u64, new: u32) -> bool {
        match self {
            Numbers::Dense { least, number } => {
                let slot = &mut number[(tag - *least) as usize];
                std::mem::replace(slot, new) != NONE
            }
            Numbers::Sparse(number) => number.insert(tag, new).is_some(),
        }
    }
}

/// Return the longest side of the box around the points.
fn size(points: &[[f64; 3]]) -> f64 {
    let [low, high] = crate::linalg::bounds(points.iter().copied());
    (0..3).map(|k| high[k] - low[k]).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn nodes(text: &str) -> Result<Nodes> {
        Nodes::read(&mut Cursor::new(Path::new("a.msh"), Box::new(std::io::Cursor::new(text)), false))
    }

    #[test]
    fn tags_may_be_far_apart_and_as_large_as_they_like() {
        let found = nodes("1 2 1 2\n2 1 0 2\n18446744073709551615\n3\n0 0 0\n1 0 0\n").unwrap();
        assert_eq!([found.number(u64::MAX), found.number(3), found.number(4)], [Some(0), Some(1), None]);
        let found = nodes("1 2 1 2\n2 1 0 2\n9\n7\n0 0 0\n1 0 0\n").unwrap();
        assert_eq!(
            [found.number(9), found.number(7), found.number(8), found.number(0)],
            [Some(0), Some(1), None, None]
        );
    }

    #[test]
    fn parameters_on_a_curve_are_not_coordinates() {
        let found = nodes("1 1 1 1\n1 1 1 1\n1\n4 5 6 0.25\n").unwrap();
        assert_eq!(found.points, [[4.0, 5.0, 6.0]]);
    }

    #[test]
    fn errors_name_the_line() {
        for (text, expected) in [
            ("1 2 1 2\n2 1 0 2\n5\n5\n0 0 0\n1 0 0\n", "a.msh:6: node tag 5 stands twice"),
            ("1 1 1 1\n2 1 0 1\n5\n0 nan 0\n", "a.msh:4: a coordinate is NaN"),
            ("1 1 1 1\n2 1 0 1\n5\n0 0\n", "a.msh:4: this line has too few entries"),
            ("1 1 1 1\n2 1 0 1\n5\n0 0 0 0\n", "a.msh:4: this line has more entries than expected"),
            ("1 2 1 1\n2 1 0 1\n5\n0 0 0\n", "$Nodes announces 2 nodes and holds 1"),
            ("1 1 1 1\n2 1 0 999999999999\n5\n0 0 0\n", "a.msh:2: the file is too short for a count of 999999999999"),
        ] {
            let error = nodes(text).err().unwrap().to_string();
            assert!(error.contains(expected), "{error}");
        }
    }
}
