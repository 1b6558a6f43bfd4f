//! Semismooth Newton (35) with a state of its own in every layer.
//!
//! Each contact point keeps a state (c_q, p_q) on its law, with the tangent kappa_q there:
//!
//! ```text
//! linear step    K u + B' omega (p_q + kappa_q (B u - d - c_q)) = f           all bodies together
//! step length    c = B u - d,   p = p_q + kappa_q (c - c_q)                   in equilibrium, also on the way to it
//! layer states   where the law meets c_q + p_q/rho = c + p/rho                (Minty)
//! ```
//!
//! A fixed point has c = c_q and p = p_q: the equations (26). The gap between (c, p) and the law bounds the error of u. Where steps have to be
//! shortened, the laws are smoothed for a while ([`path`](super::path)).

use super::bound::Reached;
use super::digits::of_compressions;
use super::fit;
use super::forcing::Forcing;
use super::history::Row;
use super::linear::resisting;
use super::path::Equilibrium;
use super::run::{End, Measured, Run};
use super::stop::{Floor, Status};
use crate::error::Result;
use crate::model::Model;
use crate::model::field::{Field, residual};
use crate::model::layer::Layer;
use crate::model::linear::{LinearStep, Solution, Solved, System, Trial};
use crate::model::surface::meeting_slopes;

/// Error of a correction as a share of it.
const HALF: f64 = 0.5;

/// Share of the tolerance below which an error in the energy norm changes nothing in the digits that are asked for.
const UNSEEN: f64 = 0.01;

/// Iterate from displacements and layer states until a rule ends the run.
///
/// # Errors
/// Failures of the solver library. Not converging is a status.
pub(super) fn iterate(run: &mut Run, linear: &mut dyn LinearStep, u: Field, states: Layer) -> Result<End> {
    let (unit, tolerance) = (meeting_slopes(run.model), run.stop.tolerance());
    let mut newton = Newton { run, linear, unit, tolerance, u, states, correction: None, best: None };
    loop {
        let step = match newton.linear_step()? {
            Ok(step) => step,
            Err(failure) => return Ok(newton.end(Status::InnerSolver(failure), None)),
        };
        let iterate = newton.advance(step);
        let measures = newton.measure(&iterate)?;
        if let Some(status) = newton.check_termination(&iterate, &measures)? {
            return Ok(newton.end(status, Some(iterate.resolved)));
        }
        newton.update_states(&iterate);
        if measures.measured.asked != 0 {
            newton.run.memory.states = Some(newton.states.clone());
            let status = Status::Paused { asked: measures.measured.asked };
            return Ok(newton.end(status, Some(iterate.resolved)));
        }
    }
}

/// A run of Newton's method under way.
struct Newton<'n, 'r> {
    run: &'n mut Run<'r>,
    linear: &'n mut dyn LinearStep,
    /// Meeting slopes, n.
    unit: Vec<f64>,
    tolerance: f64,
    u: Field,
    /// States of the layers from which the next linear step is taken.
    states: Layer,
    /// Watches what corrections gain, while roundoff leaves too much of a step: a correction takes the same states once more.
    correction: Option<Floor>,
    /// The best iterate so far of those whose errors tell what roundoff left of equilibrium: what roundoff spoils at the end is taken back.
    best: Option<(Row, Field, Layer)>,
}

/// What a step has led to: a state in equilibrium with the displacements.
struct Iterate {
    step: Solution,
    /// The part of the linear step that was taken.
    length: f64,
    /// c, n, and what roundoff leaves unknown of it.
    compression: Vec<f64>,
    roundoff: Vec<f64>,
    /// p, n.
    pressure: Vec<f64>,
    /// Slopes of the lines on which layer states are found, n.
    rho: Vec<f64>,
    /// States on the laws themselves.
    resolved: Layer,
}

/// How good an iterate is.
struct Measures {
    measured: Measured,
    reached: Reached,
    /// Whether the errors tell what roundoff left of equilibrium.
    is_complete: bool,
    is_roundoff: bool,
}

impl Newton<'_, '_> {
    /// Solve the linear step from the states; a correction to half of what is left, as only the size of roundoff is wanted.
    fn linear_step(&mut self) -> Result<Solved> {
        let (model, states) = (&mut *self.run.model, &self.states);
        let springs = resisting(model, states.springs(model));
        let compression = model.compression(&self.u.trace);
        let (residual, _) = residual(model, &self.u, &model.forces(&states.linear(&compression)));
        let rho = self.run.memory.progress.slopes(model, &self.unit);
        let scale = (self.tolerance, &self.run.scale);
        let mut forcing = Forcing::new(states, compression, &rho, scale, self.linear.roughest());
        let is_correction = self.correction.is_some();
        let mut enough = |model: &Model, trial: &Trial| match is_correction {
            true => trial.is_within(HALF),
            false => forcing.is_enough(model, trial),
        };
        self.linear.solve(System { model, places: states, springs: &springs, residual: &residual, enough: &mut enough })
    }

    /// Take the step as far as it comes nearer to the laws, and resolve the laws there.
    fn advance(&mut self, mut step: Solution) -> Iterate {
        let (model, progress) = (&mut *self.run.model, &mut self.run.memory.progress);
        let before = model.compression(&self.u.trace);
        let whole: Vec<f64> = before.iter().zip(step.field.closing()).map(|(c, closing)| c + closing).collect();
        let whole_pressure = self.states.linear(&whole);
        let length = match self.correction {
            None => {
                let roundoff = of_compressions(model, &self.u.trace);
                let states = [[&before[..], &roundoff], [&whole, &whole_pressure]];
                progress.step_length(model, &self.unit, &self.states.smoothing, states)
            }
            Some(_) => 1.0,
        };
        step.field.scale(length);
        self.u.add(1.0, &step.field);
        self.u.retrace(model);
        // pressures of the step, not of the compressions at its end: roundoff of displacements, which a stiff layer makes large, stays out
        let pressure = progress.go(length, whole_pressure);
        let rho = progress.slopes(model, &self.unit);
        if self.states.closed > 0 && self.states.smoothing.is_empty() {
            fit::fit(model, [&mut self.u, &mut step.field], &pressure, &rho, self.tolerance);
        }
        let compression = model.compression(&self.u.trace);
        let roundoff = of_compressions(model, &self.u.trace);
        let resolved = Layer::resolve(model, &compression, &pressure, &rho, &[]);
        Iterate { step, length, compression, roundoff, pressure, rho, resolved }
    }

    /// Measure the errors of an iterate. One that seems good enough, or at the roundoff level, is asked what roundoff, or an iterative solver, has left of its
    /// equilibrium: a further step with the same matrix tells how large that is.
    fn measure(&mut self, iterate: &Iterate) -> Result<Measures> {
        let Iterate { step, compression, roundoff, pressure, rho, resolved, .. } = iterate;
        let run = &mut *self.run;
        let (rest, energy) = residual(run.model, &self.u, &run.model.forces(pressure));
        let mut measured = run.measure(energy, &Layer::new(run.model, compression.clone()), self.linear);
        let state = (&compression[..], &roundoff[..], &pressure[..]);
        let mut reached = Reached::new((run.model, &run.scale), measured.strain, step, state, resolved, rho);
        let (mut is_roundoff, corrected) = (false, self.correction.take());
        let is_enough = run.is_enough(&reached);
        let is_complete = is_enough || run.is_at_floor(&reached, &self.u, resolved, measured.strain);
        if is_complete {
            let springs = resisting(run.model, self.states.springs(run.model));
            let mut enough = |_: &Model, trial: &Trial| trial.is_within(HALF);
            let (places, before) = (&self.states, self.linear.counts());
            let system = System { model: run.model, places, springs: &springs, residual: &rest, enough: &mut enough };
            let more = self.linear.solve(system)?;
            measured.inner_iterations += self.linear.counts().inner_iterations - before.inner_iterations;
            measured.factorizations += self.linear.counts().factorizations - before.factorizations;
            if let Ok(more) = more {
                let lost = reached.add_rounding((&run.scale, measured.strain), &more, &self.states, resolved);
                if is_enough && !run.is_enough(&reached) {
                    // a correction gains a digit, unless roundoff gives as much again
                    let mut floor = corrected.unwrap_or_else(Floor::of_steps);
                    is_roundoff = floor.is_reached(lost);
                    self.correction = Some(floor);
                }
            }
        }
        Ok(Measures { measured, reached, is_complete, is_roundoff })
    }

    /// Show and keep the row of an iterate; the status if the run ends with it.
    fn check_termination(&mut self, iterate: &Iterate, measures: &Measures) -> Result<Option<Status>> {
        let (run, resolved) = (&mut *self.run, &iterate.resolved);
        let step = (&self.u, &iterate.step.field, iterate.length);
        let at = run.after_step(step, measures.measured, &measures.reached, resolved, self.linear);
        // errors of states on smoothed laws fall with mu, and tell nothing of roundoff
        let is_smoothed = !self.states.smoothing.is_empty();
        let ended = run.end_at(&at, self.linear)?.filter(|status| !(is_smoothed && *status == Status::RoundoffLimited));
        let is_best = |row: &Row| self.best.as_ref().is_none_or(|(best, ..)| row.residual <= best.residual);
        if let Some(row) = run.rows.last().filter(|row| measures.is_complete && is_best(row)) {
            self.best = Some((row.clone(), self.u.clone(), resolved.clone()));
        }
        Ok(ended.or(measures.is_roundoff.then_some(Status::RoundoffLimited)))
    }

    /// Set the states of the next step, unless that is a correction of this one.
    fn update_states(&mut self, iterate: &Iterate) {
        if self.correction.is_some() {
            return;
        }
        let run = &mut *self.run;
        let Iterate { compression, roundoff, pressure, rho, .. } = iterate;
        let state = Equilibrium { compression, roundoff, pressure, rho };
        let unseen = (UNSEEN * self.tolerance).powi(2) * run.scale.energy(run.energy);
        let smoothing = run.memory.progress.path.smoothing(run.model, &state, &self.states.smoothing, unseen);
        self.states = match smoothing.is_empty() {
            true => iterate.resolved.clone(),
            false => Layer::resolve(run.model, compression, pressure, rho, &smoothing),
        };
    }

    /// End the run at the last iterate, or at the best one where roundoff ends it.
    fn end(&mut self, status: Status, resolved: Option<Layer>) -> End {
        let (mut u, mut states) = (std::mem::take(&mut self.u), resolved.unwrap_or_else(|| self.states.clone()));
        if let (Status::RoundoffLimited, Some(best)) = (&status, self.best.take()) {
            (u, states) = self.run.go_back(best);
        }
        self.run.end(status, u, states, self.linear)
    }
}
