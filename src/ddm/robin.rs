//! The paper's loop (41)-(42), and faster ones over the same sweep.
//!
//! ```text
//! layers      c = B u - d,   p = p(c)
//! Robin term  G_s = K_s + B_s' omega psi kappa B_s                            (37)-(38)
//! sweep       G_s z_s = r_s = f_s - K_s u_s - B_s' omega p                    (41)  every body by itself
//! update      u <- u + gamma z                                                (42)
//! ```

use super::acceleration::{Acceleration, Here, Step};
use super::coefficient::{Coefficient, underconstrained};
use super::run::{End, Run, Swept};
use super::stop::Status;
use super::sweep::{Sweep, Sweeper};
use crate::error::Result;
use crate::model::field::Field;
use crate::model::layer::Layer;
use crate::model::linear::LinearStep;

/// The step that led to an iterate.
pub(super) struct Last {
    /// The sweep before it.
    pub sweep: Sweep,
    /// gamma, if it went along the sweep's correction.
    pub relaxed: Option<f64>,
    /// How far it went along its direction.
    pub length: f64,
    /// Change of the traces.
    pub moved: Vec<f64>,
}

/// Iterates from a displacement until a rule ends it; `linear` serves estimates of the mesh's error.
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
    let mut sweeper = Sweeper::default();
    let mut last: Option<Last> = None;
    let end = |status, u, layer, weight, sweeper: &Sweeper| {
        let (sweeps, skipped) = (sweeper.sweeps, sweeper.solves_skipped);
        Ok(End { status, iterate: u, layer, weight, sweeps, skipped })
    };
    for k in 0.. {
        let layer = Layer::at(run.model, &u.trace);
        let weight = coefficient.weight(run.model, &layer, k)?;
        if let Some(moved) = underconstrained(run.model, &weight) {
            return end(Status::Underconstrained(moved), u, layer, weight, &sweeper);
        }
        run.model.robin(&weight)?;
        let relaxed = last.as_ref().and_then(|last| Some((&last.sweep, last.relaxed?)));
        let sweep = sweeper.sweep(run.model, &u, &layer, &weight, relaxed)?;

        let reached = last.as_ref().map(|last| (&last.moved[..], last.length));
        let (amplification, sweeps) = (acceleration.amplification().sqrt(), sweeper.sweeps);
        let swept = Swept { k, u: &u, layer: &layer, sweep: &sweep, last: reached, amplification, sweeps };
        if let Some(status) = run.end_of_sweep(&swept, linear)? {
            return end(status, u, layer, weight, &sweeper);
        }
        let residual = run.rows[run.rows.len() - 1].residual;
        let mut here = Here { model: run.model, k, layer: &layer, weight: &weight, sweep: &sweep, residual };
        let (direction, length, relaxed) = match acceleration.step(&mut here)? {
            Step::Unbounded => {
                return end(Status::Unbounded { moving: Vec::new() }, u, layer, weight, &sweeper);
            }
            Step::Sweep(gamma) => (None, gamma, Some(gamma)),
            Step::Along(direction, length) => (Some(direction), length, None),
        };
        let direction = direction.as_ref().unwrap_or(&sweep.correction);
        u.add(length, direction);
        let moved = direction.trace.iter().map(|t| length * t).collect();
        last = Some(Last { sweep, relaxed, length, moved });
    }
    unreachable!("the limit of iterations ends the loop")
}
