//! Quadratic cells: each mid-edge node serves one edge, and no curved cell is folded.
//!
//! A mesher moves mid-edge nodes to the curved boundary after it has made the straight cells. If a cell is flat, or large in
//! comparison with the radius of the boundary, its map may no longer be one to one. With straight edges it is a good cell. The
//! boundary there is then that of linear elements.

use super::faces::Cells;
use crate::error::Result;
use crate::linalg::{cross, dot, minus, pad};
use crate::mesh::Mesh;
use crate::mesh::simplex::EDGES;
use crate::problem::order::Order;
use std::collections::HashSet;

/// Share of the largest coefficient of a Jacobian below which a value is rounding. The Jacobian is zero where a cell is flat at
/// a corner, as at the end of two edges that touch each other.
const ROUNDING: f64 = 1e-9;

/// Check the mid-edge nodes of a body and the Jacobians of its curved cells.
///
/// # Errors
/// A mid-edge node is on two edges or at a corner, or a cell is folded. The error gives the cell and the place in it.
pub fn check<const D: usize>(cells: &Cells<D>) -> Result<()> {
    if !cells.is_quadratic() {
        return Ok(());
    }
    let mut ends = vec![None; cells.node_count()];
    for cell in 0..cells.count() {
        let nodes = cells.cell(cell);
        for j in 0..=D {
            for i in 0..=j {
                let node = if i == j { nodes[i] } else { cells.simplices().middle(cell, [i, j]) };
                let own = [nodes[i].min(nodes[j]), nodes[i].max(nodes[j])];
                if *ends[node as usize].get_or_insert(own) != own {
                    let error = cells.refuse("a node lies on two edges", &[cell], cells.at(node));
                    return Err(error.help("mesh the geometry again"));
                }
            }
        }
        if is_folded(&nodes.iter().map(|&node| cells.at(node)).collect::<Vec<_>>(), D) {
            let error = cells.refuse("a curved cell is folded", &[cell], cells.at(nodes[0]));
            return Err(error.help("refine the mesh there, or use order = 1"));
        }
    }
    Ok(())
}

/// Return whether a quadratic cell with these nodes, corners first, may be folded: a coefficient of its Jacobian in Bernstein's basis is negative.
///
/// The Jacobian is a polynomial of degree D, which lies between its least and its largest coefficient. A cell that passes has none that is
/// negative. One that fails may still be good, but is so distorted that its straight form serves better.
fn is_folded(x: &[[f64; 3]], dimension: usize) -> bool {
    let coefficients = coefficients(&control_points(x, dimension), dimension);
    let largest = coefficients.iter().fold(0.0, |max: f64, c| max.max(c.abs()));
    coefficients.iter().any(|c| *c < -ROUNDING * largest)
}

/// Return the control points `b_ij` of the quadratic map `sum_ij l_i l_j b_ij` from corners and mid-edge nodes, where `l_i` are
/// the barycentric coordinates.
fn control_points(x: &[[f64; 3]], dimension: usize) -> [[[f64; 3]; 4]; 4] {
    let mut b = [[[0.0; 3]; 4]; 4];
    (0..=dimension).for_each(|i| b[i][i] = x[i]);
    for (&middle, [i, j]) in x[dimension + 1..].iter().zip(EDGES) {
        b[i][j] = std::array::from_fn(|c| 2.0 * middle[c] - 0.5 * (x[i][c] + x[j][c]));
        b[j][i] = b[i][j];
    }
    b
}

/// Return the coefficients of the Jacobian in Bernstein's basis. The derivative along edge 0a is `2 sum_k l_k (b_ak - b_0k)`. The coefficient of a
/// determinant of such sums at `l_k l_m ...` is the mean over all orders of k, m, ...
fn coefficients(b: &[[[f64; 3]; 4]; 4], dimension: usize) -> Vec<f64> {
    let d = |a: usize, k: usize| -> [f64; 3] { minus(b[a][k], b[0][k]) };
    if dimension == 2 {
        let area = |k: usize, m: usize| cross(d(1, k), d(2, m))[2];
        let pairs = (0..3).flat_map(|k| (0..=k).map(move |m| (k, m)));
        return pairs.map(|(k, m)| 0.5 * (area(k, m) + area(m, k))).collect();
    }
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
        let mut straight_edges = HashSet::new();
        loop {
            let folded: Vec<Vec<u32>> = self.folded_cells();
            if folded.is_empty() {
                return;
            }
            let mut has_moved = false;
            for cell in &folded {
                for (&[i, j], &middle) in EDGES.iter().zip(&cell[D + 1..]) {
                    if !straight_edges.insert(middle) {
                        continue;
                    }
                    let [x, y] = [cell[i], cell[j]].map(|node| self.points[node as usize]);
                    let straight = std::array::from_fn(|c| 0.5 * (x[c] + y[c]));
                    has_moved |= std::mem::replace(&mut self.points[middle as usize], straight) != straight;
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
        let folded = |cell: &&[u32]| is_folded(&cell.iter().map(place).collect::<Vec<_>>(), D);
        let mut found: Vec<Vec<u32>> =
            cells.filter(|cell| self.is_curved(cell)).filter(folded).map(<[u32]>::to_vec).collect();
        // A cell may be in several groups.
        found.sort_unstable();
        found.dedup();
        found
    }

    /// Return whether a quadratic cell has an edge whose middle is off its chord by more than rounding. Most cells have none.
    fn is_curved(&self, cell: &[u32]) -> bool {
        EDGES.iter().zip(&cell[D + 1..]).any(|(&[i, j], &middle)| {
            let [x, y, m] = [cell[i], cell[j], middle].map(|node| self.points[node as usize]);
            (0..D).any(|c| (2.0 * m[c] - x[c] - y[c]).abs() > 1e-9 * (0..D).map(|c| (x[c] - y[c]).abs()).sum::<f64>())
        })
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
            let (found, least) = (is_folded(&x, 3), least(&control_points(&x, 3)));
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
