//! The paper's loop (41)-(42), and faster variants over the same sweep.
//!
//! ```text
//! layers      c = B u - d,   p = p(c)
//! Robin term  G_s = K_s + B_s' omega psi kappa B_s                            (37)-(38)
//! sweep       G_s z_s = r_s = f_s - K_s u_s - B_s' omega p                    (41)  every body by itself
//! update      u <- u + gamma z                                                (42)
//! ```

use super::acceleration::{Acceleration, Iterate, Step};
use super::memory::Last;
use super::run::{End, Run};
use super::stop::Status;
use crate::error::Result;
use crate::model::field::Field;
use crate::model::layer::Layer;
use crate::model::linear::LinearStep;
use crate::robin::coefficient::{Coefficient, underconstrained};
use crate::robin::sweep::Sweeper;

/// Iterate from a displacement until a rule ends the run. `linear` serves estimates of the mesh's error. A run that goes on already has the row
/// of the displacement in its history.
///
/// # Errors
/// Failures of the solver library. Not converging is a status.
pub(super) fn iterate(
    run: &mut Run,
    acceleration: &mut dyn Acceleration,
    coefficient: &mut Coefficient,
    linear: &mut dyn LinearStep,
    mut u: Field,
) -> Result<End> {
    let end = |status, u, layer, weight, run: &Run| {
        let Sweeper { sweeps, solves_skipped: skipped } = run.memory.sweeper;
        Ok(End { status, iterate: u, layer, weight, sweeps, skipped })
    };
    for k in run.rows.len().saturating_sub(1).. {
        let layer = Layer::at(run.model, &u.trace);
        let weight = coefficient.weight(run.model, &layer, k)?;
        if let Some(moved) = underconstrained(run.model, &weight) {
            return end(Status::Underconstrained(moved), u, layer, weight, run);
        }
        run.model.robin(&weight)?;
        let last = run.memory.last.take();
        let sweep = match run.memory.sweep.take() {
            // the sweep at which the run paused
            Some(sweep) => sweep,
            None => {
                let relaxed = last.as_ref().and_then(|last| Some((&last.sweep, last.relaxed?)));
                let asked = run.observer.asked();
                run.memory.sweeper.sweep(run.model, &u, &layer, &weight, relaxed, asked)?
            }
        };
        // the first iterate of a run that goes on was checked before the pause
        if k == run.rows.len() {
            let step = last.as_ref().map_or((None, f64::NAN), |last| (Some(&last.moved[..]), last.length));
            let at = run.after_sweep(&u, &layer, &sweep, step, acceleration.amplification().sqrt());
            let paused = (at.measured.asked != 0).then_some(Status::Paused { asked: at.measured.asked });
            let failed = sweep.failed.clone().map(Status::InnerSolver);
            let ended = run.check_termination(&at, linear)?;
            if let Some(status) = failed.or(ended).or(paused) {
                run.memory.sweep = Some(sweep);
                return end(status, u, layer, weight, run);
            }
        }
        let residual = run.rows[k].residual;
        let mut here = Iterate { model: run.model, k, layer: &layer, weight: &weight, sweep: &sweep, residual };
        let (direction, length, relaxed) = match acceleration.step(&mut here)? {
            Step::Unbounded => {
                return end(Status::Unbounded { moving: Vec::new() }, u, layer, weight, run);
            }
            Step::Sweep(gamma) => (None, gamma, Some(gamma)),
            Step::Along(direction, length) => (Some(direction), length, None),
        };
        let direction = direction.as_ref().unwrap_or(&sweep.correction);
        u.add(length, direction);
        let moved = direction.trace.iter().map(|t| length * t).collect();
        run.memory.last = Some(Last { sweep, relaxed, length, moved });
    }
    unreachable!("the limit of iterations ends the loop")
}
