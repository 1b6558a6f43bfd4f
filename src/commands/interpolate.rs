//! Values at scattered points: brought to other points, and compared with the values there.

use crate::linalg::range;
use nalgebra::DMatrix;
use rstar::RTree;
use rstar::primitives::GeomWithData;

/// Points by their index, each with the weight that its value has in an interpolated value.
pub type Weights = Vec<(usize, f64)>;

/// Scattered points in a search tree, each with its index.
pub struct Scattered(RTree<GeomWithData<[f64; 3], usize>>);

/// Points that a linear function is fitted to: twice the four that determine one in space.
const NEAREST: usize = 8;

/// Weight of the slopes with which a plane follows the values as they are. Points of a plane determine no slope across it: this weight alone
/// makes it zero.
pub const EXACT: f64 = 1e-6;

/// Weight of the slopes with which a plane leans towards the values of the nearest points.
///
/// Points of a surface hardly differ across it, so that the data determine no slope there. Along the surface the squares of the data's
/// weights are some hundred times that of the slopes.
pub const DAMPED: f64 = 0.1;

impl Scattered {
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

/// Sums of squares over contact surfaces, weighted by the areas of the points.
#[derive(Debug, Default)]
pub struct Squares {
    /// Of the difference of both functions.
    pub difference: f64,
    /// Of the function that is known, or of the earlier mesh.
    pub old: f64,
    /// Of the function that is compared with it.
    new: f64,
}

/// The roots of [`Squares`].
#[derive(Debug, Clone, Copy)]
pub struct Norms {
    /// Norm of the difference of both functions.
    pub difference: f64,
    /// Norm of the function that is known, or of the earlier mesh.
    pub old: f64,
    /// Norm of the function that is compared with it.
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
    pub fn norms(&self) -> Norms {
        Norms { difference: self.difference.sqrt(), old: self.old.sqrt(), new: self.new.sqrt() }
    }
}
