//! The linearised problem at an iterate: the response of the bodies and their layers to small loads.

use super::field::Field;
use super::layer::Layer;
use super::method::{Here, cg};
use super::model::Model;
use super::sweep::Sweeper;
use crate::error::Result;

/// Steps of conjugate gradients at most.
const MOST: usize = 200;

/// Solves (K + B' diag(omega kappa) B) w = r until the residual has fallen by `reduction`, and gives w with its squared energy
/// norm w'r. `loads` is r, one entry a dof of each body that lives here; `weight` = omega psi kappa is the Robin term that the
/// model carries.
///
/// # Errors
/// Failures of the solver library.
pub fn respond(
    model: &mut Model,
    layer: &Layer,
    weight: &[f64],
    loads: &[Vec<f64>],
    reduction: f64,
) -> Result<(Field, f64)> {
    let mut residual = Vec::new();
    for (slot, load) in model.bodies.iter_mut().zip(loads) {
        residual.push(match &mut slot.local {
            Some(body) => body.reduce(load)?,
            None => Vec::new(),
        });
    }
    let spring: Vec<f64> = model.weight.iter().zip(&layer.tangent).map(|(w, k)| w * k).collect();
    let mut sweeper = Sweeper::default();
    let sweep = sweeper.precondition(model, residual.clone(), &residual)?;
    let mut here =
        Here { model, sweeper: &mut sweeper, k: 0, layer, weight, sweep: &sweep, residual: 1.0, target: reduction };
    let solution = cg::solve(&mut here, &spring, reduction, MOST)?;
    Ok((solution.x, solution.energy))
}
