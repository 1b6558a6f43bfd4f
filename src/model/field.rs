//! Vectors over all bodies (iterates, corrections, search directions), and the functional F1 along a line with an exact line search. F1
//! is convex.

use super::body::Energy;
use super::layer::Layer;
use super::{BodySlot, Model};
use crate::linalg::{axpy, dot};

/// A displacement of all bodies: the states of the local bodies and the traces of all bodies.
#[derive(Debug, Clone, Default)]
pub struct Field {
    /// State of each body; empty for a body of another rank.
    pub states: Vec<Vec<f64>>,
    /// B u of all contact rows (see [`model`](crate::model) for the layout).
    pub trace: Vec<f64>,
}

impl Field {
    /// Return the field of all bodies at rest.
    pub fn rest(model: &Model) -> Field {
        let state = |slot: &BodySlot| slot.local.as_ref().map_or(Vec::new(), |body| body.states().rest());
        Field { states: model.bodies.iter().map(state).collect(), trace: vec![0.0; 2 * model.points()] }
    }

    /// Return the field without displacement of any body.
    pub fn zero(model: &Model) -> Field {
        let state = |slot: &BodySlot| vec![0.0; slot.local.as_ref().map_or(0, |body| body.states().size())];
        Field { states: model.bodies.iter().map(state).collect(), trace: vec![0.0; 2 * model.points()] }
    }

    /// Add t `other`.
    pub fn add(&mut self, t: f64, other: &Field) {
        for (u, z) in self.states.iter_mut().zip(&other.states) {
            axpy(t, z, u);
        }
        axpy(t, &other.trace, &mut self.trace);
    }

    /// Multiply by t.
    pub fn scale(&mut self, t: f64) {
        if t != 1.0 {
            self.states.iter_mut().flatten().chain(&mut self.trace).for_each(|x| *x *= t);
        }
    }

    /// Multiply by t, then add `other`.
    pub fn add_to(&mut self, t: f64, other: &Field) {
        let all = self.states.iter_mut().zip(&other.states).chain([(&mut self.trace, &other.trace)]);
        for (own, other) in all {
            own.iter_mut().zip(other).for_each(|(x, y)| *x = y + t * *x);
        }
    }

    /// Recompute the traces from the states. Steps are added to both separately, so that they come to differ by the rounding of large steps.
    /// Collective.
    pub fn retrace(&mut self, model: &Model) {
        self.trace_here(model);
        model.exchange.sum(&mut self.trace);
    }

    /// Set the traces to those of the local bodies, and to zero for other bodies.
    pub fn trace_here(&mut self, model: &Model) {
        let mut trace = vec![0.0; self.trace.len()];
        for (index, slot) in model.bodies.iter().enumerate() {
            if let Some(body) = slot.local.as_ref() {
                let mut rows = vec![0.0; slot.row_stiffness.len()];
                body.states().trace(&self.states[index], &mut rows);
                model.put(index, &rows, &mut trace);
            }
        }
        self.trace = trace;
    }

    /// Return the change of compression at each point: B_a v_a + B_b v_b.
    pub fn closing(&self) -> Vec<f64> {
        let points = self.trace.len() / 2;
        (0..points).map(|q| self.trace[q] + self.trace[points + q]).collect()
    }
}

/// Return the sum of x_s'y_s over the local bodies s. The caller adds the sums of all ranks.
pub fn local_dot(x: &[Vec<f64>], y: &[Vec<f64>]) -> f64 {
    x.iter().zip(y).map(|(x, y)| dot(x, y)).sum()
}

/// Return K v for every local body. Collective where bodies have joined their matrices.
pub fn apply_stiffness(model: &mut Model, v: &Field) -> Vec<Vec<f64>> {
    if let Some(joint) = &model.joint {
        return joint.borrow_mut().multiply(&v.states);
    }
    let apply = |(slot, v): (&mut BodySlot, &Vec<f64>)| {
        let mut y = vec![0.0; v.len()];
        if let Some(body) = slot.local.as_mut() {
            body.apply_stiffness(v, &mut y);
        }
        y
    };
    model.bodies.iter_mut().zip(&v.states).map(apply).collect()
}

/// Return the residual r = f - K u - B' `force` (26) of every local body, for forces at the points (n), and the sum of the energies of u.
pub fn residual(model: &mut Model, u: &Field, force: &[f64]) -> (Vec<Vec<f64>>, Energy) {
    let (all, energies) = residuals(model, u, force);
    let mut sum = Energy::default();
    for energy in energies {
        sum.strain += energy.strain;
        sum.potential += energy.potential;
    }
    (all, sum)
}

/// Return the residual r = f - K u - B' `force` (26) and the energies of u for every local body, for forces at the points (n).
pub fn residuals(model: &mut Model, u: &Field, force: &[f64]) -> (Vec<Vec<f64>>, Vec<Energy>) {
    let products = apply_stiffness(model, u);
    let of_body = |(index, product): (usize, Vec<f64>)| {
        let (state, rows) = (&u.states[index], model.at_rows(index, force));
        let mut r = vec![0.0; state.len()];
        let body = model.bodies[index].local.as_ref();
        let energy = body.map_or_else(Energy::default, |body| body.residual(state, &product, &rows, &mut r));
        (r, energy)
    };
    products.into_iter().enumerate().map(of_body).unzip()
}

/// Return the squared energy norm of unbalanced forces r of the local bodies, taken for each dof alone: r'D^-1 r with the diagonal D of
/// K + B' diag(`springs`) B, for springs omega kappa at the points (n). The caller adds the sums of all ranks.
pub fn unbalanced(model: &Model, r: &[Vec<f64>], springs: &[f64]) -> f64 {
    let of_body = |(index, slot): (usize, &BodySlot)| {
        slot.local.as_ref().map_or(0.0, |body| body.unbalanced(&r[index], &model.at_rows(index, springs)))
    };
    model.bodies.iter().enumerate().map(of_body).sum()
}

/// Add B' `force` to y for every local body, for forces at the points (n).
pub fn add_forces(model: &Model, force: &[f64], y: &mut [Vec<f64>]) {
    for (index, y) in y.iter_mut().enumerate() {
        if let Some(body) = model.bodies[index].local.as_ref() {
            body.states().add_rows(1.0, &model.at_rows(index, force), y);
        }
    }
}

/// F1(u + t v) as a function of t: linear and quadratic terms of the bodies, and the laws of the layers at every point.
pub struct LineEnergy<'a> {
    model: &'a Model,
    /// Compression at u, n.
    compression: &'a [f64],
    /// B v, the change of compression with t, n.
    closing: Vec<f64>,
    /// (K u - f)'v.
    slope: f64,
    /// v'K v.
    curvature: f64,
}

/// The error for a line along which F1 decreases without end, because some body is not constrained.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Unbounded;

impl<'a> LineEnergy<'a> {
    /// Return the line from an iterate with the layer state `layer` and the equilibrium residual `r` along `v`. One message.
    pub fn new(model: &'a mut Model, layer: &'a Layer, r: &[Vec<f64>], v: &Field) -> Self {
        let kv = apply_stiffness(model, v);
        let mut sums = [local_dot(r, &v.states), local_dot(&kv, &v.states)];
        model.exchange.sum(&mut sums);
        let closing = v.closing();
        let slope = -sums[0] - dot(&layer.force, &closing);
        Self { model, compression: &layer.compression, closing, slope, curvature: sums[1] }
    }

    /// Return d/dt F1(u + t v).
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
        // a law that leaves the range of numbers resists with an infinite force
        if sum.is_nan() { f64::INFINITY } else { sum }
    }

    /// Return the minimiser t >= 0 of F1 along the line, or 0 if F1 does not decrease along it. `accuracy` is that of the derivative, relative to the derivative
    /// at 0.
    ///
    /// # Errors
    /// [`Unbounded`] if F1 still decreases at the longest step.
    pub fn minimize(&self, accuracy: f64) -> Result<f64, Unbounded> {
        zero(|t| self.derivative(t), self.derivative(0.0), accuracy)
    }
}

/// Step, as a multiple of the first one, beyond which nothing stops a motion. With a law p = c^10, a load of 1e-100 moves a body 1e90 times as far as the
/// springs of a first step do. Squares of longer steps leave the range of numbers.
const LONGEST: f64 = 1e150;

/// A point (t, f(t)) of a function f, and the value that the secant rule uses in place of f(t).
#[derive(Clone, Copy)]
struct SearchPoint {
    t: f64,
    value: f64,
    weight: f64,
}

impl SearchPoint {
    fn new(t: f64, value: f64) -> Self {
        Self { t, value, weight: value }
    }
}

/// Return the zero t >= 0 of an increasing function with the value `start` at 0, or 0 if `start` is not negative. `accuracy` is relative to `start`.
///
/// # Errors
/// [`Unbounded`] if the function is still negative at the longest step.
pub fn zero(value: impl Fn(f64) -> f64, start: f64, accuracy: f64) -> Result<f64, Unbounded> {
    if start >= 0.0 {
        return Ok(0.0);
    }
    let target = accuracy * start.abs();
    let (mut low, mut high) = (SearchPoint::new(0.0, start), SearchPoint::new(1.0, value(1.0)));
    while high.value < -target {
        if high.t > LONGEST {
            return Err(Unbounded);
        }
        low = high;
        high = SearchPoint::new(4.0 * high.t, value(4.0 * high.t));
    }
    // Illinois variant of the secant rule, with bisection where a law is too steep for it
    for _ in 0..200 {
        if high.value <= target {
            return Ok(high.t);
        }
        let secant = (low.t * high.weight - high.t * low.weight) / (high.weight - low.weight);
        let middle = 0.5 * (low.t + high.t);
        let is_steep = !high.value.is_finite() || high.value > 1e3 * low.value.abs();
        let t = if is_steep || !(secant > low.t && secant < high.t) { middle } else { secant };
        let next = SearchPoint::new(t, value(t));
        if next.value.abs() <= target || high.t - low.t <= 1e-15 * high.t {
            return Ok(t);
        }
        if next.value < 0.0 {
            low = next;
            high.weight *= 0.5;
        } else {
            high = next;
            low.weight *= 0.5;
        }
    }
    Ok(low.t)
}
