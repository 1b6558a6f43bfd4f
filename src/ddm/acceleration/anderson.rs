//! Anderson acceleration of the sweep, safeguarded by F1.

use super::{Acceleration, Iterate, Step};
use crate::error::Result;
use crate::model::field::Field;
use crate::model::line::Line;
use crate::robin::Ritz;
use nalgebra::{DMatrix, DVector};
use std::collections::VecDeque;

/// Anderson acceleration. It mixes the last corrections such that the change of the traces is least, and searches along the mixture. It restarts
/// when the contact set changes.
pub struct Anderson {
    depth: usize,
    /// Earlier steps, oldest first.
    history: VecDeque<Earlier>,
    last: Option<Last>,
    /// Whether each point was closed at the last iterate.
    closed: Vec<bool>,
    ritz: Ritz,
}

/// An earlier step.
struct Earlier {
    step: Field,
    /// Change of the correction by the step.
    change: Field,
}

/// The last iterate.
struct Last {
    correction: Field,
    /// The step that was taken from it.
    step: Field,
}

impl Anderson {
    /// Return an acceleration that mixes up to `depth` earlier steps.
    pub fn new(depth: usize) -> Self {
        Self { depth, history: VecDeque::new(), last: None, closed: Vec::new(), ritz: Ritz::default() }
    }

    /// Return z - sum_j w_j (s_j + dz_j): Anderson's step with mixing parameter one. s_j are the earlier steps, dz_j the changes of z by them, and the
    /// weights w_j make the traces of z - sum_j w_j dz_j least.
    fn mixture(&self, z: &Field) -> Field {
        let n = self.history.len();
        let mut mixed = z.clone();
        if n == 0 {
            return mixed;
        }
        let changes = DMatrix::from_fn(z.trace.len(), n, |i, j| self.history[j].change.trace[i]);
        // the columns may have very different lengths: scale them to one
        let norms: Vec<f64> = changes.column_iter().map(|c| c.norm().max(f64::MIN_POSITIVE)).collect();
        let scaled = DMatrix::from_fn(z.trace.len(), n, |i, j| changes[(i, j)] / norms[j]);
        let right = DVector::from_column_slice(&z.trace);
        if let Ok(weights) = scaled.svd(true, true).solve(&right, 1e-10) {
            for (j, Earlier { step, change }) in self.history.iter().enumerate() {
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

    fn step(&mut self, here: &mut Iterate) -> Result<Step> {
        let closed: Vec<bool> = here.layer.compression.iter().map(|&c| c > 0.0).collect();
        let z = &here.sweep.correction;
        if closed != self.closed {
            self.history.clear();
            self.last = None;
            self.closed = closed;
        }
        if let Some(Last { correction, step }) = self.last.take() {
            let mut change = z.clone();
            change.add(-1.0, &correction);
            if self.history.len() == self.depth {
                self.history.pop_front();
            }
            self.history.push_back(Earlier { step, change });
        }
        let mut direction = self.mixture(z);
        let mut line = Line::new(here.model, here.layer, &here.sweep.residual, &direction);
        if line.derivative(0.0) >= 0.0 {
            // F1 does not fall along the mixture, but it does along the correction of the sweep
            self.history.clear();
            direction = z.clone();
            line = Line::new(here.model, here.layer, &here.sweep.residual, &direction);
        }
        let Ok(length) = line.minimize(1e-4) else { return Ok(Step::Unbounded) };
        // the mixture is the best estimate of the error, so it contains the slow modes
        self.ritz.observe(here.model, &direction);
        self.ritz.bounds(here.model, here.layer, here.weight);
        let mut step = direction.clone();
        step.add(length - 1.0, &direction);
        self.last = Some(Last { correction: z.clone(), step });
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
