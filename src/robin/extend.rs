//! The start of sweeps: a trace, extended into every body with the interior in equilibrium.
//!
//! The sweep (41) depends on the iterate through its traces only, so a start is a trace. The extension minimises the energy of the body among
//! all displacements with that trace. It is found by the augmented Lagrangian method with springs much stiffer than the body: in every step
//! the error shrinks by the ratio of the two stiffnesses.

use crate::error::Result;
use crate::exchange::Exchange;
use crate::linalg::axpy;
use crate::model::body::Body;
use crate::model::field::Field;
use crate::model::linear::Failure;
use crate::model::{BodySlot, Model};

/// Springs of the constraint B u = t over the stiffness of the nodes under them: half the digits of a number are left to the body.
const STIFF: f64 = 1e4;

/// Steps of the augmented Lagrangian method; each gains a factor of about `STIFF` over the surface's compliance.
const STEPS: usize = 4;

/// Give every body that lives on this rank the Robin term of its extension, and set its solver up. A refusal of the solver or of an option
/// then comes before the first sweep, and the extension needs no other factorisation.
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

/// Return the iterate with the given trace (2n). Values at rows that a support prescribes are ignored. Collective.
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
        let Extension { state, rows, failure } = extend_body(&mut **body, &*model.exchange, &springs, &target)?;
        model.put(index, &rows, &mut iterate.trace);
        iterate.states.push(state);
        if let Some(reason) = failure {
            failed[index] = 1.0;
            reasons[index] = reason;
        }
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

/// The extension of a trace into one body.
struct Extension {
    state: Vec<f64>,
    /// B u of the state.
    rows: Vec<f64>,
    /// Why the inner solver failed last, if it did.
    failure: Option<String>,
}

/// Extend the trace `target` of a body, with springs of this stiffness at its contact rows. Collective for a distributed body.
///
/// # Errors
/// Failures of the solver library.
fn extend_body(body: &mut dyn Body, exchange: &dyn Exchange, springs: &[f64], target: &[f64]) -> Result<Extension> {
    body.robin(springs)?;
    let mut u = body.rest();
    let [mut r, mut z, mut product] = [(); 3].map(|()| vec![0.0; u.len()]);
    let [mut rows, mut multiplier, mut force] = [(); 3].map(|()| vec![0.0; springs.len()]);
    let (mut first, mut failure) = (None, None);
    for step in 0..STEPS {
        body.trace(&u, &mut rows);
        if body.distribution().is_some() {
            exchange.sum(&mut rows);
        }
        let mut violation = 0.0f64;
        for q in 0..rows.len() {
            let difference = if springs[q] > 0.0 { rows[q] - target[q] } else { 0.0 };
            violation = violation.max(difference.abs());
            if step > 0 {
                multiplier[q] += springs[q] * difference;
            }
            force[q] = multiplier[q] + springs[q] * difference;
        }
        // the interior is in equilibrium from the first solve on
        if first.is_some_and(|first: f64| violation <= 1e-9 * first) {
            break;
        }
        first.get_or_insert(violation.max(f64::MIN_POSITIVE));
        body.apply_stiffness(&u, &mut product);
        body.residual(&u, &product, &force, &mut r);
        failure = body.solve(&r, &mut z)?.failure.or(failure);
        axpy(1.0, &z, &mut u);
    }
    body.trace(&u, &mut rows);
    Ok(Extension { state: u, rows, failure })
}
