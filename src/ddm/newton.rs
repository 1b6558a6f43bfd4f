//! Semismooth Newton (35) with a state of its own in every layer.
//!
//! Each contact point keeps a state (c_q, p_q) on its law, with the tangent kappa_q there:
//!
//! ```text
//! linear step    K u + B' omega (p_q + kappa_q (B u - d - c_q)) = f           all bodies together
//! step length    c = B u - d,   p = p_q + kappa_q (c - c_q)                   in equilibrium, also on the way
//! layer states   the point of the law with c_q + p_q/rho = c + p/rho          (resolvent, Minty)
//! ```
//!
//! A fixed point has c = c_q and p = p_q: the equations (26). The gap between (c, p) and the law bounds the error of u. Where steps have to be
//! shortened, the laws are smoothed for a while ([`Path`](super::progress::Path)).

use super::bound::{Reached, Scale, compression_roundoff, contact_energy, surface_energy};
use super::progress::{Equilibrium, SHORTEST};
use super::run::{FallbackIterate, LoopEnd, Measured, Run};
use super::start;
use super::stop::{Cycle, Stagnation, Status};
use crate::error::Result;
use crate::model::Model;
use crate::model::field::{Field, LineEnergy, residual};
use crate::model::layer::{Layer, meeting_slopes, surface_slopes};
use crate::model::linear::{Failure, LinearResult, LinearSolution, LinearStep, System, Trial};
use crate::model::rigid::Motions;
use std::collections::VecDeque;

/// Relative error of a correction.
const HALF: f64 = 0.5;

/// Relative error above which the first linear step from the states of another solution does not end. Displacements are zero before it, and the
/// first iterations of a solver leave them so far from the laws that [`Forcing`] would take them for settled, with all points closed. The last adapted
/// meshes of a bearing cap and of a fishplate take 2 steps, instead of 10 and 6. With 0.03 and 0.01 the cap takes 3 and 2 steps, and more
/// iterations. Spheres, flanges, a T-slot nut and a clamp take as many steps as without this limit.
const NEAR: f64 = 0.1;

/// Share of the tolerance below which an error in the energy norm changes nothing in the digits that are asked for.
const UNSEEN: f64 = 0.01;

/// Distance from 1 of the length of a descent at which the descent ends. Lengths tend to 1 where Newton's method for F1 converges fast. With 0.2 none of
/// 900 random scenes and none of 320 scenes with saturating layers was lost.
const WHOLE: f64 = 0.2;

/// Accuracy of the search for the least F1 along a descent, relative to its slope there. F1 falls with any accuracy below one; the search of the
/// automatic start has the same.
const SEARCH: f64 = 1e-3;

/// Iterate from displacements and layer states until a rule ends the run. `is_near` is whether the states are those of another solution, while the
/// displacements are still at rest.
pub(super) fn iterate(
    run: &mut Run,
    linear: &mut dyn LinearStep,
    u: Field,
    states: Layer,
    is_near: bool,
) -> Result<LoopEnd> {
    let (unit, tolerance) = (meeting_slopes(run.model), run.stop.tolerance());
    let start = Some(u.clone());
    let mut newton = Newton { run, linear, unit, tolerance, u, start, states, is_near, correction: None, best: None };
    loop {
        let step = match newton.linear_step()? {
            Ok(step) => step,
            Err(failure) => return Ok(newton.end(Status::InnerSolver(failure), None)),
        };
        let part = newton.step_length(&step);
        if part.is_lost && newton.descend()? {
            continue;
        }
        let iterate = newton.advance(step, part);
        let measures = newton.measure(&iterate)?;
        if let Some(status) = newton.check_termination(&iterate, &measures)? {
            if newton.leave_cycle(&status)? {
                continue;
            }
            return Ok(newton.end(status, Some(iterate.resolved)));
        }
        newton.update_states(&iterate);
        if let Some(status) = newton.check_pause(&measures) {
            return Ok(newton.end(status, Some(iterate.resolved)));
        }
    }
}

/// A run of Newton's method under way.
struct Newton<'n, 'r> {
    run: &'n mut Run<'r>,
    linear: &'n mut dyn LinearStep,
    /// Slopes rho as long as no step has shown how the bodies answer, n.
    unit: Vec<f64>,
    tolerance: f64,
    u: Field,
    /// Displacements at the start, until F1 has fallen from there.
    start: Option<Field>,
    /// States of the layers from which the next linear step is taken.
    states: Layer,
    /// Whether these states are those of another solution, while the displacements are still at rest.
    is_near: bool,
    /// Present while roundoff leaves too large an error of the linear step, so that the next step is a correction: it takes the same states once
    /// more. It watches what corrections gain.
    correction: Option<Stagnation>,
    /// The best iterate whose errors include those of its equilibrium. If roundoff ends the run, this one is the result.
    best: Option<FallbackIterate>,
}

/// The part of a linear step that is taken.
struct PartialStep {
    /// 1 for a whole step.
    length: f64,
    /// Pressures at the end of the whole step, n.
    whole_pressure: Vec<f64>,
    /// Whether no part of the step comes nearer to the laws, so that the least one is taken.
    is_lost: bool,
}

/// The result of a step: displacements and pressures in equilibrium, and the states on the laws that belong to them.
struct StepResult {
    /// The part of the linear step that was taken.
    step: LinearSolution,
    length: f64,
    /// c, n.
    compression: Vec<f64>,
    /// Error of c by roundoff, n.
    roundoff: Vec<f64>,
    /// p, n.
    pressure: Vec<f64>,
    /// Slopes of the lines on which the laws are resolved, n.
    rho: Vec<f64>,
    /// States on the laws themselves.
    resolved: Layer,
}

impl StepResult {
    fn equilibrium(&self) -> Equilibrium<'_> {
        let Self { compression, roundoff, pressure, rho, .. } = self;
        Equilibrium { compression, roundoff, pressure, rho }
    }
}

/// The errors of an iterate.
struct Measures {
    measured: Measured,
    reached: Reached,
    /// Whether the errors include what roundoff or an iterative solver left of equilibrium.
    is_complete: bool,
    /// Whether corrections gain nothing any more.
    is_roundoff: bool,
}

impl Newton<'_, '_> {
    /// Solve the linear step from the states. A correction is solved to half of its size only.
    fn linear_step(&mut self) -> Result<LinearResult> {
        let (model, states) = (&mut *self.run.model, &self.states);
        let springs = resisting(model, states.springs(model));
        let compression = model.compression(&self.u.trace);
        let (residual, _) = residual(model, &self.u, &model.forces(&states.linear(&compression)));
        let rho = self.run.memory.progress.slopes(model, &self.unit, states);
        let scale = (self.tolerance, &self.run.scale);
        let limit = if std::mem::take(&mut self.is_near) { NEAR } else { 1.0 };
        let roughest = limit.min(self.linear.roughest());
        let mut forcing = Forcing::new(states, compression, &rho, scale, roughest);
        let is_correction = self.correction.is_some();
        let mut enough = |model: &Model, trial: &Trial| match is_correction {
            true => trial.is_within(HALF),
            false => forcing.is_enough(model, trial),
        };
        self.linear.solve(System { model, places: states, springs: &springs, residual: &residual, enough: &mut enough })
    }

    /// Return the part of a step that does not lead away from the laws; all of a correction.
    fn step_length(&mut self, step: &LinearSolution) -> PartialStep {
        let (model, progress) = (&*self.run.model, &mut self.run.memory.progress);
        let before = model.compression(&self.u.trace);
        let whole: Vec<f64> = before.iter().zip(step.field.closing()).map(|(c, closing)| c + closing).collect();
        let whole_pressure = self.states.linear(&whole);
        if self.correction.is_some() {
            return PartialStep { length: 1.0, whole_pressure, is_lost: false };
        }
        let roundoff = compression_roundoff(model, &self.u.trace);
        let ends = [[&before[..], &roundoff], [&whole, &whole_pressure]];
        let length = progress.step_length(model, &self.unit, &self.states, ends);
        PartialStep { length: length.unwrap_or(SHORTEST), whole_pressure, is_lost: length.is_none() }
    }

    /// Let F1 fall from the iterate by Newton's method for F1 itself, until whole steps are taken: to least F1 along each step. Return whether it
    /// fell; then the next step begins from the states at the new compressions.
    ///
    /// The distance from the laws falls along no step whose tangents nearly vanish, as where a law saturates or hardly anything holds a body. F1 is convex,
    /// and a step of Newton's method always descends. The least F1 may be at a tiny part of the step, which halving would not find.
    fn descend(&mut self) -> Result<bool> {
        let start = self.u.clone();
        for _ in 0..self.run.stop.iterations {
            let Some(length) = self.descent_step()? else {
                self.u = start;
                return Ok(false);
            };
            if length == 0.0 || (length - 1.0).abs() <= WHOLE {
                break;
            }
        }
        self.states = Layer::at(self.run.model, &self.u.trace);
        self.run.memory.progress.forget_pressure();
        Ok(true)
    }

    /// Leave a cycle once: go back to the start, and let F1 fall from there. Far from the solution roundoff may hide in which direction it falls.
    /// Return whether the run goes on.
    fn leave_cycle(&mut self, status: &Status) -> Result<bool> {
        let is_cycle = matches!(status, Status::Cycle { .. });
        let Some(start) = self.start.take_if(|_| is_cycle) else { return Ok(false) };
        self.u = start;
        (self.correction, self.best) = (None, None);
        self.run.memory.cycle = Cycle::default();
        self.descend()
    }

    /// Take one step of Newton's method for F1 from the states at the compressions of the iterate. Return its length; none if its linear system
    /// is not solved, or F1 falls without end.
    fn descent_step(&mut self) -> Result<Option<f64>> {
        let model = &mut *self.run.model;
        let layer = Layer::at(model, &self.u.trace);
        let springs = resisting(model, layer.springs(model));
        let (residual, _) = residual(model, &self.u, &layer.force);
        let roughest = self.linear.roughest();
        let mut enough = |_: &Model, trial: &Trial| trial.is_within(roughest);
        let system =
            System { model: &mut *model, places: &layer, springs: &springs, residual: &residual, enough: &mut enough };
        let Ok(step) = self.linear.solve(system)? else { return Ok(None) };
        let Ok(length) = LineEnergy::new(model, &layer, &residual, &step.field).minimize(SEARCH) else {
            return Ok(None);
        };
        self.u.add(length, &step.field);
        self.u.retrace(model);
        Ok(Some(length))
    }

    /// Take this part of a step, and resolve the laws at its end.
    fn advance(&mut self, mut step: LinearSolution, part: PartialStep) -> StepResult {
        let PartialStep { length, whole_pressure, .. } = part;
        let (model, progress) = (&*self.run.model, &mut self.run.memory.progress);
        step.field.scale(length);
        self.u.add(1.0, &step.field);
        self.u.retrace(model);
        // pressures of the linear step, not of the compressions at its end: a stiff layer would magnify the roundoff of displacements
        let pressure = progress.go(length, whole_pressure);
        let rho = progress.slopes(model, &self.unit, &self.states);
        if self.states.closed > 0 && self.states.smoothing.is_empty() {
            rigid_correction(model, [&mut self.u, &mut step.field], &pressure, &rho, self.tolerance);
        }
        let compression = model.compression(&self.u.trace);
        let roundoff = compression_roundoff(model, &self.u.trace);
        let resolved = Layer::resolve(model, &compression, &pressure, &rho, &[]);
        StepResult { step, length, compression, roundoff, pressure, rho, resolved }
    }

    /// Measure the errors of an iterate. If it seems good enough or at the roundoff level, measure its equilibrium, too; if that is what makes it
    /// too inexact, the next step is a correction.
    fn measure(&mut self, iterate: &StepResult) -> Result<Measures> {
        let StepResult { step, resolved, .. } = iterate;
        let run = &mut *self.run;
        let (rest, energy) = residual(run.model, &self.u, &run.model.forces(&iterate.pressure));
        let measured = run.measure(energy, &Layer::new(run.model, iterate.compression.clone()), self.linear);
        let strain = measured.strain;
        let mut reached = Reached::new(run.model, &run.scale, strain, step, &iterate.equilibrium(), resolved);
        if step.is_exact {
            reached.verify(measured.unbalanced);
        }
        let is_enough = run.is_enough(&reached);
        let is_complete = is_enough || run.is_at_roundoff(&reached, &self.u, resolved, strain);
        let mut measures = Measures { measured, reached, is_complete, is_roundoff: false };
        let corrected = self.correction.take();
        if is_complete
            && let Some(missed) = self.measure_equilibrium(&rest, resolved, &mut measures)?
            && is_enough
            && !self.run.is_enough(&measures.reached)
        {
            // a correction gains a digit, unless roundoff adds as much again
            let mut stagnation = corrected.unwrap_or_else(Stagnation::of_steps);
            measures.is_roundoff = stagnation.is_reached(missed);
            self.correction = Some(stagnation);
        }
        Ok(measures)
    }

    /// Add to the errors what roundoff, or an iterative solver, left of equilibrium. A further step with the same matrix for the residual `rest`
    /// shows how large that is. Return the larger error that was added, none if the step fails.
    fn measure_equilibrium(
        &mut self,
        rest: &[Vec<f64>],
        resolved: &Layer,
        measures: &mut Measures,
    ) -> Result<Option<f64>> {
        let (run, places) = (&mut *self.run, &self.states);
        let springs = resisting(run.model, places.springs(run.model));
        let mut enough = |_: &Model, trial: &Trial| trial.is_within(HALF);
        let before = self.linear.counts();
        let system = System { model: run.model, places, springs: &springs, residual: rest, enough: &mut enough };
        let more = self.linear.solve(system)?;
        let (counts, measured) = (self.linear.counts(), &mut measures.measured);
        measured.inner_iterations += counts.inner_iterations - before.inner_iterations;
        measured.factorizations += counts.factorizations - before.factorizations;
        let add = |more| measures.reached.add_rounding((&run.scale, measured.strain), &more, places, resolved);
        Ok(more.ok().map(add))
    }

    /// Show the row of an iterate and keep it. Return the status if the run ends with this iterate.
    fn check_termination(&mut self, iterate: &StepResult, measures: &Measures) -> Result<Option<Status>> {
        let (run, resolved) = (&mut *self.run, &iterate.resolved);
        let step = (&self.u, &iterate.step.field, iterate.length);
        let at = run.after_step(step, measures.measured, &measures.reached, resolved, self.linear);
        let status = run.check_termination(&at, self.linear)?;
        if let Some(row) = run.rows.last().filter(|_| measures.is_complete)
            && self.best.as_ref().is_none_or(|best| row.residual <= best.row.residual)
        {
            self.best = Some(FallbackIterate { row: row.clone(), u: self.u.clone(), layer: resolved.clone() });
        }
        // errors of states on smoothed laws fall with mu, and show no roundoff
        let is_smoothed = !self.states.smoothing.is_empty();
        let status = status.filter(|status| !(is_smoothed && *status == Status::RoundoffLimited));
        Ok(status.or(measures.is_roundoff.then_some(Status::RoundoffLimited)))
    }

    /// Set the states of the next step, unless that is a correction of this one.
    fn update_states(&mut self, iterate: &StepResult) {
        if self.correction.is_some() {
            return;
        }
        let run = &mut *self.run;
        let unseen = (UNSEEN * self.tolerance).powi(2) * run.scale.energy(run.energy);
        let path = &mut run.memory.progress.path;
        let smoothing = path.smoothing(run.model, &iterate.equilibrium(), &self.states.smoothing, unseen);
        self.states = match smoothing.is_empty() {
            true => iterate.resolved.clone(),
            false => Layer::resolve(run.model, &iterate.compression, &iterate.pressure, &iterate.rho, &smoothing),
        };
    }

    /// Return the status of a run that is requested to pause, and keep the states from which it can go on.
    fn check_pause(&mut self, measures: &Measures) -> Option<Status> {
        let asked = measures.measured.asked;
        (asked != 0).then(|| {
            self.run.memory.states = Some(self.states.clone());
            Status::Paused { asked }
        })
    }

    /// End the run at the last iterate, or at the best one if roundoff ends it.
    fn end(&mut self, status: Status, resolved: Option<Layer>) -> LoopEnd {
        let (mut u, mut states) = (std::mem::take(&mut self.u), resolved.unwrap_or_else(|| self.states.clone()));
        if let (Status::RoundoffLimited, Some(best)) = (&status, self.best.take()) {
            (u, states) = self.run.go_back(best);
        }
        self.run.end(status, u, states, self.linear)
    }
}

/// Iterations over which the change of the pressures estimates their error before these iterations, as the gain of energy does (Hestenes and
/// Stiefel, 1952); the error after them is several times smaller. Tried were 2, 3 and 4 iterations and shares of 0.1 to 1 of the distance from the
/// laws, on 13 scenes of spheres, grooves, a flange and rollers. Three iterations and the whole distance took the fewest iterations among those that
/// needed no more steps than exact ones.
const DELAY: usize = 3;

/// The stopping test of a linear step.
///
/// The forcing rule: an inexact linear step of Newton's method ends when the error of the linear solver is small compared with the distance from
/// the laws (Ern and Vohralík, Adaptive inexact Newton methods, 2013). Both are known after each iteration of the linear solver.
struct Forcing<'a> {
    /// Layer states from which the step is taken.
    places: &'a Layer,
    /// Slopes on which the laws are resolved, n.
    rho: &'a [f64],
    /// Relative error that ends the run, or half the digits if none does.
    tolerance: f64,
    /// Scales to which that error refers.
    scale: &'a Scale,
    /// Relative error of the step above which it does not end.
    roughest: f64,
    /// Compressions before the step, n.
    before: Vec<f64>,
    /// Pressures of the last iterations, n each.
    pressures: VecDeque<Vec<f64>>,
}

impl<'a> Forcing<'a> {
    /// Return the test for the step from these layer states and compressions (n), in a run that ends at a tolerance, by a solver with this
    /// [`roughest`](crate::model::linear::LinearStep::roughest) step.
    pub fn new(
        places: &'a Layer,
        before: Vec<f64>,
        rho: &'a [f64],
        (tolerance, scale): (f64, &'a Scale),
        roughest: f64,
    ) -> Self {
        Self { places, rho, tolerance, scale, roughest, pressures: VecDeque::from([places.linear(&before)]), before }
    }

    /// Whether a step is solved well enough: the pressures change by less than their distance from the laws, or by less than the error that ends
    /// the run.
    pub fn is_enough(&mut self, model: &Model, trial: &Trial) -> bool {
        let c: Vec<f64> = self.before.iter().zip(trial.closing).map(|(c, closing)| c + closing).collect();
        let p = self.places.linear(&c);
        let resolved = Layer::resolve(model, &c, &p, self.rho, &self.places.smoothing);
        let (mut change, mut largest_change, mut distance, mut peak) = (0.0, 0.0f64, 0.0, 0.0f64);
        for (q, old) in self.pressures[0].iter().enumerate() {
            let here = (p[q] - old).abs();
            change += model.weight[q] * here;
            distance += model.weight[q] * (p[q] - resolved.pressure[q]).abs();
            (largest_change, peak) = (largest_change.max(here), peak.max(resolved.pressure[q]));
        }
        // an error that is small relative to the energy of the bodies may be large for the pressures of stiff layers
        let ends_run = || {
            largest_change <= self.tolerance * peak
                && trial.error <= 0.5 * self.tolerance * contact_energy(model, &resolved).sqrt()
                && self.scale.imbalance(model, &model.forces(&p), surface_energy(model, &resolved)) <= self.tolerance
        };
        let has_settled = change < distance || ends_run();
        let is_enough = trial.is_within(if has_settled { self.roughest } else { f64::EPSILON });
        if self.pressures.len() == DELAY {
            self.pressures.pop_front();
        }
        self.pressures.push_back(p);
        is_enough
    }
}

/// Largest share of the squared distance from the laws that a motion may leave: half of the distance. With 0.01 to 0.5 random scenes took the
/// same steps within a per cent; with one, which lets rounding move bodies on stiff layers, one of 900 was not solved (docs/methods.md).
const PART: f64 = 0.25;

/// Move u by a free rigid motion, and the step x that led to u with it, if this brings u much nearer to the laws. `p` are the pressures of
/// the step and `rho` the slopes of the lines on which the laws are resolved, n each. The loads are balanced to the `tolerance` of the run.
///
/// Free rigid motions E strain nothing. With (u, p) also (u + E a, p) is in equilibrium, for any amounts a. If no pressure is negative, the laws
/// can have these pressures. Then the Moreau envelope of the layers, resolved on lines of slope rho, is least where the layer states balance the
/// loads. So pressures that follow from statics alone need no steps in which the compressions follow them.
fn rigid_correction(model: &Model, [u, x]: [&mut Field; 2], p: &[f64], rho: &[f64], tolerance: f64) {
    let motions = Motions::of(model);
    if motions.count() == 0 || p.iter().any(|&p| p < 0.0) {
        return;
    }
    let compression = model.compression(&u.trace);
    let before = distance(model, u, &compression, p, rho);
    let balance = || start::balance(model, &motions, [&compression, p], rho, tolerance);
    let Some(amounts) = (before > 0.0).then(balance).flatten() else { return };
    let motion = motions.field(model, &amounts);
    let mut moved = u.clone();
    moved.add(1.0, &motion);
    if distance(model, &moved, &model.compression(&moved.trace), p, rho) <= PART * before {
        *u = moved;
        x.add(1.0, &motion);
    }
}

/// Return the squared distance of displacements u with pressures p from the laws.
fn distance(model: &Model, u: &Field, compression: &[f64], pressure: &[f64], rho: &[f64]) -> f64 {
    let roundoff = &compression_roundoff(model, &u.trace)[..];
    Equilibrium { compression, roundoff, pressure, rho }.distance(model, &[])
}

/// Return the response w of the bodies and their layers to small loads r, (K + B' diag(omega kappa) B) w = r, and its squared energy norm. The
/// layers are in the states `places`. `loads` is r, one entry per dof of each body that lives on this rank. The relative error of w may be `share`.
pub fn respond(
    model: &mut Model,
    step: &mut dyn LinearStep,
    places: &Layer,
    loads: &[Vec<f64>],
    share: f64,
) -> Result<std::result::Result<(Field, f64), Failure>> {
    let (mut residual, mut work) = (Vec::new(), [0.0]);
    for (slot, load) in model.bodies.iter_mut().zip(loads) {
        let reduced = slot.local.as_mut().map(|body| body.reduce(load)).transpose()?.unwrap_or_default();
        residual.push(reduced.force);
        work[0] += reduced.work;
    }
    model.exchange.sum(&mut work);
    let springs = resisting(model, places.springs(model));
    let mut enough = |_: &Model, trial: &Trial| trial.is_within(share);
    let system = System { model, places, springs: &springs, residual: &residual, enough: &mut enough };
    Ok(step.solve(system)?.map(|solution| (solution.field, solution.energy + work[0])))
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::sample::two_pairs;

    /// Steps of two points with p = 4 c and two with p = c^2; one of these opens.
    #[test]
    fn a_step_ends_when_pressures_have_settled() {
        let model = two_pairs();
        let places = Layer::new(&model, vec![0.5, 1.0, 2.0, 1.0]);
        let (rho, scale, half) = ([2.0, 0.5, 0.25, 3.0], Scale::default(), f64::EPSILON.sqrt());
        let asked = |closings: &[[f64; 4]], tolerance: f64, error: f64| -> Vec<bool> {
            let mut forcing = Forcing::new(&places, places.compression.clone(), &rho, (tolerance, &scale), 0.5);
            let trial = |closing| Trial { closing, energy: 1.0, error };
            closings.iter().map(|closing| forcing.is_enough(&model, &trial(closing))).collect()
        };
        // the second pair goes to c = 3, where the line of slope 4 has p = 8 and the law 9: they meet between
        let far = [0.0, 0.0, 1.0, 0.0];
        assert_eq!(asked(&[far; 5], half, 0.1), [false, false, false, true, true]);
        assert_eq!(asked(&[far; 5], half, 0.6), [false; 5], "more than half of the step is missing");
        // pressures that change by more than their distance from the laws
        let moving = [[0.0, 0.0, 0.2, 0.0], [0.0, 0.0, 0.4, 0.0], [0.0, 0.0, 0.6, 0.0], [0.0, 0.0, 0.8, 0.0]];
        assert_eq!(asked(&moving, half, 0.1), [false; 4]);
        // the first pair is linear: its distance is zero, and only the tolerance of the run ends the step
        let linear = [0.1, 0.0, 0.0, 0.0];
        assert_eq!(asked(&[linear; 5], half, 0.1), [false; 5]);
        let contact = contact_energy(&model, &Layer::new(&model, vec![0.6, 1.0, 2.0, 1.0])).sqrt();
        assert_eq!(asked(&[linear; 5], 0.01, 0.0049 * contact), [false, false, false, true, true]);
        assert_eq!(asked(&[linear; 5], 0.01, 0.0051 * contact), [false; 5]);
        // rounding
        assert_eq!(asked(&[linear; 1], half, 1e-16), [true]);
    }
}
