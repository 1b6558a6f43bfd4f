//! Vectors over all bodies (iterates, corrections, search directions), and the functional F1 along a line with an exact
//! line search. F1 is convex.

use super::body::{Body, Energy};
use super::layer::Layer;
use super::{BodySlot, Model, closing, motions};
use crate::linalg::{axpy, dot};

/// Displacements v + E a of all bodies, with rigid motions E that supports and springs leave free.
///
/// Steps and directions have all of B (v + E a) in their traces. Iterates have only B v: the closings B E a are in the
/// gap of the model ([`DisplacementField::advance`]), which then has the digits of compressions, however far bodies
/// fall.
#[derive(Debug, Clone, Default)]
pub struct DisplacementField {
    /// v, the displacements of each local body without their rigid parts; empty for a body of another rank.
    pub displacements: Vec<Vec<f64>>,
    /// a, the amounts of the motions of each body, on all ranks.
    pub rigid: Vec<Vec<f64>>,
    /// B (v + E a) or B v of all contact rows (see [`model`](crate::model) for the layout).
    pub trace: Vec<f64>,
}

impl DisplacementField {
    /// Return the field of all bodies at rest.
    pub fn rest(model: &Model) -> DisplacementField {
        Self::of(model, |body| body.dofs().rest())
    }

    /// Return the field with the displacements that supports prescribe.
    #[must_use]
    pub fn supported(mut self, model: &Model) -> DisplacementField {
        model.locals().for_each(|(index, body)| body.dofs().prescribe(&mut self.displacements[index]));
        self
    }

    /// Return the field without displacement of any body.
    pub fn zero(model: &Model) -> DisplacementField {
        Self::of(model, |body| vec![0.0; body.dofs().count])
    }

    fn of(model: &Model, displacements: impl Fn(&Body) -> Vec<f64>) -> DisplacementField {
        let state = |slot: &BodySlot| slot.local.as_ref().map_or(Vec::new(), &displacements);
        DisplacementField {
            displacements: model.bodies.iter().map(state).collect(),
            rigid: model.bodies.iter().map(|slot| vec![0.0; slot.free]).collect(),
            trace: vec![0.0; 2 * model.points()],
        }
    }

    /// Return the step with the displacements u + E a of the local bodies, and the sums over ranks of `more` numbers. u
    /// may have rigid parts; a are the amounts `apart` of the motions of each local body, or empty where all is in u.
    /// One message, so that all ranks have the same numbers although their processors may round differently.
    pub fn of_step(
        model: &Model,
        displacements: Vec<Vec<f64>>,
        apart: &[Vec<f64>],
        more: &[f64],
    ) -> (DisplacementField, Vec<f64>) {
        let (mut field, mut fallen) =
            (DisplacementField { displacements, ..Self::zero(model) }, Self::zero(model).rigid);
        field.trace_here(model);
        for (index, body) in model.locals() {
            field.rigid[index] = body.dofs().amounts(&field.displacements[index]);
            fallen[index].iter_mut().zip(&apart[index]).for_each(|(sum, a)| *sum = *a);
        }
        let mut message = [&field.trace[..], &field.rigid.concat(), &fallen.concat(), more].concat();
        model.exchange.sum(&mut message);
        let mut numbers = message.into_iter();
        let rigid = field.rigid.iter_mut().chain(&mut fallen).flatten();
        field.trace.iter_mut().chain(rigid).zip(&mut numbers).for_each(|(to, sum)| *to = sum);
        for (index, body) in model.locals() {
            body.dofs().add_motions(-1.0, &field.rigid[index], &mut field.displacements[index]);
        }
        axpy(1.0, &motions::trace(model, &fallen), &mut field.trace);
        field.rigid.iter_mut().zip(&fallen).for_each(|(rigid, a)| axpy(1.0, a, rigid));
        (field, numbers.collect())
    }

    /// Add t `other`.
    pub fn add(&mut self, t: f64, other: &DisplacementField) {
        self.parts_with(other).for_each(|(u, z)| axpy(t, z, u));
    }

    /// Multiply by t.
    pub fn scale(&mut self, t: f64) {
        if t != 1.0 {
            let Self { displacements, rigid, trace } = self;
            displacements.iter_mut().chain(rigid).flatten().chain(trace).for_each(|x| *x *= t);
        }
    }

    /// Multiply by t, then add `other`.
    pub fn add_to(&mut self, t: f64, other: &DisplacementField) {
        self.parts_with(other).for_each(|(own, other)| own.iter_mut().zip(other).for_each(|(x, y)| *x = y + t * *x));
    }

    /// Return all vectors of this field with those of the `other` one.
    fn parts_with<'f>(
        &'f mut self,
        other: &'f DisplacementField,
    ) -> impl Iterator<Item = (&'f mut Vec<f64>, &'f Vec<f64>)> {
        let displacements = self.displacements.iter_mut().zip(&other.displacements);
        displacements.chain(self.rigid.iter_mut().zip(&other.rigid)).chain([(&mut self.trace, &other.trace)])
    }

    /// Add t `step` to an iterate, whose rigid part goes into the gap of the model.
    pub fn advance(&mut self, model: &mut Model, t: f64, step: &DisplacementField) {
        let fall: Vec<Vec<f64>> = step.rigid.iter().map(|amounts| amounts.iter().map(|a| t * a).collect()).collect();
        let falling = motions::trace(model, &fall);
        self.add(t, step);
        axpy(-1.0, &falling, &mut self.trace);
        model.close_gap(&falling);
    }

    /// Recompute the traces B v from the displacements. Steps are added to both separately, so that they come to differ
    /// by the rounding of large steps. Collective.
    pub fn retrace(&mut self, model: &Model) {
        self.trace_here(model);
        model.exchange.sum(&mut self.trace);
    }

    /// Set the traces to those of the local bodies, and to zero for other bodies.
    fn trace_here(&mut self, model: &Model) {
        let mut trace = vec![0.0; self.trace.len()];
        for (index, body) in model.locals() {
            let mut rows = vec![0.0; body.dofs().rows.rows()];
            body.dofs().rows.multiply(&self.displacements[index], &mut rows);
            model.add(index, &rows, &mut trace);
        }
        self.trace = trace;
    }

    /// Return the change of compression at each point: B_a v_a + B_b v_b.
    pub fn closing(&self) -> Vec<f64> {
        closing(&self.trace).collect()
    }
}

/// Return the sum of x_s'y_s over the local bodies s. The caller adds the sums of all ranks.
pub fn local_dot(x: &[Vec<f64>], y: &[Vec<f64>]) -> f64 {
    x.iter().zip(y).map(|(x, y)| dot(x, y)).sum()
}

/// Return the residual r = f - K u - B' `force` (26) of every local body, for forces at the points (n), and the sum of
/// the energies of u. `products` are K u.
pub fn residual(
    model: &Model,
    products: Vec<Vec<f64>>,
    u: &DisplacementField,
    force: &[f64],
) -> (Vec<Vec<f64>>, Energy) {
    let mut sum = Energy::default();
    let of_body = |(index, product): (usize, Vec<f64>)| {
        let (slot, state, rows) = (&model.bodies[index], &u.displacements[index], model.at_rows(index, force));
        let mut r = vec![0.0; state.len()];
        let Some(body) = slot.local.as_ref() else { return r };
        let energy = body.residual(state, &product, &rows, &mut r);
        body.dofs().balance(&mut r, &slot.works(&rows));
        sum.strain += energy.strain;
        sum.potential += energy.potential;
        if body.dofs().leads() {
            sum.potential -=
                slot.free_motions().iter().zip(&u.rigid[index]).map(|(motion, a)| motion.work * a).sum::<f64>();
        }
        r
    };
    let all = products.into_iter().enumerate().map(of_body).collect();
    (all, sum)
}

/// Return the squared energy norm of unbalanced forces r of the local bodies, taken for each dof alone: r'D^-1 r with
/// the diagonal D of K + B' diag(`springs`) B, for springs omega kappa at the points (n). The caller adds the sums of
/// all ranks.
pub fn unbalanced(model: &Model, r: &[Vec<f64>], springs: &[f64]) -> f64 {
    model.locals().map(|(index, body)| body.unbalanced(&r[index], &model.at_rows(index, springs))).sum()
}

/// Add B' `force` to y for every local body, for forces at the points (n).
pub fn add_forces(model: &Model, force: &[f64], y: &mut [Vec<f64>]) {
    for (index, body) in model.locals() {
        body.dofs().rows.add_transpose(1.0, &model.at_rows(index, force), &mut y[index]);
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
    /// Return the line from an iterate with the layer state `layer` and the equilibrium residual `r` along `v`, with
    /// the products `kv` = K v. One message.
    pub fn new(model: &'a Model, layer: &'a Layer, r: &[Vec<f64>], v: &DisplacementField, kv: &[Vec<f64>]) -> Self {
        let mut sums = [local_dot(r, &v.displacements), local_dot(kv, &v.displacements)];
        model.exchange.sum(&mut sums);
        let closing = v.closing();
        let works = (0..model.bodies.len()).map(|body| {
            let works = model.bodies[body].works(&model.at_rows(body, &layer.force));
            dot(&works, &v.rigid[body])
        });
        let slope = -sums[0] - works.sum::<f64>() - dot(&layer.force, &closing);
        Self { model, compression: &layer.compression, closing, slope, curvature: sums[1] }
    }

    /// Return d/dt F1(u + t v).
    pub fn derivative(&self, t: f64) -> f64 {
        let mut sum = self.slope + t * self.curvature;
        for (q, pair, point) in self.model.each_point().filter(|(q, ..)| self.closing[*q] != 0.0) {
            let s = self.closing[q];
            sum += self.model.area[q] * pair.law.pressure(point, self.compression[q] + t * s) * s;
        }
        // a law that leaves the range of numbers resists with an infinite force
        if sum.is_nan() { f64::INFINITY } else { sum }
    }

    /// Return the minimiser t >= 0 of F1 along the line, or 0 if F1 does not decrease along it. `accuracy` is that of
    /// the derivative, relative to the derivative at 0.
    ///
    /// # Errors
    /// [`Unbounded`] if F1 still decreases at the longest step.
    pub fn minimize(&self, accuracy: f64) -> Result<f64, Unbounded> {
        zero(|t| self.derivative(t), self.derivative(0.0), accuracy)
    }
}

/// Step, as a multiple of the first one, beyond which nothing stops a motion. With a law p = c^10, a load of 1e-100
/// moves a body 1e90 times as far as the springs of a first step do. Squares of longer steps leave the range of
/// numbers.
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

/// Return the zero t >= 0 of an increasing function with the value `start` at 0, or 0 if `start` is not negative.
/// `accuracy` is relative to `start`.
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
    // Illinois variant of the secant rule, with bisection where a law is too steep for it: halving a value of a
    // thousand times the other takes ten secants. Every third step halves the interval at least, so that 200 are more
    // than the 53 bits of t need.
    for _ in 0..200 {
        if high.value <= target {
            return Ok(high.t);
        }
        let secant = (low.t * high.weight - high.t * low.weight) / (high.weight - low.weight);
        let middle = 0.5 * (low.t + high.t);
        let is_steep = !high.value.is_finite() || high.value > 1e3 * low.value.abs();
        let t = if is_steep || !(secant > low.t && secant < high.t) { middle } else { secant };
        let next = SearchPoint::new(t, value(t));
        if next.value.abs() <= target || high.t - low.t <= 4.0 * f64::EPSILON * high.t {
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
