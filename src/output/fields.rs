//! Meshes with fields at their points and cells, which `vtu.rs` writes for ParaView and `views.rs` for Gmsh.

use serde::{Deserialize, Serialize};

/// The kind of the cells of a body. The local numbering of the points is that of VTK.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum CellKind {
    /// Two ends.
    Line,
    /// Two ends, then the middle.
    QuadraticLine,
    /// Two ends, then equally spaced points between them, of this order.
    LagrangeLine(u8),
    /// Three vertices.
    Triangle,
    /// Three vertices, then mid-edges 01 12 02.
    QuadraticTriangle,
    /// Three vertices, then equally spaced points inside the edges 01 12 20 and inside the triangle, of this order.
    LagrangeTriangle(u8),
    /// Four vertices.
    Tetra,
    /// Four vertices, then mid-edges 01 12 02 03 13 23.
    QuadraticTetra,
}

impl CellKind {
    /// Return the kind of the simplices of a dimension (1 to 3) and order.
    pub fn simplex(dimension: usize, order: usize) -> Self {
        match (dimension, order) {
            (1, 1) => CellKind::Line,
            (1, 2) => CellKind::QuadraticLine,
            (1, _) => CellKind::LagrangeLine(order as u8),
            (2, 3..) => CellKind::LagrangeTriangle(order as u8),
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
            CellKind::QuadraticLine | CellKind::Triangle => 3,
            CellKind::QuadraticTriangle => 6,
            CellKind::LagrangeLine(order) => usize::from(order) + 1,
            CellKind::LagrangeTriangle(order) => (usize::from(order) + 1) * (usize::from(order) + 2) / 2,
            CellKind::Tetra => 4,
            CellKind::QuadraticTetra => 10,
        }
    }

    /// Return the number of the kind in VTK.
    pub(super) fn vtk(self) -> u8 {
        match self {
            CellKind::Line => 3,
            CellKind::QuadraticLine => 21,
            CellKind::Triangle => 5,
            CellKind::QuadraticTriangle => 22,
            CellKind::LagrangeLine(_) => 68,
            CellKind::LagrangeTriangle(_) => 69,
            CellKind::Tetra => 10,
            CellKind::QuadraticTetra => 24,
        }
    }

    /// Return the dimension of the kind and its number in Gmsh.
    pub(super) fn gmsh(self) -> (i32, i32) {
        match self {
            CellKind::Line => (1, 1),
            CellKind::QuadraticLine => (1, 8),
            CellKind::Triangle => (2, 2),
            CellKind::QuadraticTriangle => (2, 9),
            CellKind::LagrangeLine(order) => (1, [26, 27, 28, 62, 63, 64][usize::from(order) - 3]),
            CellKind::LagrangeTriangle(order) => (2, [21, 23, 25, 42, 43, 45][usize::from(order) - 3]),
            CellKind::Tetra => (3, 4),
            CellKind::QuadraticTetra => (3, 11),
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
