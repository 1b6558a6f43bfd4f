//! Vectors over all bodies: iterates, corrections, search directions.

use super::body::Energy;
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
        let state = |slot: &BodySlot| slot.local.as_ref().map_or(Vec::new(), |body| body.rest());
        Field { states: model.bodies.iter().map(state).collect(), trace: vec![0.0; 2 * model.points()] }
    }

    /// Return the field without displacement of any body.
    pub fn zero(model: &Model) -> Field {
        let state = |slot: &BodySlot| vec![0.0; slot.local.as_ref().map_or(0, |body| body.len())];
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
            if let Some(body) = &slot.local {
                let mut rows = vec![0.0; slot.row_stiffness.len()];
                body.trace(&self.states[index], &mut rows);
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
        if let Some(body) = &mut slot.local {
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

/// Add B' `force` to y for every local body, for forces at the points (n).
pub fn add_forces(model: &Model, force: &[f64], y: &mut [Vec<f64>]) {
    for (index, y) in y.iter_mut().enumerate() {
        if let Some(body) = &model.bodies[index].local {
            body.add_rows(&model.at_rows(index, force), y);
        }
    }
}
