//! The division of quadrangles, hexahedra, prisms and pyramids into triangles and tetrahedra.
//!
//! Every cell is the cone from its vertex with the smallest number over the faces without that vertex. A quadrangle is the cone
//! from its smallest vertex over the edges without it. The diagonal of a quadrangle therefore depends on the numbers of its
//! vertices alone, so that cells of any kind agree on common faces.
//!
//! Only vertices are divided here. [`middles`](super::middles) adds the mid-edge nodes of quadratic cells.

use super::simplex;
use crate::problem::order::Order;

/// The vertices of a face, or of an edge of a quadrangle.
type Face = &'static [usize];

/// A kind of cell that is divided into simplices.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Split {
    /// Dimension, 2 or 3.
    pub dimension: usize,
    /// Number of vertices.
    pub vertices: usize,
    /// Number of nodes: vertices, then those of `edges`, then those of quadrangular faces, then that of the cell.
    pub stride: usize,
    /// The vertices of each edge, in Gmsh's order of mid-edge nodes. Linear cells have none here.
    pub edges: &'static [[usize; 2]],
    /// The faces, with quadrangles in Gmsh's order of the nodes in their middle.
    faces: &'static [Face],
}

const EDGES: [Face; 4] = [&[0, 1], &[1, 2], &[2, 3], &[3, 0]];

const HEXAHEDRON: [Face; 6] =
    [&[0, 3, 2, 1], &[0, 1, 5, 4], &[0, 4, 7, 3], &[1, 2, 6, 5], &[2, 3, 7, 6], &[4, 5, 6, 7]];

const PRISM: [Face; 5] = [&[0, 2, 1], &[3, 4, 5], &[0, 1, 4, 3], &[0, 3, 5, 2], &[1, 2, 5, 4]];

const PYRAMID: [Face; 5] = [&[0, 3, 2, 1], &[0, 1, 4], &[1, 2, 4], &[2, 3, 4], &[3, 0, 4]];

/// The quadrangle as a face of itself.
const WHOLE: [Face; 1] = [&[0, 1, 2, 3]];

const EDGES_OF_QUADRANGLE: [[usize; 2]; 4] = [[0, 1], [1, 2], [2, 3], [3, 0]];

const EDGES_OF_HEXAHEDRON: [[usize; 2]; 12] =
    [[0, 1], [0, 3], [0, 4], [1, 2], [1, 5], [2, 3], [2, 6], [3, 7], [4, 5], [4, 7], [5, 6], [6, 7]];

const EDGES_OF_PRISM: [[usize; 2]; 9] = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 4], [2, 5], [3, 4], [3, 5], [4, 5]];

const EDGES_OF_PYRAMID: [[usize; 2]; 8] = [[0, 1], [0, 3], [0, 4], [1, 2], [1, 4], [2, 3], [2, 4], [3, 4]];

impl Split {
    /// Return the kind of cell that an element type number of Gmsh stands for, if it is of order 1 or 2 and not a simplex.
    pub fn of_type(number: i32) -> Option<Split> {
        let (dimension, vertices, faces, edges): (_, _, &[Face], &'static [[usize; 2]]) = match number {
            3 | 10 | 16 => (2, 4, &EDGES, &EDGES_OF_QUADRANGLE),
            5 | 12 | 17 => (3, 8, &HEXAHEDRON, &EDGES_OF_HEXAHEDRON),
            6 | 13 | 18 => (3, 6, &PRISM, &EDGES_OF_PRISM),
            7 | 14 | 19 => (3, 5, &PYRAMID, &EDGES_OF_PYRAMID),
            _ => return None,
        };
        let stride = simplex::type_name(number)?.1;
        let edges = if stride == vertices { &[] } else { edges };
        Some(Split { dimension, vertices, stride, edges, faces })
    }

    /// Return the order of the cells.
    pub fn order(&self) -> Order {
        if self.edges.is_empty() { Order::P1 } else { Order::P2 }
    }

    /// Return the quadrangular faces. A quadrangle has one, itself.
    pub fn quadrangles(&self) -> impl Iterator<Item = &'static [usize]> {
        let faces: &[Face] = if self.dimension == 2 { &WHOLE } else { self.faces };
        faces.iter().copied().filter(|face| face.len() == 4)
    }

    /// Return the simplices of a cell, `dimension + 1` vertices each, with any orientation. The vertices are the first nodes of
    /// `cell`. Simplices in which a vertex occurs twice, since an edge was drawn into a point, are omitted.
    pub fn simplices(&self, cell: &[u32]) -> Vec<u32> {
        let corners: Vec<Vec<u32>> = self.faces.iter().map(|face| face.iter().map(|&at| cell[at]).collect()).collect();
        let simplices = cone(&cell[..self.vertices], &corners);
        simplices.into_iter().filter(|simplex| all_differ(simplex)).flatten().collect()
    }
}

/// Return the cone from the smallest vertex of a cell over its faces without this vertex.
fn cone(cell: &[u32], faces: &[Vec<u32>]) -> Vec<Vec<u32>> {
    let Some(&apex) = cell.iter().min() else { return Vec::new() };
    let mut simplices = Vec::new();
    for face in faces.iter().filter(|face| !face.contains(&apex)) {
        let parts = if face.len() == 4 {
            let edges: Vec<Vec<u32>> = EDGES.iter().map(|edge| edge.iter().map(|&at| face[at]).collect()).collect();
            cone(face, &edges)
        } else {
            vec![face.clone()]
        };
        simplices.extend(parts.into_iter().map(|part| [&[apex][..], &part].concat()));
    }
    simplices
}

fn all_differ(simplex: &[u32]) -> bool {
    simplex.iter().enumerate().all(|(at, vertex)| !simplex[..at].contains(vertex))
}

/// Corners of the unit cube in Gmsh's order, for tests.
#[cfg(test)]
pub(super) const CUBE: [[f64; 3]; 8] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [1.0, 1.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
    [1.0, 0.0, 1.0],
    [1.0, 1.0, 1.0],
    [0.0, 1.0, 1.0],
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::simplex::measure;
    use std::collections::BTreeMap;

    /// Return six times the volume of the pieces of a cell, and the number of pieces that have each triangle as a face.
    fn pieces(kind: i32, cell: &[u32], points: &[[f64; 3]]) -> (f64, BTreeMap<Vec<u32>, usize>) {
        let (mut volume, mut faces) = (0.0, BTreeMap::new());
        for tetrahedron in Split::of_type(kind).unwrap().simplices(cell).chunks_exact(4) {
            volume += measure(&[0, 1, 2, 3].map(|at| points[tetrahedron[at] as usize]), 3).abs();
            for left in 0..4 {
                let mut face: Vec<u32> = tetrahedron.iter().copied().filter(|v| *v != tetrahedron[left]).collect();
                face.sort_unstable();
                *faces.entry(face).or_insert(0) += 1;
            }
        }
        (volume, faces)
    }

    /// Whatever the numbers of the vertices, the pieces fill the cell. The pieces of two cells have the same triangles on the
    /// common face.
    #[test]
    fn pieces_fill_cells_and_fit_across_faces() {
        let mut seed = 7_u64;
        for _ in 0..500 {
            let mut order: Vec<u32> = (0..12).collect();
            for at in (1..12).rev() {
                seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                order.swap(at, (seed >> 33) as usize % (at + 1));
            }
            // The points are those of a cube and, beside its face x = 1, of a prism with the vertices 1 2 6 5 8 9.
            let mut points = vec![[0.0; 3]; 12];
            let named = [&CUBE[..], &[[2.0, 0.0, 0.0], [2.0, 1.0, 0.0], [3.0, 0.5, 0.5], [0.0; 3]]].concat();
            order.iter().zip(named).for_each(|(&at, x)| points[at as usize] = x);
            let of = |vertices: &[usize]| vertices.iter().map(|&v| order[v]).collect::<Vec<_>>();
            let (cube, of_cube) = pieces(5, &of(&[0, 1, 2, 3, 4, 5, 6, 7]), &points);
            assert!((cube - 6.0).abs() < 1e-12);
            let (prism, of_prism) = pieces(6, &of(&[2, 9, 6, 1, 8, 5]), &points);
            assert!((prism - 3.0).abs() < 1e-12);
            let (pyramid, of_pyramid) = pieces(7, &of(&[2, 6, 5, 1, 10]), &points);
            assert!((pyramid - 4.0).abs() < 1e-12);
            let common = of(&[1, 2, 5, 6]);
            let shared = |faces: &BTreeMap<Vec<u32>, usize>| -> Vec<Vec<u32>> {
                faces.keys().filter(|face| face.iter().all(|v| common.contains(v))).cloned().collect()
            };
            assert_eq!((shared(&of_cube).len(), shared(&of_cube)), (2, shared(&of_prism)));
            assert_eq!(shared(&of_cube), shared(&of_pyramid));
            // A triangle inside the cube is a face of two pieces, and one on the boundary of one. A cube has 12 triangles on
            // its boundary.
            assert_eq!(of_cube.values().filter(|&&count| count == 1).count(), 12);
            assert!(of_cube.values().all(|&count| count <= 2));
            // A quadrangle of the surface has the same diagonal.
            let triangles = Split::of_type(3).unwrap().simplices(&of(&[1, 2, 6, 5]));
            for triangle in triangles.chunks_exact(3) {
                let mut triangle = triangle.to_vec();
                triangle.sort_unstable();
                assert!(shared(&of_cube).contains(&triangle));
            }
        }
    }

    #[test]
    fn a_hexahedron_with_an_edge_drawn_into_a_point_is_a_prism() {
        let points = [&CUBE[..]].concat();
        let (volume, _) = pieces(5, &[0, 1, 2, 2, 4, 5, 6, 6], &points);
        assert!((volume - 3.0).abs() < 1e-12);
    }
}
