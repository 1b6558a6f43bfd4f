//! One last look: forces summed anew from the displacements of a result say whether it is as good as its run thought.
//!
//! Nothing of the solvers is used: r = f - K u - B' omega p goes over the cells. How much energy r is worth,
//!
//! ```text
//! |r|^2 = r' H^-1 r >= (r'v)^2 / v'H v       for every v,      H = K + B' omega kappa B,
//! ```
//!
//! is bounded below by displacements v that no solver makes: what the force on each node alone would make, and what those on hats of coarser and coarser grids
//! would (docs/theory.md).

use super::ended::{All, Look, Recovered};
use super::stages::Done;
use crate::ddm::linear::resisting;
use crate::ddm::{Inaccuracy, Row, Status, Whose};
use crate::discretize::Unbalanced;
use crate::exchange::share;
use crate::linalg::axpy;
use crate::model::BodySlot;
use nalgebra::{DMatrix, DVector};
use std::time::Instant;

/// Displacements that are tried: of nodes, of hats with and without contact springs.
const TRIALS: usize = 3;

/// Runs know their errors in norms of their own, or, where they end by increments of displacements, by the error of the mesh or by rounding, by estimates from
/// few steps. Ten times what they saw is believed: an error of the mesh is ten times the one that it lets a run end with.
const ROUGHLY: f64 = 10.0;

/// Relative error beyond which a number has no correct digit: a run that rounding ended there has found nothing.
const ONE_DIGIT: f64 = 0.1;

/// Looks at a result in the units of its model, and takes the name of a solution from one whose error is larger than was asked for and than ten times what the run
/// thought. Collective.
pub fn look(done: &mut Done, recovered: &All) {
    let is_solved = done.outcome.status.is_solved();
    if !is_solved && done.outcome.status != Status::IterationLimit {
        return;
    }
    let began = Instant::now();
    let energy = Energy::of(done, recovered);
    let (reached, pair) = done.outcome.reached(done.model(), energy.strain, energy.unbalanced);
    let whose = pair.map_or(Whose::Body(energy.most), Whose::Pair);
    let told = done.outcome.rows.last().map_or(0.0, told);
    let found = reached.worst();
    let asked = done.built.scene.method.stop.residual.unwrap_or(0.0);
    // forces count beyond their rounding: those that the layers' compressions can have from rounding are left
    let is_rounding = reached.error <= asked || done.outcome.is_rounding(energy.unbalanced);
    let rounding = done.outcome.rounding;
    // the report states what rounding makes of pressures by itself
    let allowed = asked.max(ROUGHLY * told).max(rounding);
    let is_seen = found <= allowed && is_rounding;
    let ended = if done.outcome.status == Status::RoundoffLimited { told } else { 0.0 };
    let lost = ended.max(rounding);
    // NaN is seen by nobody
    if is_solved && !is_seen {
        done.outcome.status = Status::Inaccurate(Inaccuracy { told, found, whose });
    } else if is_solved && lost > ONE_DIGIT {
        done.outcome.status = Status::Inaccurate(Inaccuracy { told, found: lost, whose: Whose::Rounding });
    }
    done.look = Some(Look { reached, whose, seconds: began.elapsed().as_secs_f64() });
}

/// The error that a run thought to have.
fn told(row: &Row) -> f64 {
    [row.residual, row.error].into_iter().filter(|error| error.is_finite()).fold(0.0, f64::max)
}

/// Energies of a result.
struct Energy {
    /// u'Ku over all bodies.
    strain: f64,
    /// Energy norm of what the forces lack in balance, at least.
    unbalanced: f64,
    /// The body with the most of it.
    most: usize,
}

impl Energy {
    /// Measure the result of a run. Collective.
    fn of(done: &Done, recovered: &All) -> Self {
        let (discrete, model) = (&done.built.discrete, done.model());
        let layer = &done.outcome.layer;
        let springs = resisting(model, layer.springs(model));
        let found = |body: usize| match &recovered[body] {
            Some(Ok(Recovered { bent, .. })) => {
                let at = |values: &[f64]| model.at_rows(body, values);
                Some(discrete.bodies[body].post().unbalanced(bent, &at(&layer.force), &at(&springs)))
            }
            // its solver failed: not a number
            Some(Err(_)) => Some(Unbalanced::unknown()),
            None => None,
        };
        let found: Vec<Option<Unbalanced>> = (0..model.bodies.len()).map(found).collect();
        let hats = Self::hats(done, &found);
        // work of all bodies on the trials, products of the trials, strain, traces of each trial
        let (bodies, points) = (model.bodies.len(), model.points());
        let mut sums = vec![0.0; TRIALS * bodies + TRIALS * TRIALS + 1 + TRIALS * 2 * points];
        let (works, rest) = sums.split_at_mut(TRIALS * bodies);
        let (products, rest) = rest.split_at_mut(TRIALS * TRIALS);
        let (strain, traces) = rest.split_at_mut(1);
        for (body, (found, hats)) in found.iter().zip(&hats).enumerate() {
            let Some(found) = found else { continue };
            strain[0] += found.strain;
            if found.force.is_empty() {
                continue;
            }
            let post = discrete.bodies[body].post();
            let rough = near(&model.bodies[body], post.rough(found));
            let trials = [rough, post.smooth(hats, true), post.smooth(hats, false)];
            axpy(1.0, &post.products(&trials), products);
            for (k, trial) in trials.iter().enumerate() {
                works[TRIALS * body + k] = crate::linalg::dot(&found.force, trial);
                let trace = &mut traces[2 * points * k..2 * points * (k + 1)];
                model.put(body, &post.trace(trial), trace);
            }
        }
        model.exchange.sum(&mut sums);
        let (works, rest) = sums.split_at(TRIALS * bodies);
        let (products, rest) = rest.split_at(TRIALS * TRIALS);
        let (strain, traces) = rest.split_at(1);
        let mut form = DMatrix::from_row_slice(TRIALS, TRIALS, products);
        let closing = |k: usize, q: usize| traces[2 * points * k + q] + traces[2 * points * k + points + q];
        for (q, spring) in springs.iter().enumerate().filter(|(_, spring)| **spring > 0.0) {
            let closing: [f64; TRIALS] = std::array::from_fn(|k| closing(k, q));
            for i in 0..TRIALS {
                (0..TRIALS).for_each(|j| form[(i, j)] += spring * closing[i] * closing[j]);
            }
        }
        let work = DVector::from_fn(TRIALS, |k, _| (0..bodies).map(|body| works[TRIALS * body + k]).sum());
        let shares = best(&form, &work);
        let of_body = |body: usize| (0..TRIALS).map(|k| shares[k] * works[TRIALS * body + k]).sum::<f64>();
        let most = (0..bodies).max_by(|&a, &b| of_body(a).total_cmp(&of_body(b))).unwrap_or(0);
        let squared = work.dot(&shares);
        // rounding can make a tiny one negative
        let unbalanced = if squared <= 0.0 { 0.0 } else { squared.sqrt() };
        Self { strain: strain[0], unbalanced, most }
    }

    /// Forces on the hats of each body, of all ranks together; empty where nothing of the body is here. Collective.
    fn hats(done: &Done, found: &[Option<Unbalanced>]) -> Vec<Vec<f64>> {
        let bodies = &done.built.discrete.bodies;
        let of_body = |(info, found): (&crate::discretize::BodyInfo, &Option<Unbalanced>)| match found {
            Some(found) if !found.force.is_empty() => info.post().on_hats(found),
            _ => Vec::new(),
        };
        let mine: Vec<Vec<f64>> = bodies.iter().zip(found).map(of_body).collect();
        let mut ranks = share(&*done.model().exchange, mine).into_iter();
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
}

/// Fill in the values of a field at ghost nodes from the ranks that own them. Collective where the nodes of the body are distributed.
fn near(slot: &BodySlot, field: Vec<f64>) -> Vec<f64> {
    match slot.local.as_ref().and_then(|body| body.distribution()) {
        Some(distribution) => distribution.near(&distribution.of_known(&field)),
        None => field,
    }
}

/// The combination x of trials with the largest (w'x)^2 / x'A x: A x = w, up to trials that are the same to rounding.
fn best(form: &DMatrix<f64>, work: &DVector<f64>) -> DVector<f64> {
    let scale = DVector::from_fn(work.len(), |k, _| if form[(k, k)] > 0.0 { form[(k, k)].sqrt().recip() } else { 0.0 });
    let scaled = DMatrix::from_fn(work.len(), work.len(), |i, j| scale[i] * form[(i, j)] * scale[j]);
    if scaled.iter().any(|a| !a.is_finite()) {
        return DVector::from_element(work.len(), f64::NAN);
    }
    let eigen = scaled.symmetric_eigen();
    let right = eigen.eigenvectors.transpose() * work.component_mul(&scale);
    // of trials that differ by half of the digits no more is known
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
