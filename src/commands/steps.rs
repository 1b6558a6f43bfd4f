//! Load steps: one solution after another, each at a share of the loads and started from the one before.
//!
//! At a share s of all loads and prescribed displacements, u/s solves the problem of the full loads with the gap d/s and the layer
//! p(s c)/s. So a step changes gaps and laws alone: no body is assembled, reduced or factored anew.

use super::stages::Built;
use super::verdict::{message, status_name};
use crate::contact::law::{LayerLaw, Scaled};
use crate::ddm::{self, Method, Observer, Outcome, Row, Settings, Start, Status};
use crate::discretize::{self, Discrete};
use crate::error::Result;
use crate::model::{Field, Model};
use crate::output::{StepPairReport, StepReport};
use std::rc::Rc;

/// Runs the steps of a scene, the last of which is its full load, and reports each. The outcome is that of the last one with the
/// counts and the history of all. A step that ends badly leaves its start to the next one.
///
/// # Errors
/// Failures of the solver library.
pub fn iterate(
    built: &mut Built,
    method: &mut Method,
    settings: Settings,
    observer: &mut dyn Observer,
) -> Result<(Outcome, Vec<StepReport>)> {
    let Built { scene, discrete, .. } = built;
    let factors = &scene.method.steps;
    let laws: Vec<Rc<dyn LayerLaw>> = discrete.model.pairs.iter().map(|pair| pair.law.clone()).collect();
    let Settings { stop, interval, mut balance, .. } = settings;
    let mut all = Steps { observer, rows: Vec::new(), factor: 1.0, step: 0, iterations: 0, sweeps: 0, seconds: 0.0 };
    let (mut reports, mut skipped) = (Vec::new(), 0);
    let mut before: Option<(Field, f64)> = None;
    loop {
        let factor = factors[all.step];
        (all.step, all.factor) = (all.step + 1, factor);
        let last = all.step == factors.len();
        load(&mut discrete.model, &laws, factor);
        let start = match before.take() {
            Some((field, share)) => {
                if let Method::Sweeps { acceleration, .. } = method {
                    acceleration.restart();
                }
                Start::Resume(rescaled(&discrete.model, field, share / factor))
            }
            None => discretize::start(scene, discrete, factor)?.into(),
        };
        let balance = if last { balance.take() } else { None };
        let mut settings = Settings { stop: stop.clone(), interval: interval && last, balance, start };
        let mut outcome = ddm::solve(&mut discrete.model, method, &mut settings, &mut all)?;
        all.iterations += outcome.iterations;
        all.sweeps += outcome.sweeps;
        all.seconds += outcome.rows.last().map_or(0.0, |row| row.seconds);
        skipped += outcome.solves_skipped;
        reports.push(report(discrete, &outcome, factor));
        if last {
            (outcome.iterations, outcome.sweeps, outcome.solves_skipped) = (all.iterations, all.sweeps, skipped);
            outcome.rows = all.rows;
            return Ok((outcome, reports));
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

/// Passes rows on in the units of the scene, numbered through.
struct Steps<'a> {
    observer: &'a mut dyn Observer,
    rows: Vec<Row>,
    factor: f64,
    /// Steps begun.
    step: usize,
    iterations: usize,
    sweeps: usize,
    seconds: f64,
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

    fn note(&mut self, text: &str) {
        self.observer.note(text);
    }
}
