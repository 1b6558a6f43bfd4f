//! The linear step of Newton's method: its springs, and the forcing term, which says how well an iterative solver
//! solves it.

use super::bound::{Scale, contact_energy, surface_energy};
use crate::error::Result;
use crate::model::Model;
use crate::model::field::DisplacementField;
use crate::model::layer::{Layer, surface_slopes};
use crate::model::linear::{LinearStep, Solved, System, Trial};
use crate::model::motions::Motions;
use std::collections::VecDeque;

/// Iterations over which the change of the pressures estimates their error before these iterations, as the gain of
/// energy does (Hestenes and Stiefel, 1952); the error after them is several times smaller. Tried were 2, 3 and 4
/// iterations and shares of 0.1 to 1 of the distance from the laws, on 13 scenes of spheres, grooves, a flange and
/// rollers. Three iterations and the whole distance took the fewest iterations among those that needed no more steps
/// than exact ones.
const DELAY: usize = 3;

/// The stopping test of a linear step.
///
/// The forcing rule: an inexact linear step of Newton's method ends when the error of the linear solver is small
/// compared with the distance from the laws (Ern and Vohralík, Adaptive inexact Newton methods, 2013). Both are known
/// after each iteration of the linear solver.
pub(super) struct Forcing<'a> {
    /// Layer states from which the step is taken.
    layer: &'a Layer,
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
    /// Return the test for the step from these layer states and compressions (n), in a run that ends at a tolerance, by
    /// a solver with this [`roughest`](crate::model::linear::LinearStep::roughest) step.
    pub fn new(
        layer: &'a Layer,
        before: Vec<f64>,
        rho: &'a [f64],
        (tolerance, scale): (f64, &'a Scale),
        roughest: f64,
    ) -> Self {
        Self { layer, rho, tolerance, scale, roughest, pressures: VecDeque::from([layer.linear(&before)]), before }
    }

    /// Whether a step is solved well enough: the pressures change by less than their distance from the laws, or by less
    /// than the error that ends the run.
    pub fn is_enough(&mut self, model: &Model, trial: &Trial) -> bool {
        let c: Vec<f64> = self.before.iter().zip(trial.closing).map(|(c, closing)| c + closing).collect();
        let p = self.layer.linear(&c);
        let resolved = Layer::resolve(model, &c, &p, self.rho, &self.layer.smoothing);
        let (mut change, mut largest_change, mut distance, mut peak) = (0.0, 0.0f64, 0.0, 0.0f64);
        for (q, old) in self.pressures[0].iter().enumerate() {
            let here = (p[q] - old).abs();
            change += model.area[q] * here;
            distance += model.area[q] * (p[q] - resolved.pressure[q]).abs();
            (largest_change, peak) = (largest_change.max(here), peak.max(resolved.pressure[q].abs()));
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

/// Return the response w of the bodies and their layers to small loads r, (K + B' diag(omega kappa) B) w = r, and its
/// squared energy norm. The layers are in the states `layer`. `loads` is r, one entry per dof of each body that lives
/// on this rank. The relative error of w may be `share`.
pub fn respond(
    model: &mut Model,
    step: &mut dyn LinearStep,
    layer: &Layer,
    loads: &[Vec<f64>],
    share: f64,
) -> Result<Solved<(DisplacementField, f64)>> {
    let (mut residual, mut work) = (Vec::new(), [0.0]);
    for (slot, load) in model.bodies.iter_mut().zip(loads) {
        let count = if slot.is_rigid { slot.local.as_ref().map_or(0, |_| slot.free) } else { 0 };
        if count > 0 {
            residual.push(vec![0.0; count]);
            continue;
        }
        let (force, inside) = slot.local.as_mut().map(|body| body.reduce(load)).transpose()?.unwrap_or_default();
        residual.push(force);
        work[0] += inside;
    }
    model.exchange.sum(&mut work);
    let springs = resisting(model, layer);
    let mut enough = |_: &Model, trial: &Trial| trial.is_within(share);
    let system = System { model, layer, springs: &springs.all, residual: &residual, enough: &mut enough };
    Ok(step.solve(system)?.map(|solution| (solution.field, solution.energy + work[0])))
}

/// Stiffness, as a share of the springs of whole surfaces, that resists motions which no closed contact resists: such
/// motions then go far, but not without end. How far is not what this share decides: where these springs carry a force,
/// a descent chooses the length of the step. With 1e-2 and 1e-4, 120 random scenes, usual, wide and slender, take the
/// same steps.
const STAND_IN: f64 = 1e-3;

/// The springs of a linear step.
pub struct Springs {
    /// omega kappa, with those that were added, n.
    pub all: Vec<f64>,
    /// Those that stand in for a contact, which resists the motions of bodies together only when it has closed, n.
    pub added: Vec<f64>,
}

/// Return the springs omega kappa of a linear step from `layer`, n, with one more for every rigid motion of the bodies
/// together that is otherwise unresisted: a contact that is still open may stop it.
///
/// The additional spring is at one point, and nowhere else. Forces may be in balance on the motion, for example where
/// bodies rest and could turn about the closed points. Then a single spring carries nothing, and the step is exact;
/// several springs would carry forces. Of the points that the motion closes at least half as much as any, it is that of
/// the least gap: over a wide one it would tie the body to another that a support carries along.
pub fn resisting(model: &Model, layer: &Layer) -> Springs {
    let (motions, mut all, mut added) = (Motions::of(model), layer.springs(model), vec![0.0; model.points()]);
    // compared with a new spring, softer ones may be rounding, so that another motion is unresisted
    for _ in 0..motions.count() {
        let mut free = motions.springs(&all).factor().kernel();
        if free.is_empty() {
            break;
        }
        let surfaces: Vec<f64> =
            surface_slopes(model).iter().zip(&model.area).map(|(slope, area)| slope * area).collect();
        while let Some(motion) = free.pop() {
            let closing = motions.closing(&motion);
            let half = 0.5 * closing.iter().fold(0.0, |most: f64, s| most.max(s.abs()));
            let near = |p: &usize, q: &usize| layer.compression[*p].total_cmp(&layer.compression[*q]);
            let Some(at) = (0..closing.len()).filter(|&q| closing[q].abs() >= half).max_by(near) else {
                break;
            };
            let shares = closing.iter().map(|s| (s / closing[at]).powi(2));
            let spring = STAND_IN * shares.zip(&surfaces).map(|(share, surface)| share * surface).sum::<f64>();
            all[at] += spring;
            added[at] += spring;
            // take this motion out of the others, so that they close nothing at that point
            for other in &mut free {
                let share = motions.closing(other)[at] / closing[at];
                other.axpy(-share, &motion, 1.0);
            }
        }
    }
    Springs { all, added }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::sample::two_pairs;

    /// Steps of two points with p = 4 c and two with p = c^2; one of these opens.
    #[test]
    fn a_step_ends_when_pressures_have_settled() {
        let model = two_pairs();
        let layer = Layer::new(&model, vec![0.5, 1.0, 2.0, 1.0]);
        let (rho, scale, half) = ([2.0, 0.5, 0.25, 3.0], Scale::default(), f64::EPSILON.sqrt());
        let asked = |closings: &[[f64; 4]], tolerance: f64, error: f64| -> Vec<bool> {
            let mut forcing = Forcing::new(&layer, layer.compression.clone(), &rho, (tolerance, &scale), 0.5);
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
