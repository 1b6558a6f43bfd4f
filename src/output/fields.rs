//! Meshes with fields at their points and cells, which `vtu.rs` writes for ParaView and `views.rs` for Gmsh.

use serde::{Deserialize, Serialize};

/// The kind of the cells of a body: simplices of a dimension (1 to 3) and an order, which is at most 2 in space.
///
/// Their points are numbered as in VTK: vertices, then those inside the edges 01 12 02 03 13 23, equally spaced and
/// from order three on along 01 12 20, then those inside the triangle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct CellKind {
    /// Dimension of the simplices.
    pub dimension: usize,
    /// Their order.
    pub order: usize,
}

impl CellKind {
    /// Return the number of points per cell, the binomial coefficient of order + dimension over dimension.
    pub fn stride(self) -> usize {
        (1..=self.dimension).fold(1, |count, d| count * (self.order + d) / d)
    }

    /// Return the number of the kind in VTK, where orders above two have one.
    pub(super) fn vtk(self) -> u8 {
        [[3, 21, 68], [5, 22, 69], [10, 24, 71]][self.dimension - 1][self.order.min(3) - 1]
    }

    /// Return the dimension of the kind and its number in Gmsh.
    pub(super) fn gmsh(self) -> (i32, i32) {
        const KINDS: [&[i32]; 3] = [&[1, 8, 26, 27, 28, 62, 63, 64], &[2, 9, 21, 23, 25, 42, 43, 44], &[4, 11]];
        (self.dimension as i32, KINDS[self.dimension - 1][self.order - 1])
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
    pub(super) const ARRAYS: [(&'static str, usize); 4] =
        [("displacement", 3), ("stress", 6), ("von_mises", 1), ("principal", 3)];

    /// Return the field as a grid with the arrays `displacement`, `stress`, `von_mises` and `principal` at its points.
    pub fn grid(&self) -> UnstructuredGrid {
        let (displacement, stress) = (self.displacement.as_flattened(), self.stress.as_flattened());
        let values = [displacement, stress, &self.von_mises, self.principal.as_flattened()];
        let array = |k: usize| {
            let (name, components) = Self::ARRAYS[k];
            FieldArray::new(name, components, values[k].to_vec())
        };
        UnstructuredGrid {
            title: self.name.clone(),
            points: self.points.clone(),
            cell: self.cell,
            connectivity: self.connectivity.clone(),
            at_points: (0..values.len()).map(array).collect(),
            at_cells: Vec::new(),
        }
    }
}

/// Numbers at the points or cells of a grid.
#[derive(Debug, Clone, PartialEq)]
pub struct FieldArray {
    /// Name.
    pub name: String,
    /// Numbers at each point or cell.
    pub components: usize,
    /// All numbers, those of a point or cell together.
    pub values: Vec<f64>,
}

impl FieldArray {
    /// Return an array.
    pub fn new(name: impl Into<String>, components: usize, values: Vec<f64>) -> Self {
        Self { name: name.into(), components, values }
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
    /// Arrays at the points.
    pub at_points: Vec<FieldArray>,
    /// Arrays at the cells.
    pub at_cells: Vec<FieldArray>,
}
