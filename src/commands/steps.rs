//! Load steps: one solution after another, each at a share of the loads and started from the one before.
//!
//! At a share s of all loads and prescribed displacements, u/s solves the problem of the full loads with the gap d/s and the layer
//! p(s c)/s. So a step changes gaps and laws alone: no body is assembled, reduced or factored anew.

use super::keep::{self, Keep};
use super::stages::{Done, Ready};
use super::verdict::{message, status_name};
use crate::contact::law::{LayerLaw, Scaled};
use crate::ddm::{Method, Observer, Outcome, Row, Start, Status};
use crate::discretize::{self, Discrete};
use crate::error::Result;
use crate::model::{Field, Layer, Model};
use crate::output::{StepPairReport, StepReport};
use std::rc::Rc;

/// Runs the steps of a scene, the last of which is its full load, and reports each. The outcome is that of the last one with the
/// counts and the history of all. A step that ends badly leaves its start to the next one; one that a signal ends is the last.
///
/// # Errors
/// Failures of the solver library.
pub fn iterate(mut ready: Ready, keep: &mut dyn Keep) -> Result<Done> {
    let scene = ready.built.scene.clone();
    let factors = &scene.method.steps;
    let mut all = Steps::new(keep, &ready);
    loop {
        let (before, factor) = (all.factor, factors[all.step]);
        (all.step, all.factor) = (all.step + 1, factor);
        let last = all.step == factors.len();
        let discrete = &mut ready.built.discrete;
        load(&mut discrete.model, &all.laws, factor);
        ready.start = match ready.start {
            Start::Resume(field) => {
                if let Method::Sweeps { acceleration, .. } = &mut ready.method {
                    acceleration.restart();
                }
                Start::Resume(rescaled(&discrete.model, field, before / factor))
            }
            paused @ Start::Continue(_) => paused,
            _ => discretize::start(&scene, discrete, factor)?.into(),
        };
        let mut done = keep::solve(ready, last, &mut all)?;
        let interrupted = matches!(done.outcome.status, Status::Paused { .. });
        if interrupted && !last {
            done.warnings.push(format!(
                "interrupted in load step {} of {}: pressures and displacements are those of {factor} of the loads",
                all.step,
                factors.len()
            ));
        }
        if last || interrupted {
            all.complete(&mut done);
            return Ok(done);
        }
        all.end_step(&mut done);
        let usable = done.outcome.status.is_solved() || done.outcome.status == Status::IterationLimit;
        ready = done.go_on(|outcome| if usable { Start::Resume(outcome.iterate) } else { Start::Automatic });
    }
}

/// Gaps and laws at a share of the loads.
fn load(model: &mut Model, laws: &[Rc<dyn LayerLaw>], factor: f64) {
    model.scale_gaps(factor);
    for (pair, law) in model.pairs.iter_mut().zip(laws) {
        // the full load is the scene itself, to the last digit
        pair.law = if factor == 1.0 { law.clone() } else { Rc::new(Scaled { law: law.clone(), factor }) };
    }
}

/// The same displacements in other shares: what supports prescribe is a part of a state that stays.
fn rescaled(model: &Model, mut field: Field, ratio: f64) -> Field {
    let rest = Field::rest(model);
    field.add_to(ratio, &rest);
    field.add(-ratio, &rest);
    field
}

/// What the report says of a step.
fn report(discrete: &Discrete, outcome: &Outcome, factor: f64) -> StepReport {
    let model = &discrete.model;
    let pair = |i: usize| {
        let range = model.range(i);
        let (layer, resultant) = (&outcome.layer, &model.pairs[i].resultant[discrete.sides(i)[0]]);
        StepPairReport {
            force: std::array::from_fn(|k| {
                range.clone().zip(resultant).fold(0.0, |sum, (q, row)| sum - factor * layer.force[q] * row[k])
            }),
            peak_pressure: factor * layer.pressure[range.clone()].iter().copied().fold(0.0, f64::max),
            closed: layer.compression[range].iter().filter(|&&c| c > 0.0).count(),
        }
    };
    StepReport {
        factor,
        status: status_name(&outcome.status).to_owned(),
        message: message(outcome, model),
        iterations: outcome.iterations,
        residual: outcome.rows.last().map(|row| row.residual).filter(|residual| residual.is_finite()),
        pairs: (0..model.pairs.len()).map(pair).collect(),
    }
}

/// Warnings of the steps before the last one that were not solved.
pub fn warnings(steps: &[StepReport]) -> Vec<String> {
    let solved = [Status::Converged, Status::RoundoffLimited].map(|status| status_name(&status));
    let before = steps.iter().take(steps.len().saturating_sub(1)).enumerate();
    let bad = before.filter(|(_, step)| !solved.contains(&step.status.as_str()));
    bad.map(|(i, step)| format!("load step {} (factor {}): {}", i + 1, step.factor, step.message)).collect()
}

/// Passes rows and results on in the units of the scene, numbered through.
struct Steps<'a> {
    keep: &'a mut dyn Keep,
    /// Laws at the full load.
    laws: Vec<Rc<dyn LayerLaw>>,
    factor: f64,
    /// Steps begun.
    step: usize,
    /// Counts of the steps before.
    iterations: usize,
    sweeps: usize,
    skipped: usize,
    seconds: f64,
}

impl<'a> Steps<'a> {
    /// After the steps that another process made.
    fn new(keep: &'a mut dyn Keep, ready: &Ready) -> Self {
        ready.earlier.iter().for_each(|row| keep.row(row));
        let (sweeps, seconds) = ready.earlier.last().map_or((0, 0.0), |row| (row.sweeps, row.seconds));
        let iterations = ready.steps.iter().map(|step| step.iterations).sum();
        let laws = ready.built.discrete.model.pairs.iter().map(|pair| pair.law.clone()).collect();
        Self { keep, laws, factor: 1.0, step: ready.steps.len(), iterations, sweeps, skipped: 0, seconds }
    }

    /// A row of this step in the units of the scene.
    fn whole(&self, row: &Row) -> Row {
        let mut row = row.clone();
        row.step = self.step;
        row.iteration += self.iterations;
        row.sweeps += self.sweeps;
        row.seconds += self.seconds;
        row.energy *= self.factor * self.factor;
        row
    }

    /// Leaves a step for the next one.
    fn end_step(&mut self, done: &mut Done) {
        let Done { built, outcome, steps, earlier, .. } = done;
        steps.push(report(&built.discrete, outcome, self.factor));
        earlier.extend(outcome.rows.iter().map(|row| self.whole(row)));
        self.iterations += outcome.iterations;
        self.sweeps += outcome.sweeps;
        self.skipped += outcome.solves_skipped;
        self.seconds += outcome.rows.last().map_or(0.0, |row| row.seconds);
    }

    /// Brings what this step has found, and the model, to the units of the scene, with the counts and the history of all steps.
    fn complete(&self, done: &mut Done) {
        let Done { built, outcome, share, steps, earlier, .. } = done;
        *share = self.factor;
        steps.push(report(&built.discrete, outcome, self.factor));
        outcome.iterations += self.iterations;
        outcome.sweeps += self.sweeps;
        outcome.solves_skipped += self.skipped;
        outcome.rows = earlier.iter().cloned().chain(outcome.rows.iter().map(|row| self.whole(row))).collect();
        if self.factor != 1.0 {
            load(&mut built.discrete.model, &self.laws, 1.0);
            outcome.iterate.add_to(self.factor, &Field::zero(&built.discrete.model));
            let compression = outcome.layer.compression.iter().map(|c| self.factor * c).collect();
            outcome.layer = Layer::new(&built.discrete.model, compression);
        }
    }
}

impl Observer for Steps<'_> {
    fn row(&mut self, row: &Row) {
        let row = self.whole(row);
        self.keep.row(&row);
    }

    fn asked(&self) -> u8 {
        self.keep.asked()
    }

    fn note(&mut self, text: &str) {
        self.keep.note(text);
    }
}

impl Keep for Steps<'_> {
    fn state(&mut self, done: &Done) {
        self.keep.state(done);
    }

    fn results(&mut self, done: &mut Done) {
        let paused = done.outcome.clone();
        self.complete(done);
        self.keep.results(done);
        done.steps.pop();
        (done.outcome, done.share) = (paused, 1.0);
        load(&mut done.built.discrete.model, &self.laws, self.factor);
    }
}
