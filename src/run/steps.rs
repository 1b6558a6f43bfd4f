//! Load steps: a sequence of solutions, each of which starts from the previous one.
//!
//! A step changes loads, prescribed displacements, gaps and motions of obstacles, and nothing else: no body is
//! assembled, reduced or factored again, and no pair is searched for.

use super::phases::next_step;
use super::recorder::{self, Recorder};
use super::results;
use super::stages::{All, Clock, Done, Prepared};
use super::verdict::message;
use super::warnings;
use crate::ddm::{InitialGuess, Observer, Outcome, Row, Solution, Status};
use crate::error::Result;
use crate::interrupt::Interrupt;
use crate::output::RunStatus;
use crate::problem::history::History;
use std::rc::Rc;

/// Iterate. From here on a signal ends the run after the current step, so that its results are written.
///
/// # Errors
/// PETSc fails. A run that does not converge is not an error but a status of the outcome.
pub fn iterate(ready: Prepared, interrupt: &Interrupt, keep: &mut dyn Recorder, clock: &mut Clock) -> Result<Done> {
    interrupt.hold();
    let mut done = if ready.built.scene.method.steps.is_empty() {
        recorder::solve(ready, true, keep).inspect(|done| {
            if matches!(done.outcome.status, Status::Interrupted { .. }) {
                keep.state(done);
            }
        })
    } else {
        steps(ready, keep, clock)
    }?;
    warnings::note_ends(&mut done);
    clock.phase("iterate");
    Ok(done)
}

/// Solve the load steps of a scene and report each. The outcome is that of the last step with the counters and rows of
/// all steps.
///
/// After a step without a usable result, the next step begins with the start of the scene. A step that a signal
/// interrupts is the last.
///
/// # Errors
/// Failures of the solver library, and loads that a body cannot have.
fn steps(mut ready: Prepared, keep: &mut dyn Recorder, clock: &mut Clock) -> Result<Done> {
    let count = ready.built.scene.method.steps.steps.len();
    let mut all = Steps::new(keep, &ready);
    loop {
        all.step += 1;
        let last = all.step == count;
        let mut done = recorder::solve(ready, last, &mut all)?;
        let interrupted = matches!(done.outcome.status, Status::Interrupted { .. });
        if interrupted && !last {
            let step = all.step;
            done.warnings.push(format!(
                "interrupted in load step {step} of {count}: pressures and displacements are those of this step"
            ));
        }
        if !interrupted {
            done.remember();
        }
        let recovered = all.report(&mut done);
        warnings::note_ends(&mut done);
        all.keep.step(&done, &recovered);
        drop(recovered);
        if interrupted || !last {
            all.keep.state(&done);
        }
        all.add(&mut done);
        if last || interrupted {
            all.complete(&mut done);
            return Ok(done);
        }
        clock.phase("iterate");
        let start = all.next_start(&done);
        ready = next_step(done, start, clock)?;
    }
}

/// An observer that passes rows and results on with iterations numbered through all steps.
struct Steps<'a> {
    keep: &'a mut dyn Recorder,
    history: History,
    /// Number of steps begun.
    step: usize,
    /// Iterations of the steps before.
    iterations: usize,
    /// Sweeps of the steps before.
    sweeps: usize,
    /// Newton steps with smoothed laws in the steps before.
    smoothed: usize,
    /// Wall seconds of the steps before.
    seconds: f64,
}

impl<'a> Steps<'a> {
    /// Continue after the steps that another process has solved.
    fn new(keep: &'a mut dyn Recorder, ready: &Prepared) -> Self {
        let iterations = ready.steps.iter().map(|step| step.iterations).sum();
        Self {
            keep,
            history: ready.built.scene.method.steps.clone(),
            step: ready.steps.len(),
            iterations,
            sweeps: 0,
            smoothed: 0,
            seconds: 0.0,
        }
    }

    /// Return a row of this step with the counters of all steps.
    fn in_scene(&self, row: &Row) -> Row {
        let mut row = row.clone();
        row.step = self.step;
        row.iteration += self.iterations;
        row.sweeps += self.sweeps;
        row.smoothed += self.smoothed;
        row.seconds += self.seconds;
        row
    }

    /// Add the report of a step that has ended. Return the displacements of the bodies. Collective.
    fn report(&self, done: &mut Done) -> Rc<All> {
        let recovered = results::recover(done);
        let (status, message) = (RunStatus::from(&done.outcome.status), message(&done.outcome, done.model()));
        let step = results::step(done, &recovered, &self.history, self.step - 1, status, message);
        done.steps.push(step);
        recovered
    }

    /// Add rows and counters of a step that has ended to those of all steps.
    fn add(&mut self, done: &mut Done) {
        let Outcome { rows, iterations, sweeps, .. } = &done.outcome;
        done.earlier.extend(rows.iter().map(|row| self.in_scene(row)));
        self.iterations += iterations;
        self.sweeps += sweeps;
        self.smoothed += rows.last().map_or(0, |row| row.smoothed);
        self.seconds += rows.last().map_or(0.0, |row| row.seconds);
    }

    /// Give the outcome of the last step the rows and counters of all steps.
    fn complete(&self, done: &mut Done) {
        let Done { outcome, earlier, .. } = done;
        (outcome.iterations, outcome.sweeps) = (self.iterations, self.sweeps);
        outcome.rows = std::mem::take(earlier);
    }

    /// Return the start of the step that follows this one, none if the scene has it.
    fn next_start(&self, done: &Done) -> Option<InitialGuess> {
        let Outcome { status, iterate, layer, .. } = &done.outcome;
        let known = || Solution { field: iterate.clone(), compression: layer.compression.clone() };
        (status.is_usable() && !self.history.is_at_rest(self.step)).then(|| InitialGuess::Known(Box::new(known())))
    }
}

impl Observer for Steps<'_> {
    fn row(&mut self, row: &Row) {
        self.keep.row(&self.in_scene(row));
    }

    fn asked(&self) -> u8 {
        self.keep.asked()
    }
}

impl Recorder for Steps<'_> {}
