//! The nodes in the middle of the diagonals along which quadratic cells are divided.
//!
//! A diagonal of a face has its node where the map of the face takes the centre of the reference square, and a diagonal through
//! a cell where the map of the cell takes the centre of the reference cube. The boundary of the simplices is thus interpolated
//! from that of the cells. Serendipity maps are those of Zienkiewicz, Taylor and Zhu, The Finite Element Method, section 6.7.

use super::check::EDGES;
use super::split::Split;
use crate::problem::order::Order;
use std::collections::HashMap;

/// The maker of the nodes in the middle of diagonals. Faces are known by their vertices, so that all cells and facets at a face
/// share its node.
pub struct Middles<'a> {
    /// Coordinates of all points, to which new ones are appended.
    pub points: &'a mut Vec<[f64; 3]>,
    /// The node of each divided face, by its sorted vertices.
    pub of_face: &'a mut HashMap<[u32; 4], u32>,
}

impl Middles<'_> {
    /// Return the simplices of a cell with the nodes `cell`, with any orientation, each with vertices before mid-edge nodes.
    pub fn simplices(&mut self, kind: &Split, cell: &[u32]) -> Vec<u32> {
        let vertices = kind.simplices(cell);
        if kind.order() == Order::P1 {
            return vertices;
        }
        let mut simplices = Vec::new();
        for simplex in vertices.chunks_exact(kind.dimension + 1) {
            simplices.extend_from_slice(simplex);
            for [a, b] in &EDGES[..kind.dimension * (kind.dimension + 1) / 2] {
                simplices.push(self.middle(kind, cell, [simplex[*a], simplex[*b]]));
            }
        }
        simplices
    }

    /// Return the node in the middle between two vertices of a quadratic cell with the nodes `cell`.
    ///
    /// Edges come first, since a diagonal of a face is an edge of the cell where another edge of the face was drawn into a
    /// point. For the same reason faces come before the cell.
    fn middle(&mut self, kind: &Split, cell: &[u32], ends: [u32; 2]) -> u32 {
        let is_edge = |[a, b]: &[usize; 2]| [[cell[*a], cell[*b]], [cell[*b], cell[*a]]].contains(&ends);
        if let Some(edge) = kind.edges.iter().position(is_edge) {
            return cell[kind.vertices + edge];
        }
        let in_middle = kind.vertices + kind.edges.len();
        let has_ends = |face: &&[usize]| ends.iter().all(|end| face.iter().any(|at| cell[*at] == *end));
        match kind.quadrangles().enumerate().find(|(_, face)| has_ends(face)) {
            Some((number, face)) => {
                let mut key = [0, 1, 2, 3].map(|at| cell[face[at]]);
                key.sort_unstable();
                let given = cell.get(in_middle + number).copied();
                let middle = self.of_face.get(&key).copied().or(given);
                let middle = middle.unwrap_or_else(|| self.make(kind, cell, face));
                self.of_face.insert(key, middle);
                middle
            }
            None => match cell.get(in_middle..) {
                Some([.., centre]) => *centre,
                _ => self.make(kind, cell, &[0, 1, 2, 3, 4, 5, 6, 7]),
            },
        }
    }

    /// Make the node in the centre of a face of a cell, or of a hexahedron, given by its vertices.
    ///
    /// In the centre the function of each vertex is -1/4. Those of the mid-edge nodes are equal and make the sum one: they are
    /// 1/2 on a face of four edges and 1/4 in a hexahedron of twelve.
    fn make(&mut self, kind: &Split, cell: &[u32], vertices: &[usize]) -> u32 {
        let edges = kind.edges.iter().zip(&cell[kind.vertices..]);
        let middles = edges.filter(|(ends, _)| ends.iter().all(|end| vertices.contains(end))).map(|(_, middle)| middle);
        let sum = |nodes: &mut dyn Iterator<Item = &u32>| {
            nodes.fold([0.0; 3], |sum, node| std::array::from_fn(|c| sum[c] + self.points[*node as usize][c]))
        };
        let (corners, middles) = (sum(&mut vertices.iter().map(|at| &cell[*at])), sum(&mut middles.into_iter()));
        let weight = if vertices.len() == 4 { 0.5 } else { 0.25 };
        self.points.push(std::array::from_fn(|c| weight * middles[c] - 0.25 * corners[c]));
        (self.points.len() - 1) as u32
    }
}
