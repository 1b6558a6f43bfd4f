//! Semismooth Newton (35) with a state of its own in every layer.
//!
//! Each contact point keeps a place (c_q, p_q) on its law, with the tangent kappa_q there:
//!
//! ```text
//! linear step    K u + B' omega (p_q + kappa_q (B u - d - c_q)) = f           all bodies together
//! update         c = B u - d,   p = p_q + kappa_q (c - c_q)                   in equilibrium
//!                the place where the law meets c_q + p_q/rho = c + p/rho      (Minty)
//! ```
//!
//! A fixed point has c = c_q and p = p_q: the equations (26). The gap between (c, p) and the law bounds the error of u.

use super::bound::Reached;
use super::digits::of_compressions;
use super::fit;
use super::forcing::Forcing;
use super::history::Row;
use super::linear::resisting;
use super::run::{End, Run};
use super::stop::{Floor, Status};
use crate::error::Result;
use crate::model::Model;
use crate::model::field::{Field, residual};
use crate::model::layer::Layer;
use crate::model::line::Line;
use crate::model::linear::{LinearStep, System, Trial};
use crate::model::surface::meeting_slopes;

/// Iterates from displacements and places until a rule ends it.
///
/// # Errors
/// Failures of the solver library. Not converging is a status.
pub(super) fn iterate(run: &mut Run, linear: &mut dyn LinearStep, mut u: Field, mut places: Layer) -> Result<End> {
    let (slopes, tolerance) = (meeting_slopes(run.model), run.stop.tolerance());
    let mut rho = run.memory.progress.slopes(run.model, &slopes);
    // where rounding ends the run, what it has spoilt meanwhile is taken back; of iterates whose errors tell what rounding left of equilibrium
    let mut best: Option<(Row, Field, Layer)> = None;
    // watches what corrections gain, if rounding left too much of the last step
    let mut left: Option<Floor> = None;
    // a correction takes half of what is left at least; of rounding the size is wanted
    let halves = |trial: &Trial| trial.is_within(0.5);
    loop {
        let springs = resisting(run.model, places.springs(run.model));
        let force = run.model.forces(&places.linear(&run.model.compression(&u.trace)));
        let (r, _) = residual(run.model, &u, &force);
        let (before, digits) = (run.model.compression(&u.trace), of_compressions(run.model, &u.trace));
        let mut forcing = Forcing::new(&places, before.clone(), &rho, (tolerance, &run.scale), linear.roughest());
        let mut enough = |model: &Model, trial: &Trial| match left {
            None => forcing.is_enough(model, trial),
            Some(_) => halves(trial),
        };
        let system = System { model: run.model, places: &places, springs: &springs, residual: &r, enough: &mut enough };
        let mut x = match linear.solve(system)? {
            Ok(solution) => solution,
            Err(failure) => return Ok(run.end(Status::InnerSolver(failure), u, places, linear)),
        };
        let end: Vec<f64> = before.iter().zip(x.field.closing()).map(|(c, closing)| c + closing).collect();
        let pressure = places.linear(&end);
        let share = match left {
            None => run.memory.progress.share(run.model, &slopes, [&before, &digits], [&end, &pressure]),
            Some(_) => 1.0,
        };
        rho = run.memory.progress.slopes(run.model, &slopes);
        x.field.scale(share);
        u.add(1.0, &x.field);
        u.retrace(run.model);

        // those of the step, not of the compressions that its end has: rounding of displacements, which a stiff layer makes large, stays out
        let p = run.memory.progress.go(share, pressure);
        if places.closed > 0 {
            fit::fit(run.model, [&mut u, &mut x.field], &p, &rho, tolerance);
        }
        let c = run.model.compression(&u.trace);
        let mut met = Layer::meet(run.model, &c, &p, &rho);

        let (rest, energy) = residual(run.model, &u, &run.model.forces(&p));
        let mut measured = run.measure(energy, &Layer::new(run.model, c.clone()), linear);
        let digits = of_compressions(run.model, &u.trace);
        let mut reached = Reached::new((run.model, &run.scale), measured.strain, &x, (&c, &digits, &p), &met, &rho);
        let (mut is_floor, corrected) = (false, left.take());
        let is_enough = run.is_enough(&reached);
        let is_complete = is_enough || run.is_at_floor(&reached, &u, &met, measured.strain);
        if is_complete {
            // a step has the rounding of its size, or what an iterative solver thought small: its matrix tells how large that is
            let mut enough = |_: &Model, trial: &Trial| halves(trial);
            let (residual, enough) = (&rest[..], &mut enough);
            let system = System { model: run.model, places: &places, springs: &springs, residual, enough };
            let before = linear.counts();
            let more = linear.solve(system)?;
            measured.inner_iterations += linear.counts().inner_iterations - before.inner_iterations;
            measured.factorizations += linear.counts().factorizations - before.factorizations;
            if let Ok(more) = more {
                let lost = reached.add_rounding((&run.scale, measured.strain), &more, &places, &met);
                if is_enough && !run.is_enough(&reached) {
                    // a correction gains a digit, unless rounding gives as much again
                    let mut floor = corrected.unwrap_or_else(Floor::of_steps);
                    is_floor = floor.is_reached(lost);
                    left = Some(floor);
                }
            }
        }
        let at = run.after_step((&u, &x.field, share), measured, &reached, &met, linear);
        let ended = run.end_at(&at, linear)?;
        let row = run.rows.last().filter(|_| is_complete);
        if let Some(row) = row.filter(|row| best.as_ref().is_none_or(|(best, ..)| row.residual <= best.residual)) {
            best = Some((row.clone(), u.clone(), met.clone()));
        }
        if let Some(status) = ended.or(is_floor.then_some(Status::RoundoffLimited)) {
            if let (Status::RoundoffLimited, Some(best)) = (&status, best) {
                (u, met) = run.go_back(best);
            }
            return Ok(run.end(status, u, met, linear));
        }
        // a step that knew of no contact runs through the other body
        let blind = places.closed == 0 && met.closed > 0;
        if blind {
            search(run.model, &mut u, &x.field)?;
            run.memory.progress.forget();
        }
        if left.is_none() {
            places = if blind { Layer::at(run.model, &u.trace) } else { met.clone() };
        }
        if measured.asked != 0 {
            run.memory.places = Some(places);
            return Ok(run.end(Status::Paused { asked: measured.asked }, u, met, linear));
        }
    }
}

/// Replaces a step x that led to u by the exact search on F1 along it.
fn search(model: &mut Model, u: &mut Field, x: &Field) -> Result<()> {
    u.add(-1.0, x);
    u.retrace(model);
    let layer = Layer::at(model, &u.trace);
    let (r, _) = residual(model, u, &layer.force);
    let line = Line::new(model, &layer, &r, x);
    u.add(line.minimize(1e-2).unwrap_or(0.0), x);
    u.retrace(model);
    Ok(())
}
