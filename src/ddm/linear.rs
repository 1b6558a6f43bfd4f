//! Linear steps: their springs, and the response of bodies and layers to small loads.

use crate::error::Result;
use crate::model::linear::{Failure, LinearStep, System, Trial};
use crate::model::rigid::Motions;
use crate::model::surface::surface_slopes;
use crate::model::{Field, Layer, Model};

/// Return the response w of the bodies and their layers to small loads r, (K + B' diag(omega kappa) B) w = r, and its squared energy norm. The
/// layers are in the states `places`. `loads` is r, one entry per dof of each body that lives on this rank. The relative error of w may be `share`.
///
/// # Errors
/// Failures of the solver library.
pub fn respond(
    model: &mut Model,
    step: &mut dyn LinearStep,
    places: &Layer,
    loads: &[Vec<f64>],
    share: f64,
) -> Result<std::result::Result<(Field, f64), Failure>> {
    let mut residual = Vec::new();
    for (slot, load) in model.bodies.iter_mut().zip(loads) {
        residual.push(match &mut slot.local {
            Some(body) => body.reduce(load)?,
            None => Vec::new(),
        });
    }
    let springs = resisting(model, places.springs(model));
    let mut enough = |_: &Model, trial: &Trial| trial.is_within(share);
    let system = System { model, places, springs: &springs, residual: &residual, enough: &mut enough };
    Ok(step.solve(system)?.map(|solution| (solution.field, solution.energy)))
}

/// Stiffness, as a share of the springs of whole surfaces, that resists motions which no closed contact resists: such motions then go far, but not
/// without end.
const PROXIMAL: f64 = 1e-3;

/// Return the springs omega kappa of a linear step, n, with one more for every rigid motion of the bodies together that is otherwise unresisted: a
/// contact that is still open may stop it.
///
/// The additional spring is at the point that the motion closes most, and nowhere else. Forces may be in balance on the motion, for example where
/// bodies rest and could turn about the closed points. Then a single spring carries nothing, and the step is exact; several springs would carry
/// forces.
pub fn resisting(model: &Model, mut springs: Vec<f64>) -> Vec<f64> {
    let motions = Motions::of(model);
    // compared with a new spring, softer ones may be rounding, so that another motion is unresisted
    for _ in 0..motions.count() {
        let mut free = motions.springs(&springs).factor().kernel();
        if free.is_empty() {
            break;
        }
        let surfaces: Vec<f64> =
            surface_slopes(model).iter().zip(&model.weight).map(|(slope, weight)| slope * weight).collect();
        while let Some(motion) = free.pop() {
            let closing = motions.closing(&motion);
            let Some(most) = (0..closing.len()).max_by(|&p, &q| closing[p].abs().total_cmp(&closing[q].abs())) else {
                break;
            };
            let shares = closing.iter().map(|s| (s / closing[most]).powi(2));
            springs[most] += PROXIMAL * shares.zip(&surfaces).map(|(share, surface)| share * surface).sum::<f64>();
            // take this motion out of the others, so that they close nothing at that point
            for other in &mut free {
                let share = motions.closing(other)[most] / closing[most];
                other.axpy(-share, &motion, 1.0);
            }
        }
    }
    springs
}
