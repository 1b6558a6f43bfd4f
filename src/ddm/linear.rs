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
    let spring = springs(model, &layer.tangent);
    let solution = solve(model, layer, weight, residual, &spring, (reduction, MOST))?;
    Ok((solution.x, solution.energy))
}

/// Extreme eigenvalues of G^-1 (K + B' diag(omega slope) B) among the displacements that forces at the contact rows cause, by at
/// most `most` Lanczos steps from the forces `rows` (layout of a trace vector); `weight` as in [`respond`].
///
/// # Errors
/// Failures of the solver library.
pub fn spectrum(
    model: &mut Model,
    layer: &Layer,
    weight: &[f64],
    slope: &[f64],
    rows: &[f64],
    most: usize,
) -> Result<Option<(f64, f64)>> {
    let mut residual = Vec::new();
    for index in 0..model.bodies.len() {
        let force = model.of_body(index, rows);
        residual.push(model.bodies[index].local.as_ref().map_or(Vec::new(), |body| {
            let mut load = vec![0.0; body.len()];
            body.add_rows(&force, &mut load);
            load
        }));
    }
    let spring = springs(model, slope);
    Ok(solve(model, layer, weight, residual, &spring, (SETTLED, most))?.spectrum)
}

/// Fall of the residual after which extreme eigenvalues have settled.
const SETTLED: f64 = 1e-9;

/// omega slope at the points.
fn springs(model: &Model, slope: &[f64]) -> Vec<f64> {
    model.weight.iter().zip(slope).map(|(w, k)| w * k).collect()
}

fn solve(
    model: &mut Model,
    layer: &Layer,
    weight: &[f64],
    residual: Vec<Vec<f64>>,
    spring: &[f64],
    (reduction, most): (f64, usize),
) -> Result<cg::Solution> {
    let mut sweeper = Sweeper::default();
    let sweep = sweeper.precondition(model, residual.clone(), &residual)?;
    let mut here =
        Here { model, sweeper: &mut sweeper, k: 0, layer, weight, sweep: &sweep, residual: 1.0, target: reduction };
    cg::solve(&mut here, spring, reduction, most)
}
