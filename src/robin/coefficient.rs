//! The Robin coefficient: what stands in diag(omega psi kappa) of G.
//!
//! Any symmetric positive definite G leads to the same solution; it decides how fast. Weights are kept for each contact row,
//! in the layout of a trace vector, because the two bodies of a pair may need different ones.

use crate::error::{Error, Result};
use crate::linalg::Blocks;
use crate::model::Model;
use crate::model::layer::Layer;
use crate::model::rigid::{Moved, TOLERANCE, combined};
use crate::problem::robin::{RobinRule, Zone};
use nalgebra::DMatrix;

/// Zone and rule with what the rule remembers.
pub struct Coefficient {
    zone: Zone,
    rule: RobinRule,
    frozen: Option<Vec<f64>>,
}

impl Coefficient {
    /// Starts with nothing remembered.
    pub fn new(zone: Zone, rule: RobinRule) -> Self {
        Self { zone, rule, frozen: None }
    }

    /// omega psi kappa of every contact row (2n, layout of a trace vector) for layers at these places in iteration `k`.
    ///
    /// # Errors
    /// A condition of the zone that has no value at a contact point; all ranks find it.
    pub fn weight(&mut self, model: &Model, layer: &Layer, k: usize) -> Result<Vec<f64>> {
        if let Some(frozen) = &self.frozen {
            return Ok(frozen.clone());
        }
        let points = tangents(&self.zone, model, layer, k).map_err(Error::common)?;
        let tangent = [&points[..], &points[..]].concat();
        Ok(match &self.rule {
            RobinRule::Tangent => tangent,
            RobinRule::Frozen => self.frozen.insert(constrained(model, tangent)).clone(),
            RobinRule::Floor(floor) => {
                let points = model.points();
                tangent.into_iter().enumerate().map(|(i, w)| w.max(floor * model.weight[i % points])).collect()
            }
            RobinRule::Auto => constrained(model, tangent),
        })
    }
}

/// omega psi kappa at every point in iteration `k`.
fn tangents(zone: &Zone, model: &Model, layer: &Layer, k: usize) -> Result<Vec<f64>> {
    let mut weight = vec![0.0; model.points()];
    for (pair, contact) in model.pairs.iter().enumerate() {
        for q in model.range(pair) {
            let point = q - model.offset[pair];
            let inside = match zone {
                Zone::None => false,
                Zone::Full => true,
                Zone::Active => layer.tangent[q] > 0.0,
                Zone::Subset(holds) => holds.is_true_at("psi", contact.position[point], k)?,
            };
            if inside {
                // a smoothed law has a tangent of its own
                let tangent = match layer.tangent[q] {
                    0.0 => contact.law.robin_tangent(point, layer.compression[q]),
                    tangent => tangent,
                };
                weight[q] = model.weight[q] * tangent;
            }
        }
    }
    Ok(weight)
}

/// The first body that nothing holds under the Robin term `weight` (omega psi kappa of the contact rows), and its motion: springs
/// below [`TOLERANCE`] of the largest stiffness in the body drown in its rounding.
pub fn underconstrained(model: &Model, weight: &[f64]) -> Option<Moved> {
    (0..model.bodies.len()).find_map(|body| {
        let slot = &model.bodies[body];
        let springs = springs(model, body, &model.of_body(body, weight));
        let free = Blocks::free(&springs, slot.scale, TOLERANCE);
        let names = slot.motions.iter().map(|motion| &motion.name[..]);
        Some(Moved { body, name: combined(names, free.first()?.iter().copied()) })
    })
}

/// A motion held by less than this share of the stiffness of the body's own surface is not held safely: the sweep would move the body
/// by as many times what its surface gives way.
const WEAK: f64 = 1e-3;

/// The weights, with at least the stiffness of the body's own surface as a whole for every body that they do not hold safely.
fn constrained(model: &Model, mut weight: Vec<f64>) -> Vec<f64> {
    for (body, slot) in model.bodies.iter().enumerate().filter(|(_, slot)| !slot.motions.is_empty()) {
        // the stiffness under each point, spread over all of them
        let rows = slot.row_stiffness.len().max(1) as f64;
        let own: Vec<f64> = slot.row_stiffness.iter().map(|stiffness| stiffness / rows).collect();
        let natural = springs(model, body, &own);
        let mut safe = springs(model, body, &model.of_body(body, &weight)) - WEAK * &natural;
        // of a motion that is felt nowhere nothing is asked
        let felt = natural.diagonal().max();
        (0..safe.nrows()).for_each(|i| safe[(i, i)] += TOLERANCE * felt);
        if safe.cholesky().is_some() {
            continue;
        }
        let now = model.of_body(body, &weight);
        let more: Vec<f64> = now.iter().zip(&own).map(|(now, own)| now.max(*own)).collect();
        model.put(body, &more, &mut weight);
    }
    weight
}

/// Stiffness of springs at a body's contact rows in terms of its free motions.
fn springs(model: &Model, body: usize, weight: &[f64]) -> DMatrix<f64> {
    let motions = &model.bodies[body].motions;
    DMatrix::from_fn(motions.len(), motions.len(), |i, j| {
        let (s, t) = (&motions[i].trace, &motions[j].trace);
        (0..weight.len()).map(|q| weight[q] * s[q] * t[q]).sum()
    })
}
