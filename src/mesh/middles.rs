//! The nodes in the middle of the diagonals along which quadratic cells are divided.
//!
//! A diagonal of a face has its node where the map of the face takes the centre of the reference square, and a diagonal through
//! a cell where the map of the cell takes the centre of the reference cube. The boundary of the simplices is thus interpolated
//! from that of the cells.

use super::check::EDGES;
use super::split::Split;
use crate::problem::order::Order;
use std::collections::HashMap;

/// The vertices of a hexahedron.
const CELL: [usize; 8] = [0, 1, 2, 3, 4, 5, 6, 7];

/// The maker of the nodes in the middle of diagonals. Faces are known by their vertices, so that all cells and facets at a face
/// share its node. So do copies of a cell in several groups.
pub struct Middles<'a> {
    /// Coordinates of all points, to which new ones are appended.
    pub points: &'a mut Vec<[f64; 3]>,
    /// The node of each divided face by its sorted vertices, and of each divided hexahedron by the ends of its diagonal, each
    /// twice.
    pub known: &'a mut HashMap<[u32; 4], u32>,
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
        let (key, vertices, given) = match kind.quadrangles().enumerate().find(|(_, face)| has_ends(face)) {
            Some((number, face)) => ([0, 1, 2, 3].map(|at| cell[face[at]]), face, cell.get(in_middle + number)),
            None => ([ends[0], ends[0], ends[1], ends[1]], &CELL[..], cell[in_middle..].last()),
        };
        let mut key = key;
        key.sort_unstable();
        let known = self.known.get(&key).or(given).copied();
        let middle = known.unwrap_or_else(|| self.make(kind, cell, vertices));
        self.known.insert(key, middle);
        middle
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::split::CUBE;
    use nalgebra::{Matrix3, Vector3};

    fn hexahedron() -> Split {
        Split::of_type(17).expect("a kind")
    }

    /// Return the nodes of a hexahedron that a map takes from the unit cube, at the numbers `order`.
    fn placed(order: &[u32], map: impl Fn([f64; 3]) -> [f64; 3]) -> Vec<[f64; 3]> {
        let middle = |[a, b]: &[usize; 2]| [0, 1, 2].map(|c| 0.5 * (CUBE[*a][c] + CUBE[*b][c]));
        let mut points = vec![[0.0; 3]; 20];
        let all = CUBE.into_iter().chain(hexahedron().edges.iter().map(middle));
        order.iter().zip(all).for_each(|(&at, x)| points[at as usize] = map(x));
        points
    }

    /// Return the volume of quadratic tetrahedra by Keast's rule, which is exact for their Jacobians of degree 3. Each is
    /// positive once its vertices are in order.
    fn volume(simplices: &[u32], points: &[[f64; 3]]) -> f64 {
        let mut sum = 0.0;
        for simplex in simplices.chunks_exact(10) {
            let mut own = 0.0;
            for k in 0..5 {
                let (l, weight) = match k {
                    4 => ([0.25; 4], -0.8),
                    _ => (std::array::from_fn(|i| if i == k { 0.5 } else { 1.0 / 6.0 }), 0.45),
                };
                // The derivatives along the barycentric coordinates.
                let mut along = [Vector3::zeros(); 4];
                for (along, (node, l)) in along.iter_mut().zip(simplex.iter().zip(&l)) {
                    *along += Vector3::from(points[*node as usize]) * (4.0 * l - 1.0);
                }
                for ([a, b], node) in EDGES.iter().zip(&simplex[4..]) {
                    let x = Vector3::from(points[*node as usize]) * 4.0;
                    along[*a] += x * l[*b];
                    along[*b] += x * l[*a];
                }
                let jacobian = Matrix3::from_columns(&[along[1] - along[0], along[2] - along[0], along[3] - along[0]]);
                own += weight * jacobian.determinant() / 6.0;
            }
            sum += own.abs();
        }
        sum
    }

    /// A piece of a spherical shell: all of its six faces are curved or on planes through the axis. The map of the cell has an
    /// error of fourth order, and so have the simplices, whatever the numbers of the nodes.
    #[test]
    fn curved_hexahedra_keep_their_volume() {
        let error = |angle: f64, turn: u32| {
            let order: Vec<u32> = (0..20).map(|k| (7 * k + turn) % 20).collect();
            let mut points = placed(&order, |[a, b, c]| {
                let (r, longitude, latitude) = (1.0 + 0.5 * angle * a, angle * b, angle * c);
                [longitude.cos() * latitude.cos(), longitude.sin() * latitude.cos(), latitude.sin()].map(|x| r * x)
            });
            let mut middles = Middles { points: &mut points, known: &mut HashMap::new() };
            let simplices = middles.simplices(&hexahedron(), &order);
            let exact = angle * angle.sin() * ((1.0 + 0.5 * angle).powi(3) - 1.0) / 3.0;
            (volume(&simplices, &points) / exact - 1.0).abs()
        };
        for turn in 0..8 {
            let [coarse, fine] = [0.4, 0.2].map(|angle| error(angle, turn));
            assert!(fine < 1e-4 && fine < coarse / 10.0, "{turn}: {coarse} {fine}");
        }
    }

    /// Cells of all kinds use the same node on a common face, which a full kind has among its own.
    #[test]
    fn faces_have_one_node() {
        let order: Vec<u32> = (0..20).collect();
        let mut points = placed(&order, |[a, b, c]| [a + 0.3 * b * c, b, c + 0.2 * a * b]);
        let mut known = HashMap::new();
        let mut middles = Middles { points: &mut points, known: &mut known };
        let cell = middles.simplices(&hexahedron(), &order);
        assert_eq!(cell, middles.simplices(&hexahedron(), &order), "a copy in another group");
        assert_eq!(middles.points.len(), 27, "six faces and the cell");
        // The face 0 3 2 1 has the mid-edge nodes 9 13 11 8.
        let facet = middles.simplices(&Split::of_type(16).expect("a kind"), &[0, 3, 2, 1, 9, 13, 11, 8]);
        let node = middles.known[&[0, 1, 2, 3]];
        assert_eq!(facet.iter().filter(|number| **number == node).count(), 2);
        let [x, y, z] = middles.points[node as usize];
        assert!((x - 0.5).abs() + (y - 0.5).abs() + (z - 0.05).abs() < 1e-15);
        let full = middles.simplices(&Split::of_type(10).expect("a kind"), &[2, 3, 7, 6, 13, 15, 19, 14, 99]);
        assert!(!full.contains(&99), "the node that the hexahedron has made");
        let full = middles.simplices(&Split::of_type(10).expect("a kind"), &[30, 31, 32, 33, 34, 35, 36, 37, 38]);
        assert_eq!(full.iter().filter(|number| **number == 38).count(), 2);
    }

    #[test]
    fn a_hexahedron_with_an_edge_drawn_into_a_point_is_a_prism() {
        let order: Vec<u32> = (0..20).collect();
        let mut points = placed(&order, |x| x);
        let mut middles = Middles { points: &mut points, known: &mut HashMap::new() };
        // The vertices 3 and 7 are 2 and 6 here. With them go the mid-edge nodes of 0 3, 2 3, 3 7, 4 7 and 6 7.
        let hexahedron =
            middles.simplices(&hexahedron(), &[0, 1, 2, 2, 4, 5, 6, 6, 8, 9, 10, 11, 12, 2, 14, 14, 16, 17, 18, 6]);
        let prism = middles
            .simplices(&Split::of_type(18).expect("a kind"), &[0, 1, 2, 4, 5, 6, 8, 9, 10, 11, 12, 14, 16, 17, 18]);
        let sorted = |simplices: &[u32]| {
            let mut all: Vec<Vec<u32>> = simplices.chunks_exact(10).map(<[u32]>::to_vec).collect();
            all.iter_mut().for_each(|simplex| simplex.sort_unstable());
            all.sort_unstable();
            all
        };
        assert_eq!(sorted(&hexahedron), sorted(&prism));
        assert_eq!(prism.len(), 30);
    }
}
