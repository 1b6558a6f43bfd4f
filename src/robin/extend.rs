//! The start of sweeps: a trace, extended into every body with the interior in equilibrium.
//!
//! The sweep (41) depends on the iterate through its traces only, so a start is a trace. Its extension minimises the energy
//! of the body among the displacements with that trace: the augmented Lagrangian method with springs much stiffer than
//! the body, whose error shrinks by their ratio in every step.

use crate::error::Result;
use crate::linalg::axpy;
use crate::model::body::Solved;
use crate::model::field::Field;
use crate::model::linear::Failure;
use crate::model::{BodySlot, Model};

/// Springs of the constraint B u = t over the stiffness of the nodes under them: half the digits of a number are left to the body.
const STIFF: f64 = 1e4;
/// Steps; each gains a factor of about `STIFF` over the surface's compliance.
const STEPS: usize = 4;

/// Gives every body that lives here the Robin term of its extension and sets its solver up, so that a refusal of the solver or of an
/// option comes before the first sweep, and the start finds its factorisation made.
///
/// # Errors
/// Failures of the solver library.
pub fn prepare(model: &mut Model) -> Result<()> {
    for index in 0..model.bodies.len() {
        let springs = springs(&model.bodies[index]);
        if let Some(body) = &mut model.bodies[index].local {
            body.robin(&springs)?;
            body.set_up()?;
        }
    }
    Ok(())
}

fn springs(slot: &BodySlot) -> Vec<f64> {
    slot.row_stiffness.iter().map(|k| STIFF * k).collect()
}

/// The iterate with the given trace (values where a support prescribes the row are not taken: the support wins).
///
/// # Errors
/// Failures of the solver library.
pub fn extend(model: &mut Model, trace: &[f64]) -> Result<std::result::Result<Field, Failure>> {
    let mut iterate = Field { states: Vec::new(), trace: vec![0.0; trace.len()] };
    let mut failed = vec![0.0; model.bodies.len()];
    let mut reasons = vec![String::new(); model.bodies.len()];
    for index in 0..model.bodies.len() {
        let target = model.of_body(index, trace);
        let slot = &mut model.bodies[index];
        let springs = springs(slot);
        let Some(body) = &mut slot.local else {
            iterate.states.push(Vec::new());
            continue;
        };
        body.robin(&springs)?;
        let mut u = body.rest();
        let [mut r, mut z, mut product] = [(); 3].map(|()| vec![0.0; u.len()]);
        let mut rows = vec![0.0; springs.len()];
        let (mut multiplier, mut force) = (vec![0.0; springs.len()], vec![0.0; springs.len()]);
        let mut first = None;
        for step in 0..STEPS {
            body.trace(&u, &mut rows);
            if body.distribution().is_some() {
                model.exchange.sum(&mut rows);
            }
            let mut violation = 0.0f64;
            for q in 0..rows.len() {
                let apart = if springs[q] > 0.0 { rows[q] - target[q] } else { 0.0 };
                violation = violation.max(apart.abs());
                if step > 0 {
                    multiplier[q] += springs[q] * apart;
                }
                force[q] = multiplier[q] + springs[q] * apart;
            }
            // the interior is in equilibrium from the first solve on
            if first.is_some_and(|first: f64| violation <= 1e-9 * first) {
                break;
            }
            first.get_or_insert(violation.max(f64::MIN_POSITIVE));
            body.apply_stiffness(&u, &mut product);
            body.residual(&u, &product, &force, &mut r);
            let Solved { failure, .. } = body.solve(&r, &mut z)?;
            if let Some(reason) = failure {
                failed[index] = 1.0;
                reasons[index] = reason;
            }
            axpy(1.0, &z, &mut u);
        }
        body.trace(&u, &mut rows);
        model.put(index, &rows, &mut iterate.trace);
        iterate.states.push(u);
    }
    // one message: traces, then which inner solvers failed
    let mut message = [&iterate.trace[..], &failed[..]].concat();
    model.exchange.sum(&mut message);
    let failed = message.split_off(trace.len());
    iterate.trace = message;
    Ok(match failed.iter().position(|&failed| failed != 0.0) {
        Some(body) => Err(Failure { body: Some(body), reason: std::mem::take(&mut reasons[body]) }),
        None => Ok(iterate),
    })
}
