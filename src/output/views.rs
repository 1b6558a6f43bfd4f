//! Views for Gmsh: `.msh` 4.1, binary.

use super::fields::{CellKind, FieldArray, UnstructuredGrid};
use super::folder::MARK_OF_MESH;
use std::io::{self, Write};

/// The entities, points and cells of earlier files. Tags go on from there, so that Gmsh can open the files of a run
/// together.
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
    /// Write the grid as `.msh`. Its cells are a physical group with the title as name, and each array at its points
    /// becomes a view `title: name`. Symmetric tensors become full ones. Nodes with a NaN are left out of a view.
    pub fn write_msh(&self, tags: Tags, out: &mut dyn Write) -> io::Result<()> {
        let (dimension, _) = self.cell.gmsh();
        let tag = tags.entity as i32 + 1;
        let name: String = self.title.chars().map(|c| if c == '"' || c.is_control() { '\'' } else { c }).collect();
        write!(out, "$MeshFormat\n4.1 1 8\n")?;
        write_i32(out, &[1])?;
        write!(out, "\n$EndMeshFormat\n$PhysicalNames\n1\n{dimension} {tag} \"{name}\"\n$EndPhysicalNames\n")?;
        self.write_entity(tag, out)?;
        self.write_nodes(tag, tags, out)?;
        self.write_elements(tag, tags, out)?;
        // principal stresses are no vector
        for array in self.at_points.iter().filter(|array| array.name != "principal") {
            write_view(&format!("{name}: {}", array.name), array, tags.points + 1, out)?;
        }
        out.write_all(MARK_OF_MESH.as_bytes())
    }

    /// Write the one entity that has all cells, with its bounding box and its physical group.
    fn write_entity(&self, tag: i32, out: &mut dyn Write) -> io::Result<()> {
        let (dimension, _) = self.cell.gmsh();
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
        let (dimension, _) = self.cell.gmsh();
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
        let (dimension, kind) = self.cell.gmsh();
        let cells = self.connectivity.chunks_exact(self.cell.stride());
        writeln!(out, "$Elements")?;
        write_u64(out, &[1, cells.len(), tags.cells + 1, tags.cells + cells.len()])?;
        write_i32(out, &[dimension, tag, kind])?;
        write_u64(out, &[cells.len()])?;
        for (number, cell) in cells.enumerate() {
            let mut line = vec![tags.cells + 1 + number];
            line.extend(cell.iter().map(|&point| tags.points + 1 + point as usize));
            if self.cell == (CellKind { dimension: 3, order: 2 }) {
                // Gmsh has the mid-edge 23 before 13
                line.swap(9, 10);
            }
            write_u64(out, &line)?;
        }
        write!(out, "\n$EndElements\n")
    }
}

/// Write a view of the values at the points; the first point has the tag `first`.
fn write_view(name: &str, array: &FieldArray, first: usize, out: &mut dyn Write) -> io::Result<()> {
    // xx yy zz xy yz xz to the rows of a tensor
    const TENSOR: [usize; 9] = [0, 3, 5, 3, 1, 4, 5, 4, 2];
    let components = array.components;
    let width = if components == 6 { TENSOR.len() } else { components };
    let has_value = |(_, value): &(usize, &[f64])| value.iter().all(|x| !x.is_nan());
    let points = || array.values.chunks_exact(components).enumerate().filter(has_value);
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
