//! Lagrange simplices of order one and two in barycentric coordinates.
//!
//! ```text
//! line       triangle          tetrahedron (VTK)
//!                2               3
//! 0-(2)-1       5 4              edges 4: 01, 5: 12, 6: 02, 7: 03, 8: 13, 9: 23
//!              0 3 1
//! ```
//! In barycentric coordinates l the shape functions of lines, triangles and tetrahedra are the same: phi_i = l_i for order one,
//! and l_i (2 l_i - 1) at vertices and 4 l_i l_j on edges for order two.

use crate::problem::order::Order;

/// Edges of the simplex with four vertices in the order of the mid-edge nodes. A triangle uses 01 12 02 and a line 01.
pub const EDGES: [(usize, usize); 6] = [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)];

/// Largest number of nodes of an element (P2 tetrahedron).
pub const MOST: usize = 10;

/// Return the number of nodes of the simplex with `vertices` vertices.
pub fn node_count(vertices: usize, order: Order) -> usize {
    match order {
        Order::P1 => vertices,
        Order::P2 => vertices * (vertices + 1) / 2,
    }
}

/// Return the values of the shape functions at barycentric point `l`; the first `node_count` entries are set.
pub fn values(order: Order, l: &[f64]) -> [f64; MOST] {
    let vertices = l.len();
    let mut phi = [0.0; MOST];
    match order {
        Order::P1 => phi[..vertices].copy_from_slice(l),
        Order::P2 => {
            for i in 0..vertices {
                phi[i] = l[i] * (2.0 * l[i] - 1.0);
            }
            for (k, &(i, j)) in EDGES[..vertices * (vertices - 1) / 2].iter().enumerate() {
                phi[vertices + k] = 4.0 * l[i] * l[j];
            }
        }
    }
    phi
}

/// Return the derivatives of the shape functions by the barycentric coordinates (as independent variables) at `l`. Entry
/// `[node][coordinate]` is zero beyond the coordinates of `l`.
pub fn derivatives(order: Order, l: &[f64]) -> [[f64; 4]; MOST] {
    let vertices = l.len();
    let mut d = [[0.0; 4]; MOST];
    match order {
        Order::P1 => {
            for i in 0..vertices {
                d[i][i] = 1.0;
            }
        }
        Order::P2 => {
            for i in 0..vertices {
                d[i][i] = 4.0 * l[i] - 1.0;
            }
            for (k, &(i, j)) in EDGES[..vertices * (vertices - 1) / 2].iter().enumerate() {
                d[vertices + k][i] = 4.0 * l[j];
                d[vertices + k][j] = 4.0 * l[i];
            }
        }
    }
    d
}

/// Return the barycentric coordinates of a node of an element with so many vertices.
pub fn place(vertices: usize, node: usize) -> [f64; 4] {
    let ends = node.checked_sub(vertices).map_or((node, node), |edge| EDGES[edge]);
    std::array::from_fn(|k| 0.5 * f64::from(u8::from(k == ends.0) + u8::from(k == ends.1)))
}

/// Return the barycentric coordinates of the nodes of an element with `N` vertices.
pub fn nodes<const N: usize>(order: Order) -> Vec<[f64; N]> {
    (0..node_count(N, order)).map(|node| std::array::from_fn(|k| place(N, node)[k])).collect()
}

/// Return the gradients in space of the shape functions of a cell at barycentric point `l`, and the measure there. The measure is
/// the area or volume of the affine simplex with the same Jacobian. The result is `None` if the map is singular or inverted there.
///
/// `l` has D + 1 entries, and `x` are the coordinates of the element's nodes (isoparametric).
pub fn gradients<const D: usize>(order: Order, x: &[[f64; D]], l: &[f64]) -> Option<([[f64; D]; MOST], f64)> {
    let d = derivatives(order, l);
    // Column c of the Jacobian is the derivative along l_{c+1} - l_0.
    let mut jacobian = [[0.0; D]; D];
    for (node, x) in x.iter().enumerate() {
        for c in 0..D {
            let slope = d[node][c + 1] - d[node][0];
            for i in 0..D {
                jacobian[i][c] += x[i] * slope;
            }
        }
    }
    let (inverse, det) = invert(&jacobian)?;
    let mut gradient = [[0.0; D]; MOST];
    for node in 0..x.len() {
        for i in 0..D {
            gradient[node][i] = (0..D).map(|c| inverse[c][i] * (d[node][c + 1] - d[node][0])).sum();
        }
    }
    let measure = det / if D == 2 { 2.0 } else { 6.0 };
    (measure > 0.0).then_some((gradient, measure))
}

/// Return the inverse and the determinant of a matrix; `None` if it is singular or the determinant overflows.
fn invert<const D: usize>(a: &[[f64; D]; D]) -> Option<([[f64; D]; D], f64)> {
    let mut inverse = [[0.0; D]; D];
    let det;
    if D == 2 {
        det = a[0][0] * a[1][1] - a[0][1] * a[1][0];
        inverse[0][0] = a[1][1];
        inverse[0][1] = -a[0][1];
        inverse[1][0] = -a[1][0];
        inverse[1][1] = a[0][0];
    } else {
        for i in 0..3 {
            for j in 0..3 {
                let (p, q, r, s) = ((j + 1) % 3, (j + 2) % 3, (i + 1) % 3, (i + 2) % 3);
                inverse[i][j] = a[p][r] * a[q][s] - a[p][s] * a[q][r];
            }
        }
        det = (0..3).map(|j| a[0][j] * inverse[j][0]).sum();
    }
    if det == 0.0 || !det.is_finite() {
        return None;
    }
    for row in &mut inverse {
        for entry in row {
            *entry /= det;
        }
    }
    Some((inverse, det))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn nodal<const N: usize>(order: Order) {
        for (i, l) in nodes::<N>(order).iter().enumerate() {
            let phi = values(order, l);
            for (j, phi) in phi.iter().enumerate() {
                assert_eq!(*phi, if i == j { 1.0 } else { 0.0 });
            }
        }
    }

    #[test]
    fn shape_functions_are_one_at_their_node_and_zero_at_the_others() {
        for order in [Order::P1, Order::P2] {
            nodal::<2>(order);
            nodal::<3>(order);
            nodal::<4>(order);
        }
    }

    #[test]
    fn gradients_reproduce_a_quadratic_field_on_a_skewed_tetrahedron() {
        let corner = [[0.1, 0.0, 0.2], [1.3, 0.1, 0.0], [0.0, 0.9, 0.3], [0.2, 0.4, 1.1]];
        let x: Vec<[f64; 3]> = nodes::<4>(Order::P2)
            .iter()
            .map(|l| std::array::from_fn(|i| (0..4).map(|v| l[v] * corner[v][i]).sum()))
            .collect();
        let field = |x: &[f64; 3]| x[0] * x[1] - 2.0 * x[2] * x[2] + x[0];
        let l = [0.2, 0.3, 0.1, 0.4];
        let (gradient, measure) = gradients(Order::P2, &x, &l).expect("positive volume");
        let at: [f64; 3] = std::array::from_fn(|i| (0..4).map(|v| l[v] * corner[v][i]).sum());
        let exact = [at[1] + 1.0, at[0], -4.0 * at[2]];
        for i in 0..3 {
            let sum: f64 = (0..10).map(|n| gradient[n][i] * field(&x[n])).sum();
            assert!((sum - exact[i]).abs() < 1e-13, "{i}: {sum} {}", exact[i]);
        }
        let mut swapped = x.clone();
        swapped.swap(0, 1);
        swapped.swap(5, 6);
        swapped.swap(7, 8);
        assert!(gradients(Order::P2, &swapped, &l).is_none(), "inverted: {measure}");
        let flat = x.iter().map(|x| [x[0], x[1], 0.0]).collect::<Vec<_>>();
        assert!(gradients(Order::P2, &flat, &l).is_none(), "flat");
        let far = x.iter().map(|x| x.map(|x| 1e150 * x)).collect::<Vec<_>>();
        assert!(gradients(Order::P2, &far, &l).is_none(), "beyond the range of numbers");
    }
}
