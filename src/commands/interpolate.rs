//! Values at scattered points: brought to other points, and compared with the values there.

use crate::fem::lagrange;
use crate::linalg::{dot, minus, range};
use crate::problem::Order;
use nalgebra::DMatrix;
use rstar::RTree;
use rstar::primitives::GeomWithData;

/// Points by their index, each with the weight that its value has in an interpolated value.
pub type Weights = Vec<(usize, f64)>;

/// Scattered points in a search tree, each with its index.
pub struct PointTree(RTree<GeomWithData<[f64; 3], usize>>);

/// Number of points that a linear function is fitted to. Four points determine the function, a constant and three slopes; twice as many leave the
/// fit determined where half of them lie on a line or have nearly one place.
const NEAREST: usize = 8;

/// Number of points near a point of an edge, as a multiple of those of an edge, among which those of its edge are: the edges beside it may be several times
/// shorter.
const NEIGHBOURS: usize = 4;

/// Weight of the slopes for a plane that follows the values. Weights of points are one at least, so that it changes a fitted value by the relative
/// amount 1e-6^2, which is below the last digit in tables. Points of a plane determine no slope across it, and this weight makes that slope zero.
pub const EXACT: f64 = 1e-6;

/// Weight of the slopes for a plane that tends to the values of the nearest points. Weights of points are one at least, so that the slopes have a
/// hundredth of their part in the sum of squares. Rounding of the surface's coordinates then causes no slope across the surface.
pub const DAMPED: f64 = 0.1;

impl PointTree {
    /// Return the tree of some points.
    pub fn new(points: &[[f64; 3]]) -> Self {
        Self(RTree::bulk_load(points.iter().enumerate().map(|(q, &x)| GeomWithData::new(x, q)).collect()))
    }

    /// Return the `count` points nearest to `at`. Their weights are inverse distances, scaled to the sum one.
    pub fn inverse_distances(&self, at: &[f64; 3], count: usize) -> Weights {
        let nearest = self.0.nearest_neighbor_iter_with_distance_2(*at).take(count);
        let mut weights: Weights =
            nearest.map(|(near, squared)| (near.data, 1.0 / squared.sqrt().max(f64::MIN_POSITIVE))).collect();
        let sum: f64 = weights.iter().map(|(_, weight)| weight).sum();
        weights.iter_mut().for_each(|(_, weight)| *weight /= sum);
        weights
    }

    /// Return the weights of the values of the nearest points in the value at a point of the linear function that is fitted to them.
    ///
    /// The fit minimises the sum of squared misfits, each weighted by the inverse distance to the fourth. The weight `slopes` holds the slopes
    /// near zero; the weights of the points are one at least.
    pub fn plane(&self, at: &[f64; 3], slopes: f64) -> Weights {
        let nearest: Vec<_> = self.0.nearest_neighbor_iter_with_distance_2(*at).take(NEAREST).collect();
        let far = nearest.last().map_or(0.0, |(_, squared)| squared.sqrt());
        if let Some((same, _)) = nearest.first().filter(|(_, squared)| squared.sqrt() <= 1e-9 * far) {
            return vec![(same.data, 1.0)];
        }
        // a row for each point, then one for each slope
        let count = nearest.len();
        let rows = DMatrix::from_fn(count + 3, 4, |i, k| match nearest.get(i) {
            Some((_, squared)) if k == 0 => far * far / squared,
            Some((near, squared)) => far * (near.geom()[k - 1] - at[k - 1]) / squared,
            None if i + 1 == count + k => slopes,
            None => 0.0,
        });
        let Ok(inverse) = rows.pseudo_inverse(f64::EPSILON) else { return vec![(nearest[0].0.data, 1.0)] };
        let nearest = nearest.iter().enumerate();
        nearest.map(|(i, (near, squared))| (near.data, inverse[(0, i)] * far * far / squared)).collect()
    }

    /// Return the weights of the values of the points of an edge of an order in the value at one of its points, by the polynomial through them, and by that
    /// through all but the middle one. The polynomials are those of the way along the line to the farthest of the nearest points. Of points with one place
    /// the first counts.
    ///
    /// A solution may have a kink where edges meet, so that a polynomial through points of two edges would miss it. The points of one edge stand as those of
    /// Gauss and Lobatto.
    pub fn polynomials(&self, at: &[f64; 3], order: Order) -> [Weights; 2] {
        let count = order.degree() + 1;
        let nearest: Vec<_> = self.0.nearest_neighbor_iter_with_distance_2(*at).take(NEIGHBOURS * count).collect();
        let Some((farthest, squared)) = nearest.last() else { return Default::default() };
        let line = minus(*farthest.geom(), *at);
        let along = |near: &GeomWithData<[f64; 3], usize>| dot(&line, &minus(*near.geom(), *at)) / squared;
        let mut places: Vec<(usize, f64)> = nearest.iter().map(|(near, _)| (near.data, along(near))).collect();
        places.sort_by(|p, q| p.1.total_cmp(&q.1));
        places.dedup_by(|next, kept| (next.1 - kept.1).abs() <= 1e-9);
        let mut pattern: Vec<f64> = lagrange::of(order, 2).nodes.iter().map(|l| l[1]).collect();
        pattern.sort_by(f64::total_cmp);
        let differs = |edge: &[(usize, f64)]| -> f64 {
            let (first, size) = (edge[0].1, edge[edge.len() - 1].1 - edge[0].1);
            edge.iter().zip(&pattern).map(|(point, place)| ((point.1 - first) / size - place).abs()).fold(0.0, f64::max)
        };
        let holds = |edge: &&[(usize, f64)]| edge[0].1 <= 1e-9 && edge[edge.len() - 1].1 >= -1e-9;
        let best = places.windows(count).filter(holds).min_by(|p, q| differs(p).total_cmp(&differs(q)));
        let edge = best.unwrap_or(&places[..count.min(places.len())]);
        let through = |edge: &[(usize, f64)]| {
            let weight = |&(point, place): &(usize, f64)| {
                let others = edge.iter().map(|(_, other)| *other).filter(|other| *other != place);
                (point, others.map(|other| other / (other - place)).product())
            };
            edge.iter().map(weight).collect()
        };
        let middle = edge.len() / 2;
        [through(edge), through(&[&edge[..middle], &edge[middle + 1..]].concat())]
    }
}

/// Return the sum of values with their weights.
pub fn mean(weights: &[(usize, f64)], column: &[f64]) -> f64 {
    weights.iter().map(|(near, weight)| weight * column[*near]).sum()
}

/// Return the fitted value, clamped to the range of the values that it is fitted to: where all points lie to one side, a plane may lead anywhere.
pub fn clamped_mean(weights: &[(usize, f64)], column: &[f64]) -> f64 {
    let [least, most] = range(weights.iter().map(|(near, _)| column[*near]));
    mean(weights, column).clamp(least, most)
}

/// Integrals over contact surfaces of the squares of an old function, a new function, and their difference.
#[derive(Debug, Default)]
pub struct Squares {
    difference: f64,
    old: f64,
    new: f64,
}

/// The L2 norms of an old function, a new function, and their difference. The old function is that of the reference or of the earlier mesh.
#[derive(Debug, Clone, Copy)]
pub struct L2Norms {
    /// The norm of the new function less the old one.
    pub difference: f64,
    /// The norm of the old function.
    pub old: f64,
    /// The norm of the new function.
    pub new: f64,
}

impl Squares {
    /// Add the squares of two values at a point that stands for an area (a length in the plane).
    pub fn add(&mut self, area: f64, old: f64, new: f64) {
        self.difference += area * (new - old).powi(2);
        self.old += area * old * old;
        self.new += area * new * new;
    }

    /// Return the norms.
    pub fn norms(&self) -> L2Norms {
        L2Norms { difference: self.difference.sqrt(), old: self.old.sqrt(), new: self.new.sqrt() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A polynomial of the degree is met on each of two edges with a kink between them, also where two points have one place.
    #[test]
    fn polynomials_of_edges_are_met() {
        let order = Order::new(5).expect("an order");
        let edge: Vec<f64> = lagrange::of(order, 2).nodes.iter().map(|l| l[1]).collect();
        let places: Vec<f64> = edge.iter().map(|s| 0.3 * s).chain(edge.iter().map(|s| 0.3 + 0.7 * s)).collect();
        let points: Vec<[f64; 3]> = places.iter().map(|s| [2.0 * s, 1.0 - s, 0.5]).collect();
        let tree = PointTree::new(&points);
        let function = |s: f64| if s < 0.3 { 1.0 - 2.0 * s + s.powi(4) } else { 0.4081 + (s - 0.3).powi(5) };
        let values: Vec<f64> = places.iter().map(|&s| function(s)).collect();
        for s in [0.0, 0.05, 0.29, 0.3, 0.31, 0.41, 0.66, 0.97] {
            let weights = tree.polynomials(&[2.0 * s, 1.0 - s, 0.5], order)[0].clone();
            assert!((mean(&weights, &values) - function(s)).abs() < 1e-12, "{s}: {weights:?}");
        }
    }
}
