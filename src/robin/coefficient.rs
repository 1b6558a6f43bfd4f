//! The Robin coefficient: what stands in diag(omega psi kappa) of G.
//!
//! Any symmetric positive definite G leads to the same solution; G decides how fast. There is one weight for each contact row, in the layout
//! of a trace vector, because the two bodies of a pair may need different weights.

use crate::error::{Error, Result};
use crate::linalg::Blocks;
use crate::model::Model;
use crate::model::layer::Layer;
use crate::model::rigid::{Moved, TOLERANCE, combined};
use crate::problem::method::{RobinRule, Zone};
use nalgebra::DMatrix;

/// The zone and the rule of the Robin term, with the weights that a frozen rule keeps.
pub struct Coefficient {
    zone: Zone,
    rule: RobinRule,
    /// Weights of the first call under the rule `frozen`.
    frozen: Option<Vec<f64>>,
}

impl Coefficient {
    /// Return a coefficient that has kept no weights yet.
    pub fn new(zone: Zone, rule: RobinRule) -> Self {
        Self { zone, rule, frozen: None }
    }

    /// Return omega psi kappa of every contact row (2n, layout of a trace vector) for layers in these states in iteration `k`.
    ///
    /// # Errors
    /// A condition of the zone has no value at a contact point; all ranks find this.
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

/// Return omega psi kappa at every point, n, in iteration `k`.
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
                // a smoothed law has a tangent where the law itself has none
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

/// Return the first body that is unconstrained under the Robin term `weight` (omega psi kappa of the contact rows, 2n), and its motion. Springs
/// below [`TOLERANCE`] of the largest stiffness in the body are lost in its rounding.
pub fn underconstrained(model: &Model, weight: &[f64]) -> Option<Moved> {
    (0..model.bodies.len()).find_map(|body| {
        let slot = &model.bodies[body];
        let springs = springs(model, body, &model.of_body(body, weight));
        let free = Blocks::free(&springs, slot.scale, TOLERANCE);
        let names = slot.motions.iter().map(|motion| &motion.name[..]);
        Some(Moved { body, name: combined(names, free.first()?.iter().copied()) })
    })
}

/// Share of the stiffness of the body's own surface below which a motion is not held safely. At this share, a sweep would move the body by a
/// thousand times what its surface gives way.
const WEAK: f64 = 1e-3;

/// Return the weights (2n). Every body that they do not hold safely gets at least the stiffness of its own surface as a whole.
fn constrained(model: &Model, mut weight: Vec<f64>) -> Vec<f64> {
    for (body, slot) in model.bodies.iter().enumerate().filter(|(_, slot)| !slot.motions.is_empty()) {
        // the stiffness under each row, spread over all rows
        let rows = slot.row_stiffness.len().max(1) as f64;
        let surface: Vec<f64> = slot.row_stiffness.iter().map(|stiffness| stiffness / rows).collect();
        let natural = springs(model, body, &surface);
        let mut safe = springs(model, body, &model.of_body(body, &weight)) - WEAK * &natural;
        // a motion that no contact row resists is not required to be held
        let largest = natural.diagonal().max();
        (0..safe.nrows()).for_each(|i| safe[(i, i)] += TOLERANCE * largest);
        if safe.cholesky().is_some() {
            continue;
        }
        let now = model.of_body(body, &weight);
        let more: Vec<f64> = now.iter().zip(&surface).map(|(now, surface)| now.max(*surface)).collect();
        model.put(body, &more, &mut weight);
    }
    weight
}

/// Return the stiffness of springs at a body's contact rows in terms of its free motions, a square matrix.
fn springs(model: &Model, body: usize, weight: &[f64]) -> DMatrix<f64> {
    let motions = &model.bodies[body].motions;
    DMatrix::from_fn(motions.len(), motions.len(), |i, j| {
        let (s, t) = (&motions[i].trace, &motions[j].trace);
        (0..weight.len()).map(|q| weight[q] * s[q] * t[q]).sum()
    })
}
