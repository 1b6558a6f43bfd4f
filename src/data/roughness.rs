//! How rough a surface or profile is, and its summits.

use super::grid::Grid;
use super::rule::Outside;

/// Moments of heights on a grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Roughness {
    /// Lowest and highest point.
    pub range: [f64; 2],
    /// Root mean square of the heights from their mean: Sq of ISO 25178-2, Rq of a profile.
    pub height: f64,
    /// Root mean square of the gradient, by differences of neighbours: that of the (bi)linear interpolation along the lines of the grid.
    pub slope: f64,
    /// Root mean square of the mean curvature (h_xx + h_yy)/2, of a profile of h_xx, by second differences.
    pub curvature: f64,
}

/// The summits of a surface: points higher than their eight neighbours.
#[derive(Debug, Clone, PartialEq)]
pub struct Summits {
    /// Number per area.
    pub density: f64,
    /// Radius whose curvature is the mean of theirs.
    pub radius: f64,
    /// Their heights, the highest first.
    pub heights: Vec<f64>,
}

impl Grid {
    /// Its roughness; a surface that repeats has differences across its border, too.
    pub fn roughness(&self) -> Roughness {
        let count = self.values.len() as f64;
        let mean = self.values.iter().sum::<f64>() / count;
        let height = (self.values.iter().map(|h| (h - mean).powi(2)).sum::<f64>() / count).sqrt();
        let (mut slope, mut curvature) = (0.0, Mean::default());
        for axis in 0..2 {
            let mut square = Mean::default();
            self.points().for_each(|at| {
                if let Some([from, to]) = self.step(at, axis, 1).map(|next| [self.at(at), self.at(next)]) {
                    square.add(((to - from) / self.axes[axis].spacing).powi(2));
                }
            });
            slope += square.value();
        }
        self.points().filter_map(|at| self.curvature(at)).for_each(|value| curvature.add(value * value));
        let range = [f64::min, f64::max].map(|pick| self.values.iter().copied().reduce(pick).unwrap_or(f64::NAN));
        Roughness { range, height, slope: slope.sqrt(), curvature: curvature.value().sqrt() }
    }

    /// Its summits; none of a profile, and none where no point stands out.
    pub fn summits(&self) -> Option<Summits> {
        if self.axes[1].count == 1 {
            return None;
        }
        let (mut heights, mut curvature) = (Vec::new(), Mean::default());
        for at in self.points() {
            let (Some(bend), Some(neighbours)) = (self.curvature(at), self.neighbours(at)) else { continue };
            if neighbours.iter().all(|&height| height < self.at(at)) {
                heights.push(self.at(at));
                curvature.add(-bend);
            }
        }
        heights.sort_by(|a, b| b.total_cmp(a));
        let area: f64 = self.axes.iter().map(|axis| axis.spacing * axis.count as f64).product();
        let radius = 1.0 / curvature.value();
        (!heights.is_empty()).then(|| Summits { density: heights.len() as f64 / area, radius, heights })
    }

    fn points(&self) -> impl Iterator<Item = [usize; 2]> + use<> {
        let [columns, rows] = self.axes.map(|axis| axis.count);
        (0..rows).flat_map(move |j| (0..columns).map(move |i| [i, j]))
    }

    fn at(&self, [i, j]: [usize; 2]) -> f64 {
        self.values[i + self.axes[0].count * j]
    }

    /// The point so many steps further along an axis; none beyond the border, or where there is only one.
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

    /// Mean of the second differences along all axes.
    fn curvature(&self, at: [usize; 2]) -> Option<f64> {
        let axes = (0..2).filter(|&axis| self.axes[axis].count > 1);
        let mut sum = Mean::default();
        for axis in axes {
            let (before, after) = (self.step(at, axis, -1)?, self.step(at, axis, 1)?);
            sum.add((self.at(before) - 2.0 * self.at(at) + self.at(after)) / self.axes[axis].spacing.powi(2));
        }
        Some(sum.value())
    }

    /// The eight heights around a point.
    fn neighbours(&self, at: [usize; 2]) -> Option<[f64; 8]> {
        let mut heights = [0.0; 8];
        let around = (-1..=1).flat_map(|i| (-1..=1).map(move |j| (i, j))).filter(|&both| both != (0, 0));
        for (height, (i, j)) in heights.iter_mut().zip(around) {
            let beside = if i == 0 { at } else { self.step(at, 0, i)? };
            *height = self.at(if j == 0 { beside } else { self.step(beside, 1, j)? });
        }
        Some(heights)
    }
}

/// A mean of numbers as they come.
#[derive(Default)]
struct Mean(f64, usize);

impl Mean {
    fn add(&mut self, value: f64) {
        self.0 += value;
        self.1 += 1;
    }

    fn value(&self) -> f64 {
        self.0 / self.1.max(1) as f64
    }
}
