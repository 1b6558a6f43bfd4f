//! Anderson acceleration of the sweep, safeguarded by F1.

use super::{Acceleration, Here, Step};
use crate::error::Result;
use crate::model::field::Field;
use crate::model::line::Line;
use crate::robin::Ritz;
use nalgebra::{DMatrix, DVector};
use std::collections::VecDeque;

/// Mixes the last corrections so that the traces' residual is least, then searches along the mixture; restarted when the
/// contact set changes.
pub struct Anderson {
    depth: usize,
    /// (step that was taken, change of the correction that it made), oldest first.
    history: VecDeque<(Field, Field)>,
    /// Correction at the last iterate and the step from it.
    last: Option<(Field, Field)>,
    closed: Vec<bool>,
    ritz: Ritz,
}

impl Anderson {
    /// Mixes up to `depth` earlier steps.
    pub fn new(depth: usize) -> Self {
        Self { depth, history: VecDeque::new(), last: None, closed: Vec::new(), ritz: Ritz::default() }
    }

    /// z - sum gamma_j (s_j + dz_j) with the least-squares gamma on traces: Anderson's step with mixing one.
    fn mixture(&self, z: &Field) -> Field {
        let n = self.history.len();
        let mut mixed = z.clone();
        if n == 0 {
            return mixed;
        }
        let changes = DMatrix::from_fn(z.trace.len(), n, |i, j| self.history[j].1.trace[i]);
        // columns of very different length are scaled before they are compared
        let norms: Vec<f64> = changes.column_iter().map(|c| c.norm().max(f64::MIN_POSITIVE)).collect();
        let scaled = DMatrix::from_fn(z.trace.len(), n, |i, j| changes[(i, j)] / norms[j]);
        let right = DVector::from_column_slice(&z.trace);
        if let Ok(weights) = scaled.svd(true, true).solve(&right, 1e-10) {
            for (j, (step, change)) in self.history.iter().enumerate() {
                mixed.add(-weights[j] / norms[j], step);
                mixed.add(-weights[j] / norms[j], change);
            }
        }
        mixed
    }
}

impl Acceleration for Anderson {
    fn name(&self) -> &'static str {
        "anderson"
    }

    fn step(&mut self, here: &mut Here) -> Result<Step> {
        let closed: Vec<bool> = here.layer.compression.iter().map(|&c| c > 0.0).collect();
        let z = &here.sweep.correction;
        if closed != self.closed {
            self.history.clear();
            self.last = None;
            self.closed = closed;
        }
        if let Some((before, step)) = self.last.take() {
            let mut change = z.clone();
            change.add(-1.0, &before);
            if self.history.len() == self.depth {
                self.history.pop_front();
            }
            self.history.push_back((step, change));
        }
        let mut direction = self.mixture(z);
        let mut line = Line::new(here.model, here.layer, &here.sweep.residual, &direction);
        if line.derivative(0.0) >= 0.0 {
            // the mixture does not descend: the sweep does
            self.history.clear();
            direction = z.clone();
            line = Line::new(here.model, here.layer, &here.sweep.residual, &direction);
        }
        let Ok(length) = line.minimize(1e-4) else { return Ok(Step::Unbounded) };
        // the step is the best guess of the error: the slow modes are in it
        self.ritz.observe(here.model, &direction);
        self.ritz.bounds(here.model, here.layer, here.weight);
        let mut step = direction.clone();
        step.add(length - 1.0, &direction);
        self.last = Some((z.clone(), step));
        Ok(Step::Along(direction, length))
    }

    fn ritz(&mut self) -> &mut Ritz {
        &mut self.ritz
    }

    fn restart(&mut self) {
        self.history.clear();
        self.last = None;
    }
}
