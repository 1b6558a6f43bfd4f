//! The start: a trace, lifted into every body with the interior in equilibrium.
//!
//! The sweep (41) depends on the iterate through its traces only, so a start is a trace. Its lift minimises the energy
//! of the body among the displacements with that trace: the augmented Lagrangian method with springs much stiffer than
//! the body, whose error shrinks by their ratio in every step.

use super::body::Solved;
use super::field::Field;
use super::held;
use super::layer::Layer;
use super::method::ROUGH;
use super::model::{BodySlot, Model};
use crate::error::Result;
use crate::linalg::{axpy, fit};

/// Springs of the constraint B u = t over the stiffness of the nodes under them.
const STIFF: f64 = 1e4;
/// The same for a rough lift: multigrid bears these springs well.
const SOFT: f64 = 10.0;
/// Share of the start's trace that a rough lift may miss.
const MISSED: f64 = 1e-3;
/// Times the energy of the layers at the trace, beyond which a rough lift is too deep: a law of p ~ c^10 turns a small miss into
/// any pressure.
const DEEPER: f64 = 100.0;
/// Energy of layers that rounding closes, over what the start's trace would cost the nodes under it.
const ROUNDING: f64 = 1e-12;
/// Steps; each gains a factor of about `STIFF` over the surface's compliance.
const STEPS: usize = 4;

/// Gives every body that lives here a Robin term and sets its solver up, so that a refusal of the solver or of an option comes
/// before the first sweep. The start then finds its factorisation made: that of the lift's springs, or for a start that
/// only moves bodies ([`move_rigidly`]) that of soft ones, near which the first sweep is.
///
/// # Errors
/// Failures of the solver library.
pub fn prepare(model: &mut Model, lifts: bool) -> Result<()> {
    for index in 0..model.bodies.len() {
        let springs = if lifts { springs(&model.bodies[index]) } else { held::natural_springs(model, index) };
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

/// The iterate with about the given trace, for a method that needs no equilibrium inside: bodies are moved rigidly, and only
/// one that is then far from its trace is deformed, roughly. Where what is missed drives the surfaces far deeper into each other
/// than the trace would, it is lifted after all. The second value is as in [`lift`].
///
/// # Errors
/// Failures of the solver library.
pub fn move_rigidly(model: &mut Model, trace: &[f64]) -> Result<(Field, Option<(usize, String)>)> {
    model.precision(ROUGH)?;
    let mut iterate = Field::rest(model);
    let (mut failed, mut cost) = (None, 0.0);
    for index in 0..model.bodies.len() {
        let target = model.of_body(index, trace);
        let slot = &mut model.bodies[index];
        cost += slot.row_stiffness.iter().zip(&target).map(|(k, t)| k * t * t).sum::<f64>();
        let Some(body) = &mut slot.local else { continue };
        let u = &mut iterate.states[index];
        let mut rows = vec![0.0; target.len()];
        body.trace(u, &mut rows);
        let mut apart: Vec<f64> = target.iter().zip(&rows).map(|(target, row)| target - row).collect();
        if let Some(traces) = body.matrices().map(|matrices| matrices.traces) {
            let rigid = fit(traces, &apart);
            let first = u.len() - rigid.len();
            u[first..].copy_from_slice(&rigid);
            rigid.iter().zip(traces).for_each(|(&a, trace)| axpy(-a, trace, &mut apart));
        }
        let size = |v: &[f64]| v.iter().fold(0.0f64, |max, t| max.max(t.abs()));
        if size(&apart) <= MISSED * size(&target) {
            continue;
        }
        let springs: Vec<f64> = slot.row_stiffness.iter().map(|k| SOFT * k).collect();
        body.robin(&springs)?;
        let force: Vec<f64> = springs.iter().zip(&apart).map(|(k, apart)| -k * apart).collect();
        let (mut r, mut z) = (vec![0.0; u.len()], vec![0.0; u.len()]);
        body.residual(u, &force, &mut r);
        let Solved { failure, .. } = body.solve(&r, &mut z)?;
        failed = failed.or(failure.map(|reason| (index, reason)));
        axpy(1.0, &z, u);
    }
    iterate.retrace(model);
    let energy = |trace: &[f64]| Layer::at(model, trace).energy.iter().sum::<f64>();
    // not a number counts as deep, rounding does not
    let shallow = energy(&iterate.trace) <= DEEPER * energy(trace) + ROUNDING * cost;
    if shallow { Ok((iterate, failed)) } else { lift(model, trace) }
}

/// The iterate with the given trace (values where a support prescribes the row are not taken: the support wins).
/// The second value is a body whose inner solver failed, with its reason.
///
/// # Errors
/// Failures of the solver library.
pub fn lift(model: &mut Model, trace: &[f64]) -> Result<(Field, Option<(usize, String)>)> {
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
        let (mut r, mut z) = (vec![0.0; u.len()], vec![0.0; u.len()]);
        let mut rows = vec![0.0; springs.len()];
        let (mut multiplier, mut force) = (vec![0.0; springs.len()], vec![0.0; springs.len()]);
        let mut first = None;
        for step in 0..STEPS {
            body.trace(&u, &mut rows);
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
            body.residual(&u, &force, &mut r);
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
    let first = failed.iter().position(|&failed| failed != 0.0);
    Ok((iterate, first.map(|body| (body, std::mem::take(&mut reasons[body])))))
}
