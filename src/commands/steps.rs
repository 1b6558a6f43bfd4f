//! Load steps: one solution after another, each at a share of the loads and started from the one before.
//!
//! At a share s of all loads and prescribed displacements, u/s solves the problem of the full loads with the gap d/s and the layer
//! p(s c)/s. So a step changes gaps and laws alone: no body is assembled, reduced or factored anew.

use super::asking;
use super::keep::Keep;
use super::prepared::{Prepared, sides};
use super::verdict::{message, status_name};
use crate::contact::law::{LayerLaw, Scaled};
use crate::ddm::{self, Method, Observer, Outcome, Row, Settings, Start, Status};
use crate::discretize;
use crate::error::Result;
use crate::model::{Field, Layer, Model};
use crate::output::{StepPairReport, StepReport};
use crate::scene::Scene;
use std::rc::Rc;

/// Runs the steps of a scene, the last of which is its full load, and notes each in `prepared`. The outcome is that of the last
/// one with the counts and the history of all. A step that ends badly leaves its start to the next one; one that a signal ends is the
/// last.
///
/// # Errors
/// Failures of the solver library.
pub fn iterate(
    scene: &Scene,
    prepared: &mut Prepared,
    method: &mut Method,
    settings: &mut Settings,
    observer: &mut dyn Observer,
    keep: &mut dyn Keep,
) -> Result<Outcome> {
    let factors = &scene.method.steps;
    let laws: Vec<Rc<dyn LayerLaw>> = prepared.problem.model.pairs.iter().map(|pair| pair.law.clone()).collect();
    let interval = std::mem::take(&mut settings.interval);
    let mut all = Steps::new(observer, prepared);
    let mut skipped = 0;
    let mut before: Option<(Field, f64)> = None;
    loop {
        let factor = factors[all.step];
        (all.step, all.factor, all.first) = (all.step + 1, factor, all.rows.len());
        let last = all.step == factors.len();
        load(&mut prepared.problem.model, &laws, factor);
        settings.interval = interval && last;
        match before.take() {
            Some((field, share)) => {
                settings.start = Start::Resume(rescaled(&prepared.problem.model, field, share / factor));
                if let Method::Sweeps { acceleration, .. } = method {
                    acceleration.restart();
                }
            }
            None => match &settings.start {
                Start::Continue(state) => state.rows.iter().for_each(|row| all.row(row)),
                _ => settings.start = discretize::start(scene, &prepared.problem, factor)?.into(),
            },
        }
        let mut outcome = loop {
            settings.balance = if last { prepared.balance(scene) } else { None };
            let outcome = ddm::solve(&mut prepared.problem.model, method, settings, &mut all)?;
            let Status::Paused { asked } = outcome.status else { break outcome };
            keep.state(prepared, &outcome, &all.rows[..all.first]);
            if asking::signal(asked).is_some() {
                break outcome;
            }
            if asking::is_snapshot(asked) {
                let entry = entry(prepared, &outcome, factor);
                prepared.steps.push(entry);
                let mut shown = outcome.clone();
                whole(&mut prepared.problem.model, &laws, &mut shown, factor);
                shown.rows.clone_from(&all.rows);
                shown.iterations += all.iterations;
                shown.sweeps += all.sweeps;
                keep.results(prepared, &shown);
                prepared.steps.pop();
                load(&mut prepared.problem.model, &laws, factor);
            }
            settings.start = Start::Continue(outcome.into_state());
        };
        all.iterations += outcome.iterations;
        all.sweeps += outcome.sweeps;
        all.seconds += outcome.rows.last().map_or(0.0, |row| row.seconds);
        skipped += outcome.solves_skipped;
        let entry = entry(prepared, &outcome, factor);
        prepared.steps.push(entry);
        let interrupted = matches!(outcome.status, Status::Paused { .. });
        if interrupted && !last {
            prepared.warnings.push(format!(
                "interrupted in load step {} of {}: pressures and displacements are those of {factor} of the loads",
                all.step,
                factors.len()
            ));
        }
        if last || interrupted {
            whole(&mut prepared.problem.model, &laws, &mut outcome, factor);
            (outcome.iterations, outcome.sweeps, outcome.solves_skipped) = (all.iterations, all.sweeps, skipped);
            outcome.rows = all.rows;
            return Ok(outcome);
        }
        if outcome.status.is_solved() || outcome.status == Status::IterationLimit {
            before = Some((outcome.iterate, factor));
        }
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

/// Brings an outcome at a share of the loads, and the model, to the units of the scene. Displacements that supports prescribe are in
/// the states of bodies, or are added to them in full where those are condensed.
fn whole(model: &mut Model, laws: &[Rc<dyn LayerLaw>], outcome: &mut Outcome, factor: f64) {
    if factor == 1.0 {
        return;
    }
    load(model, laws, 1.0);
    let zero = outcome.iterate.zero_like();
    outcome.iterate.add_to(factor, &zero);
    outcome.layer = Layer::new(model, outcome.layer.compression.iter().map(|c| factor * c).collect());
}

/// The same displacements in other shares: what supports prescribe is a part of a state that stays.
fn rescaled(model: &Model, mut field: Field, ratio: f64) -> Field {
    let rest = Field::rest(model);
    field.add_to(ratio, &rest);
    field.add(-ratio, &rest);
    field
}

/// What the report says of a step.
fn entry(prepared: &Prepared, outcome: &Outcome, factor: f64) -> StepReport {
    let model = &prepared.problem.model;
    let pair = |i: usize| {
        let range = model.range(i);
        let (layer, resultant) = (&outcome.layer, &model.pairs[i].resultant[sides(prepared, i)[0]]);
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

/// Passes rows on in the units of the scene, numbered through.
struct Steps<'a> {
    observer: &'a mut dyn Observer,
    rows: Vec<Row>,
    factor: f64,
    /// Steps begun.
    step: usize,
    /// Rows of the steps before.
    first: usize,
    iterations: usize,
    sweeps: usize,
    seconds: f64,
}

impl<'a> Steps<'a> {
    /// After the steps that another process made.
    fn new(observer: &'a mut dyn Observer, prepared: &mut Prepared) -> Self {
        let rows = std::mem::take(&mut prepared.earlier);
        rows.iter().for_each(|row| observer.row(row));
        let (sweeps, seconds) = rows.last().map_or((0, 0.0), |row| (row.sweeps, row.seconds));
        let iterations = prepared.steps.iter().map(|step| step.iterations).sum();
        Self { observer, factor: 1.0, step: prepared.steps.len(), first: rows.len(), rows, iterations, sweeps, seconds }
    }
}

impl Observer for Steps<'_> {
    fn row(&mut self, row: &Row) {
        let mut row = row.clone();
        row.step = self.step;
        row.iteration += self.iterations;
        row.sweeps += self.sweeps;
        row.seconds += self.seconds;
        row.energy *= self.factor * self.factor;
        self.observer.row(&row);
        self.rows.push(row);
    }

    fn asked(&self) -> u8 {
        self.observer.asked()
    }

    fn note(&mut self, text: &str) {
        self.observer.note(text);
    }
}
