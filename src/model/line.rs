//! F1 along a line: exact line search on a convex function.

use crate::model::Model;
use crate::model::field::{Field, apply_stiffness, local_dot};
use crate::model::layer::Layer;

/// The derivative of F1(u + t v): linear and quadratic terms of the bodies, laws of the layers at every point.
pub struct Line<'a> {
    model: &'a Model,
    compression: &'a [f64],
    closing: Vec<f64>,
    /// (K u - f)'v.
    slope: f64,
    /// v'K v.
    curvature: f64,
}

/// A line along which F1 falls for ever: something is not held.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Unbounded;

impl<'a> Line<'a> {
    /// The line from an iterate with `layer` and equilibrium residual `r` along `v`. One message.
    pub fn new(model: &'a mut Model, layer: &'a Layer, r: &[Vec<f64>], v: &Field) -> Self {
        let kv = apply_stiffness(model, v);
        let mut sums = [local_dot(r, &v.states), local_dot(&kv, &v.states)];
        model.exchange.sum(&mut sums);
        let closing = v.closing();
        let pushed: f64 = layer.force.iter().zip(&closing).map(|(force, s)| force * s).sum();
        Self { model, compression: &layer.compression, closing, slope: -sums[0] - pushed, curvature: sums[1] }
    }

    /// v'K v.
    pub fn curvature(&self) -> f64 {
        self.curvature
    }

    /// d/dt F1(u + t v).
    pub fn derivative(&self, t: f64) -> f64 {
        let mut sum = self.slope + t * self.curvature;
        for (i, pair) in self.model.pairs.iter().enumerate() {
            for q in self.model.range(i) {
                let s = self.closing[q];
                if s != 0.0 {
                    let c = self.compression[q] + t * s;
                    sum += self.model.weight[q] * pair.law.pressure(q - self.model.offset[i], c) * s;
                }
            }
        }
        // a law beyond the range of numbers pushes back
        if sum.is_nan() { f64::INFINITY } else { sum }
    }

    /// F1(u + t v) - F1(u); infinite beyond the range of numbers.
    pub fn change(&self, t: f64) -> f64 {
        let mut sum = t * (self.slope + 0.5 * t * self.curvature);
        for (i, pair) in self.model.pairs.iter().enumerate() {
            for q in self.model.range(i) {
                let energy = |c: f64| pair.law.response(q - self.model.offset[i], c).energy;
                let c = self.compression[q];
                sum += self.model.weight[q] * (energy(c + t * self.closing[q]) - energy(c));
            }
        }
        if sum.is_nan() { f64::INFINITY } else { sum }
    }

    /// The minimiser t >= 0 of F1 along the line, to `accuracy` relative to the derivative at 0; 0 if the line does not
    /// descend.
    ///
    /// # Errors
    /// [`Unbounded`] if F1 still falls at the longest step.
    pub fn minimize(&self, accuracy: f64) -> Result<f64, Unbounded> {
        zero(|t| self.derivative(t), self.derivative(0.0), accuracy)
    }
}

/// Step, as a multiple of the first, beyond which nothing stops a motion. A law p = c^10 lets a load of 1e-100 move a body 1e90 times as far as the
/// springs of a first step do; squares of longer steps leave the range of numbers.
const LONGEST: f64 = 1e150;

/// The zero t >= 0 of an increasing function with the value `start` at 0, to `accuracy` relative to it; 0 if that is not negative.
///
/// # Errors
/// [`Unbounded`] if the function is still negative at the longest step.
pub fn zero(value: impl Fn(f64) -> f64, start: f64, accuracy: f64) -> Result<f64, Unbounded> {
    if start >= 0.0 {
        return Ok(0.0);
    }
    let target = accuracy * start.abs();
    let (mut low, mut high) = ((0.0, start), (1.0, value(1.0)));
    while high.1 < -target {
        if high.0 > LONGEST {
            return Err(Unbounded);
        }
        low = high;
        high.0 *= 4.0;
        high.1 = value(high.0);
    }
    // Illinois variant of the secant rule, bisection where a law is too steep for it
    let (mut weight_low, mut weight_high) = (low.1, high.1);
    for _ in 0..200 {
        if high.1 <= target {
            return Ok(high.0);
        }
        let secant = (low.0 * weight_high - high.0 * weight_low) / (weight_high - weight_low);
        let middle = 0.5 * (low.0 + high.0);
        let steep = !high.1.is_finite() || high.1 > 1e3 * low.1.abs();
        let t = if steep || !(secant > low.0 && secant < high.0) { middle } else { secant };
        let there = value(t);
        if there.abs() <= target || high.0 - low.0 <= 1e-15 * high.0 {
            return Ok(t);
        }
        if there < 0.0 {
            low = (t, there);
            weight_low = there;
            weight_high *= 0.5;
        } else {
            high = (t, there);
            weight_high = there;
            weight_low *= 0.5;
        }
    }
    Ok(low.0)
}
