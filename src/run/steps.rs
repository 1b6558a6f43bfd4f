//! Load steps: a sequence of solutions, each of which starts from the previous one.
//!
//! A leg of a load history is a sequence of steps in which all loads and prescribed displacements have a common factor s. For the
//! displacements u at the factor s, u/s solves the problem of the full loads with the gap d/s and the layer law p(s c)/s of the
//! compression c. A step within a leg therefore changes gaps and laws alone, and no body is assembled, reduced or factorised again.
//! Another leg is another problem on the same mesh, which reuses condensed bodies.

use super::recorder::{self, Recorder};
use super::report::GatheredCounters;
use super::results;
use super::stages::{self, All, Begin, Clock, Done, Prepared};
use super::verdict::{message, status_name};
use super::warnings;
use crate::contact::law::{LayerLaw, Scaled};
use crate::ddm::{InitialGuess, Observer, Outcome, Row, Solution, Status};
use crate::discretize::{self, Discrete};
use crate::error::Result;
use crate::model::{BodyCounts, Field, Layer, Model};
use crate::problem::history::History;
use crate::scene::Scene;
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
        let before = all.factor;
        all.factor = history.share(all.step);
        all.step += 1;
        let (last, factor) = (all.step == history.steps.len(), all.factor);
        scale_loads(&mut ready.built.discrete.model, &all.laws, factor);
        ready.start = start(ready.start, &ready.built.discrete, &scene, [before, factor])?;
        let mut done = recorder::solve(ready, last, &mut all)?;
        let interrupted = matches!(done.outcome.status, Status::Interrupted { .. });
        if interrupted && !last {
            let (step, count) = (all.step, history.steps.len());
            done.warnings.push(format!(
                "interrupted in load step {step} of {count}: pressures and displacements are those of this step"
            ));
        }
        let of_step = done.outcome.clone();
        let recovered = all.complete(&mut done);
        warnings::note_ends(&mut done);
        all.keep.step(&done, &recovered);
        drop(recovered);
        if interrupted || !last {
            all.keep.state(&done);
        }
        if last || interrupted {
            return Ok(done);
        }
        let usable = of_step.status.is_solved() || of_step.status == Status::IterationLimit;
        if history.leg(all.step).contains(&(all.step - 1)) {
            all.end_step(&mut done, &of_step);
            done.recovered = None;
            (done.outcome, done.share) = (of_step, 1.0);
            scale_loads(&mut done.built.discrete.model, &all.laws, factor);
            ready = done.go_on(|Outcome { iterate: field, layer, .. }| match usable {
                true => InitialGuess::Known(Box::new(Solution { field, compression: layer.compression })),
                false => InitialGuess::Automatic,
            });
        } else {
            ready = all.end_leg(done, &of_step, usable, clock)?;
        }
    }
}

/// Set the gaps d/s and the laws p(s c)/s for a load factor s.
fn scale_loads(model: &mut Model, laws: &[Rc<dyn LayerLaw>], factor: f64) {
    model.scale_gaps(factor);
    for (pair, law) in model.pairs.iter_mut().zip(laws) {
        // at the full load, the law is the one of the scene without rounding
        pair.law = if factor == 1.0 { law.clone() } else { Rc::new(Scaled { law: law.clone(), factor }) };
    }
}

/// Return the start of a step, from the load factor in whose units a known solution is, and that of this step.
fn start(start: InitialGuess, discrete: &Discrete, scene: &Scene, [before, factor]: [f64; 2]) -> Result<InitialGuess> {
    Ok(match start {
        InitialGuess::Known(mut solution) => {
            let ratio = before / factor;
            solution.compression.iter_mut().for_each(|c| *c *= ratio);
            solution.field = rescaled(&discrete.model, solution.field, ratio);
            InitialGuess::Known(solution)
        }
        _ => discretize::start(scene, discrete, factor)?.into(),
    })
}

/// Return the displacements multiplied by a ratio, except for the part that supports prescribe, which stays.
fn rescaled(model: &Model, mut field: Field, ratio: f64) -> Field {
    if field.states.is_empty() {
        field.scale(ratio);
        return field;
    }
    let rest = Field::rest(model);
    field.add_to(ratio, &rest);
    field.add(-ratio, &rest);
    field
}

/// An observer that passes rows and results on in the units of the scene, with iterations numbered through all steps.
struct Steps<'a> {
    keep: &'a mut dyn Recorder,
    history: History,
    /// Laws at the full load.
    laws: Vec<Rc<dyn LayerLaw>>,
    /// Load factor of the current step relative to its leg.
    factor: f64,
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
            laws: laws(&ready.built.discrete.model),
            factor: 1.0,
            step: ready.steps.len(),
            iterations,
            sweeps: 0,
            smoothed: 0,
            seconds: 0.0,
            counts: BodyCounts::default(),
        }
    }

    /// Return a row of this step in the units of the scene, with the counters of all steps.
    fn in_scene(&self, row: &Row) -> Row {
        let mut row = row.clone();
        row.step = self.step;
        row.iteration += self.iterations;
        row.sweeps += self.sweeps;
        row.smoothed += self.smoothed;
        row.seconds += self.seconds;
        row.factorizations += self.counts.factorizations;
        row.inner_iterations += self.counts.inner_iterations;
        row.energy *= self.factor * self.factor;
        row
    }

    fn end_step(&mut self, done: &mut Done, of_step: &Outcome) {
        done.earlier.extend(of_step.rows.iter().map(|row| self.in_scene(row)));
        self.iterations += of_step.iterations;
        self.sweeps += of_step.sweeps;
        self.smoothed += of_step.rows.last().map_or(0, |row| row.smoothed);
        self.seconds += of_step.rows.last().map_or(0.0, |row| row.seconds);
    }

    /// End a leg and return the problem of the next one, which begins with the pressures of this one. Collective.
    fn end_leg(&mut self, mut done: Done, of_step: &Outcome, usable: bool, clock: &mut Clock) -> Result<Prepared> {
        clock.phase("iterate");
        self.end_step(&mut done, of_step);
        self.counts += GatheredCounters::gather(&done.built.discrete).counts;
        self.counts += of_step.joint;
        let Discrete { assemblies, assemblies_avoided, .. } = done.built.discrete;
        let Done { built, method, outcome, steps, earlier, mut warnings, .. } = done;
        // at zero load the ratio p/s is undefined, so there is no warm start
        let known = || Box::new(Solution { compression: outcome.layer.compression, ..Solution::default() });
        let start = (usable && !self.history.is_at_rest(self.step)).then(|| InitialGuess::Known(known()));
        let (legs, mut known) = (built.legs.clone(), built.warnings.clone());
        drop(method);
        let condensed = built.into_condensed();
        let Some(legs) = legs else { unreachable!("a history of several legs comes with the way to them") };
        let mut ready = legs.prepare(self.step, Begin { start, steps }, condensed, clock)?;
        (ready.earlier, self.factor) = (earlier, 1.0);
        ready.built.legs = Some(legs);
        ready.built.discrete.assemblies += assemblies;
        ready.built.discrete.assemblies_avoided += assemblies_avoided;
        self.laws = laws(&ready.built.discrete.model);
        for (all, new) in [(&mut known, &mut ready.built.warnings), (&mut warnings, &mut ready.warnings)] {
            new.retain(|warning| !all.contains(warning));
            all.append(new);
        }
        (ready.built.warnings, ready.warnings) = (known, warnings);
        Ok(ready)
    }

    /// Bring the result of this step and the model to the units of the scene, with the counters and rows of all steps. Return the
    /// displacements of the bodies. Collective.
    fn complete(&self, done: &mut Done) -> Rc<All> {
        let Done { built, outcome, share, earlier, .. } = &mut *done;
        *share = self.factor;
        let iterations = outcome.iterations;
        let (status, message) = (status_name(&outcome.status), message(outcome, &built.discrete.model));
        outcome.iterations += self.iterations;
        outcome.sweeps += self.sweeps;
        outcome.joint += self.counts;
        outcome.rows = earlier.iter().cloned().chain(outcome.rows.iter().map(|row| self.in_scene(row))).collect();
        if self.factor != 1.0 {
            scale_loads(&mut built.discrete.model, &self.laws, 1.0);
            outcome.iterate.add_to(self.factor, &Field::zero(&built.discrete.model));
            let compression = outcome.layer.compression.iter().map(|c| self.factor * c).collect();
            outcome.layer = Layer::new(&built.discrete.model, compression);
        }
        done.recovered = done.recovered.take().map(|all| Rc::new(stages::scaled(&all, self.factor)));
        let recovered = results::recover(done);
        let step = results::step(done, &recovered, &self.history, self.step - 1, iterations, status, message);
        done.steps.push(step);
        recovered
    }
}

fn laws(model: &Model) -> Vec<Rc<dyn LayerLaw>> {
    model.pairs.iter().map(|pair| pair.law.clone()).collect()
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
