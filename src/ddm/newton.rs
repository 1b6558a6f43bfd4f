//! Semismooth Newton (35) with a state of its own in every layer.
//!
//! Each contact point keeps a state (c_q, p_q) on its law, with the tangent kappa_q there:
//!
//! ```text
//! linear step    K u + B' omega (p_q + kappa_q (B u - d - c_q)) = f           all bodies together
//! step length    c = B u - d,   p = p_q + kappa_q (c - c_q)                   in equilibrium, also on the way
//! layer states   the point of the law with c_q + p_q/rho = c + p/rho          (resolvent, Minty)
//! ```
//!
//! A fixed point has c = c_q and p = p_q: the equations (26). The gap between (c, p) and the law bounds the error of u. Where steps have to be
//! shortened, the laws are smoothed for a while ([`path`](super::path)).

use super::bound::Reached;
use super::fit;
use super::forcing::Forcing;
use super::linear::resisting;
use super::path::Equilibrium;
use super::roundoff::of_compressions;
use super::run::{Candidate, End, Measured, Run};
use super::stop::{Stagnation, Status};
use crate::error::Result;
use crate::model::Model;
use crate::model::field::{Field, residual};
use crate::model::layer::Layer;
use crate::model::linear::{LinearStep, Solution, Solved, System, Trial};
use crate::model::surface::meeting_slopes;

/// Relative error of a correction.
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
        let part = newton.step_length(&step);
        let iterate = newton.advance(step, part);
        let measures = newton.measure(&iterate)?;
        if let Some(status) = newton.check_termination(&iterate, &measures)? {
            return Ok(newton.end(status, Some(iterate.resolved)));
        }
        newton.update_states(&iterate);
        if let Some(status) = newton.check_pause(&measures) {
            return Ok(newton.end(status, Some(iterate.resolved)));
        }
    }
}

/// A run of Newton's method under way.
struct Newton<'n, 'r> {
    run: &'n mut Run<'r>,
    linear: &'n mut dyn LinearStep,
    /// Slopes rho as long as no step has shown how the bodies answer, n.
    unit: Vec<f64>,
    tolerance: f64,
    u: Field,
    /// States of the layers from which the next linear step is taken.
    states: Layer,
    /// Present while roundoff leaves too large an error of the linear step, so that the next step is a correction: it takes the same states once
    /// more. It watches what corrections gain.
    correction: Option<Stagnation>,
    /// The best iterate whose errors include those of its equilibrium. If roundoff ends the run, this one is the result.
    best: Option<Candidate>,
}

/// The part of a linear step that is taken.
struct Part {
    /// 1 for a whole step.
    length: f64,
    /// Pressures at the end of the whole step, n.
    whole_pressure: Vec<f64>,
}

/// The result of a step: displacements and pressures in equilibrium, and the states on the laws that belong to them.
struct Iterate {
    /// The part of the linear step that was taken.
    step: Solution,
    length: f64,
    /// c, n.
    compression: Vec<f64>,
    /// Error of c by roundoff, n.
    roundoff: Vec<f64>,
    /// p, n.
    pressure: Vec<f64>,
    /// Slopes of the lines on which the laws are resolved, n.
    rho: Vec<f64>,
    /// States on the laws themselves.
    resolved: Layer,
}

impl Iterate {
    fn equilibrium(&self) -> Equilibrium<'_> {
        let Self { compression, roundoff, pressure, rho, .. } = self;
        Equilibrium { compression, roundoff, pressure, rho }
    }
}

/// The errors of an iterate.
struct Measures {
    measured: Measured,
    reached: Reached,
    /// Whether the errors include what roundoff or an iterative solver left of equilibrium.
    is_complete: bool,
    /// Whether corrections gain nothing any more.
    is_roundoff: bool,
}

impl Newton<'_, '_> {
    /// Solve the linear step from the states. A correction is solved to half of its size only.
    fn linear_step(&mut self) -> Result<Solved> {
        let (model, states) = (&mut *self.run.model, &self.states);
        let springs = resisting(model, states.springs(model));
        let compression = model.compression(&self.u.trace);
        let (residual, _) = residual(model, &self.u, &model.forces(&states.linear(&compression)));
        let rho = self.run.memory.progress.slopes(model, &self.unit, states);
        let scale = (self.tolerance, &self.run.scale);
        let mut forcing = Forcing::new(states, compression, &rho, scale, self.linear.roughest());
        let is_correction = self.correction.is_some();
        let mut enough = |model: &Model, trial: &Trial| match is_correction {
            true => trial.is_within(HALF),
            false => forcing.is_enough(model, trial),
        };
        self.linear.solve(System { model, places: states, springs: &springs, residual: &residual, enough: &mut enough })
    }

    /// Return the part of a step that does not lead away from the laws; all of a correction.
    fn step_length(&mut self, step: &Solution) -> Part {
        let (model, progress) = (&*self.run.model, &mut self.run.memory.progress);
        let before = model.compression(&self.u.trace);
        let whole: Vec<f64> = before.iter().zip(step.field.closing()).map(|(c, closing)| c + closing).collect();
        let whole_pressure = self.states.linear(&whole);
        if self.correction.is_some() {
            return Part { length: 1.0, whole_pressure };
        }
        let roundoff = of_compressions(model, &self.u.trace);
        let ends = [[&before[..], &roundoff], [&whole, &whole_pressure]];
        let length = progress.step_length(model, &self.unit, &self.states, ends);
        Part { length, whole_pressure }
    }

    /// Take this part of a step, and resolve the laws at its end.
    fn advance(&mut self, mut step: Solution, Part { length, whole_pressure }: Part) -> Iterate {
        let (model, progress) = (&*self.run.model, &mut self.run.memory.progress);
        step.field.scale(length);
        self.u.add(1.0, &step.field);
        self.u.retrace(model);
        // pressures of the linear step, not of the compressions at its end: a stiff layer would magnify the roundoff of displacements
        let pressure = progress.go(length, whole_pressure);
        let rho = progress.slopes(model, &self.unit, &self.states);
        if self.states.closed > 0 && self.states.smoothing.is_empty() {
            fit::rigid_correction(model, [&mut self.u, &mut step.field], &pressure, &rho, self.tolerance);
        }
        let compression = model.compression(&self.u.trace);
        let roundoff = of_compressions(model, &self.u.trace);
        let resolved = Layer::resolve(model, &compression, &pressure, &rho, &[]);
        Iterate { step, length, compression, roundoff, pressure, rho, resolved }
    }

    /// Measure the errors of an iterate. If it seems good enough or at the roundoff level, measure its equilibrium, too; if that is what makes it
    /// too inexact, the next step is a correction.
    fn measure(&mut self, iterate: &Iterate) -> Result<Measures> {
        let Iterate { step, resolved, .. } = iterate;
        let run = &mut *self.run;
        let (rest, energy) = residual(run.model, &self.u, &run.model.forces(&iterate.pressure));
        let measured = run.measure(energy, &Layer::new(run.model, iterate.compression.clone()), self.linear);
        let strain = measured.strain;
        let reached = Reached::new(run.model, &run.scale, strain, step, &iterate.equilibrium(), resolved);
        let is_enough = run.is_enough(&reached);
        let is_complete = is_enough || run.is_at_roundoff(&reached, &self.u, resolved, strain);
        let mut measures = Measures { measured, reached, is_complete, is_roundoff: false };
        let corrected = self.correction.take();
        if is_complete
            && let Some(missed) = self.measure_equilibrium(&rest, resolved, &mut measures)?
            && is_enough
            && !self.run.is_enough(&measures.reached)
        {
            // a correction gains a digit, unless roundoff adds as much again
            let mut stagnation = corrected.unwrap_or_else(Stagnation::of_steps);
            measures.is_roundoff = stagnation.is_reached(missed);
            self.correction = Some(stagnation);
        }
        Ok(measures)
    }

    /// Add to the errors what roundoff, or an iterative solver, left of equilibrium. A further step with the same matrix for the residual `rest`
    /// shows how large that is. Return the larger error that was added, none if the step fails.
    fn measure_equilibrium(
        &mut self,
        rest: &[Vec<f64>],
        resolved: &Layer,
        measures: &mut Measures,
    ) -> Result<Option<f64>> {
        let (run, places) = (&mut *self.run, &self.states);
        let springs = resisting(run.model, places.springs(run.model));
        let mut enough = |_: &Model, trial: &Trial| trial.is_within(HALF);
        let before = self.linear.counts();
        let system = System { model: run.model, places, springs: &springs, residual: rest, enough: &mut enough };
        let more = self.linear.solve(system)?;
        let (counts, measured) = (self.linear.counts(), &mut measures.measured);
        measured.inner_iterations += counts.inner_iterations - before.inner_iterations;
        measured.factorizations += counts.factorizations - before.factorizations;
        let add = |more| measures.reached.add_rounding((&run.scale, measured.strain), &more, places, resolved);
        Ok(more.ok().map(add))
    }

    /// Show the row of an iterate and keep it. Return the status if the run ends with this iterate.
    fn check_termination(&mut self, iterate: &Iterate, measures: &Measures) -> Result<Option<Status>> {
        let (run, resolved) = (&mut *self.run, &iterate.resolved);
        let step = (&self.u, &iterate.step.field, iterate.length);
        let at = run.after_step(step, measures.measured, &measures.reached, resolved, self.linear);
        let status = run.check_termination(&at, self.linear)?;
        if let Some(row) = run.rows.last().filter(|_| measures.is_complete)
            && self.best.as_ref().is_none_or(|best| row.residual <= best.row.residual)
        {
            self.best = Some(Candidate { row: row.clone(), u: self.u.clone(), layer: resolved.clone() });
        }
        // errors of states on smoothed laws fall with mu, and show no roundoff
        let is_smoothed = !self.states.smoothing.is_empty();
        let status = status.filter(|status| !(is_smoothed && *status == Status::RoundoffLimited));
        Ok(status.or(measures.is_roundoff.then_some(Status::RoundoffLimited)))
    }

    /// Set the states of the next step, unless that is a correction of this one.
    fn update_states(&mut self, iterate: &Iterate) {
        if self.correction.is_some() {
            return;
        }
        let run = &mut *self.run;
        let unseen = (UNSEEN * self.tolerance).powi(2) * run.scale.energy(run.energy);
        let path = &mut run.memory.progress.path;
        let smoothing = path.smoothing(run.model, &iterate.equilibrium(), &self.states.smoothing, unseen);
        self.states = match smoothing.is_empty() {
            true => iterate.resolved.clone(),
            false => Layer::resolve(run.model, &iterate.compression, &iterate.pressure, &iterate.rho, &smoothing),
        };
    }

    /// Return the status of a run that is requested to pause, and keep the states from which it can go on.
    fn check_pause(&mut self, measures: &Measures) -> Option<Status> {
        let asked = measures.measured.asked;
        (asked != 0).then(|| {
            self.run.memory.states = Some(self.states.clone());
            Status::Paused { asked }
        })
    }

    /// End the run at the last iterate, or at the best one if roundoff ends it.
    fn end(&mut self, status: Status, resolved: Option<Layer>) -> End {
        let (mut u, mut states) = (std::mem::take(&mut self.u), resolved.unwrap_or_else(|| self.states.clone()));
        if let (Status::RoundoffLimited, Some(best)) = (&status, self.best.take()) {
            (u, states) = self.run.go_back(best);
        }
        self.run.end(status, u, states, self.linear)
    }
}
