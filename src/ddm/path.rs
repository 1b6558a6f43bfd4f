//! The remedy for slow convergence: a path of smoothed laws.
//!
//! Where slender bodies peel off each other, the contact moves by about one point a step, however Newton's method begins. Laws smoothed by an
//! energy per area mu ([`resolve`](crate::contact::law::resolve)) have no corner, so that many points move at once. In equilibrium with smoothed
//! laws, the duality gap is at most mu times the area. As mu falls, the states follow the central path of interior-point methods to the laws
//! themselves.
//!
//! mu is measured by the squared distance e^2/rho of states in equilibrium from the laws, which is an energy per area, too. D, its mean over all
//! points, shows how far Newton's method has come.
//!
//! ```text
//! enter    at the second step with the laws themselves that is not taken whole:  mu = 100 D
//! step     mu <- min(mu, D),  D from the smoothed laws: mu stays while the states are far, and falls as fast as Newton's method converges
//! lost     mu <- D where D is more than 100 mu
//! leave    when mu times the area is below what the tolerance of the run can detect
//! ```

use crate::model::Model;
use crate::model::layer::Layer;

/// Steps of the laws themselves that are not taken whole before the laws are smoothed. With one, 58 slender scenes took 335 steps, with two 321, both with an
/// earlier rule for the fall of mu.
const SHORTENED: usize = 2;

/// Ratio of mu at the beginning to the mean squared distance D of the states, and of D to mu where the path is lost. D counts the mismatch of
/// few points, while the contact is far from its final place. With ratios from 30 to 300, peeling beams with linear layers took the same number of steps within one; with 1 they took nine
/// times as many. Without the way back a block that leans on its edge runs in a cycle of whole steps, with D from 20 to 3e5 mu (docs/methods.md).
const AHEAD: f64 = 100.0;

/// The state of a run's paths.
#[derive(Debug, Clone, Default)]
pub(super) struct Path {
    /// Steps with the laws themselves that were not taken whole, since the last path.
    shortened: usize,
    /// Steps taken with smoothed laws.
    pub steps: usize,
}

/// A state in equilibrium, with the slopes of the lines on which the laws are resolved, n each.
#[derive(Clone, Copy)]
pub(super) struct Equilibrium<'a> {
    /// c.
    pub compression: &'a [f64],
    /// Error of c by roundoff.
    pub roundoff: &'a [f64],
    /// p.
    pub pressure: &'a [f64],
    /// rho.
    pub rho: &'a [f64],
}

impl Equilibrium<'_> {
    /// Return sum omega e^2/rho with e = p - p_q: the squared distance from the laws with this smoothing. Components of e below the roundoff level
    /// are ignored, so that states that differ by roundoff have the same distance.
    pub fn distance(&self, model: &Model, smoothing: &[f64]) -> f64 {
        let Self { compression, roundoff, pressure, rho } = *self;
        let resolved = Layer::resolve(model, compression, pressure, rho, smoothing);
        let known = |q: usize| rho[q] * roundoff[q] + f64::EPSILON * (pressure[q].abs() + resolved.pressure[q]);
        // `clamp` keeps NaN, which is not nearer than any distance
        let difference = |q: usize| ((pressure[q] - resolved.pressure[q]).abs() - known(q)).clamp(0.0, f64::INFINITY);
        let squared = |q: usize| model.weight[q] * difference(q).powi(2) / rho[q];
        // on a line of infinite slope the state is that at c itself
        (0..model.points()).filter(|&q| rho[q] < f64::INFINITY).map(squared).sum()
    }
}

impl Path {
    /// Note a step of this length with or without smoothing.
    pub fn note(&mut self, length: f64, is_smoothed: bool) {
        self.steps += usize::from(is_smoothed);
        self.shortened += usize::from(length < 1.0 && !is_smoothed);
    }

    /// Return mu of the next step at each point, n, after a step to `state` with `smoothing`; empty for the laws themselves. Smoothing below the energy
    /// `unseen` does not change the result any more.
    pub fn smoothing(&mut self, model: &Model, state: &Equilibrium, smoothing: &[f64], unseen: f64) -> Vec<f64> {
        let enters = smoothing.is_empty();
        if enters && self.shortened < SHORTENED {
            return Vec::new();
        }
        self.shortened = 0;
        let area: f64 = model.weight.iter().sum();
        let distance = state.distance(model, smoothing) / area;
        let mu = match smoothing.first() {
            None => AHEAD * distance,
            Some(mu) if distance > AHEAD * mu => distance,
            Some(mu) => mu.min(distance),
        };
        // without a finite distance there is no smoothing
        if mu * area > unseen && mu.is_finite() { vec![mu; model.points()] } else { Vec::new() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::sample::two_pairs;

    /// Points with p = 4 c and p = c^2, n = 4: the path begins at the second shortened step with 100 times the mean distance, falls with it,
    /// rises where the distance is more than 100 times as large, and ends where nobody sees it.
    #[test]
    fn smoothing_follows_the_distance() {
        let model = two_pairs();
        let (rho, exact) = ([2.0, 0.5, 0.25, 3.0], [0.0; 4]);
        let state =
            |pressure| Equilibrium { compression: &[0.5, 0.5, 1.0, 1.0], roundoff: &exact, pressure, rho: &rho };
        let off = state(&[2.0, 4.0, 1.0, 1.0]);
        // the line through (0.5, 4) of slope -1/2 meets p = 4 c at c = 8.5/9... and p = 34/9
        let e = 4.0 - 4.0 * (0.5 + 8.0) / 9.0;
        let distance = 2.0 * e * e / 0.5;
        assert!((off.distance(&model, &[]) - distance).abs() < 1e-14);
        let mut path = Path::default();
        path.note(0.5, false);
        assert!(path.smoothing(&model, &off, &[], 0.0).is_empty());
        path.note(1.0, false);
        assert!(path.smoothing(&model, &off, &[], 0.0).is_empty());
        path.note(0.25, false);
        let mu = path.smoothing(&model, &off, &[], 0.0);
        let area: f64 = model.weight.iter().sum();
        assert!(mu.iter().all(|mu| (mu - 100.0 * distance / area).abs() < 1e-12), "{mu:?}");
        path.note(1.0, true);
        assert_eq!(path.smoothing(&model, &state(&[2.0, 40.0, 1.0, 1.0]), &mu, 0.0), mu);
        let lost = state(&[2.0, 1e4, 1.0, 1.0]);
        let risen = path.smoothing(&model, &lost, &mu, 0.0);
        assert!(risen.iter().all(|&risen| risen == lost.distance(&model, &mu) / area && risen > 100.0 * mu[0]));
        let smoothed = Layer::resolve(&model, &[0.5, 0.5, 1.0, 1.0], &[2.0, 4.0, 1.0, 1.0], &rho, &mu);
        let on = Equilibrium { compression: &smoothed.compression, pressure: &smoothed.pressure, ..off };
        assert!(path.smoothing(&model, &on, &mu, 1e-20).is_empty());
        assert_eq!((path.steps, path.shortened), (1, 0));
    }
}
