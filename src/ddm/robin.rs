//! The paper's loop (34), (42), with one of its two forms G.
//!
//! ```text
//! layers      c = B u - d,   p = p(c)
//! correction  G z = r = f - K u - B' omega p                                  (34)
//!   sweep     G_s = K_s + B_s' omega psi kappa B_s    every body by itself    (37)-(38), (41)
//!   joint     G = K + B' omega kappa B                all bodies together     (35)-(36)
//! update      u <- u + gamma z                                                (42)
//! ```

use super::forcing::resisting;
use super::gamma::{GammaRule, Iterate};
use super::history::{Outcome, Row, Run};
use super::stop::Status;
use crate::error::Result;
use crate::exchange::{self, ASKS};
use crate::linalg::DIGIT;
use crate::model::body::Energy;
use crate::model::field::{DisplacementField, residual, unbalanced};
use crate::model::layer::Layer;
use crate::model::linear::{LinearSolution, LinearStep, Solved, System, Trial};
use crate::model::{INNER_TOLERANCE, Model, closing};
use crate::robin::Sweep;
use crate::robin::spectrum::{Interval, interval};
use crate::robin::sweep::{Coefficient, Sweeper, extend, stiff_joint_springs, underconstrained};

/// The step that led to an iterate.
struct LastStep {
    gamma: f64,
    /// r'z before the step.
    decrement: f64,
    /// Change of the traces, 2n.
    moved: Vec<f64>,
}

/// Solves G z = r at an iterate.
pub(super) struct Corrector<'a> {
    /// The Robin term of sweeps; without one, G is the matrix of all bodies.
    pub coefficient: Option<&'a mut Coefficient>,
    pub sweeper: Sweeper,
    /// The solver of all bodies.
    pub linear: &'a mut dyn LinearStep,
}

impl Corrector<'_> {
    /// Return r and z at an iterate with this layer, or the status that ends the run because G is singular or its
    /// solver fails.
    fn correct(
        &mut self,
        run: &mut Run,
        u: &DisplacementField,
        layer: &Layer,
        k: usize,
    ) -> Result<std::result::Result<Sweep, Status>> {
        let Some(coefficient) = &mut self.coefficient else { return self.correct_jointly(run, u, layer) };
        let weight = coefficient.weight(run.model, layer, k)?;
        if let Some(moved) = underconstrained(run.model, &weight) {
            return Ok(Err(Status::Underconstrained(moved)));
        }
        run.model.robin(&weight)?;
        self.sweeper.sweep(run.model, u, layer, run.observer.asked()).map(Ok)
    }

    /// Do the work of [`Self::correct`] with the matrix of all bodies. Where no closed contact resists a motion, a
    /// spring stands in for it, as in the linear steps of Newton's method.
    fn correct_jointly(
        &mut self,
        run: &mut Run,
        u: &DisplacementField,
        layer: &Layer,
    ) -> Result<std::result::Result<Sweep, Status>> {
        let springs = resisting(run.model, layer).all;
        let (residual, energy, z) = self.solve_jointly(run.model, u, layer, &springs, &layer.force)?;
        let z = match z {
            Ok(z) => z,
            Err(failure) => return Ok(Err(Status::InnerSolver(failure))),
        };
        let (sums, joint) = (run.sum(energy, 0.0), self.linear.counts());
        Ok(Ok(Sweep {
            residual,
            correction: z.field,
            decrement: z.energy,
            strain: sums[0],
            potential: sums[1],
            factorizations: sums[3] as usize + joint.factorizations,
            inner_iterations: sums[4] as usize + joint.inner_iterations,
            asked: exchange::asked(&sums[sums.len() - ASKS..]),
            ..Sweep::default()
        }))
    }

    /// Move the bodies from the motions of a start to displacements of least energy with its trace (2n). With the
    /// matrix of all bodies these have its closings B u; no iterate's closings depend on another part of a start.
    pub fn extend(&mut self, model: &mut Model, u: &mut DisplacementField, trace: &[f64]) -> Result<Solved<()>> {
        if self.coefficient.is_some() {
            return Ok(
                extend(model, trace)?.map(|bent| *u = DisplacementField { rigid: sums(&u.rigid, &bent.rigid), ..bent })
            );
        }
        u.retrace(model);
        let springs = stiff_joint_springs(model);
        let missing = closing(trace).zip(closing(&u.trace)).map(|(wanted, now)| wanted - now);
        let pull: Vec<f64> = springs.iter().zip(missing).map(|(spring, missing)| -spring * missing).collect();
        let layer = Layer::at(model, &u.trace);
        let (.., step) = self.solve_jointly(model, u, &layer, &springs, &pull)?;
        Ok(step.map(|step| {
            u.advance(model, 1.0, &step.field);
            u.retrace(model);
        }))
    }

    /// Solve (K + B' diag(`springs`) B) z = r = f - K u - B' `force` for all bodies together, as accurately as sweeps
    /// solve for each. Return r, the energies of u, and z.
    fn solve_jointly(
        &mut self,
        model: &mut Model,
        u: &DisplacementField,
        layer: &Layer,
        springs: &[f64],
        force: &[f64],
    ) -> Result<(Vec<Vec<f64>>, Energy, Solved<LinearSolution>)> {
        let products = self.linear.multiply(model, &u.displacements);
        let (residual, energy) = residual(model, products, u, force);
        let mut enough = |_: &Model, trial: &Trial| trial.is_within(INNER_TOLERANCE);
        let z = self.linear.solve(System { model, layer, springs, residual: &residual, enough: &mut enough })?;
        Ok((residual, energy, z))
    }
}

/// Return the sums of two lists of amounts.
fn sums(a: &[Vec<f64>], b: &[Vec<f64>]) -> Vec<Vec<f64>> {
    a.iter().zip(b).map(|(a, b)| a.iter().zip(b).map(|(a, b)| a + b).collect()).collect()
}

/// Iterate from a displacement until a rule ends the run. With `wants_interval` the interval (33) of gamma is found at
/// the end.
pub(super) fn iterate(
    run: &mut Run,
    rule: &mut dyn GammaRule,
    mut corrector: Corrector,
    mut u: DisplacementField,
    wants_interval: bool,
) -> Result<Outcome> {
    let mut settling = Settling::default();
    let mut last: Option<LastStep> = None;
    for k in 0.. {
        let layer = Layer::at(run.model, &u.trace);
        let sweep = match corrector.correct(run, &u, &layer, k)? {
            Ok(sweep) => sweep,
            Err(status) => {
                u.retrace(run.model);
                return Ok(Outcome::at_start(status, u, layer));
            }
        };
        let sweeps = corrector.sweeper.sweeps;
        let residual = run.scale.relative(sweep.decrement, sweep.strain + layer.work);
        let broken = record(run, &u, &layer, &sweep, last.as_ref(), sweeps);
        let mut ended = status(run, &layer, &sweep, &settling, broken);
        settling.note(residual, &layer.pressure);
        let mut gamma = 0.0;
        if ended.is_none() {
            let (model, linear) = (&mut *run.model, &mut *corrector.linear);
            let mut here = Iterate { model, linear, k, layer: &layer, sweep: &sweep, residual };
            match rule.gamma(&mut here) {
                Ok(value) => gamma = value,
                Err(_) => ended = Some(Status::Unbounded { moving: Vec::new() }),
            }
        }
        if let Some(status) = ended {
            let interval = if wants_interval && status.is_solved() { found_interval(run, &layer)? } else { None };
            let mut left = [unbalanced(run.model, &sweep.residual, &layer.springs(run.model))];
            run.model.exchange.sum(&mut left);
            // updates add to states and traces separately, so that they come to differ by rounding
            u.retrace(run.model);
            return Ok(Outcome {
                strain: sweep.strain,
                unbalanced: run.scale.relative(left[0], sweep.strain + layer.work),
                sweeps,
                interval,
                ..Outcome::at_start(status, u, layer)
            });
        }
        u.advance(run.model, gamma, &sweep.correction);
        let moved = sweep.correction.trace.iter().map(|z| gamma * z).collect();
        last = Some(LastStep { gamma, decrement: sweep.decrement, moved });
    }
    unreachable!("the limit of iterations ends the loop")
}

/// Complete the row of an iterate u. Return the first body with a displacement that is not finite.
///
/// The slowest mode remains after a while, and corrections decrease by its factor 1 - gamma lambda. Then the squared
/// error in the energy norm is r'z/lambda.
fn record(
    run: &mut Run,
    u: &DisplacementField,
    layer: &Layer,
    sweep: &Sweep,
    last: Option<&LastStep>,
    sweeps: usize,
) -> Option<usize> {
    let residual = run.scale.relative(sweep.decrement, sweep.strain + layer.work);
    let amplification = last.map_or(f64::NAN, |last| {
        let factor = (sweep.decrement / last.decrement).sqrt();
        if factor < 1.0 { (last.gamma / (1.0 - factor)).max(1.0) } else { f64::NAN }
    });
    let row = Row {
        iteration: run.rows.len(),
        residual,
        error: residual * amplification.sqrt(),
        gamma: last.map_or(f64::NAN, |last| last.gamma),
        energy: sweep.potential + layer.energy.iter().sum::<f64>(),
        closed: layer.closed,
        sweeps,
        factorizations: sweep.factorizations,
        inner_iterations: sweep.inner_iterations,
        ..Row::default()
    };
    let broken = run.record(u, last.map(|last| &last.moved[..]), row);
    broken.or((!residual.is_finite()).then_some(0))
}

/// Return the status if a rule ends the run with its last row.
fn status(run: &Run, layer: &Layer, sweep: &Sweep, settling: &Settling, broken: Option<usize>) -> Option<Status> {
    let row = &run.rows[run.rows.len() - 1];
    if let Some(body) = broken {
        return Some(Status::NotFinite { body });
    }
    if run.stop.is_met(row.residual, row.increment) && is_settled(run, layer, sweep.strain, settling, row.residual) {
        return Some(Status::Converged);
    }
    if let Some(failure) = &sweep.failed {
        return Some(Status::InnerSolver(failure.clone()));
    }
    if row.iteration >= run.stop.iterations {
        return Some(Status::IterationLimit);
    }
    (sweep.asked != 0).then_some(Status::Interrupted { asked: sweep.asked })
}

/// Whether the pressures of an iterate have settled and its forces balance, to the tolerance that is asked for. The
/// residual alone is not enough: a slow mode has a small residual and a large error.
fn is_settled(run: &Run, layer: &Layer, strain: f64, settling: &Settling, residual: f64) -> bool {
    let peak = run.scale.peak(&layer.pressure, strain);
    let imbalance = run.scale.imbalance(run.model, &layer.force, strain);
    let has_settled = |tolerance: f64| settling.error(residual, &layer.pressure, peak) <= tolerance * peak;
    run.stop.residual.is_none_or(|tolerance| has_settled(tolerance) && imbalance <= tolerance)
        && run.stop.increment.is_none_or(|tolerance| imbalance <= tolerance)
}

/// Return the interval (33) at a solution, for the level set of the first iterate.
fn found_interval(run: &mut Run, layer: &Layer) -> Result<Option<Interval>> {
    match &run.rows[..] {
        [first, .., last] => interval(run.model, layer, first.energy - last.energy),
        _ => Ok(None),
    }
}

/// Earlier iterates, whose residuals fall from each to the next at least by a [`DIGIT`].
///
/// They estimate the error of the pressures from their change while the residual fell.
///
/// A last step that moves nothing proves little. It may have been short, or along modes that do not change the contact,
/// while other modes are far from their end. In the long run, errors fall as the residual does. While the residual
/// falls to a share s of its earlier value, a pressure changes by 1 - s of its earlier error. So s/(1 - s) of that
/// change is left as its error.
#[derive(Debug, Default)]
struct Settling {
    /// Residual and pressures, n, of each.
    past: Vec<(f64, Vec<f64>)>,
}

impl Settling {
    /// Estimate the largest error of the pressures `now` (n) of an iterate with this residual; zero if it is the first
    /// one. Changes above their `peak` count as the peak: laws are far from linear there, so that larger errors say
    /// nothing about those that follow.
    fn error(&self, residual: f64, now: &[f64], peak: f64) -> f64 {
        // from a good start the residual may never have fallen so far
        let earlier = self.past.iter().rfind(|(earlier, _)| residual <= DIGIT * earlier).or(self.past.first());
        earlier.map_or(0.0, |(earlier, pressure)| {
            let changes = pressure.iter().zip(now).map(|(before, now)| (now - before).abs());
            let change = changes.fold(0.0, f64::max).min(peak);
            // without a fall of the residual, no smaller error is known
            if residual < *earlier { change * residual / (earlier - residual) } else { change }
        })
    }

    /// Note an iterate.
    fn note(&mut self, residual: f64, pressure: &[f64]) {
        self.past.retain(|(earlier, _)| *earlier > residual);
        if self.past.last().is_none_or(|(earlier, _)| residual <= DIGIT * earlier) {
            self.past.push((residual, pressure.to_vec()));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One mode with the factor 0.99: its error is a hundred times each of its steps.
    #[test]
    fn a_slow_mode_has_not_settled() {
        let mut settling = Settling::default();
        let error = |k: i32| 0.99f64.powi(k);
        for k in 0..1000 {
            if k > 300 {
                let missing = settling.error(error(k), &[1.0 - error(k)], 1.0);
                assert!((missing / error(k) - 1.0).abs() < 1e-9, "{k}: {missing}");
            }
            settling.note(error(k), &[1.0 - error(k)]);
        }
        assert!(settling.past.len() < 12, "{} iterates are kept", settling.past.len());
    }

    /// A step that is short, or a residual that grew in between, hides nothing.
    #[test]
    fn neither_short_steps_nor_peaks_deceive() {
        let mut settling = Settling::default();
        assert_eq!(settling.error(1e-9, &[3.0], 3.0), 0.0);
        let iterates = [(1.0, 0.0), (1e-5, 0.9), (1e-2, 0.95), (1e-3, 0.999), (0.99e-3, 0.999)];
        iterates.iter().for_each(|(residual, p)| settling.note(*residual, &[*p]));
        // since 1e-2 the pressure has moved by 0.049
        let missing = settling.error(0.99e-3, &[0.999], 1.0);
        assert!((missing / (0.049 * 0.099 / 0.901) - 1.0).abs() < 1e-9, "{missing}");
        // from a start that was nearly as good
        let mut near = Settling::default();
        near.note(2e-8, &[1.0]);
        assert!((near.error(1e-8, &[1.5], 1.5) - 0.5).abs() < 1e-12);
        assert_eq!(near.error(3e-8, &[1.5], 1.5), 0.5);
        // a change from pressures above the peak gives no estimate
        let mut wild = Settling::default();
        wild.note(1.0, &[1e30]);
        assert!(wild.error(1e-10, &[1.0], 1.0) < 1.1e-10);
    }
}
