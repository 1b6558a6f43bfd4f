//! Linear steps of the method: their springs, and the response to small loads.

use crate::error::Result;
use crate::model::linear::{Failure, LinearStep, System, Trial};
use crate::model::rigid::{Motions, TOLERANCE};
use crate::model::surface::surface_slopes;
use crate::model::{Field, Layer, Model};

/// The response w of the bodies and their layers to small loads: (K + B' diag(omega kappa) B) w = r, with its squared energy norm,
/// whose error may be this `share` of it. `loads` is r, one entry a dof of each body that lives here.
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

/// Share of the springs of whole surfaces that resists motions which no closed contact resists: they then go far, but not without end.
const PROXIMAL: f64 = 1e-3;

/// The springs omega kappa of a linear step, n, with one more for every rigid motion of the bodies together that would else meet no
/// resistance: a contact that is open now may be what stops it.
///
/// It is at the point that the motion closes most, and nowhere else. If forces are in balance on the motion, as where bodies rest
/// and could turn about the points that are closed, a single spring carries nothing, and the step is exact; several would.
pub fn resisting(model: &Model, mut springs: Vec<f64>) -> Vec<f64> {
    let motions = Motions::of(model);
    // beside new springs, softer ones may be nothing but rounding
    for _ in 0..motions.count() {
        let mut free = motions.springs(&springs).factor(TOLERANCE).kernel();
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
            // what the others close at that point is this one's
            for other in &mut free {
                let share = motions.closing(other)[most] / closing[most];
                other.axpy(-share, &motion, 1.0);
            }
        }
    }
    springs
}
