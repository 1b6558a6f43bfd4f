//! Properties of single simplices: sizes, orientation, Gmsh's numbering.

use crate::problem::order::Order;
use nalgebra::Vector3;

/// Gmsh's words for entities of dimension 0 to 3, as in `Physical Surface`.
pub const THINGS: [&str; 4] = ["Point", "Curve", "Surface", "Volume"];

/// A simplex type of Gmsh.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Kind {
    /// Dimension, 0 to 3.
    pub dimension: usize,
    /// Order; `None` for points, which have none.
    pub order: Option<Order>,
    /// Points per simplex.
    pub stride: usize,
}

impl Kind {
    /// Return the simplex that an element type number of Gmsh stands for, if this program computes with it.
    pub fn of_type(number: i32) -> Option<Kind> {
        let (dimension, order, stride) = match number {
            15 => (0, None, 1),
            1 => (1, Some(Order::P1), 2),
            8 => (1, Some(Order::P2), 3),
            2 => (2, Some(Order::P1), 3),
            9 => (2, Some(Order::P2), 6),
            4 => (3, Some(Order::P1), 4),
            11 => (3, Some(Order::P2), 10),
            _ => return None,
        };
        Some(Kind { dimension, order, stride })
    }

    /// Return the simplex of a dimension from 1 on and an order.
    pub fn simplex(dimension: usize, order: Order) -> Kind {
        let middles = if order == Order::P1 { 0 } else { dimension * (dimension + 1) / 2 };
        Kind { dimension, order: Some(order), stride: dimension + 1 + middles }
    }
}

/// Return Gmsh's name of an element type and its number of nodes, for types 1 to 31.
pub fn type_name(number: i32) -> Option<(&'static str, usize)> {
    const NODES: [usize; 31] =
        [2, 3, 4, 4, 8, 6, 5, 3, 6, 9, 10, 27, 18, 14, 1, 8, 20, 15, 13, 9, 10, 12, 15, 15, 21, 4, 5, 6, 20, 35, 56];
    let nodes = *NODES.get(usize::try_from(number).ok()?.checked_sub(1)?)?;
    let name = match number {
        1 | 8 | 26..=28 => "line",
        2 | 9 | 20..=25 => "triangle",
        3 | 10 | 16 => "quadrangle",
        4 | 11 | 29..=31 => "tetrahedron",
        5 | 12 | 17 => "hexahedron",
        6 | 13 | 18 => "prism",
        7 | 14 | 19 => "pyramid",
        _ => "point",
    };
    Some((name, nodes))
}

/// Return the dimension of elements with a name from [`type_name`].
pub fn dimension(name: &str) -> usize {
    match name {
        "point" => 0,
        "line" => 1,
        "triangle" | "quadrangle" => 2,
        _ => 3,
    }
}

/// Reorder the points of a simplex from Gmsh's order to ours. They differ only in the quadratic tetrahedron, where Gmsh has
/// mid-edge 23 before 13.
pub fn from_gmsh_order(simplex: &mut [u32]) {
    if simplex.len() == 10 {
        simplex.swap(8, 9);
    }
}

/// Invert the orientation of a cell: exchange its last two vertices and the mid-edges that go with them.
fn mirror(cell: &mut [u32]) {
    match cell.len() {
        3 => cell.swap(1, 2),
        4 => cell.swap(2, 3),
        6 => {
            cell.swap(1, 2);
            cell.swap(3, 5);
        }
        10 => {
            cell.swap(2, 3);
            cell.swap(5, 8);
            cell.swap(6, 7);
        }
        _ => {}
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

/// Translate the first of up to four vertices to the origin and scale them by a power of two, which is exact. The largest
/// difference of coordinates is then near one, so that powers of lengths neither vanish nor overflow.
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

/// Return the signed measure of the simplex on these vertices, times the factorial of its dimension. The sign is meaningful for
/// cells alone: for triangles if `space` is 2, for tetrahedra if it is 3. Coordinates are (x, y, z); z is unused in the plane.
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

/// Return whether a simplex of unit size with this [`measure`] has no extent, to rounding. A measure that is not finite counts
/// as none.
fn is_degenerate(vertices: &[[f64; 3]], measure: f64) -> bool {
    let mut longest = 0.0_f64;
    for (i, a) in vertices.iter().enumerate() {
        for b in &vertices[..i] {
            longest = longest.max((Vector3::from(*a) - Vector3::from(*b)).norm());
        }
    }
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

    /// Each mid-edge stays between the same two vertices, whatever their order.
    #[test]
    fn mirrored_cells_keep_their_edges() {
        let edges: [(usize, &[[usize; 2]]); 2] =
            [(3, &[[0, 1], [1, 2], [0, 2]]), (4, &[[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]])];
        for (vertices, edges) in edges {
            // The number of a mid-edge point is the sum of the powers of ten of its vertices, so it identifies them.
            let mut cell: Vec<u32> = (0..vertices).map(|vertex| 10_u32.pow(vertex as u32)).collect();
            cell.extend(edges.iter().map(|[a, b]| 10_u32.pow(*a as u32) + 10_u32.pow(*b as u32)).collect::<Vec<_>>());
            let before = cell.clone();
            mirror(&mut cell);
            assert_ne!(before, cell);
            for (k, [a, b]) in edges.iter().enumerate() {
                assert_eq!(cell[vertices + k], cell[*a] + cell[*b]);
            }
        }
    }
}
