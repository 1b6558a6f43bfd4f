//! The Robin coefficient: what stands in diag(omega psi kappa) of G.
//!
//! Any symmetric positive definite G leads to the same solution; it decides how fast. Weights are kept for each contact row,
//! in the layout of a trace vector, because the two bodies of a pair may need different ones.

use super::held;
use super::layer::Layer;
use super::model::Model;
use crate::problem::robin::{RobinRule, Zone};

/// The rule with what it remembers.
#[derive(Debug)]
pub struct Robin {
    rule: RobinRule,
    frozen: Option<Vec<f64>>,
}

impl Robin {
    /// Starts with nothing remembered.
    pub fn new(rule: RobinRule) -> Self {
        Self { rule, frozen: None }
    }

    /// omega psi kappa of every contact row in iteration `k`.
    pub fn weight(&mut self, model: &Model, zone: &Zone, layer: &Layer, k: usize) -> Vec<f64> {
        let tangent = || {
            let points = zone.robin_weight(model, layer, k);
            [&points[..], &points[..]].concat()
        };
        match &self.rule {
            RobinRule::Tangent => tangent(),
            RobinRule::Frozen => self.frozen.get_or_insert_with(|| held_safely(model, tangent())).clone(),
            RobinRule::Floor(floor) => {
                let mut weight = tangent();
                let points = model.points();
                for (q, weight) in weight.iter_mut().enumerate() {
                    *weight = weight.max(floor * model.weight[q % points]);
                }
                weight
            }
            RobinRule::Auto => held_safely(model, tangent()),
        }
    }
}

/// The weights, with more for every body that they do not hold safely.
fn held_safely(model: &Model, mut weight: Vec<f64>) -> Vec<f64> {
    for body in 0..model.bodies.len() {
        if held::weak_motion(model, body, &weight, WEAK).is_some() {
            hold(model, body, &mut weight);
        }
    }
    weight
}

/// Growth of a body's whole Robin term, either way, beyond which an old one does not even serve to measure.
const FAR: f64 = 10.0;

/// Whether the Robin terms of two iterates are alike, body by body.
pub(super) fn is_of_the_size(model: &Model, old: &[f64], new: &[f64]) -> bool {
    (0..model.bodies.len()).all(|body| {
        let [old, new] = [old, new].map(|weight| model.of_body(body, weight).iter().sum::<f64>());
        old <= FAR * new && new <= FAR * old
    })
}

/// A motion held by less than this share of what [`hold`] gives is not held safely.
const WEAK: f64 = 1e-3;

/// Gives every contact row of a body at least the stiffness of the body's own surface as a whole.
fn hold(model: &Model, body: usize, weight: &mut [f64]) {
    let springs = held::natural_springs(model, body);
    let mut next = 0;
    for range in model.trace_ranges(body).collect::<Vec<_>>() {
        for i in range {
            weight[i] = weight[i].max(springs[next]);
            next += 1;
        }
    }
}
