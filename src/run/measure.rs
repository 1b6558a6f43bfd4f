//! Quantities of a result: forces, approach and contact size of each pair, and reactions of each body.

use super::balance;
use super::ended::{All, Recovered};
use super::stages::{Built, Done};
use super::words::numbered;
use crate::ddm::Status;
use crate::model::Model;
use crate::output::{BalanceReport, BodyReport, Extent, ReactionReport, StepPairReport, StepReport};
use crate::problem::history::History;

/// Least length of the integrated normal of a pair relative to its area: below this ratio the pair has no mean normal.
///
/// Around a closed surface the integral is zero except for facets without a partner, and one such facet in a thousand does not
/// define a direction of the contact. Half a circle has the ratio 0.64.
const CANCELS: f64 = 1e-3;

/// Return the names of the pairs in the order of the scene, made unique.
pub fn pair_names(built: &Built) -> Vec<String> {
    let model = &built.discrete.model;
    let names = (0..model.pairs.len()).map(|i| {
        let [a, b] = built.discrete.sides(i).map(|side| &model.bodies[model.pairs[i].bodies[side]].name);
        format!("{a}-{b}")
    });
    numbered(names)
}

/// Return the measure of the contact points: `"length"`, or `"area"` in space and for bodies of revolution.
pub fn of_points(built: &Built) -> &'static str {
    built.discrete.model.pairs.first().map_or("length", |pair| pair.measure)
}

/// Return the names of the supports, springs and rigid surfaces, body by body, made unique.
pub fn reaction_names(built: &Built) -> Vec<String> {
    numbered(built.discrete.bodies.iter().flat_map(|body| {
        let all = body.supports.iter().chain(&body.springs).chain(&body.rigid);
        all.map(|on| format!("{}:{on}", body.name))
    }))
}

/// Return the reactions of bodies with these names and balances, in the order of [`reaction_names`].
fn reactions<'a>(bodies: impl Iterator<Item = (&'a String, BalanceReport)>) -> Vec<ReactionReport> {
    let of_body = |(name, balance): (&String, BalanceReport)| {
        let BalanceReport { supports, springs, rigid, .. } = balance;
        let all = supports.into_iter().chain(springs).chain(rigid);
        all.map(|part| ReactionReport { body: name.clone(), on: part.on, force: part.force }).collect::<Vec<_>>()
    };
    bodies.flat_map(of_body).collect()
}

/// Return the reactions from the reports of bodies, in the order of [`reaction_names`].
pub fn reported(bodies: &[BodyReport]) -> Vec<ReactionReport> {
    reactions(bodies.iter().map(|body| (&body.name, body.balance.clone())))
}

/// Return the report of the load step `number` of a history, counted from 0, which has ended with these displacements. Collective.
pub fn step(
    done: &Done,
    recovered: &All,
    history: &History,
    number: usize,
    iterations: usize,
    status: &str,
    message: String,
) -> StepReport {
    let approaches = approaches(done, recovered);
    let balances = balance::gather(done, recovered);
    let names = done.built.discrete.bodies.iter().map(|body| &body.name);
    let last = done.outcome.rows.last();
    let step = &history.steps[number];
    StepReport {
        time: step.time,
        factors: history.names.iter().cloned().zip(step.factors.iter().copied()).collect(),
        status: status.to_owned(),
        message,
        iterations,
        residual: last.map(|row| row.residual).filter(|residual| residual.is_finite()),
        pairs: approaches.into_iter().enumerate().map(|(i, approach)| pair(done, i, approach)).collect(),
        reactions: reactions(names.zip(balances)),
    }
}

/// Return the resultant force or moment of contact forces (n) on a side: minus the sum of the forces times the `rows` (n x 3) of their
/// points.
pub fn resultant(force: &[f64], rows: &[[f64; 3]]) -> [f64; 3] {
    std::array::from_fn(|k| force.iter().zip(rows).fold(0.0, |sum, (force, row)| sum - force * row[k]))
}

/// Return the largest compression of a layer, negative if all of it is open.
pub fn peak(compression: &[f64]) -> f64 {
    compression.iter().copied().fold(f64::NEG_INFINITY, f64::max)
}

/// Return the report of pair `i` in a load step.
fn pair(done: &Done, i: usize, approach: Option<f64>) -> StepPairReport {
    let (discrete, model, layer) = (&done.built.discrete, done.model(), &done.outcome.layer);
    let (pair, range) = (&model.pairs[i], model.range(i));
    let (c, force) = (&layer.compression[range.clone()], &layer.force[range.clone()]);
    StepPairReport {
        force: resultant(force, &pair.resultant[discrete.sides(i)[0]]),
        approach,
        extent: Extent::new(pair.measure, &pair.weight, c),
        peak_pressure: layer.pressure[range].iter().copied().fold(0.0, f64::max),
        peak_compression: peak(c),
        closed: c.iter().filter(|c| **c > 0.0).count(),
    }
}

/// Return the approach of the bodies of each pair along its mean normal, none without a mean normal. Collective, one message.
pub fn approaches(done: &Done, recovered: &All) -> Vec<Option<f64>> {
    let (discrete, model) = (&done.built.discrete, done.model());
    let directions: Vec<Option<[f64; 3]>> = (0..model.pairs.len()).map(|i| direction(model, i)).collect();
    let mut message = vec![0.0; model.pairs.len()];
    for (i, &n) in directions.iter().enumerate() {
        let Some(n) = n else { continue };
        for (side, sign) in [(0, 1.0), (1, -1.0)] {
            let body = model.pairs[i].bodies[side];
            message[i] += match &recovered[body] {
                None => 0.0,
                Some(Err(_)) => f64::NAN,
                Some(Ok(Recovered { state, .. })) => {
                    let u = discrete.bodies[body].post().outer(state, n);
                    sign * (0..3).map(|k| u[k] * n[k]).sum::<f64>()
                }
            };
        }
    }
    model.exchange.sum(&mut message);
    let finite = |(n, value): (Option<[f64; 3]>, f64)| n.map(|_| value).filter(|value| value.is_finite());
    directions.into_iter().zip(message).map(finite).collect()
}

/// Return the mean normal of pair `i` from side a to side b, if there is one.
fn direction(model: &Model, i: usize) -> Option<[f64; 3]> {
    let pair = &model.pairs[i];
    let points = || pair.weight.iter().zip(&pair.resultant[0]);
    let sum: [f64; 3] = std::array::from_fn(|k| points().map(|(weight, n)| weight * n[k]).sum());
    let (size, total) = (sum.iter().map(|n| n * n).sum::<f64>().sqrt(), pair.weight.iter().sum::<f64>());
    (size > CANCELS * total).then(|| sum.map(|n| n / size))
}

/// Whether a run with this status is a start for the next load step.
pub fn is_usable(status: &Status) -> bool {
    status.is_solved() || *status == Status::IterationLimit
}
