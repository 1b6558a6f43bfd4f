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
//! A fixed point has c = c_q and p = p_q: the equations (26). The gap between (c, p) and the law bounds the error of u.
//! Where steps have to be shortened, the laws are smoothed for a while ([`Path`](super::step::Path)); where no part of
//! a step comes nearer to the laws, F1 falls instead ([`Newton::descend`]).

use super::bound::{EXACT, Reached, compression_roundoff};
use super::forcing::{Forcing, resisting};
use super::history::{Outcome, Row, Run};
use super::start::SEARCH;
use super::step::{Equilibrium, Progress, StepLength};
use super::stop::{Stagnation, Status, falls, roundoff};
use crate::error::Result;
use crate::exchange::{self, ASKS, asks};
use crate::model::Model;
use crate::model::body::Energy;
use crate::model::field::{DisplacementField, LineEnergy, residual, unbalanced};
use crate::model::layer::Layer;
use crate::model::linear::{LinearSolution, LinearStep, Solved, System, Trial};

/// Relative error of the linear system that shows what is left of equilibrium: its size is wanted, which is then known
/// to a factor of two.
const LOOK: f64 = 0.5;

/// Relative error above which the first linear step from the states of another solution does not end. Displacements are
/// zero before it, and the first iterations of a solver leave them so far from the laws that [`Forcing`] would take
/// them for settled, with all points closed. The last adapted meshes of a bearing cap and of a fishplate take 2 steps,
/// instead of 10 and 6. With 0.03 and 0.01 the cap takes 3 and 2 steps, and more iterations. Spheres, flanges, a T-slot
/// nut and a clamp take as many steps as without this limit.
const FIRST_STEP: f64 = 0.1;

/// Share of the tolerance below which an error in the energy norm changes nothing in the digits that are asked for.
const UNSEEN: f64 = 0.01;

/// Distance from 1 of the length of a descent at which the descent ends. Lengths tend to 1 where Newton's method for F1
/// converges fast. With 0.2 none of 900 random scenes and none of 320 scenes with saturating layers was lost.
const WHOLE_STEP: f64 = 0.2;

/// Iterate from displacements and layer states until a rule ends the run. `is_near` is whether the states are those of
/// another solution, while the displacements are still at rest.
pub(super) fn iterate(
    run: &mut Run,
    linear: &mut dyn LinearStep,
    u: DisplacementField,
    states: Layer,
    is_near: bool,
) -> Result<Outcome> {
    let (progress, tolerance, foreign) = (Progress::new(run.model), run.stop.tolerance(), linear.sweeps());
    let (stagnation, added, descents, lowest) = (Stagnation::default(), Vec::new(), 0, Position::default());
    let mut newton =
        Newton { run, linear, progress, stagnation, tolerance, foreign, u, lowest, descents, states, added, is_near };
    newton.lowest = newton.position();
    loop {
        let step = match newton.linear_step()? {
            Ok(step) => step,
            Err(failure) => return Ok(newton.end_without_step(Status::InnerSolver(failure))),
        };
        let part = newton.step_length(&step);
        if (part.is_lost || part.is_measured && newton.is_unresisted(&step)) && newton.descend()? {
            continue;
        }
        let iterate = newton.advance(step, part);
        let mut measured = newton.measure(&iterate)?;
        if let Some(status) = newton.check_termination(&iterate, &mut measured)? {
            if status == Status::Stagnated && newton.descend()? {
                continue;
            }
            return Ok(newton.end(status, iterate, &measured));
        }
        newton.update_states(&iterate, &measured);
    }
}

/// A run of Newton's method under way.
struct Newton<'n, 'r> {
    run: &'n mut Run<'r>,
    linear: &'n mut dyn LinearStep,
    progress: Progress,
    stagnation: Stagnation,
    tolerance: f64,
    /// Sweeps that the solver of linear steps had made before this run began.
    foreign: usize,
    u: DisplacementField,
    /// Where the next descent begins, unless F1 is less at the iterate: the start, then the end of the last descent.
    lowest: Position,
    /// Steps of all descents so far.
    descents: usize,
    /// States of the layers from which the next linear step is taken.
    states: Layer,
    /// Springs that stood in for a contact in the last linear step, n.
    added: Vec<f64>,
    /// Whether the states are those of another solution, while the displacements are still at rest.
    is_near: bool,
}

/// An iterate that can be returned to.
#[derive(Clone, Default)]
struct Position {
    u: DisplacementField,
    /// The gaps that the rigid parts of u leave, n.
    gap: Vec<f64>,
    f1: f64,
}

/// The result of a step: displacements and pressures in equilibrium, and the states on the laws that belong to them.
struct StepResult {
    /// The part of the linear step that was taken.
    step: LinearSolution,
    part: StepLength,
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

/// Sums over all ranks at an iterate, and its errors.
struct Measured {
    /// f - K u - B' omega p of each local body.
    rest: Vec<Vec<f64>>,
    /// u'Ku over all bodies.
    strain: f64,
    /// F1.
    f1: f64,
    factorizations: usize,
    inner_iterations: usize,
    /// See [`Outcome::unbalanced`].
    unbalanced: f64,
    /// Requests from outside, of all ranks.
    asked: u8,
    reached: Reached,
}

impl Newton<'_, '_> {
    /// Return where the iterate is. Collective.
    fn position(&mut self) -> Position {
        let model = &mut *self.run.model;
        let layer = Layer::at(model, &self.u.trace);
        let products = self.linear.multiply(model, &self.u.displacements);
        let (_, energy) = residual(model, products, &self.u, &layer.force);
        let mut potential = [energy.potential];
        model.exchange.sum(&mut potential);
        Position { u: self.u.clone(), gap: model.gap.clone(), f1: potential[0] + layer.energy.iter().sum::<f64>() }
    }

    fn return_to(&mut self, position: Position) {
        (self.u, self.run.model.gap) = (position.u, position.gap);
    }

    /// Solve the linear step from the states.
    fn linear_step(&mut self) -> Result<Solved<LinearSolution>> {
        let (model, states) = (&mut *self.run.model, &self.states);
        let springs = resisting(model, states);
        self.added = springs.added;
        let compression = model.compression(&self.u.trace);
        let products = self.linear.multiply(model, &self.u.displacements);
        let (residual, _) = residual(model, products, &self.u, &model.forces(&states.linear(&compression)));
        let rho = self.progress.slopes(model, states);
        let scale = (self.tolerance, &self.run.scale);
        let limit = if std::mem::take(&mut self.is_near) { FIRST_STEP } else { 1.0 };
        let roughest = limit.min(self.linear.roughest());
        let mut forcing = Forcing::new(states, compression, &rho, scale, roughest);
        let mut enough = |model: &Model, trial: &Trial| forcing.is_enough(model, trial);
        self.linear.solve(System {
            model,
            layer: states,
            springs: &springs.all,
            residual: &residual,
            enough: &mut enough,
        })
    }

    /// Return the compressions of the iterate, and those at the end of the whole step, n each.
    fn ends(&self, step: &LinearSolution) -> [Vec<f64>; 2] {
        let before = self.run.model.compression(&self.u.trace);
        let whole = before.iter().zip(step.field.closing()).map(|(c, closing)| c + closing).collect();
        [before, whole]
    }

    /// Return the part of a step that does not lead away from the laws.
    fn step_length(&mut self, step: &LinearSolution) -> StepLength {
        let model = &*self.run.model;
        let [before, whole] = self.ends(step);
        let roundoff = compression_roundoff(model, &self.u.trace);
        let pressure = self.states.linear(&whole);
        self.progress.step_length(model, &self.states, [&before, &roundoff], [&whole, &pressure])
    }

    /// Return whether springs that stand in for a contact take more of a step's energy than the accuracy of a line
    /// search. The step then has the direction in which loads push the bodies, but a length that those springs chose,
    /// which says nothing of where the bodies meet.
    fn is_unresisted(&self, step: &LinearSolution) -> bool {
        let closing = step.field.closing();
        let taken: f64 = self.added.iter().zip(closing).map(|(spring, s)| spring * s.powi(2)).sum();
        taken > SEARCH * step.energy
    }

    /// Let F1 fall by Newton's method for F1 itself, to its least along each step, until whole steps are taken. Return
    /// whether it fell; then the next step begins from the states at the new compressions.
    ///
    /// The distance from the laws falls along no step whose tangents nearly vanish, as where a law saturates or hardly
    /// anything holds a body. F1 is convex, and a step of Newton's method always descends. The least F1 may be at a
    /// tiny part of the step, which halving would not find.
    ///
    /// A descent begins where the last one ended, or at the iterate if F1 is less there, and takes at least as many
    /// steps as all before. So F1 falls to its minimum if whole steps lead away from it again and again.
    fn descend(&mut self) -> Result<bool> {
        let here = self.position();
        let begin = if here.f1 <= self.lowest.f1 { here.clone() } else { self.lowest.clone() };
        let f1 = begin.f1;
        self.return_to(begin);
        let least = self.descents;
        for step in 1..=self.run.stop.iterations {
            let length = self.descent_step(roundoff(f1))?;
            self.descents += 1;
            let is_whole = (length - 1.0).abs() <= WHOLE_STEP && step >= least;
            if length == 0.0 || is_whole || self.is_asked() {
                break;
            }
        }
        let end = self.position();
        let falls = falls(f1, end.f1);
        if falls {
            (self.lowest, self.stagnation) = (end, Stagnation::default());
            self.states = Layer::at(self.run.model, &self.u.trace);
            self.progress.forget_pressure();
        } else {
            self.return_to(here);
        }
        Ok(falls)
    }

    /// Return whether something outside asks the run to end, on any rank. Collective.
    fn is_asked(&self) -> bool {
        let mut sums = asks(self.run.observer.asked());
        self.run.model.exchange.sum(&mut sums);
        exchange::asked(&sums) != 0
    }

    /// Take one step of Newton's method for F1 from the states at the compressions of the iterate. Return its length;
    /// zero if its linear system is not solved, if F1 falls without end, or if the whole step promises a fall of less
    /// than `unseen`.
    fn descent_step(&mut self, unseen: f64) -> Result<f64> {
        let model = &mut *self.run.model;
        let layer = Layer::at(model, &self.u.trace);
        let springs = resisting(model, &layer);
        let products = self.linear.multiply(model, &self.u.displacements);
        let (residual, _) = residual(model, products, &self.u, &layer.force);
        let roughest = self.linear.roughest();
        let mut enough = |_: &Model, trial: &Trial| trial.is_within(roughest);
        let system = System {
            model: &mut *model,
            layer: &layer,
            springs: &springs.all,
            residual: &residual,
            enough: &mut enough,
        };
        let Ok(step) = self.linear.solve(system)? else { return Ok(0.0) };
        if 0.5 * step.energy <= unseen {
            return Ok(0.0);
        }
        let products = self.linear.multiply(model, &step.field.displacements);
        let Ok(length) = LineEnergy::new(model, &layer, &residual, &step.field, &products).minimize(SEARCH) else {
            return Ok(0.0);
        };
        self.u.advance(model, length, &step.field);
        self.u.retrace(model);
        Ok(length)
    }

    /// Take this part of a step, and resolve the laws at its end.
    fn advance(&mut self, mut step: LinearSolution, part: StepLength) -> StepResult {
        let [_, whole] = self.ends(&step);
        let model = &mut *self.run.model;
        step.field.scale(part.length);
        self.u.advance(model, 1.0, &step.field);
        self.u.retrace(model);
        // pressures of the linear step, not of the compressions at its end: a stiff layer would magnify the roundoff of
        // displacements
        let pressure = self.progress.go(part.length, self.states.linear(&whole));
        let rho = self.progress.slopes(model, &self.states);
        let compression = model.compression(&self.u.trace);
        let roundoff = compression_roundoff(model, &self.u.trace);
        let resolved = Layer::resolve(model, &compression, &pressure, &rho, &[]);
        StepResult { step, part, compression, roundoff, pressure, rho, resolved }
    }

    /// Measure the errors of an iterate. Collective.
    fn measure(&mut self, iterate: &StepResult) -> Result<Measured> {
        let StepResult { step, resolved, .. } = iterate;
        let run = &mut *self.run;
        let products = self.linear.multiply(run.model, &self.u.displacements);
        let (rest, energy) = residual(run.model, products, &self.u, &run.model.forces(&iterate.pressure));
        let sums = self.sum(&rest, energy);
        let run = &mut *self.run;
        let layer = Layer::new(run.model, iterate.compression.clone());
        let strain = sums[0];
        run.scale.note_displacements(run.model, &self.u.trace);
        let mut reached = Reached::new(run.model, &run.scale, strain, step, &iterate.equilibrium(), resolved);
        let unbalanced = run.scale.relative(sums[2], strain + resolved.work);
        reached.verify(unbalanced);
        let joint = self.linear.counts();
        Ok(Measured {
            rest,
            strain,
            f1: sums[1] + layer.energy.iter().sum::<f64>(),
            factorizations: sums[3] as usize + joint.factorizations,
            inner_iterations: sums[4] as usize + joint.inner_iterations,
            unbalanced,
            asked: exchange::asked(&sums[sums.len() - ASKS..]),
            reached,
        })
    }

    /// Return the sums of [`Run::sum`] with the squared energy norm of the unbalanced forces `rest` of each node.
    fn sum(&self, rest: &[Vec<f64>], energy: Energy) -> Vec<f64> {
        let model = &*self.run.model;
        let unbalanced = unbalanced(model, rest, &self.states.springs(model));
        self.run.sum(energy, unbalanced)
    }

    /// Look at the equilibrium of an iterate once more: one linear system, with the matrix of the step, for the forces
    /// that are left. Add twice the size of its solution to the errors, since roundoff may do as much again. Return the
    /// solution, none if the system is not solved.
    fn look(&mut self, iterate: &StepResult, measured: &mut Measured) -> Result<Option<LinearSolution>> {
        let (run, layer) = (&mut *self.run, &self.states);
        let springs = resisting(run.model, layer);
        let mut enough = |_: &Model, trial: &Trial| trial.is_within(LOOK);
        let before = self.linear.counts();
        let system =
            System { model: run.model, layer, springs: &springs.all, residual: &measured.rest, enough: &mut enough };
        let Ok(more) = self.linear.solve(system)? else { return Ok(None) };
        let counts = self.linear.counts();
        measured.inner_iterations += counts.inner_iterations - before.inner_iterations;
        measured.factorizations += counts.factorizations - before.factorizations;
        measured.reached.add_unbalanced(&run.scale, measured.strain, &more, layer, &iterate.resolved);
        Ok(Some(more))
    }

    /// Show the row of an iterate and keep it. Return the status if the run ends with this iterate.
    ///
    /// An iterate that seems good enough, or makes no progress any more, has its equilibrium looked at. If too much is
    /// left, further steps go on, which take it into account. Roundoff ends a run that stagnates on the laws.
    fn check_termination(&mut self, iterate: &StepResult, measured: &mut Measured) -> Result<Option<Status>> {
        let is_smoothed = !self.states.smoothing.is_empty();
        let is_enough = |error: f64| self.run.stop.residual.is_some_and(|tolerance| error <= tolerance);
        let seems_enough = is_enough(measured.reached.worst());
        let (error, fall) = (measured.reached.worst(), iterate.part.fall);
        let stagnates = self.stagnation.note(error, measured.f1, fall, is_smoothed);
        if seems_enough || stagnates {
            self.look(iterate, measured)?;
        }
        let error = measured.reached.worst();
        let broken = self.record(iterate, measured);
        let run = &*self.run;
        let last = &run.rows[run.rows.len() - 1];
        // pressures of far compressions may be beyond the range of numbers; those of the layer states are not
        if let Some(body) = broken.or(error.is_nan().then_some(0)) {
            return Ok(Some(Status::NotFinite { body }));
        }
        if run.stop.is_met(error, last.increment) {
            return Ok(Some(Status::Converged));
        }
        if stagnates {
            let unseen = self.unseen(measured, iterate);
            let is_on_laws = iterate.equilibrium().distance(run.model, &[]) <= unseen;
            let is_balanced = iterate.step.is_exact || measured.unbalanced <= EXACT;
            // a relative error of one or more leaves no digit of a solution
            let is_solution = is_on_laws && is_balanced && error < 1.0;
            return Ok(Some(if is_solution { Status::RoundoffLimited } else { Status::Stagnated }));
        }
        if measured.asked != 0 {
            return Ok(Some(Status::Interrupted { asked: measured.asked }));
        }
        Ok((last.iteration >= run.stop.iterations).then_some(Status::IterationLimit))
    }

    /// Return the energy below which a distance from the laws changes nothing in the digits that are asked for.
    fn unseen(&self, measured: &Measured, iterate: &StepResult) -> f64 {
        (UNSEEN * self.tolerance).powi(2) * self.run.scale.energy(measured.strain + iterate.resolved.work)
    }

    /// Complete the row of an iterate. Return the first body with a displacement that is not finite.
    fn record(&mut self, iterate: &StepResult, measured: &Measured) -> Option<usize> {
        let layer = &iterate.resolved;
        let row = Row {
            iteration: self.run.rows.len() + 1,
            residual: measured.reached.worst(),
            error: measured.reached.error,
            is_bound: measured.reached.is_bound,
            gamma: iterate.part.length,
            energy: measured.f1,
            closed: layer.closed,
            sweeps: self.linear.sweeps() - self.foreign,
            factorizations: measured.factorizations,
            inner_iterations: measured.inner_iterations,
            smoothed: self.progress.path.steps,
            ..Row::default()
        };
        self.run.record(&self.u, Some(&iterate.step.field.trace), row)
    }

    /// Set the states of the next step.
    fn update_states(&mut self, iterate: &StepResult, measured: &Measured) {
        let (unseen, model) = (self.unseen(measured, iterate), &*self.run.model);
        let smoothing = self.progress.path.smoothing(model, &iterate.equilibrium(), &self.states.smoothing, unseen);
        self.states = if smoothing.is_empty() {
            iterate.resolved.clone()
        } else {
            Layer::resolve(model, &iterate.compression, &iterate.pressure, &iterate.rho, &smoothing)
        };
    }

    /// End the run at the last iterate.
    fn end(self, status: Status, iterate: StepResult, measured: &Measured) -> Outcome {
        Outcome {
            strain: measured.strain,
            unbalanced: measured.unbalanced,
            answer: self.progress.answers(self.run.model),
            sweeps: self.linear.sweeps() - self.foreign,
            ..Outcome::at_start(status, self.u, iterate.resolved)
        }
    }

    /// End the run because a linear step failed.
    fn end_without_step(self, status: Status) -> Outcome {
        let sweeps = self.linear.sweeps() - self.foreign;
        Outcome { sweeps, ..Outcome::at_start(status, self.u, self.states) }
    }
}
