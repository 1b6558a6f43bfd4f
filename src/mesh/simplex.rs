//! Shapes of elements, and single simplices: measure and orientation.

use crate::problem::order::Order;
use nalgebra::Vector3;

/// Gmsh's words for entities of dimension 0 to 3, as in `Physical Surface`.
pub const THINGS: [&str; 4] = ["Point", "Curve", "Surface", "Volume"];

/// Edges of a simplex in the order of its mid-edge nodes, which follow the corners.
pub const EDGES: [[usize; 2]; 6] = [[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]];

/// A shape of elements, with corners numbered by Gmsh.
#[derive(Debug, PartialEq, Eq)]
pub struct Shape {
    /// Gmsh's name.
    pub name: &'static str,
    /// Dimension, 0 to 3.
    pub dimension: usize,
    pub corners: usize,
    /// Ends of the edges in Gmsh's order of mid-edge nodes.
    pub edges: &'static [[usize; 2]],
    /// Corners of the faces of shapes that are divided, with quadrangles in Gmsh's order of the nodes in their middle.
    /// Those of a quadrangle are its edges.
    pub faces: &'static [&'static [usize]],
}

/// The point.
pub const POINT: Shape = Shape { name: "point", dimension: 0, corners: 1, edges: &[], faces: &[] };
/// The line.
pub const LINE: Shape = Shape { name: "line", dimension: 1, corners: 2, edges: &[[0, 1]], faces: &[] };
/// The triangle.
pub const TRIANGLE: Shape =
    Shape { name: "triangle", dimension: 2, corners: 3, edges: &[[0, 1], [1, 2], [2, 0]], faces: &[] };
/// The quadrangle.
pub const QUADRANGLE: Shape = Shape {
    name: "quadrangle",
    dimension: 2,
    corners: 4,
    edges: &[[0, 1], [1, 2], [2, 3], [3, 0]],
    faces: &[&[0, 1], &[1, 2], &[2, 3], &[3, 0]],
};
/// The tetrahedron.
pub const TETRAHEDRON: Shape = Shape {
    name: "tetrahedron",
    dimension: 3,
    corners: 4,
    edges: &[[0, 1], [1, 2], [2, 0], [0, 3], [2, 3], [1, 3]],
    faces: &[],
};
/// The hexahedron.
pub const HEXAHEDRON: Shape = Shape {
    name: "hexahedron",
    dimension: 3,
    corners: 8,
    edges: &[[0, 1], [0, 3], [0, 4], [1, 2], [1, 5], [2, 3], [2, 6], [3, 7], [4, 5], [4, 7], [5, 6], [6, 7]],
    faces: &[&[0, 3, 2, 1], &[0, 1, 5, 4], &[0, 4, 7, 3], &[1, 2, 6, 5], &[2, 3, 7, 6], &[4, 5, 6, 7]],
};
/// The prism.
pub const PRISM: Shape = Shape {
    name: "prism",
    dimension: 3,
    corners: 6,
    edges: &[[0, 1], [0, 2], [0, 3], [1, 2], [1, 4], [2, 5], [3, 4], [3, 5], [4, 5]],
    faces: &[&[0, 2, 1], &[3, 4, 5], &[0, 1, 4, 3], &[0, 3, 5, 2], &[1, 2, 5, 4]],
};
/// The pyramid.
pub const PYRAMID: Shape = Shape {
    name: "pyramid",
    dimension: 3,
    corners: 5,
    edges: &[[0, 1], [0, 3], [0, 4], [1, 2], [1, 4], [2, 3], [2, 4], [3, 4]],
    faces: &[&[0, 3, 2, 1], &[0, 1, 4], &[1, 2, 4], &[2, 3, 4], &[3, 0, 4]],
};

/// Number and nodes of Gmsh's types of elements of a shape, from order one on. Where there are types with the nodes of
/// corners and edges alone, these come first.
const TYPES: [(&Shape, &[(i32, usize)]); 13] = [
    (&POINT, &[(POINTS, 1)]),
    (&LINE, &[(1, 2), (8, 3), (26, 4), (27, 5), (28, 6), (62, 7), (63, 8), (64, 9)]),
    (&TRIANGLE, &[(2, 3), (9, 6), (20, 9), (22, 12), (24, 15), (52, 18), (53, 21), (54, 24)]),
    (&TRIANGLE, &[(2, 3), (9, 6), (21, 10), (23, 15), (25, 21), (42, 28), (43, 36), (44, 45)]),
    (&QUADRANGLE, &[(3, 4), (16, 8), (39, 12), (40, 16), (41, 20), (57, 24), (58, 28), (59, 32)]),
    (&QUADRANGLE, &[(3, 4), (10, 9), (36, 16), (37, 25), (38, 36), (47, 49), (48, 64), (49, 81)]),
    (&TETRAHEDRON, &[(4, 4), (11, 10), (29, 20), (30, 35), (31, 56)]),
    (&HEXAHEDRON, &[(5, 8), (17, 20)]),
    (&HEXAHEDRON, &[(5, 8), (12, 27)]),
    (&PRISM, &[(6, 6), (18, 15)]),
    (&PRISM, &[(6, 6), (13, 18)]),
    (&PYRAMID, &[(7, 5), (19, 13)]),
    (&PYRAMID, &[(7, 5), (14, 14)]),
];

/// Gmsh's number of the type of points.
pub const POINTS: i32 = 15;

/// A type of elements of Gmsh.
#[derive(Debug, Clone, Copy)]
pub struct ElementType {
    /// Gmsh's number.
    pub number: i32,
    pub shape: &'static Shape,
    /// Number of nodes: corners, then those of edges, then those of faces, then those of the cell.
    pub nodes: usize,
    /// The order; points have none.
    pub order: Option<Order>,
}

impl ElementType {
    /// Return the type with this number of Gmsh.
    pub fn of(number: i32) -> Option<ElementType> {
        TYPES.iter().find_map(|&(shape, types)| {
            let at = types.iter().position(|kind| kind.0 == number)?;
            let order = Order::new(at + 1).filter(|_| number != POINTS);
            Some(ElementType { number, shape, nodes: types[at].1, order })
        })
    }

    /// Return Gmsh's number of the type with this shape and number of nodes, all of them on edges if there is such a
    /// type.
    pub fn number(shape: &Shape, nodes: usize) -> i32 {
        let types = TYPES.iter().filter(|(own, _)| *own == shape).flat_map(|(_, types)| types.iter());
        types.into_iter().find(|kind| kind.1 == nodes).map_or(0, |kind| kind.0)
    }

    /// Return whether the elements are no simplices and must be divided.
    pub fn is_divided(&self) -> bool {
        !self.shape.faces.is_empty()
    }

    /// Return the number of nodes inside each edge.
    pub fn inside(&self) -> usize {
        self.order.map_or(0, |order| order.degree() - 1)
    }

    /// Reorder the nodes of a simplex from Gmsh's order to ours, without those inside a triangle. Gmsh has the third
    /// edge of a triangle as 20, and mid-edge 23 before 13 in the quadratic tetrahedron.
    pub fn reorder(&self, simplex: &mut Vec<u32>) {
        simplex.truncate(stride(self.shape.dimension, self.order));
        match (self.shape.dimension, self.order) {
            (2, Some(order)) => simplex[2 * order.degree() + 1..].reverse(),
            (3, Some(Order::P2)) => simplex.swap(8, 9),
            _ => {}
        }
    }
}

/// Return the number of points of a simplex: its vertices and those inside its edges.
pub fn stride(dimension: usize, order: Option<Order>) -> usize {
    let inside = order.map_or(0, |order| order.degree() - 1);
    dimension + 1 + dimension * (dimension + 1) / 2 * inside
}

/// Invert the orientation of a cell: exchange its last two vertices and the points of edges that go with them.
fn mirror(cell: &mut [u32]) {
    match cell.len() {
        4 => cell.swap(2, 3),
        10 => [(2, 3), (5, 8), (6, 7)].into_iter().for_each(|(a, b)| cell.swap(a, b)),
        points => {
            let degree = points / 3;
            cell.swap(1, 2);
            (3..degree + 2).for_each(|at| cell.swap(at, at + 2 * (degree - 1)));
            cell[degree + 2..2 * degree + 1].reverse();
        }
    }
}

/// Turn a simplex to positive volume if it is a cell of `space`. Return `false` if it has no extent.
pub fn turn(simplex: &mut [u32], points: &[[f64; 3]], dimension: usize, space: usize) -> bool {
    let mut vertices = [[0.0; 3]; 4];
    vertices.iter_mut().zip(&simplex[..=dimension]).for_each(|(vertex, point)| *vertex = points[*point as usize]);
    let vertices = &vertices[..=dimension];
    let vertices = &of_unit_size(vertices)[..=dimension];
    let measure = measure(vertices, space);
    if is_degenerate(vertices, measure) {
        return false;
    }
    if dimension == space && measure < 0.0 {
        mirror(simplex);
    }
    true
}

/// Translate the first of up to four vertices to the origin and scale them by a power of two, which is exact. The
/// largest difference of coordinates is then near one, so that powers of lengths neither vanish nor overflow.
fn of_unit_size(vertices: &[[f64; 3]]) -> [[f64; 3]; 4] {
    let mut scaled = [[0.0; 3]; 4];
    for (edge, vertex) in scaled.iter_mut().zip(vertices) {
        *edge = std::array::from_fn(|c| vertex[c] - vertices[0][c]);
    }
    let largest = scaled.iter().flatten().fold(0.0f64, |most, x| most.max(x.abs()));
    // The root of the scale is applied twice, since the reciprocal of a tiny number overflows.
    let root = if largest > 0.0 { (-0.5 * largest.log2()).round().exp2() } else { 1.0 };
    scaled.iter_mut().flatten().for_each(|x| *x = *x * root * root);
    scaled
}

/// Return the signed measure of the simplex on these vertices, times the factorial of its dimension. The sign is
/// meaningful for cells alone: for triangles if `space` is 2, for tetrahedra if it is 3. Coordinates are (x, y, z); z
/// is unused in the plane.
pub fn measure(vertices: &[[f64; 3]], space: usize) -> f64 {
    let edge = |to: usize| Vector3::from(vertices[to]) - Vector3::from(vertices[0]);
    match vertices.len() {
        2 => edge(1).norm(),
        3 if space == 2 => edge(1).cross(&edge(2)).z,
        3 => edge(1).cross(&edge(2)).norm(),
        4 => edge(1).cross(&edge(2)).dot(&edge(3)),
        _ => 1.0,
    }
}

/// Return whether a simplex of unit size with this [`measure`] has no extent, to rounding. A measure that is not finite
/// counts as none.
fn is_degenerate(vertices: &[[f64; 3]], measure: f64) -> bool {
    let pairs = vertices.iter().enumerate().flat_map(|(i, a)| vertices[..i].iter().map(move |b| (a, b)));
    let longest = pairs.map(|(a, b)| (Vector3::from(*a) - Vector3::from(*b)).norm()).fold(0.0, f64::max);
    let smallest = 1e-12 * longest.powi(vertices.len() as i32 - 1);
    // A point has measure 1 and passes.
    !measure.is_finite() || measure.abs() <= smallest
}

#[cfg(test)]
mod tests {
    use super::*;

    const TETRAHEDRON: [[f64; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

    #[test]
    fn measures_have_their_sign() {
        assert_eq!(measure(&TETRAHEDRON, 3), 1.0);
        assert_eq!(measure(&TETRAHEDRON[..3], 2), 1.0);
        let [a, b, c, d] = TETRAHEDRON;
        assert_eq!(measure(&[a, c, b, d], 3), -1.0);
        assert_eq!(measure(&[a, c, b], 2), -1.0);
        assert_eq!(measure(&[a, c, b], 3), 1.0);
    }

    #[test]
    fn flat_simplices_are_degenerate_whatever_their_size() {
        let [a, b, c, d] = TETRAHEDRON;
        for size in [1.0, 1e-120, 1e120, 1e-300, 1e300] {
            let turns = |points: &[[f64; 3]]| {
                let points: Vec<_> = points.iter().map(|x| x.map(|x| size * x)).collect();
                turn(&mut [0, 1, 2, 3][..points.len()], &points, points.len() - 1, 3)
            };
            assert!(turns(&[a, b, c, d]) && turns(&[a, b, c]) && turns(&[a, b]) && turns(&[a]));
            assert!(!turns(&[a, b, c, [0.3, 0.3, 1e-14]]) && !turns(&[a, b, [2.0, 1e-13, 0.0]]) && !turns(&[a, a]));
        }
        assert!(!turn(&mut [0, 1], &[a, [f64::INFINITY, 0.0, 0.0]], 1, 3));
    }

    /// Each mid-edge stays between the same two vertices: its number is the sum of the powers of ten of these.
    #[test]
    fn mirrored_cells_keep_their_edges() {
        for vertices in [3, 4] {
            let edges = &EDGES[..vertices * (vertices - 1) / 2];
            let corners = (0..vertices as u32).map(|vertex| 10_u32.pow(vertex));
            let middles = edges.iter().map(|[a, b]| 10_u32.pow(*a as u32) + 10_u32.pow(*b as u32));
            let mut cell: Vec<u32> = corners.chain(middles).collect();
            let before = cell.clone();
            mirror(&mut cell);
            assert_ne!(before, cell);
            assert!(edges.iter().zip(&cell[vertices..]).all(|([a, b], middle)| *middle == cell[*a] + cell[*b]));
        }
    }
}
