//! How far inexact linear steps of Newton's method are solved: until what the linear solver leaves is small beside what the laws leave
//! (Ern and Vohralík, Adaptive inexact Newton methods, 2013). Both are known after each iteration of the linear solver.

use super::bound::{contact_energy, surface_energy};
use super::scale::Scale;
use crate::model::Model;
use crate::model::layer::Layer;
use crate::model::linear::Trial;
use std::collections::VecDeque;

/// Iterations over which the change of the pressures estimates their error before them, as the gain of energy does (Hestenes and Stiefel,
/// 1952): what is left after them is some times less. Of 2, 3 and 4, a share of 0.1 to 1 of the laws' distance, and 13 scenes of spheres,
/// grooves, a flange and rollers, 3 and all of it took the fewest iterations among those that needed no more steps than exact ones.
const DELAY: usize = 3;

/// When a linear step ends.
pub(super) struct Forcing<'a> {
    places: &'a Layer,
    /// Slopes on which places are met, n.
    rho: &'a [f64],
    /// Relative error that ends the run, or half the digits if none does, and what it refers to.
    tolerance: f64,
    scale: &'a Scale,
    /// Error of the step, as a share of it, above which it does not end.
    roughest: f64,
    /// Compressions before the step, n.
    before: Vec<f64>,
    /// Pressures of the last iterations, n each.
    pressures: VecDeque<Vec<f64>>,
}

impl<'a> Forcing<'a> {
    /// For the step from places and compressions (n) in a run that ends at a tolerance, by a solver with this
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

    /// Whether a step is solved well enough: the pressures have settled beside their distance from the laws, or beside the error by which
    /// the run ends.
    pub fn is_enough(&mut self, model: &Model, trial: &Trial) -> bool {
        let c: Vec<f64> = self.before.iter().zip(trial.closing).map(|(c, closing)| c + closing).collect();
        let p = self.places.linear(&c);
        let met = Layer::resolve(model, &c, &p, self.rho, &self.places.smoothing);
        let (mut moved, mut most, mut apart, mut peak) = (0.0, 0.0f64, 0.0, 0.0f64);
        for (q, old) in self.pressures[0].iter().enumerate() {
            let change = (p[q] - old).abs();
            moved += model.weight[q] * change;
            apart += model.weight[q] * (p[q] - met.pressure[q]).abs();
            (most, peak) = (most.max(change), peak.max(met.pressure[q]));
        }
        // an error that is small beside the energy of the bodies may be large for the pressures of stiff layers
        let ends = || {
            let energy = contact_energy(model, &met);
            most <= self.tolerance * peak
                && trial.error <= 0.5 * self.tolerance * energy.sqrt()
                && self.scale.imbalance(model, &model.forces(&p), surface_energy(model, &met)) <= self.tolerance
        };
        let settled = moved < apart || ends();
        let enough = trial.is_within(if settled { self.roughest } else { f64::EPSILON });
        if self.pressures.len() == DELAY {
            self.pressures.pop_front();
        }
        self.pressures.push_back(p);
        enough
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::sample::two_pairs;

    /// Steps of two points with p = 4 c and two with p = c^2, of which one opens.
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
        // pressures that move by more than they are off
        let moving = [[0.0, 0.0, 0.2, 0.0], [0.0, 0.0, 0.4, 0.0], [0.0, 0.0, 0.6, 0.0], [0.0, 0.0, 0.8, 0.0]];
        assert_eq!(asked(&moving, half, 0.1), [false; 4]);
        // the first pair is linear: nothing is off, and only the tolerance of the run ends the step
        let linear = [0.1, 0.0, 0.0, 0.0];
        assert_eq!(asked(&[linear; 5], half, 0.1), [false; 5]);
        let contact = contact_energy(&model, &Layer::new(&model, vec![0.6, 1.0, 2.0, 1.0])).sqrt();
        assert_eq!(asked(&[linear; 5], 0.01, 0.0049 * contact), [false, false, false, true, true]);
        assert_eq!(asked(&[linear; 5], 0.01, 0.0051 * contact), [false; 5]);
        // rounding
        assert_eq!(asked(&[linear; 1], half, 1e-16), [true]);
    }
}
