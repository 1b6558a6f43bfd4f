//! Roughness of surfaces and profiles, and their summits.

use super::grid::Grid;
use super::rule::Outside;

/// Moments of heights on a grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Roughness {
    /// Least and largest height.
    pub range: [f64; 2],
    /// Root mean square of the heights from their mean: Sq of ISO 25178-2, Rq of a profile.
    pub height: f64,
    /// Root mean square of the gradient, by differences of neighbours: that of the (bi)linear interpolation along the lines of the grid.
    pub slope: f64,
    /// Root mean square of the mean curvature (h_xx + h_yy)/2, or of h_xx for a profile, by second differences of the heights h.
    pub curvature: f64,
}

/// The summits of a surface: points higher than their eight neighbours.
#[derive(Debug, Clone, PartialEq)]
pub struct Summits {
    /// Number per area.
    pub density: f64,
    /// Radius that belongs to the mean of their curvatures.
    pub radius: f64,
    /// Their heights, the highest first.
    pub heights: Vec<f64>,
}

impl Grid {
    /// Return the roughness. A periodic surface has differences across its border, too.
    pub fn roughness(&self) -> Roughness {
        let count = self.values.len() as f64;
        let mean = self.values.iter().sum::<f64>() / count;
        let height = (self.values.iter().map(|h| (h - mean).powi(2)).sum::<f64>() / count).sqrt();
        let (mut slope, mut curvature) = (0.0, Mean::default());
        for axis in 0..2 {
            let mut square = Mean::default();
            self.points().for_each(|at| {
                if let Some(next) = self.step(at, axis, 1) {
                    square.add(((self.height(next) - self.height(at)) / self.axes[axis].spacing).powi(2));
                }
            });
            slope += square.value();
        }
        self.points().filter_map(|at| self.curvature(at)).for_each(|value| curvature.add(value * value));
        let range = [f64::min, f64::max].map(|pick| self.values.iter().copied().reduce(pick).unwrap_or(f64::NAN));
        Roughness { range, height, slope: slope.sqrt(), curvature: curvature.value().sqrt() }
    }

    /// Return the summits; none for a profile, and none if no point is higher than its neighbours.
    pub fn summits(&self) -> Option<Summits> {
        if self.axes[1].count == 1 {
            return None;
        }
        let (mut heights, mut curvature) = (Vec::new(), Mean::default());
        for at in self.points() {
            let (Some(bend), Some(neighbours)) = (self.curvature(at), self.neighbours(at)) else { continue };
            if neighbours.iter().all(|&height| height < self.height(at)) {
                heights.push(self.height(at));
                curvature.add(-bend);
            }
        }
        heights.sort_by(|a, b| b.total_cmp(a));
        let area: f64 = self.axes.iter().map(|axis| axis.spacing * axis.count as f64).product();
        let radius = 1.0 / curvature.value();
        (!heights.is_empty()).then(|| Summits { density: heights.len() as f64 / area, radius, heights })
    }

    /// Return the indices of all points, along a row and of the row.
    fn points(&self) -> impl Iterator<Item = [usize; 2]> + use<> {
        let [columns, rows] = self.axes.map(|axis| axis.count);
        (0..rows).flat_map(move |j| (0..columns).map(move |i| [i, j]))
    }

    fn height(&self, [i, j]: [usize; 2]) -> f64 {
        self.values[i + self.axes[0].count * j]
    }

    /// Return the point that is `steps` further along an axis; none beyond the border, or if the axis has only one point.
    fn step(&self, mut at: [usize; 2], axis: usize, steps: isize) -> Option<[usize; 2]> {
        let count = self.axes[axis].count;
        let next = at[axis].wrapping_add_signed(steps);
        at[axis] = match next < count {
            _ if count == 1 => return None,
            true => next,
            false if self.outside == Outside::Periodic => next.wrapping_add(count) % count,
            false => return None,
        };
        Some(at)
    }

    /// Return the mean of the second differences along all axes.
    fn curvature(&self, at: [usize; 2]) -> Option<f64> {
        let axes = (0..2).filter(|&axis| self.axes[axis].count > 1);
        let mut sum = Mean::default();
        for axis in axes {
            let (before, after) = (self.step(at, axis, -1)?, self.step(at, axis, 1)?);
            let difference = self.height(before) - 2.0 * self.height(at) + self.height(after);
            sum.add(difference / self.axes[axis].spacing.powi(2));
        }
        Some(sum.value())
    }

    /// Return the eight heights around a point; none at the border.
    fn neighbours(&self, at: [usize; 2]) -> Option<[f64; 8]> {
        let mut heights = [0.0; 8];
        let around = (-1..=1).flat_map(|i| (-1..=1).map(move |j| (i, j))).filter(|&both| both != (0, 0));
        for (height, (i, j)) in heights.iter_mut().zip(around) {
            let beside = if i == 0 { at } else { self.step(at, 0, i)? };
            *height = self.height(if j == 0 { beside } else { self.step(beside, 1, j)? });
        }
        Some(heights)
    }
}

/// A mean of numbers that are added one by one; zero without any.
#[derive(Default)]
struct Mean {
    sum: f64,
    count: usize,
}

impl Mean {
    fn add(&mut self, value: f64) {
        self.sum += value;
        self.count += 1;
    }

    fn value(&self) -> f64 {
        self.sum / self.count.max(1) as f64
    }
}
