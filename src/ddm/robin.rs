//! The paper's loop (41)-(42), and faster variants over the same sweep.
//!
//! ```text
//! layers      c = B u - d,   p = p(c)
//! Robin term  G_s = K_s + B_s' omega psi kappa B_s                            (37)-(38)
//! sweep       G_s z_s = r_s = f_s - K_s u_s - B_s' omega p                    (41)  every body by itself
//! update      u <- u + gamma z                                                (42)
//! ```
//!
//! An [`Acceleration`] makes the next iterate from the sweep at the present one. All minimise the same F1 with the same sweep.

use super::run::{LastSweep, LoopEnd, Row, Run};
use super::stop::Status;
use crate::error::Result;
use crate::linalg::portable::{log, pow};
use crate::model::Model;
use crate::model::field::{Field, LineEnergy, local_dot};
use crate::model::layer::Layer;
use crate::model::linear::LinearStep;
use crate::robin::sweep::{Coefficient, Sweeper, underconstrained};
use crate::robin::{Ritz, Sweep};
use nalgebra::{DMatrix, DVector};
use std::collections::VecDeque;

/// Iterate from a displacement until a rule ends the run. `linear` serves estimates of the mesh's error. A run that goes on already has the row
/// of the displacement in its history.
pub(super) fn iterate(
    run: &mut Run,
    acceleration: &mut dyn Acceleration,
    coefficient: &mut Coefficient,
    linear: &mut dyn LinearStep,
    mut u: Field,
) -> Result<LoopEnd> {
    let end = |status, u, layer, weight, run: &Run| {
        let Sweeper { sweeps, solves_skipped: skipped } = run.memory.sweeper;
        Ok(LoopEnd { status, iterate: u, layer, weight, sweeps, skipped })
    };
    for k in run.rows.len().saturating_sub(1).. {
        let layer = Layer::at(run.model, &u.trace);
        let weight = coefficient.weight(run.model, &layer, k)?;
        if let Some(moved) = underconstrained(run.model, &weight) {
            return end(Status::Underconstrained(moved), u, layer, weight, run);
        }
        run.model.robin(&weight)?;
        let last = run.memory.last.take();
        let sweep = match run.memory.sweep.take() {
            // the sweep at which the run paused
            Some(sweep) => sweep,
            None => {
                let relaxed = last.as_ref().and_then(|last| Some((&last.sweep, last.relaxed?)));
                let asked = run.observer.asked();
                run.memory.sweeper.sweep(run.model, &u, &layer, &weight, relaxed, asked)?
            }
        };
        // the first iterate of a run that goes on was checked before the pause
        if k == run.rows.len() {
            let step = last.as_ref().map_or((None, f64::NAN), |last| (Some(&last.moved[..]), last.length));
            let at = run.after_sweep(&u, &layer, &sweep, step, acceleration.amplification().sqrt());
            let paused = (at.measured.asked != 0).then_some(Status::Paused { asked: at.measured.asked });
            let failed = sweep.failed.clone().map(Status::InnerSolver);
            let ended = run.check_termination(&at, linear)?;
            if let Some(status) = failed.or(ended).or(paused) {
                run.memory.sweep = Some(sweep);
                return end(status, u, layer, weight, run);
            }
        }
        let residual = run.rows[k].residual;
        let mut here = Iterate { model: run.model, k, layer: &layer, weight: &weight, sweep: &sweep, residual };
        let (direction, length, relaxed) = match acceleration.step(&mut here)? {
            RobinStep::Unbounded => {
                return end(Status::Unbounded { moving: Vec::new() }, u, layer, weight, run);
            }
            RobinStep::Sweep(gamma) => (None, gamma, Some(gamma)),
            RobinStep::Along(direction, length) => (Some(direction), length, None),
        };
        let direction = direction.as_ref().unwrap_or(&sweep.correction);
        u.add(length, direction);
        let moved = direction.trace.iter().map(|t| length * t).collect();
        run.memory.last = Some(LastSweep { sweep, relaxed, length, moved });
    }
    unreachable!("the limit of iterations ends the loop")
}

/// The present iterate.
pub struct Iterate<'a> {
    /// The problem. Its bodies carry the Robin term of this iterate.
    pub model: &'a mut Model,
    /// Number of the iterate.
    pub k: usize,
    /// The layers at the iterate.
    pub layer: &'a Layer,
    /// The Robin term, omega psi kappa of each contact row (2n).
    pub weight: &'a [f64],
    /// The sweep at the iterate: r and z = G^-1 r.
    pub sweep: &'a Sweep,
    /// Relative residual.
    pub residual: f64,
}

impl Iterate<'_> {
    /// Return r'z over all bodies.
    pub fn decrement(&self) -> f64 {
        self.sweep.decrement.iter().sum()
    }
}

/// A step from an iterate.
pub enum RobinStep {
    /// Along the correction z of the sweep, by this gamma (42).
    Sweep(f64),
    /// Along another direction, by this length.
    Along(Field, f64),
    /// F1 falls for ever along the direction: a body is unconstrained.
    Unbounded,
}

/// A rule that makes the next iterate.
pub trait Acceleration {
    /// Return the name, as in the scene and the table.
    fn name(&self) -> &'static str;

    /// Return the next step.
    fn step(&mut self, here: &mut Iterate) -> Result<RobinStep>;

    /// Return the Ritz values on the span of its directions, which estimate the spectrum of G^-1 F1''.
    fn ritz(&mut self) -> &mut Ritz;

    /// Estimate 1/(smallest eigenvalue of G^-1 F1''); NaN while nothing is known. The squared energy error is at most about this times r'G^-1 r.
    fn amplification(&mut self) -> f64 {
        self.ritz().known().map_or(f64::NAN, |(low, _)| low.recip().max(1.0))
    }

    /// Return the estimated bounds of the spectrum of G^-1 F1'', if there were enough directions.
    fn spectrum(&mut self) -> Option<(f64, f64)> {
        self.ritz().known()
    }

    /// Return the factor by which an iteration reduces the residual in the long run, if the method has one of its own.
    fn factor(&mut self) -> Option<f64> {
        None
    }

    /// Update the estimates at the iterate with which a run ends. `weight` is the Robin term that the model carries (2n). Collective.
    fn conclude(&mut self, model: &Model, layer: &Layer, weight: &[f64]) {
        self.ritz().bounds(model, layer, weight);
    }

    /// Forget the earlier iterations, because the problem changes.
    fn restart(&mut self);
}

/// Anderson acceleration. It mixes the last corrections such that the change of the traces is least, and searches along the mixture. It restarts
/// when the contact set changes.
pub struct Anderson {
    depth: usize,
    /// Earlier steps, oldest first.
    history: VecDeque<PastStep>,
    last: Option<Mixed>,
    /// Whether each point was closed at the last iterate.
    closed: Vec<bool>,
    ritz: Ritz,
}

/// An earlier step.
struct PastStep {
    step: Field,
    /// Change of the correction by the step.
    change: Field,
}

/// The last iterate.
struct Mixed {
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
            for (j, PastStep { step, change }) in self.history.iter().enumerate() {
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

    fn step(&mut self, here: &mut Iterate) -> Result<RobinStep> {
        let closed: Vec<bool> = here.layer.compression.iter().map(|&c| c > 0.0).collect();
        let z = &here.sweep.correction;
        if closed != self.closed {
            self.history.clear();
            self.last = None;
            self.closed = closed;
        }
        if let Some(Mixed { correction, step }) = self.last.take() {
            let mut change = z.clone();
            change.add(-1.0, &correction);
            if self.history.len() == self.depth {
                self.history.pop_front();
            }
            self.history.push_back(PastStep { step, change });
        }
        let mut direction = self.mixture(z);
        let mut line = LineEnergy::new(here.model, here.layer, &here.sweep.residual, &direction);
        if line.derivative(0.0) >= 0.0 {
            // F1 does not fall along the mixture, but it does along the correction of the sweep
            self.history.clear();
            direction = z.clone();
            line = LineEnergy::new(here.model, here.layer, &here.sweep.residual, &direction);
        }
        let Ok(length) = line.minimize(1e-4) else { return Ok(RobinStep::Unbounded) };
        // the mixture is the best estimate of the error, so it contains the slow modes
        self.ritz.observe(here.model, &direction);
        self.ritz.bounds(here.model, here.layer, here.weight);
        let mut step = direction.clone();
        step.add(length - 1.0, &direction);
        self.last = Some(Mixed { correction: z.clone(), step });
        Ok(RobinStep::Along(direction, length))
    }

    fn ritz(&mut self) -> &mut Ritz {
        &mut self.ritz
    }

    fn restart(&mut self) {
        self.history.clear();
        self.last = None;
    }
}

/// Conjugate gradients by the rule of Polak and Ribière with exact line search on F1. They restart when the contact set changes.
#[derive(Default)]
pub struct Conjugate {
    last: Option<Conjugated>,
    ritz: Ritz,
}

/// The last iterate, and the direction taken from it.
struct Conjugated {
    direction: Field,
    residual: Vec<Vec<f64>>,
    /// r'z.
    decrement: f64,
    /// Whether each point was closed.
    closed: Vec<bool>,
}

impl Acceleration for Conjugate {
    fn name(&self) -> &'static str {
        "ncg"
    }

    fn step(&mut self, here: &mut Iterate) -> Result<RobinStep> {
        let closed: Vec<bool> = here.layer.compression.iter().map(|&c| c > 0.0).collect();
        let z = &here.sweep.correction;
        let mut direction = z.clone();
        if let Some(last) = self.last.take().filter(|last| last.closed == closed) {
            let mut products =
                [local_dot(&last.residual, &z.states), local_dot(&here.sweep.residual, &last.direction.states)];
            here.model.exchange.sum(&mut products);
            let beta = ((here.decrement() - products[0]) / last.decrement).max(0.0);
            // if F1 does not fall along the new direction, it is not conjugate any more
            if here.decrement() + beta * products[1] > 0.0 {
                direction = last.direction;
                direction.add_to(beta, z);
            }
        }
        let line = LineEnergy::new(here.model, here.layer, &here.sweep.residual, &direction);
        let Ok(length) = line.minimize(1e-8) else { return Ok(RobinStep::Unbounded) };
        self.ritz.observe(here.model, &direction);
        self.ritz.bounds(here.model, here.layer, here.weight);
        let residual = here.sweep.residual.clone();
        self.last = Some(Conjugated { direction: direction.clone(), residual, decrement: here.decrement(), closed });
        Ok(RobinStep::Along(direction, length))
    }

    fn ritz(&mut self) -> &mut Ritz {
        &mut self.ritz
    }

    fn factor(&mut self) -> Option<f64> {
        self.spectrum().map(gradients_factor)
    }

    fn restart(&mut self) {
        self.last = None;
    }
}

/// An estimate of the iterations to come.
#[derive(Debug, Clone, PartialEq)]
pub struct Forecast {
    /// Factor by which an iteration reduces the residual in the long run; 1 or more where it does not.
    pub factor: f64,
    /// Iterations from the last iterate to the residual that was asked for; infinite if it is never reached.
    pub iterations: f64,
}

/// Iterations whose mean factor is used for a method without a rate of its own.
const RECENT: usize = 10;

impl Forecast {
    /// Estimate from the history of a run, the residual that was asked for, and the method's own factor if it has one.
    pub fn new(rows: &[Row], target: f64, factor: Option<f64>) -> Option<Self> {
        let last = rows.last()?.residual;
        let seen = || {
            let before = rows.len().checked_sub(RECENT + 1)?;
            Some(pow(last / rows[before].residual, 1.0 / RECENT as f64))
        };
        let factor = match (factor, seen()) {
            // a mode that grows from a small amplitude appears in the history before it appears in the spectrum
            (Some(own), Some(seen)) if seen >= 1.0 => own.max(seen),
            (own, seen) => own.or(seen)?,
        };
        if !factor.is_finite() {
            return None;
        }
        let gain = target / last;
        let iterations = match factor {
            _ if gain >= 1.0 => 0.0,
            factor if factor >= 1.0 => f64::INFINITY,
            // a thousandth of an iteration counts as rounding
            factor => (log(gain) / log(factor) - 1e-3).ceil(),
        };
        (!iterations.is_nan()).then_some(Self { factor, iterations })
    }
}

/// Return the factor of a relaxed iteration with this gamma: the largest |1 - gamma lambda| over the spectrum (low, high).
pub fn relaxed_factor(gamma: f64, (low, high): (f64, f64)) -> f64 {
    (1.0 - gamma * low).abs().max((1.0 - gamma * high).abs())
}

/// Return the gamma with the least such factor.
pub fn best_gamma((low, high): (f64, f64)) -> f64 {
    2.0 / (low + high)
}

/// Return that factor, (kappa - 1)/(kappa + 1) with the condition number kappa. An exact line search has the same factor in the worst case.
pub fn best_factor(spectrum: (f64, f64)) -> f64 {
    relaxed_factor(best_gamma(spectrum), spectrum)
}

/// Return the factor of conjugate gradients, (sqrt kappa - 1)/(sqrt kappa + 1).
pub fn gradients_factor((low, high): (f64, f64)) -> f64 {
    let root = (high / low).sqrt();
    (root - 1.0) / (root + 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(factor: f64, count: i32) -> Vec<Row> {
        (0..=count).map(|k| Row { residual: factor.powi(k), ..Row::default() }).collect()
    }

    /// The closed forms of two modes 1 -+ theta.
    #[test]
    fn factors_of_two_modes() {
        let theta = 0.6;
        let spectrum = (1.0 - theta, 1.0 + theta);
        assert!((best_gamma(spectrum) - 1.0).abs() < 1e-15 && (best_factor(spectrum) - theta).abs() < 1e-15);
        assert!((relaxed_factor(0.5, spectrum) - 0.8).abs() < 1e-15);
        assert!((relaxed_factor(1.5, spectrum) - 1.4).abs() < 1e-15);
        // sqrt(1.6/0.4) = 2
        assert!((gradients_factor(spectrum) - 1.0 / 3.0).abs() < 1e-15);
    }

    #[test]
    fn iterations_follow_from_the_factor() {
        let left = |factor: Option<f64>| Forecast::new(&rows(0.1, 3), 1e-8, factor);
        assert_eq!(left(Some(0.1)).map(|f| f.iterations), Some(5.0));
        assert_eq!(left(Some(0.01)).map(|f| f.iterations), Some(3.0));
        assert_eq!(left(Some(1.2)).map(|f| f.iterations), Some(f64::INFINITY));
        // a residual that rises will not fall, whatever the spectrum says
        let risen = Forecast::new(&rows(1.1, 12), 1e-8, Some(0.8)).expect("a forecast");
        assert!((risen.factor - 1.1).abs() < 1e-12 && risen.iterations == f64::INFINITY, "{risen:?}");
        // a short history gives no factor, a longer one its mean
        assert_eq!(left(None), None);
        let seen = Forecast::new(&rows(0.5, 20), 0.5f64.powi(24), None).expect("a forecast");
        assert!((seen.factor - 0.5).abs() < 1e-12 && (4.0..=5.0).contains(&seen.iterations), "{seen:?}");
        assert_eq!(Forecast::new(&rows(0.1, 9), 1e-8, Some(0.1)).map(|f| f.iterations), Some(0.0));
    }
}
