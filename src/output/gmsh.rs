//! Fields as Gmsh's `.msh` 4.1, binary: the mesh of a body or a contact surface, and a view of each field at its nodes.

use super::vtu::{CellKind, Grid};
use std::io::{self, Write};

/// Numbers from which the tags of a file go on, so that Gmsh can open the files of a run together.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Tags {
    /// Files before this one.
    pub entity: usize,
    /// Points in them.
    pub points: usize,
    /// Cells in them.
    pub cells: usize,
}

impl CellKind {
    /// Dimension, and type in Gmsh.
    fn gmsh(self) -> (i32, i32) {
        match self {
            CellKind::Line => (1, 1),
            CellKind::QuadraticLine => (1, 8),
            CellKind::Triangle => (2, 2),
            CellKind::QuadraticTriangle => (2, 9),
            CellKind::Tetra => (3, 4),
            CellKind::QuadraticTetra => (3, 11),
        }
    }
}

impl Grid {
    /// Writes the grid as `.msh`, its cells a physical group called like its title, with a view `title: name` of each array at its
    /// points; symmetric tensors become full ones. Nodes where a value is no number have none.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn write_msh(&self, tags: Tags, out: &mut dyn Write) -> io::Result<()> {
        let (dimension, kind) = self.cell.gmsh();
        let (points, stride) = (self.points.len(), self.cell.stride());
        let cells = self.connectivity.len() / stride;
        let tag = tags.entity as i32 + 1;
        let name = self.title.replace('"', "'");
        write!(out, "$MeshFormat\n4.1 1 8\n")?;
        put(out, &[1])?;
        writeln!(
            out,
            "\n$EndMeshFormat\n$PhysicalNames\n1\n{dimension} {tag} \"{name}\"\n$EndPhysicalNames\n$Entities"
        )?;
        sizes(out, &[0, 1, 2, 3].map(|of| usize::from(of == dimension)))?;
        put(out, &[tag])?;
        let corner = |pick: fn(f64, f64) -> f64| -> [f64; 3] {
            std::array::from_fn(|k| self.points.iter().map(|x| x[k]).reduce(pick).unwrap_or(0.0))
        };
        numbers(out, [corner(f64::min), corner(f64::max)].as_flattened())?;
        sizes(out, &[1])?;
        put(out, &[tag])?;
        sizes(out, &[0])?;
        write!(out, "\n$EndEntities\n$Nodes\n")?;
        let first = tags.points + 1;
        sizes(out, &[1, points, first, tags.points + points])?;
        put(out, &[dimension, tag, 0])?;
        sizes(out, &[points])?;
        sizes(out, &(first..first + points).collect::<Vec<_>>())?;
        numbers(out, self.points.as_flattened())?;
        write!(out, "\n$EndNodes\n$Elements\n")?;
        sizes(out, &[1, cells, tags.cells + 1, tags.cells + cells])?;
        put(out, &[dimension, tag, kind])?;
        sizes(out, &[cells])?;
        for (number, cell) in self.connectivity.chunks_exact(stride).enumerate() {
            let mut line = vec![tags.cells + 1 + number];
            line.extend(cell.iter().map(|&point| first + point as usize));
            if self.cell == CellKind::QuadraticTetra {
                // Gmsh has the mid-edge 23 before 13
                line.swap(9, 10);
            }
            sizes(out, &line)?;
        }
        write!(out, "\n$EndElements\n")?;
        // principal stresses are no vector
        for (array, components, values) in self.at_points.iter().filter(|(array, ..)| array != "principal") {
            self.view(&format!("{name}: {array}"), *components as usize, values, first, out)?;
        }
        Ok(())
    }

    fn view(&self, name: &str, components: usize, values: &[f64], first: usize, out: &mut dyn Write) -> io::Result<()> {
        // xx yy zz xy yz xz to the rows of a tensor
        const TENSOR: [usize; 9] = [0, 3, 5, 3, 1, 4, 5, 4, 2];
        let width = if components == 6 { TENSOR.len() } else { components };
        let known =
            || values.chunks_exact(components).enumerate().filter(|(_, value)| value.iter().all(|x| !x.is_nan()));
        write!(out, "$NodeData\n1\n\"{name}\"\n1\n0\n3\n0\n{width}\n{}\n", known().count())?;
        for (point, value) in known() {
            put(out, &[(first + point) as i32])?;
            match components {
                6 => numbers(out, &TENSOR.map(|place| value[place]))?,
                _ => numbers(out, value)?,
            }
        }
        write!(out, "\n$EndNodeData\n")
    }
}

fn put(out: &mut dyn Write, integers: &[i32]) -> io::Result<()> {
    integers.iter().try_for_each(|number| out.write_all(&number.to_ne_bytes()))
}

fn sizes(out: &mut dyn Write, sizes: &[usize]) -> io::Result<()> {
    sizes.iter().try_for_each(|size| out.write_all(&(*size as u64).to_ne_bytes()))
}

fn numbers(out: &mut dyn Write, numbers: &[f64]) -> io::Result<()> {
    numbers.iter().try_for_each(|number| out.write_all(&number.to_ne_bytes()))
}
