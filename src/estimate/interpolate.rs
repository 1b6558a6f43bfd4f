//! Values at scattered points: brought to other points, and compared with the values there.

use crate::linalg::{dot, interpolation_weights, length, minus, range};
use nalgebra::DMatrix;
use rstar::RTree;
use rstar::primitives::GeomWithData;

/// Points by their index, each with the weight that its value has in an interpolated value.
pub type Weights = Vec<(usize, f64)>;

/// Scattered points in a search tree, each with its index.
pub struct PointTree(RTree<GeomWithData<[f64; 3], usize>>);

/// Number of points that a linear function is fitted to. Four points determine the function, a constant and three
/// slopes; twice as many leave the fit determined where half of them lie on a line or have nearly one place.
const NEAREST: usize = 8;

/// Weight of the slopes for a plane that follows the values. Weights of points are one at least, so that it changes a
/// fitted value by the relative amount 1e-6^2, which is below the last digit in tables. Points of a plane determine no
/// slope across it, and this weight makes that slope zero.
pub const EXACT: f64 = 1e-6;

/// Weight of the slopes for a plane that tends to the values of the nearest points. Weights of points are one at least,
/// so that the slopes have a hundredth of their part in the sum of squares. Rounding of the surface's coordinates then
/// causes no slope across the surface.
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

    /// Return the weights of the values of the nearest points in the value at a point of the linear function that is
    /// fitted to them.
    ///
    /// The fit minimises the sum of squared misfits, each weighted by the inverse distance to the fourth. The weight
    /// `slopes` holds the slopes near zero; the weights of the points are one at least.
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
}

/// Return the first and the last point of an edge, `edge` being the indices of all its points: those that are farthest
/// apart.
pub fn ends(points: &[[f64; 3]], edge: &[usize]) -> [usize; 2] {
    let farthest = |from: usize| {
        let apart = |point: usize| length(minus(points[point], points[from]));
        edge.iter().copied().max_by(|&p, &q| apart(p).total_cmp(&apart(q))).unwrap_or(from)
    };
    let first = farthest(edge[0]);
    [first, farthest(first)]
}

/// Return the weights of the values of an edge's points in the value at a point of the polynomial through them, and of
/// that through all but the middle one. The edge is the nearest one of `edges`, each the indices of its `points`. The
/// polynomials are those of the way along its chord.
///
/// A solution may have a kink where edges meet, so that no polynomial goes through the points of two edges.
pub fn on_edge(points: &[[f64; 3]], edges: &[Vec<usize>], at: &[f64; 3]) -> [Weights; 2] {
    let along = |edge: &[usize]| {
        let [first, last] = ends(points, edge);
        let chord = minus(points[last], points[first]);
        let place = move |x: [f64; 3]| dot(&minus(x, points[first]), &chord) / dot(&chord, &chord);
        let here = place(*at);
        let foot: [f64; 3] = std::array::from_fn(|c| points[first][c] + here.clamp(0.0, 1.0) * chord[c]);
        let places: Vec<f64> = edge.iter().map(|&point| place(points[point])).collect();
        (length(minus(*at, foot)), here, places)
    };
    let known = edges.iter().filter(|edge| edge.len() > 1).map(|edge| (edge, along(edge)));
    let Some((edge, (_, here, mut places))) = known.min_by(|p, q| p.1.0.total_cmp(&q.1.0)) else {
        return Default::default();
    };
    let mut edge = edge.clone();
    let weights =
        |edge: &[usize], places: &[f64]| edge.iter().copied().zip(interpolation_weights(places, here)).collect();
    let all = weights(&edge, &places);
    let middle = (0..edge.len()).min_by(|&p, &q| (places[p] - 0.5).abs().total_cmp(&(places[q] - 0.5).abs()));
    if let Some(middle) = middle {
        edge.remove(middle);
        places.remove(middle);
    }
    [all, weights(&edge, &places)]
}

/// Return the sum of values with their weights.
pub fn mean(weights: &[(usize, f64)], column: &[f64]) -> f64 {
    weights.iter().map(|(near, weight)| weight * column[*near]).sum()
}

/// Return the fitted value, clamped to the range of the values that it is fitted to: where all points lie to one side,
/// a plane may lead anywhere.
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

/// The L2 norms of an old function, a new function, and their difference. The old function is that of the reference or
/// of the earlier mesh.
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

    /// A polynomial of the degree is met on each of two edges with a kink between them, and one of a degree less
    /// without the middle points.
    #[test]
    fn polynomials_of_edges_are_met() {
        let places = [0.0, 0.3, 0.05, 0.14, 0.26, 1.0, 0.37, 0.5, 0.82];
        let edges = [vec![0, 1, 2, 3, 4], vec![1, 5, 6, 7, 8]];
        let points = places.map(|s| [2.0 * s, 1.0 - s, 0.5]);
        for power in [4, 3] {
            let function = |s: f64| if s < 0.3 { 1.0 - 2.0 * s } else { 0.4 + (s - 0.3).powi(power) };
            let values = places.map(function);
            for s in [0.0, 0.05, 0.29, 0.3, 0.31, 0.41, 0.66, 0.97] {
                let [all, fewer] = on_edge(&points, &edges, &[2.0 * s, 1.0 - s, 0.5]);
                assert!((mean(&all, &values) - function(s)).abs() < 1e-12, "{s}: {all:?}");
                let differs = (mean(&fewer, &values) - function(s)).abs();
                assert!(
                    if power == 4 && s > 0.6 { differs > 1e-3 } else { power == 4 || differs < 1e-12 },
                    "{s}: {differs}"
                );
            }
        }
    }
}
