//! Load steps: a sequence of solutions, each of which starts from the previous one.
//!
//! A leg of a load history is a sequence of steps in which all loads and prescribed displacements have a common factor. A step within a leg changes
//! loads alone, and no body is assembled, reduced or factorised again. Another leg is another problem on the same mesh, which reuses condensed
//! bodies.

use super::recorder::{self, Recorder};
use super::report::GatheredCounters;
use super::results;
use super::stages::{All, Begin, Clock, Done, Prepared};
use super::verdict::{message, status_name};
use super::warnings;
use crate::ddm::{InitialGuess, Observer, Outcome, Row, Solution, Status};
use crate::discretize::{self, Discrete};
use crate::error::Result;
use crate::model::BodyCounts;
use crate::problem::history::History;
use std::rc::Rc;

/// Solve the load steps of a scene and report each. The outcome is that of the last step with the counters and rows of all steps.
///
/// After a step without a usable result, the next step begins with the start of the scene. A step that a signal interrupts is the
/// last.
///
/// # Errors
/// Failures of the solver library, and loads that a body cannot have.
pub fn iterate(mut ready: Prepared, keep: &mut dyn Recorder, clock: &mut Clock) -> Result<Done> {
    let scene = ready.built.scene.clone();
    let history = &scene.method.steps;
    let mut all = Steps::new(keep, &ready);
    loop {
        ready.built.discrete.scale_loads(history.share(all.step));
        if !matches!(ready.start, InitialGuess::Known(_)) {
            ready.start = discretize::start(&scene, &ready.built.discrete)?.into();
        }
        all.step += 1;
        let last = all.step == history.steps.len();
        let mut done = recorder::solve(ready, last, &mut all)?;
        let interrupted = matches!(done.outcome.status, Status::Interrupted { .. });
        if interrupted && !last {
            let (step, count) = (all.step, history.steps.len());
            done.warnings.push(format!(
                "interrupted in load step {step} of {count}: pressures and displacements are those of this step"
            ));
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
        let usable = done.outcome.status.is_solved() || done.outcome.status == Status::IterationLimit;
        ready = match history.leg(all.step).contains(&(all.step - 1)) {
            true => done.go_on(|Outcome { iterate: field, layer, .. }| match usable {
                true => InitialGuess::Known(Box::new(Solution { field, compression: layer.compression })),
                false => InitialGuess::Automatic,
            }),
            false => all.end_leg(done, usable, clock)?,
        };
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
    /// Counters of the bodies in the legs before.
    counts: BodyCounts,
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
            counts: BodyCounts::default(),
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
        row.factorizations += self.counts.factorizations;
        row.inner_iterations += self.counts.inner_iterations;
        row
    }

    /// Add the report of a step that has ended. Return the displacements of the bodies. Collective.
    fn report(&self, done: &mut Done) -> Rc<All> {
        let recovered = results::recover(done);
        let (status, message) = (status_name(&done.outcome.status), message(&done.outcome, done.model()));
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
        outcome.joint += self.counts;
        outcome.rows = std::mem::take(earlier);
    }

    /// End a leg and return the problem of the next one, which begins with the pressures of this one. Collective.
    fn end_leg(&mut self, done: Done, usable: bool, clock: &mut Clock) -> Result<Prepared> {
        clock.phase("iterate");
        self.counts += GatheredCounters::gather(&done.built.discrete).counts;
        self.counts += done.outcome.joint;
        let Discrete { assemblies, assemblies_avoided, .. } = done.built.discrete;
        let Done { built, method, outcome, steps, earlier, mut warnings, .. } = done;
        let known = || Box::new(Solution { compression: outcome.layer.compression, ..Solution::default() });
        let start = (usable && !self.history.is_at_rest(self.step)).then(|| InitialGuess::Known(known()));
        let (legs, mut known) = (built.legs.clone(), built.warnings.clone());
        drop(method);
        let condensed = built.into_condensed();
        let Some(legs) = legs else { unreachable!("a history of several legs comes with the way to them") };
        let mut ready = legs.prepare(self.step, Begin { start, steps }, condensed, clock)?;
        ready.earlier = earlier;
        ready.built.legs = Some(legs);
        ready.built.discrete.assemblies += assemblies;
        ready.built.discrete.assemblies_avoided += assemblies_avoided;
        for (all, new) in [(&mut known, &mut ready.built.warnings), (&mut warnings, &mut ready.warnings)] {
            new.retain(|warning| !all.contains(warning));
            all.append(new);
        }
        (ready.built.warnings, ready.warnings) = (known, warnings);
        Ok(ready)
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
