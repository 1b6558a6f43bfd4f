//! Linear steps of the method: their springs, and the response to small loads.

use super::start::surface_slopes;
use crate::error::Result;
use crate::model::linear::{Failure, LinearStep, System};
use crate::model::rigid::{Motions, TOLERANCE};
use crate::model::{Field, Layer, Model};

/// The response w of the bodies and their layers to small loads: (K + B' diag(omega kappa) B) w = r, with its squared energy norm.
/// `loads` is r, one entry a dof of each body that lives here.
///
/// # Errors
/// Failures of the solver library.
pub fn respond(
    model: &mut Model,
    step: &mut dyn LinearStep,
    places: &Layer,
    loads: &[Vec<f64>],
    reduction: f64,
) -> Result<std::result::Result<(Field, f64), Failure>> {
    let mut residual = Vec::new();
    for (slot, load) in model.bodies.iter_mut().zip(loads) {
        residual.push(match &mut slot.local {
            Some(body) => body.reduce(load)?,
            None => Vec::new(),
        });
    }
    let springs = resisting(model, places.springs(model));
    let system = System { model, places, springs: &springs, residual: &residual, reduction };
    Ok(step.solve(system)?.map(|solution| (solution.field, solution.energy)))
}

/// Share of the springs of whole surfaces that resists motions which no closed contact resists: they then go far, but not without end.
const PROXIMAL: f64 = 1e-3;

/// The springs omega kappa of a linear step, n, with a little everywhere if some rigid motion of the bodies together would else meet no
/// resistance: a contact that is open now may be what stops it.
pub fn resisting(model: &Model, mut springs: Vec<f64>) -> Vec<f64> {
    let motions = Motions::of(model);
    if motions.count() > 0 && motions.springs(&springs).factor(TOLERANCE).rank() < motions.count() {
        let slopes = surface_slopes(model);
        springs.iter_mut().enumerate().for_each(|(q, spring)| *spring += PROXIMAL * model.weight[q] * slopes[q]);
    }
    springs
}
