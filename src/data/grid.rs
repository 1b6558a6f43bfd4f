//! Values at the points of a regular grid in one direction or two, their interpolation, and their roughness. A lookup takes the same few
//! operations whatever the size.

use super::rule::{Interpolation, Outside, Sample};

/// A direction of a grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GridAxis {
    /// Place of the first point.
    pub origin: f64,
    /// Distance of neighbours, greater than 0.
    pub spacing: f64,
    /// Number of points; one where values do not depend on this direction.
    pub count: usize,
}

impl GridAxis {
    /// Return the first and the last place with a value. They are half a spacing beyond the points, since a measured height is the mean over a
    /// cell around its point.
    pub fn range(&self) -> [f64; 2] {
        [-0.5, self.count as f64 - 0.5].map(|steps| self.origin + self.spacing * steps)
    }
}

/// A function on a regular grid.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    /// The axis along a row, and the axis from row to row.
    pub axes: [GridAxis; 2],
    /// Values at the points, row by row.
    pub values: Vec<f64>,
    /// Interpolation between the points.
    pub interpolation: Interpolation,
    /// Values beyond the points.
    pub outside: Outside,
}

/// The points along an axis from which a value is interpolated. Points that are not needed have the weight zero.
#[derive(Clone, Copy, Default)]
struct Stencil {
    /// Indices of the points.
    at: [usize; 4],
    weight: [f64; 4],
    /// Derivatives of the weights by the coordinate.
    slope: [f64; 4],
}

impl Grid {
    /// Return value and gradient at a place. A profile does not depend on the second coordinate.
    pub fn sample(&self, place: [f64; 2]) -> Sample {
        let [Some(across), Some(down)] = [0, 1].map(|axis| self.stencil(axis, place[axis])) else {
            return Sample::NONE;
        };
        let mut sample = Sample { value: 0.0, gradient: [0.0; 2] };
        for j in 0..4 {
            if down.weight[j] == 0.0 && down.slope[j] == 0.0 {
                continue;
            }
            let row = &self.values[down.at[j] * self.axes[0].count..];
            let (mut value, mut slope) = (0.0, 0.0);
            for i in 0..4 {
                value += across.weight[i] * row[across.at[i]];
                slope += across.slope[i] * row[across.at[i]];
            }
            sample.value += down.weight[j] * value;
            sample.gradient[0] += down.weight[j] * slope;
            sample.gradient[1] += down.slope[j] * value;
        }
        sample
    }

    /// Return the stencil of a coordinate on an axis; none where there are no values.
    fn stencil(&self, axis: usize, x: f64) -> Option<Stencil> {
        let GridAxis { origin, spacing, count } = self.axes[axis];
        if count == 1 {
            return Some(Stencil { weight: [1.0, 0.0, 0.0, 0.0], ..Stencil::default() });
        }
        let steps = (x - origin) / spacing;
        let last = (count - 1) as f64;
        let (steps, is_held) = match self.outside {
            _ if !steps.is_finite() => return None,
            Outside::Periodic => (steps.rem_euclid(count as f64), false),
            Outside::Error if !(-0.5..=last + 0.5).contains(&steps) => return None,
            _ => (steps.clamp(0.0, last), !(0.0..=last).contains(&steps)),
        };
        // a periodic grid has one more cell, between its last and its first point
        let cells = if self.outside == Outside::Periodic { count } else { count - 1 };
        let cell = (steps as usize).min(cells - 1);
        let mut stencil = match self.interpolation {
            Interpolation::Linear => linear(steps - cell as f64),
            Interpolation::Cubic => cubic(steps - cell as f64),
        };
        if self.outside == Outside::Periodic {
            stencil.at = [count - 1, 0, 1, 2].map(|step| (cell + step) % count);
        } else {
            if cell == 0 {
                stencil.fold(0, [1, 2, 3]);
            }
            if cell == cells - 1 {
                stencil.fold(3, [2, 1, 0]);
            }
            stencil.at = [0, 1, 2, 3].map(|step: usize| (cell + step).saturating_sub(1).min(count - 1));
        }
        let scale = if is_held { 0.0 } else { 1.0 / spacing };
        stencil.slope.iter_mut().for_each(|slope| *slope *= scale);
        Some(stencil)
    }
}

impl Stencil {
    /// Replace the point beyond the end of the grid by extrapolation, f = 3 f1 - 3 f2 + f3, from the three points next to it.
    ///
    /// This is Keys' condition, which keeps the third order.
    fn fold(&mut self, beyond: usize, next: [usize; 3]) {
        for weights in [&mut self.weight, &mut self.slope] {
            let weight = std::mem::take(&mut weights[beyond]);
            next.iter().zip([3.0, -3.0, 1.0]).for_each(|(&k, factor)| weights[k] += factor * weight);
        }
    }
}

/// Return the weights of linear interpolation at t, which is from 0 to 1 between the second and the third point.
fn linear(t: f64) -> Stencil {
    Stencil { weight: [0.0, 1.0 - t, t, 0.0], slope: [0.0, -1.0, 1.0, 0.0], ..Stencil::default() }
}

/// Return the weights of cubic convolution at t.
fn cubic(t: f64) -> Stencil {
    let weight = [
        t * (-0.5 + t * (1.0 - 0.5 * t)),
        1.0 + t * t * (-2.5 + 1.5 * t),
        t * (0.5 + t * (2.0 - 1.5 * t)),
        t * t * (-0.5 + 0.5 * t),
    ];
    let slope = [-0.5 + t * (2.0 - 1.5 * t), t * (-5.0 + 4.5 * t), 0.5 + t * (4.0 - 4.5 * t), t * (-1.0 + 1.5 * t)];
    Stencil { weight, slope, ..Stencil::default() }
}

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
