//! Values at the points of a regular grid in one direction or two, and their interpolation. A lookup takes the same few
//! operations whatever the size.

use super::read::NumberRows;
use super::rule::{DataSpec, Detrend, Interpolation, Outside, Sample};
use crate::error::Result;

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
    /// Return the first and the last place with a value. They are half a spacing beyond the points, since a measured
    /// height is the mean over a cell around its point.
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
    /// Return the function of heights in rows and columns. A single row or column is a profile.
    ///
    /// # Errors
    /// Numbers that are no function, or too few for the interpolation.
    pub(super) fn new(spec: &DataSpec, NumberRows { columns, values }: NumberRows) -> Result<Self> {
        let mut counts = [columns, values.len() / columns.max(1)];
        if counts[0] == 1 {
            counts.swap(0, 1);
        }
        if counts[0] < 2 {
            return Err(spec.refuse("has no two numbers", "write heights in rows: two points or more make a function"));
        }
        if spec.interpolation == Interpolation::Cubic && counts.contains(&2) {
            return Err(
                spec.refuse("has two points in a direction", "cubic interpolation needs three: take \"linear\"")
            );
        }
        let axes = [0, 1].map(|d| GridAxis { origin: spec.origin[d], spacing: spec.spacing[d], count: counts[d] });
        let values = values.iter().map(|value| spec.unit * value).collect();
        let mut grid = Self { axes, values, interpolation: spec.interpolation, outside: spec.outside };
        if spec.detrend == Detrend::Plane {
            grid.subtract_plane();
        }
        Ok(grid)
    }

    /// Subtract the plane of least squares. On a grid, with coordinates from its middle, the constant and both slopes
    /// are orthogonal: each is the mean of the heights times its function, over the mean square of the function.
    fn subtract_plane(&mut self) {
        let columns = self.axes[0].count;
        let middle = self.axes.map(|axis| 0.5 * (axis.count - 1) as f64);
        let functions = move |k: usize| [1.0, (k % columns) as f64 - middle[0], (k / columns) as f64 - middle[1]];
        let factors = [0, 1, 2].map(|i| {
            let products = self.values.iter().enumerate().map(|(k, height)| functions(k)[i] * height).sum::<f64>();
            let squares = (0..self.values.len()).map(|k| functions(k)[i].powi(2)).sum::<f64>();
            if squares > 0.0 { products / squares } else { 0.0 }
        });
        for (k, height) in self.values.iter_mut().enumerate() {
            *height -= functions(k).iter().zip(factors).map(|(value, factor)| value * factor).sum::<f64>();
        }
    }

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
    /// Replace the point beyond the end of the grid by extrapolation, f = 3 f1 - 3 f2 + f3, from the three points next
    /// to it.
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
