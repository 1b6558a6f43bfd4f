//! The last look: forces summed anew from the displacements of a result show whether the result is as good as its run reported.
//!
//! No solver takes part: the residual r = f - K u - B' omega p is summed over the cells. Here f are the loads, K is the stiffness,
//! B are the contact rows, and omega and p are the areas and pressures of the contact points. The energy of r is bounded from below,
//!
//! ```text
//! |r|^2 = r' H^-1 r >= (r'v)^2 / v'H v       for every v,      H = K + B' omega kappa B,
//! ```
//!
//! where kappa are the tangent stiffnesses of the layers. The trial displacements v come from no solver: one is what the force on
//! each node alone would cause, others are what forces on hats of coarser and coarser grids would cause (docs/theory.md).

use super::stages::{All, Done, Look, Recovered};
use crate::ddm::{Inaccuracy, Row, Status, Whose, resisting};
use crate::discretize::Unbalanced;
use crate::exchange::all_gather;
use crate::linalg::{axpy, dot};
use crate::model::BodySlot;
use nalgebra::{DMatrix, DVector};
use std::time::Instant;

/// Number of trial displacements: of nodes, of hats with and without contact springs.
const TRIALS: usize = 3;

/// Factor by which the found error may exceed the one that the run reported. Runs measure their errors in norms of their own. Runs that
/// end by increments of displacements, by the error of the mesh or by rounding estimate them from few steps. The factor covers such
/// differences: the error of the mesh is ten times the error with which it lets a run end.
const ROUGHLY: f64 = 10.0;

/// Relative error beyond which a number has no correct digit. A run that rounding ended there has no result.
const ONE_DIGIT: f64 = 0.1;

/// Check a result in the units of its model. A solution becomes inaccurate if its error is larger than the tolerance and more than
/// ten times larger than the run reported. Collective.
pub fn look(done: &mut Done, recovered: &All) {
    let is_solved = done.outcome.status.is_solved();
    if !is_solved && done.outcome.status != Status::IterationLimit {
        return;
    }
    let began = Instant::now();
    let energy = EnergyCheck::of(done, recovered);
    let (reached, pair) = done.outcome.reached(done.model(), energy.strain, energy.unbalanced);
    let whose = pair.map_or(Whose::Body(energy.most), Whose::Pair);
    let reported = done.outcome.rows.last().map_or(0.0, reported_error);
    let found = reached.worst();
    let tolerance = done.built.scene.method.stop.residual.unwrap_or(0.0);
    // A run that rounding ended may leave the forces that rounding of the compressions gives the layers, and no more.
    let is_rounding = reached.error <= tolerance || done.outcome.is_rounding(energy.unbalanced);
    let rounding = done.outcome.rounding;
    // the report itself states the effect of rounding on pressures
    let allowed = tolerance.max(ROUGHLY * reported).max(rounding);
    let is_confirmed = found <= allowed && is_rounding;
    let ended = if done.outcome.status == Status::RoundoffLimited { reported } else { 0.0 };
    let lost = ended.max(rounding);
    // NaN is never confirmed
    if is_solved && !is_confirmed {
        done.outcome.status = Status::Inaccurate(Inaccuracy { reported, found, whose });
    } else if is_solved && lost > ONE_DIGIT {
        done.outcome.status = Status::Inaccurate(Inaccuracy { reported, found: lost, whose: Whose::Rounding });
    }
    done.look = Some(Look { reached, whose, seconds: began.elapsed().as_secs_f64() });
}

/// Return the relative error with which a run ended by its own measure.
fn reported_error(row: &Row) -> f64 {
    [row.residual, row.error].into_iter().filter(|error| error.is_finite()).fold(0.0, f64::max)
}

struct EnergyCheck {
    /// u'Ku over all bodies.
    strain: f64,
    /// Lower bound of the energy norm of the unbalanced forces r.
    unbalanced: f64,
    /// The body with the largest part of it.
    most: usize,
}

impl EnergyCheck {
    /// Measure the result of a run. Collective.
    fn of(done: &Done, recovered: &All) -> Self {
        let model = done.model();
        let (bodies, points) = (model.bodies.len(), model.points());
        let springs = resisting(model, done.outcome.layer.springs(model));
        let found: Vec<Option<Unbalanced>> =
            (0..bodies).map(|body| unbalanced_forces(done, recovered, &springs, body)).collect();
        let hats = forces_on_hats(done, &found);
        let mut message = vec![0.0; TRIALS * bodies + TRIALS * TRIALS + 1 + TRIALS * 2 * points];
        let mut sums = Sums::of(&mut message, bodies);
        for (body, (found, hats)) in found.iter().zip(&hats).enumerate() {
            if let Some(found) = found {
                sums.add_body(done, body, found, hats);
            }
        }
        model.exchange.sum(&mut message);
        let sums = Sums::of(&mut message, bodies);
        let work = DVector::from_fn(TRIALS, |k, _| (0..bodies).map(|body| sums.works[TRIALS * body + k]).sum());
        let coefficients = best(&sums.form(&springs), &work);
        let of_body = |body: usize| (0..TRIALS).map(|k| coefficients[k] * sums.works[TRIALS * body + k]).sum::<f64>();
        let most = (0..bodies).max_by(|&a, &b| of_body(a).total_cmp(&of_body(b))).unwrap_or(0);
        let squared = work.dot(&coefficients);
        // rounding can make a tiny one negative
        let unbalanced = if squared <= 0.0 { 0.0 } else { squared.sqrt() };
        Self { strain: *sums.strain, unbalanced, most }
    }
}

/// Sums over the bodies and ranks, which are parts of one message.
struct Sums<'a> {
    /// Work of the unbalanced forces of each body on the trials, TRIALS per body.
    works: &'a mut [f64],
    /// Products v_i'K v_j of the trials, row by row.
    products: &'a mut [f64],
    /// u'Ku.
    strain: &'a mut f64,
    /// Traces B v of each trial, 2 per contact point: those of side a before those of side b.
    traces: &'a mut [f64],
}

impl<'a> Sums<'a> {
    /// Return the parts of a message.
    fn of(message: &'a mut [f64], bodies: usize) -> Self {
        let (works, rest) = message.split_at_mut(TRIALS * bodies);
        let (products, rest) = rest.split_at_mut(TRIALS * TRIALS);
        let (strain, traces) = rest.split_at_mut(1);
        Self { works, products, strain: &mut strain[0], traces }
    }

    /// Add what this rank has of a body. Collective where the nodes of the body are distributed.
    fn add_body(&mut self, done: &Done, body: usize, found: &Unbalanced, hats: &[f64]) {
        *self.strain += found.strain;
        if found.force.is_empty() {
            return;
        }
        let (model, post) = (done.model(), done.built.discrete.bodies[body].post());
        let rough = with_ghosts(&model.bodies[body], post.rough(found));
        let trials = [rough, post.smooth(hats, true), post.smooth(hats, false)];
        axpy(1.0, &post.products(&trials), self.products);
        let length = 2 * model.points();
        for (k, trial) in trials.iter().enumerate() {
            self.works[TRIALS * body + k] = dot(&found.force, trial);
            model.put(body, &post.trace(trial), &mut self.traces[length * k..length * (k + 1)]);
        }
    }

    /// Return v_i'H v_j for the trials, with the contact springs omega kappa.
    fn form(&self, springs: &[f64]) -> DMatrix<f64> {
        let points = springs.len();
        let mut form = DMatrix::from_row_slice(TRIALS, TRIALS, self.products);
        let closing = |k: usize, q: usize| self.traces[2 * points * k + q] + self.traces[2 * points * k + points + q];
        for (q, spring) in springs.iter().enumerate().filter(|(_, spring)| **spring > 0.0) {
            let closing: [f64; TRIALS] = std::array::from_fn(|k| closing(k, q));
            for i in 0..TRIALS {
                (0..TRIALS).for_each(|j| form[(i, j)] += spring * closing[i] * closing[j]);
            }
        }
        form
    }
}

/// Return the unbalanced forces on this rank's part of a body, if it has one.
fn unbalanced_forces(done: &Done, recovered: &All, springs: &[f64], body: usize) -> Option<Unbalanced> {
    let at_rows = |values: &[f64]| done.model().at_rows(body, values);
    Some(match recovered[body].as_ref()? {
        Ok(Recovered { bent, .. }) => {
            let post = done.built.discrete.bodies[body].post();
            post.unbalanced(bent, &at_rows(&done.outcome.layer.force), &at_rows(springs))
        }
        // the solver of the body failed, so the forces are not a number
        Err(_) => Unbalanced::unknown(),
    })
}

/// Return the forces on the hats of each body, summed over all ranks; empty for a body without any. Collective.
fn forces_on_hats(done: &Done, found: &[Option<Unbalanced>]) -> Vec<Vec<f64>> {
    let mut mine = Vec::new();
    for (info, found) in done.built.discrete.bodies.iter().zip(found) {
        let found = found.as_ref().filter(|found| !found.force.is_empty());
        mine.push(found.map_or(Vec::new(), |found| info.post().on_hats(found)));
    }
    let mut ranks = all_gather(&*done.model().exchange, mine).into_iter();
    let mut all = ranks.next().unwrap_or_default();
    for rank in ranks {
        for (all, mine) in all.iter_mut().zip(rank) {
            if all.is_empty() {
                *all = mine;
            } else {
                axpy(1.0, &mine, all);
            }
        }
    }
    all
}

/// Fill in the values of a field at ghost nodes from the ranks that own them. Collective where the nodes of the body are distributed.
fn with_ghosts(slot: &BodySlot, field: Vec<f64>) -> Vec<f64> {
    match slot.distribution() {
        Some(distribution) => distribution.near(&distribution.of_known(&field)),
        None => field,
    }
}

/// Return the combination x of the trials with the largest (w'x)^2 / x'A x, for `form` A and `work` w. It solves A x = w, except
/// for combinations that vanish up to rounding.
fn best(form: &DMatrix<f64>, work: &DVector<f64>) -> DVector<f64> {
    let scale = DVector::from_fn(work.len(), |k, _| if form[(k, k)] > 0.0 { form[(k, k)].sqrt().recip() } else { 0.0 });
    let scaled = DMatrix::from_fn(work.len(), work.len(), |i, j| scale[i] * form[(i, j)] * scale[j]);
    if scaled.iter().any(|a| !a.is_finite()) {
        return DVector::from_element(work.len(), f64::NAN);
    }
    let eigen = scaled.symmetric_eigen();
    let right = eigen.eigenvectors.transpose() * work.component_mul(&scale);
    // a combination that loses half of the digits to cancellation is ignored
    let inverse =
        |k: usize| if eigen.eigenvalues[k] > f64::EPSILON.sqrt() { right[k] / eigen.eigenvalues[k] } else { 0.0 };
    let inner = DVector::from_fn(work.len(), |k, _| inverse(k));
    (eigen.eigenvectors * inner).component_mul(&scale)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_best_trial_is_a_combination() {
        let form = DMatrix::from_row_slice(2, 2, &[2.0, 1.0, 1.0, 3.0]);
        let work = DVector::from_row_slice(&[1.0, -4.0]);
        let x = best(&form, &work);
        assert!((&form * &x - &work).norm() < 1e-13);
        // one that is there twice, and one that does nothing
        let form = DMatrix::from_row_slice(3, 3, &[2.0, 2.0, 0.0, 2.0, 2.0, 0.0, 0.0, 0.0, 0.0]);
        let work = DVector::from_row_slice(&[3.0, 3.0, 0.0]);
        assert!((work.dot(&best(&form, &work)) - 4.5).abs() < 1e-13);
    }
}
