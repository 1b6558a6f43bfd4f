//! Curved cells: each node inside an edge serves one edge, and folded cells become straight.
//!
//! A mesher moves the points of edges to the curved boundary after it has made the straight cells. If a cell is flat,
//! or large in comparison with the radius of the boundary, its map may no longer be one to one. With straight edges it
//! is a good cell. The boundary there is then that of linear elements.

use super::faces::Cells;
use crate::error::Result;
use crate::linalg::{cross, dot, length, minus, pad};
use crate::mesh::Mesh;
use crate::mesh::shape;
use crate::problem::order::Order;
use nalgebra::DMatrix;
use std::collections::HashSet;
use std::sync::OnceLock;

/// Share of the largest coefficient of a Jacobian below which a value is rounding. The Jacobian is zero where a cell is
/// flat at a corner, as at the end of two edges that touch each other.
const ROUNDING: f64 = 1e-9;

/// Check the nodes inside the edges of a body. Folded cells are straight since the mesh was loaded
/// ([`Mesh::straighten`]).
///
/// # Errors
/// A node is on two edges or at a corner of another one. The error gives the cell and the place in it.
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
    }
    Ok(())
}

/// Return whether a cell has a point of an edge that is off its place on the chord by more than rounding. Most cells
/// have none.
fn is_curved(x: &[[f64; 3]], dimension: usize) -> bool {
    shape::edges(x, dimension).any(|(ends, inside)| {
        let ends = ends.map(|end| x[end]);
        let most = 0.5 * ROUNDING * length(minus(ends[1], ends[0]));
        let off = |k: usize| length(minus(inside[k], shape::on_chord(ends, k, inside.len())));
        (0..inside.len()).any(|k| off(k) > most)
    })
}

/// Return whether a curved cell with these nodes, corners first, may be folded: a coefficient of its Jacobian in
/// Bernstein's basis is negative.
///
/// The Jacobian is a polynomial that lies between its least and its largest coefficient. A cell that passes has none
/// that is negative. One that fails may still be good, but is so distorted that its straight form serves better.
fn is_folded(x: &[[f64; 3]], dimension: usize) -> bool {
    let coefficients = Bernstein::of(x.len(), dimension).map_or_else(Vec::new, |basis| basis.jacobian(x));
    let largest = coefficients.iter().fold(0.0, |max: f64, c| max.max(c.abs()));
    coefficients.iter().any(|c| *c < -ROUNDING * largest)
}

/// Bernstein's basis for the maps of simplices of one order and dimension.
///
/// With the control points b of degree k, the derivative along the edge 0a has the control points k (b_(p+e_a) -
/// b_(p+e_0)), where p are powers of degree k - 1. A coefficient of a product of polynomials is the mean of the
/// products of theirs, with multinomial weights.
struct Bernstein {
    /// Matrix from the points of the simplex to its control points.
    control: DMatrix<f64>,
    /// For all powers p: the control points p + e_0, p + e_1, ...
    raised: Vec<Vec<usize>>,
    /// For each product of derivatives along 01, 02 and in space 03: their powers p, the coefficient and the weight
    /// there.
    products: Vec<([usize; 3], usize, f64)>,
}

/// Powers of the barycentric coordinates in one function of the basis.
type Powers = [usize; 4];

/// Return the powers in each function of the basis of a degree on a simplex of a dimension.
fn powers(degree: usize, dimension: usize) -> Vec<Powers> {
    let height = if dimension == 2 { 0 } else { degree };
    let all = (0..=degree).flat_map(|i| (0..=degree - i).map(move |j| (i, j, degree - i - j)));
    all.flat_map(|(i, j, rest)| (0..=rest.min(height)).map(move |k| [rest - k, i, j, k])).collect()
}

/// Return the multinomial coefficient of powers.
fn multinomial(powers: &Powers) -> f64 {
    let factorial = |n: usize| (1..=n).map(|i| i as f64).product::<f64>();
    factorial(powers.iter().sum()) / powers.iter().map(|&power| factorial(power)).product::<f64>()
}

impl Bernstein {
    /// Return the basis for simplices with so many points, none if these are of no order.
    fn of(points: usize, dimension: usize) -> Option<&'static Self> {
        static BASES: [[OnceLock<Bernstein>; Order::HIGHEST]; 2] =
            [const { [const { OnceLock::new() }; Order::HIGHEST] }; 2];
        let order = Order::new(1 + (points - dimension - 1) / (dimension * (dimension + 1) / 2))?;
        Some(BASES[dimension - 2][order.degree() - 1].get_or_init(|| Self::new(order, dimension)))
    }

    fn new(order: Order, dimension: usize) -> Self {
        let degree = order.degree();
        let [own, lower, last] = [degree, degree - 1, dimension * (degree - 1)].map(|degree| powers(degree, dimension));
        let number = |all: &[Powers], powers: Powers| all.iter().position(|own| *own == powers).unwrap_or(0);
        let raised = |p: &Powers| {
            let raised = |a: usize| std::array::from_fn(|i| p[i] + usize::from(i == a));
            (0..=dimension).map(|a| number(&own, raised(a))).collect()
        };
        let product = |at: usize| {
            let all = [at % lower.len(), at / lower.len() % lower.len(), at / lower.len() / lower.len()];
            let factors = || all[..dimension].iter().map(|&p| &lower[p]);
            let sum = factors().fold([0; 4], |sum, p| std::array::from_fn(|i| sum[i] + p[i]));
            (all, number(&last, sum), factors().map(multinomial).product::<f64>() / multinomial(&sum))
        };
        Self {
            control: Self::control(order, &own, dimension),
            raised: lower.iter().map(raised).collect(),
            products: (0..lower.len().pow(dimension as u32)).map(product).collect(),
        }
    }

    /// Return the matrix from points to control points: both give the map at points as many as there are `powers`.
    fn control(order: Order, powers: &[Powers], dimension: usize) -> DMatrix<f64> {
        let places = powers.iter().map(|at| at.map(|power| power as f64 / order.degree() as f64));
        let (mut values, mut basis) = (Vec::new(), Vec::new());
        for l in places {
            values.extend(shape::weights(order, &l[..=dimension]));
            let power = |p: &Powers| (0..4).map(|k| l[k].powi(p[k] as i32)).product::<f64>();
            basis.extend(powers.iter().map(|p| multinomial(p) * power(p)));
        }
        let [values, basis] =
            [values, basis].map(|rows| DMatrix::from_row_slice(powers.len(), rows.len() / powers.len(), &rows));
        basis.lu().solve(&values).unwrap_or(values)
    }

    /// Return the coefficients of the Jacobian of a simplex with these points.
    fn jacobian(&self, x: &[[f64; 3]]) -> Vec<f64> {
        let b = &self.control * DMatrix::from_fn(x.len(), 3, |k, c| x[k][c]);
        let edge = |from: usize, to: usize| [0, 1, 2].map(|c| b[(to, c)] - b[(from, c)]);
        // the third column is the normal of the plane
        let along = |p: &Vec<usize>, a: usize| p.get(a).map_or([0.0, 0.0, 1.0], |&to| edge(p[0], to));
        let slopes: Vec<[[f64; 3]; 3]> = self.raised.iter().map(|p| [1, 2, 3].map(|a| along(p, a))).collect();
        let mut coefficients = vec![0.0; self.products.iter().map(|product| product.1 + 1).max().unwrap_or(0)];
        for ([p, q, r], at, weight) in &self.products {
            coefficients[*at] += weight * dot(&cross(slopes[*p][0], slopes[*q][1]), &slopes[*r][2]);
        }
        coefficients
    }
}

impl<const D: usize> Mesh<D> {
    /// Make the edges of all folded cells straight until no cell is folded, and count the cells in
    /// [`Mesh::straightened`]. Neighbours share the edges, so a straight edge may fold another cell, which becomes
    /// straight in the next pass. A node moves once: one that serves two edges, as with a wrong node number, would move
    /// for ever. The checks report it.
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
                for (ends, inside) in shape::edges(cell, D) {
                    let ends = ends.map(|end| self.points[cell[end] as usize]);
                    for (k, &point) in inside.iter().enumerate().filter(|(_, point)| straight_points.insert(**point)) {
                        let straight = shape::on_chord(ends, k, inside.len());
                        has_moved |= std::mem::replace(&mut self.points[point as usize], straight) != straight;
                    }
                }
            }
            if !has_moved {
                // a node serves two edges, which the checks report
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
    use crate::mesh::{EDGES, Group};

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

    /// Return the least Jacobian that differences of the map of a cell have on a grid.
    fn least(x: &[[f64; 3]], order: Order, dimension: usize) -> f64 {
        let (n, step) = (10, 1e-5);
        let at = |l: [f64; 4]| -> [f64; 3] {
            let weights = shape::weights(order, &l[..=dimension]);
            std::array::from_fn(|c| weights.iter().zip(x).map(|(weight, x)| weight * x[c]).sum())
        };
        let jacobian = |p: Powers| {
            let l = p.map(|power| power as f64 / n as f64);
            let along = |a: usize| {
                let moved =
                    |by: f64| at(std::array::from_fn(|i| l[i] + by * f64::from(i == a) - by * f64::from(i == 0)));
                minus(moved(step), moved(-step)).map(|d| 0.5 * d / step)
            };
            dot(&cross(along(1), along(2)), &if dimension == 2 { [0.0, 0.0, 1.0] } else { along(3) })
        };
        powers(n, dimension).into_iter().map(jacobian).fold(f64::INFINITY, f64::min)
    }

    /// A triangle with the arc of an angle as its edge 12.
    fn sector(order: Order, angle: f64) -> Vec<[f64; 3]> {
        let arc = |s: f64| [(angle * s).cos(), (angle * s).sin(), 0.0];
        let inside = |of: &dyn Fn(f64) -> [f64; 3]| {
            (1..order.degree()).map(|k| of(k as f64 / order.degree() as f64)).collect::<Vec<_>>()
        };
        let radius = |end: f64| inside(&|s| arc(end).map(|c| s * c));
        [vec![[0.0; 3], arc(0.0), arc(1.0)], radius(0.0), inside(&arc), radius(1.0)].concat()
    }

    /// Sectors of any order that pass have a positive Jacobian. That of more than 180 degrees is folded at its centre.
    #[test]
    fn triangles_of_all_orders_that_pass_are_not_folded() {
        for order in (2..=Order::HIGHEST).filter_map(Order::new) {
            for angle in [0.3, 0.8, 1.2, 1.6, 2.0, 2.4, 2.8, 3.1, 3.5, 4.5] {
                let x = sector(order, angle);
                assert!(is_folded(&x, 2) || least(&x, order, 2) > -1e-6, "{order:?} {angle}");
            }
            assert!(!is_folded(&sector(order, 1.2), 2) && is_folded(&sector(order, 3.5), 2), "{order:?}");
        }
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
            let middle =
                |[i, j]: [usize; 2]| shape::on_chord([corners[i], corners[j]], 0, 1).map(|c| c + size * random());
            let x = [&corners[..], &EDGES.map(middle)].concat();
            let found = is_folded(&x, 3);
            assert!(found || least(&x, Order::P2, 3) > -1e-6);
            counts[usize::from(found)] += 1;
        }
        assert!(counts.iter().all(|&count| count > 30), "{counts:?}");
    }

    /// Return two quadratic triangles on the square of four corners. The mid-edge node of the bottom is at the height
    /// `bottom`. The one of the diagonal is moved by `bent` towards the lower corner.
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
