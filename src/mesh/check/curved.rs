//! Curved cells: each node inside an edge serves one edge, and no curved cell is folded.
//!
//! A mesher moves the points of edges to the curved boundary after it has made the straight cells. If a cell is flat,
//! or large in comparison with the radius of the boundary, its map may no longer be one to one. With straight edges it
//! is a good cell. The boundary there is then that of linear elements.

use super::faces::Cells;
use crate::error::Result;
use crate::linalg::{cross, dot, minus, pad};
use crate::mesh::Mesh;
use crate::mesh::shape;
use crate::mesh::simplex::EDGES;
use crate::problem::order::Order;
use nalgebra::DMatrix;
use std::collections::HashSet;
use std::sync::OnceLock;

/// Share of the largest coefficient of a Jacobian below which a value is rounding. The Jacobian is zero where a cell is flat at
/// a corner, as at the end of two edges that touch each other.
const ROUNDING: f64 = 1e-9;

/// Check the nodes inside the edges of a body and the Jacobians of its curved cells.
///
/// # Errors
/// A node is on two edges or at a corner of another one, or a cell is folded. The error gives the cell and the place in
/// it.
pub fn check<const D: usize>(cells: &Cells<D>) -> Result<()> {
    if !cells.is_curved() {
        return Ok(());
    }
    let mut ends = vec![None; cells.node_count()];
    for cell in 0..cells.count() {
        let nodes = cells.cell(cell);
        for j in 0..=D {
            for i in 0..=j {
                let inside = (i < j).then(|| cells.simplices().inside(cell, [i, j])).into_iter().flatten();
                let own = [nodes[i].min(nodes[j]), nodes[i].max(nodes[j])];
                for node in inside.chain((i == j).then_some(nodes[i])) {
                    if *ends[node as usize].get_or_insert(own) != own {
                        let error = cells.refuse("a node lies on two edges", &[cell], cells.at(node));
                        return Err(error.help("mesh the geometry again"));
                    }
                }
            }
        }
        let x: Vec<[f64; 3]> = nodes.iter().map(|&node| cells.at(node)).collect();
        if is_curved(&x, D) && is_folded(&x, D) {
            let error = cells.refuse("a curved cell is folded", &[cell], cells.at(nodes[0]));
            return Err(error.help("refine the mesh there, or use order = 1"));
        }
    }
    Ok(())
}

/// Return the points inside each edge of a simplex, with their number and the ends of the edge.
fn edges(points: usize, dimension: usize) -> (usize, impl Iterator<Item = ([usize; 2], usize)>) {
    let edges = dimension * (dimension + 1) / 2;
    let inside = (points - dimension - 1) / edges;
    (inside, EDGES.into_iter().zip((dimension + 1..points).step_by(inside.max(1))))
}

/// Return whether a cell has a point of an edge that is off its place on the chord by more than rounding. Most cells
/// have none.
fn is_curved(x: &[[f64; 3]], dimension: usize) -> bool {
    let (inside, mut edges) = edges(x.len(), dimension);
    edges.any(|([i, j], first)| {
        let size: f64 = (0..3).map(|c| (x[j][c] - x[i][c]).abs()).sum();
        (0..inside).any(|k| {
            let at = on_chord([x[i], x[j]], k, inside);
            (0..3).any(|c| (x[first + k][c] - at[c]).abs() > 0.5 * ROUNDING * size)
        })
    })
}

/// Return the place of point `k` of so many inside an edge if it is straight.
fn on_chord<const N: usize>([a, b]: [[f64; N]; 2], k: usize, inside: usize) -> [f64; N] {
    let s = (k + 1) as f64 / (inside + 1) as f64;
    std::array::from_fn(|c| (1.0 - s) * a[c] + s * b[c])
}

/// Return whether a curved cell with these nodes, corners first, may be folded: a coefficient of its Jacobian in
/// Bernstein's basis is negative.
///
/// The Jacobian is a polynomial that lies between its least and its largest coefficient. A cell that passes has none
/// that is negative. One that fails may still be good, but is so distorted that its straight form serves better.
fn is_folded(x: &[[f64; 3]], dimension: usize) -> bool {
    let coefficients = if dimension == 2 { areas(x) } else { volumes(&control_points(x)) };
    let largest = coefficients.iter().fold(0.0, |max: f64, c| max.max(c.abs()));
    coefficients.iter().any(|c| *c < -ROUNDING * largest)
}

/// Return the powers of l_0, l_1 and l_2 in each polynomial of Bernstein's basis of a degree on the triangle.
fn powers(degree: usize) -> impl Iterator<Item = [usize; 3]> {
    (0..=degree).flat_map(move |j| (0..=degree - j).map(move |i| [degree - i - j, i, j]))
}

/// Return the position of powers among all [`powers`] of their degree.
fn index(powers: [usize; 3]) -> usize {
    let degree: usize = powers.iter().sum();
    (0..powers[2]).map(|j| degree + 1 - j).sum::<usize>() + powers[1]
}

/// Return the multinomial coefficient of powers.
fn multinomial(powers: [usize; 3]) -> f64 {
    let choose = |n: usize, k: usize| (1..=k).map(|i| (n - k + i) as f64 / i as f64).product::<f64>();
    choose(powers.iter().sum(), powers[0]) * choose(powers[1] + powers[2], powers[1])
}

/// Return the matrix from the points of a triangle of a degree to the control points of its [map](shape).
fn to_control_points(order: Order) -> &'static DMatrix<f64> {
    static MATRICES: [OnceLock<DMatrix<f64>>; Order::HIGHEST] = [const { OnceLock::new() }; Order::HIGHEST];
    let degree = order.degree();
    MATRICES[degree - 1].get_or_init(|| {
        let all: Vec<[usize; 3]> = powers(degree).collect();
        let place = |at: &[usize; 3]| at.map(|power| power as f64 / degree as f64);
        let values: Vec<f64> = all.iter().flat_map(|at| shape::weights(order, &place(at))).collect();
        let values = DMatrix::from_row_slice(all.len(), 3 * degree, &values);
        let basis = DMatrix::from_fn(all.len(), all.len(), |row, column| {
            let l = place(&all[row]);
            multinomial(all[column]) * (0..3).map(|k| l[k].powi(all[column][k] as i32)).product::<f64>()
        });
        basis.lu().solve(&values).unwrap_or(values)
    })
}

/// Return the coefficients of the Jacobian of a triangle in Bernstein's basis.
///
/// With the control points b of degree k, the derivatives along the edges 01 and 02 have the control points k (b_(p +
/// e_1) - b_(p + e_0)) and k (b_(p + e_2) - b_(p + e_0)). The coefficient of a product of two polynomials is the mean
/// of the products of theirs, with multinomial weights.
fn areas(x: &[[f64; 3]]) -> Vec<f64> {
    let Some(order) = Order::new(x.len() / 3) else { return Vec::new() };
    let (matrix, degree) = (to_control_points(order), order.degree());
    let b: Vec<[f64; 2]> = (0..matrix.nrows())
        .map(|row| std::array::from_fn(|c| x.iter().enumerate().map(|(k, x)| matrix[(row, k)] * x[c]).sum()))
        .collect();
    let along = |at: [usize; 3], k: usize| -> [f64; 2] {
        let raised = |k: usize| b[index(std::array::from_fn(|i| at[i] + usize::from(i == k)))];
        minus(raised(k), raised(0))
    };
    let below: Vec<([usize; 3], f64, [[f64; 2]; 2])> =
        powers(degree - 1).map(|at| (at, multinomial(at), [along(at, 1), along(at, 2)])).collect();
    let mut coefficients = vec![0.0; degree * (2 * degree - 1)];
    for (p, weight, [first, _]) in &below {
        for (q, other, [_, second]) in &below {
            let sum: [usize; 3] = std::array::from_fn(|i| p[i] + q[i]);
            coefficients[index(sum)] +=
                weight * other / multinomial(sum) * (first[0] * second[1] - first[1] * second[0]);
        }
    }
    coefficients
}

/// Return the control points `b_ij` of the quadratic map `sum_ij l_i l_j b_ij` from the corners and mid-edge nodes of a
/// tetrahedron, where `l_i` are the barycentric coordinates.
fn control_points(x: &[[f64; 3]]) -> [[[f64; 3]; 4]; 4] {
    let mut b = [[[0.0; 3]; 4]; 4];
    (0..4).for_each(|i| b[i][i] = x[i]);
    for (&middle, [i, j]) in x[4..].iter().zip(EDGES) {
        b[i][j] = std::array::from_fn(|c| 2.0 * middle[c] - 0.5 * (x[i][c] + x[j][c]));
        b[j][i] = b[i][j];
    }
    b
}

/// Return the coefficients of the Jacobian of a quadratic tetrahedron in Bernstein's basis. The derivative along edge
/// 0a is `2 sum_k l_k (b_ak - b_0k)`. The coefficient of a determinant of such sums at `l_k l_m l_n` is the mean over
/// all orders of k, m and n.
fn volumes(b: &[[[f64; 3]; 4]; 4]) -> Vec<f64> {
    let d = |a: usize, k: usize| -> [f64; 3] { minus(b[a][k], b[0][k]) };
    let volume = |[k, m, n]: [usize; 3]| dot(&d(1, k), &cross(d(2, m), d(3, n)));
    let orders = |k, m, n| [[k, m, n], [m, n, k], [n, k, m], [m, k, n], [k, n, m], [n, m, k]];
    let triples = (0..4).flat_map(|k| (0..=k).flat_map(move |m| (0..=m).map(move |n| (k, m, n))));
    triples.map(|(k, m, n)| orders(k, m, n).map(volume).iter().sum::<f64>() / 6.0).collect()
}

impl<const D: usize> Mesh<D> {
    /// Make the edges of all folded cells straight until no cell is folded, and count the cells in [`Mesh::straightened`].
    /// Neighbours share the edges, so a straight edge may fold another cell, which becomes straight in the next pass. A node moves once: one that serves
    /// two edges, as with a wrong node number, would move for ever. The checks report it.
    pub fn straighten(&mut self) {
        if self.order == Order::P1 {
            return;
        }
        let mut straight_points = HashSet::new();
        loop {
            let folded: Vec<Vec<u32>> = self.folded_cells();
            if folded.is_empty() {
                return;
            }
            let mut has_moved = false;
            for cell in &folded {
                let (inside, edges) = edges(cell.len(), D);
                for ([i, j], first) in edges {
                    let ends = [cell[i], cell[j]].map(|node| self.points[node as usize]);
                    for k in (0..inside).filter(|k| straight_points.insert(cell[first + k])) {
                        let straight = on_chord(ends, k, inside);
                        let point = &mut self.points[cell[first + k] as usize];
                        has_moved |= std::mem::replace(point, straight) != straight;
                    }
                }
            }
            if !has_moved {
                // The cells are inverted even with straight edges. The checks report them.
                return;
            }
            self.straightened += folded.len();
        }
    }

    /// Return the nodes of the folded cells, one list per cell.
    fn folded_cells(&self) -> Vec<Vec<u32>> {
        let of_cells = self.groups.iter().filter(|group| group.dimension == D);
        let cells = of_cells.flat_map(|group| group.connectivity.chunks_exact(group.stride));
        let place = |&node: &u32| pad(self.points[node as usize]);
        let folded = |cell: &&[u32]| {
            let x: Vec<[f64; 3]> = cell.iter().map(place).collect();
            is_curved(&x, D) && is_folded(&x, D)
        };
        let mut found: Vec<Vec<u32>> = cells.filter(folded).map(<[u32]>::to_vec).collect();
        // A cell may be in several groups.
        found.sort_unstable();
        found.dedup();
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Group;

    fn triangle(middle: [f64; 3]) -> bool {
        let x = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.5, 0.0, 0.0], middle, [0.0, 0.5, 0.0]];
        is_folded(&x, 2)
    }

    /// With the middle of 12 at (a, a) the Jacobian is 1 at corner 0. Its least value is 4 a - 1, at corners 1 and 2.
    #[test]
    fn a_triangle_folds_at_a_quarter() {
        assert!(!triangle([0.5, 0.5, 0.0]) && !triangle([0.25 + 1e-6, 0.25 + 1e-6, 0.0]));
        assert!(triangle([0.25 - 1e-6, 0.25 - 1e-6, 0.0]));
    }

    /// A triangle with the arc of an angle as its edge 12, and the least Jacobian that differences of its map have on a
    /// grid.
    fn sector(order: Order, angle: f64) -> (Vec<[f64; 3]>, f64) {
        let degree = order.degree();
        let arc = |s: f64| [(angle * s).cos(), (angle * s).sin(), 0.0];
        let mut x = vec![[0.0; 3], arc(0.0), arc(1.0)];
        let share = |k: usize| k as f64 / degree as f64;
        x.extend((1..degree).map(|k| arc(0.0).map(|c| share(k) * c)));
        x.extend((1..degree).map(|k| arc(share(k))));
        x.extend((1..degree).map(|k| arc(1.0).map(|c| share(k) * c)));
        let at = |u: f64, v: f64| -> [f64; 2] {
            let weights = shape::weights(order, &[1.0 - u - v, u, v]);
            std::array::from_fn(|c| weights.iter().zip(&x).map(|(weight, x)| weight * x[c]).sum())
        };
        let (n, step) = (12, 1e-5);
        let jacobian = |(i, j): (usize, usize)| {
            let [u, v] = [i, j].map(|k| k as f64 / n as f64);
            let along = |p: [f64; 2], q: [f64; 2]| minus(p, q).map(|d| 0.5 * d / step);
            let (a, b) = (along(at(u + step, v), at(u - step, v)), along(at(u, v + step), at(u, v - step)));
            a[0] * b[1] - a[1] * b[0]
        };
        let least = (0..=n).flat_map(|i| (0..=n - i).map(move |j| (i, j))).map(jacobian).fold(f64::INFINITY, f64::min);
        (x, least)
    }

    /// Sectors of any order that pass have a positive Jacobian. That of more than 180 degrees is folded at its centre.
    #[test]
    fn triangles_of_all_orders_that_pass_are_not_folded() {
        for order in (2..=Order::HIGHEST).filter_map(Order::new) {
            for angle in [0.3, 0.8, 1.2, 1.6, 2.0, 2.4, 2.8, 3.1, 3.5, 4.5] {
                let (x, least) = sector(order, angle);
                assert!(is_folded(&x, 2) || least > -1e-6, "{order:?} {angle}: {least}");
            }
            assert!(!is_folded(&sector(order, 1.2).0, 2) && is_folded(&sector(order, 3.5).0, 2), "{order:?}");
        }
    }

    /// Return the least Jacobian of the map with these control points on a grid of the cell.
    fn least(b: &[[[f64; 3]; 4]; 4]) -> f64 {
        let n = 12;
        let grid =
            (0..=n).flat_map(|i| (0..=n - i).flat_map(move |j| (0..=n - i - j).map(move |k| [n - i - j - k, i, j, k])));
        let jacobian = |l: [usize; 4]| {
            let l = l.map(|i| i as f64 / n as f64);
            let d = |a: usize| -> [f64; 3] {
                std::array::from_fn(|c| (0..4).map(|k| l[k] * (b[a][k][c] - b[0][k][c])).sum())
            };
            dot(&d(1), &cross(d(2), d(3)))
        };
        grid.map(jacobian).fold(f64::INFINITY, f64::min)
    }

    /// The mid-edge nodes of the tetrahedra are random. A cell that passes has a positive Jacobian.
    #[test]
    fn tetrahedra_that_pass_are_not_folded() {
        let mut state = 1_u64;
        let mut random = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 33) as f64 / 2f64.powi(31) - 0.5
        };
        let mut counts = [0; 2];
        for _ in 0..300 {
            let corners = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
            let size = 0.2 + 0.4 * random();
            let middle = |[i, j]: [usize; 2]| -> [f64; 3] {
                std::array::from_fn(|c| 0.5 * (corners[i][c] + corners[j][c]) + size * random())
            };
            let x = [&corners[..], &EDGES.map(middle)].concat();
            let (found, least) = (is_folded(&x, 3), least(&control_points(&x)));
            assert!(found || least > 0.0, "{least}");
            counts[usize::from(found)] += 1;
        }
        assert!(counts.iter().all(|&count| count > 30), "{counts:?}");
    }

    /// Return two quadratic triangles on the square of four corners. The mid-edge node of the bottom is at the height `bottom`.
    /// The one of the diagonal is moved by `bent` towards the lower corner.
    fn square(bottom: f64, bent: f64) -> Mesh<2> {
        let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let middles = [[0.5, bottom], [1.0, 0.5], [0.5 + bent, 0.5 - bent], [0.5, 1.0], [0.0, 0.5]];
        let points = [&corners[..], &middles].concat();
        let connectivity = vec![0, 1, 2, 4, 5, 6, 0, 2, 3, 6, 7, 8];
        let group = Group { name: "body".into(), dimension: 2, stride: 6, connectivity, tags: Vec::new() };
        Mesh::new("a.msh".into(), points, Order::P2, vec![group].into())
    }

    #[test]
    fn folded_cells_become_straight_and_others_stay_as_they_are() {
        let mut good = square(0.1, 0.1);
        good.straighten();
        assert_eq!((good.straightened, good.points[4], good.points[6]), (0, [0.5, 0.1], [0.6, 0.4]));
        let mut folded = square(0.6, 0.0);
        folded.straighten();
        assert_eq!((folded.straightened, folded.points[4]), (1, [0.5, 0.0]));
        // The diagonal folds the lower cell, and it is an edge of the upper cell, too.
        let mut both = square(0.0, 0.4);
        both.straighten();
        assert_eq!((both.straightened, both.points[6]), (1, [0.5, 0.5]));
        // a node of two edges, as with a wrong node number, ends the work
        let mut wrong = square(0.0, 0.4);
        wrong.groups[0].connectivity = vec![0, 1, 2, 4, 5, 6, 1, 3, 2, 6, 7, 8];
        wrong.straighten();
        let mut linear = square(0.6, 0.0).lower_order();
        linear.straighten();
        assert_eq!(linear.straightened, 0);
    }
}
