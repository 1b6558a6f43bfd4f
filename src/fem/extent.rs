//! Summary of a set of points: their number, their mean, and the box around them.

use crate::linalg::{Total, around, bounds, pad};
use serde::{Deserialize, Serialize};

/// The number, the sum and the box of a set of points, on which the rigid motions of the points depend.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct Extent {
    count: usize,
    sum: [Total; 3],
    /// Corners of the box around the points, with the least and the largest coordinates.
    bounds: [[f64; 3]; 2],
}

impl Default for Extent {
    fn default() -> Self {
        Self { count: 0, sum: [Total::default(); 3], bounds: bounds([]) }
    }
}

impl Extent {
    /// Summarise these points.
    pub fn of<const D: usize>(points: impl Iterator<Item = [f64; D]>) -> Self {
        let mut all = Self::default();
        points.for_each(|x| all.add(x));
        all
    }

    /// Add a point.
    pub fn add<const D: usize>(&mut self, x: [f64; D]) {
        let x = pad(x);
        self.count += 1;
        self.sum.iter_mut().zip(x).for_each(|(sum, x)| sum.add(x));
        self.bounds = around(self.bounds, [x; 2]);
    }

    /// Return the summary of these points and others.
    #[must_use]
    pub fn join(mut self, others: &Self) -> Self {
        self.sum.iter_mut().zip(&others.sum).for_each(|(sum, more)| sum.join(more));
        Self { count: self.count + others.count, bounds: around(self.bounds, others.bounds), ..self }
    }

    /// Return the mean of the points.
    pub fn mean<const D: usize>(&self) -> [f64; D] {
        std::array::from_fn(|c| self.sum[c].value() / self.count.max(1) as f64)
    }

    /// Return the largest distance of a point from the mean along an axis, which is positive.
    pub fn farthest<const D: usize>(&self) -> f64 {
        let mean: [f64; D] = self.mean();
        let along = |c: usize| self.bounds.map(|x| (x[c] - mean[c]).abs());
        (0..D).filter(|_| self.count > 0).flat_map(along).fold(f64::MIN_POSITIVE, f64::max)
    }

    /// Return the largest side of the box around the points.
    pub fn size(&self) -> f64 {
        let [low, high] = self.bounds;
        (0..3).map(|c| high[c] - low[c]).fold(0.0, f64::max)
    }

    /// Return the corners of this box. A rigid motion that moves none of them moves no point.
    pub fn corners<const D: usize>(&self) -> impl Iterator<Item = [f64; D]> {
        let bounds = self.bounds;
        (0..1 << D).map(move |corner: usize| std::array::from_fn(|c| bounds[corner >> c & 1][c]))
    }
}
