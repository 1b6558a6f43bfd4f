//! How far a step of Newton's method goes, and on which lines the laws are resolved.
//!
//! States (c, p) in equilibrium are an affine set, so that those on the way of a step need no solve. A state is off its states (c_q, p_q) on the
//! laws by e = p - p_q = -rho (c - c_q). The step goes to a state c' on the tangents, so that with s = c' - c_q it begins with
//!
//! ```text
//! dc = s + e/rho,   dp = kappa s - e,   dp_q = kappa/(1 + kappa/rho) (dc + dp/rho) = kappa s,   de = dp - dp_q = -e
//! ```
//!
//! and sum omega e^2/rho falls, with any weights and any rho, until a law turns a corner. Where the whole step is no nearer to the laws, a shorter
//! one is. Smoothed laws have no corner.
//!
//! Any slope leads to the same solution. The bodies answer with dp = -S dc between states in equilibrium: the longest waves as stiffly as in the last
//! step, where sum omega dp^2/rho = sum omega dc^2 rho over a pair, the shortest like single nodes. The laws themselves are best resolved with the slopes of the last step. Where
//! they are smoothed, many points move at once, some of which are hardly pressed and some nearly fixed. There the slope is the geometric mean of
//! three stiffnesses: of single nodes, of the bodies in the last step, and of the layer of the point itself (docs/methods.md).

use super::path::{Equilibrium, Path};
use crate::model::Model;
use crate::model::layer::Layer;
use crate::model::rigid::PART;

/// What Newton's method remembers of its steps.
#[derive(Debug, Clone, Default)]
pub(super) struct Progress {
    /// Pressures in equilibrium with the iterate, n; empty before the first.
    pressure: Vec<f64>,
    /// Slopes for each pair after the last step, as multiples of [`meeting_slopes`](crate::model::surface::meeting_slopes); empty before the second.
    answer: Vec<f64>,
    /// The way out of slow convergence.
    pub path: Path,
}

/// How often a step is halved: to less than a hundredth. From 3 to 14 times 4000 random scenes took the same number of steps within a per cent
/// (docs/methods.md).
const HALVINGS: i32 = 7;

impl Progress {
    /// Return the stiffnesses with which the bodies answered the last step, n, of meeting slopes `unit`, n.
    pub fn answers(&self, model: &Model, unit: &[f64]) -> Vec<f64> {
        let mut answers = unit.to_vec();
        for (pair, answer) in self.answer.iter().enumerate() {
            answers[model.range(pair)].iter_mut().for_each(|slope| *slope *= answer);
        }
        answers
    }

    /// Return rho, n: the slopes on which laws are resolved after a step from `states`, of meeting slopes `unit`, n.
    pub fn slopes(&self, model: &Model, unit: &[f64], states: &Layer) -> Vec<f64> {
        let mut slopes = self.answers(model, unit);
        if !states.smoothing.is_empty() {
            let nodes_and_layers = unit.iter().zip(&states.tangent);
            slopes
                .iter_mut()
                .zip(nodes_and_layers)
                .for_each(|(slope, (&node, &layer))| *slope = mean(*slope, node, layer));
        }
        slopes
    }

    /// Keep how the bodies answered a step that changed compressions and pressures by dc and dp, n each, of equilibrium.
    fn observe(&mut self, model: &Model, unit: &[f64], dc: &[f64], dp: &[f64]) {
        self.answer.resize(model.pairs.len(), 1.0);
        for (pair, answer) in self.answer.iter_mut().enumerate() {
            let (mut pressures, mut compressions) = (0.0, 0.0);
            for q in model.range(pair).filter(|&q| unit[q] < f64::INFINITY) {
                pressures += model.weight[q] * dp[q].powi(2) / unit[q];
                compressions += model.weight[q] * dc[q].powi(2) * unit[q];
            }
            let stiffness = (pressures / compressions).sqrt();
            if stiffness.is_finite() {
                // softer are motions of whole bodies, which `fit` finds
                *answer = stiffness.clamp(PART, PART.recip());
            }
        }
    }

    /// Return the length of a step from compressions `from`, known but for their `roundoff`, to the state (c, p), n each: the part of the way that comes no
    /// farther from the laws with the smoothing of `states`, from which the step is taken. Meeting slopes are `unit`.
    pub fn step_length(
        &mut self,
        model: &Model,
        unit: &[f64],
        states: &Layer,
        [[from, roundoff], [c, p]]: [[&[f64]; 2]; 2],
    ) -> f64 {
        if self.pressure.is_empty() {
            return 1.0;
        }
        let change = |from: &[f64], to: &[f64]| to.iter().zip(from).map(|(to, from)| to - from).collect::<Vec<f64>>();
        self.observe(model, unit, &change(from, c), &change(&self.pressure, p));
        let rho = &self.slopes(model, unit, states)[..];
        let off = |t: f64| {
            let (compression, pressure) = (&between(from, c, t)[..], &between(&self.pressure, p, t)[..]);
            Equilibrium { compression, roundoff, pressure, rho }.distance(model, &states.smoothing)
        };
        let here = off(0.0);
        let mut lengths = (0..HALVINGS).map(|halvings| 0.5f64.powi(halvings));
        let length = lengths.find(|&t| off(t) <= here).unwrap_or(0.5f64.powi(HALVINGS));
        self.path.note(length, !states.smoothing.is_empty());
        length
    }

    /// Return the pressures this part of the way to `pressure`, n, which are those of the iterate from now on.
    pub fn go(&mut self, length: f64, pressure: Vec<f64>) -> Vec<f64> {
        self.pressure = if length < 1.0 { between(&self.pressure, &pressure, length) } else { pressure };
        self.pressure.clone()
    }
}

/// Return the geometric mean of stiffnesses of the bodies, of a node and of a smoothed layer, as far as there are such: a layer at an infinite gap has none.
fn mean(bodies: f64, node: f64, layer: f64) -> f64 {
    let both = (bodies * node).sqrt();
    if layer > 0.0 { both.powf(2.0 / 3.0) * layer.cbrt() } else { both }
}

fn between(from: &[f64], to: &[f64], t: f64) -> Vec<f64> {
    from.iter().zip(to).map(|(from, to)| from + t * (to - from)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::sample::two_pairs;

    /// Points with p = 4 c and p = c^2, n = 4: a step to the laws goes all the way, one that goes far beyond a part of it, one away from the laws almost
    /// none of it.
    #[test]
    fn a_step_goes_as_far_as_it_comes_nearer() {
        let model = two_pairs();
        let rho = [2.0, 0.5, 0.25, 3.0];
        let (from, start, exact) = ([0.5, 0.5, 1.0, 1.0], [2.0, 4.0, 1.0, 1.0], [0.0; 4]);
        let length = |progress: &mut Progress, rho: &[f64; 4], roundoff: &[f64; 4], c: &[f64; 4], p: &[f64; 4]| {
            progress.step_length(&model, rho, &Layer::default(), [[&from, roundoff], [c, p]])
        };
        let begin = || Progress { pressure: start.to_vec(), ..Progress::default() };
        let mut progress = Progress::default();
        // the first step has no pressures to begin with
        assert_eq!(length(&mut progress, &rho, &exact, &[9.0; 4], &[0.0; 4]), 1.0);
        assert_eq!(progress.go(1.0, start.to_vec()), start);
        // the second point is on p = 4 c then
        assert_eq!(length(&mut progress, &rho, &exact, &[0.5, 0.75, 1.0, 1.0], &[2.0, 3.0, 1.0, 1.0]), 1.0);
        // from p = 4 to p = -4 where the law has 6
        let (to, pressure) = ([0.5, 1.5, 1.0, 1.0], [2.0, -4.0, 1.0, 1.0]);
        assert_eq!(length(&mut begin(), &rho, &exact, &to, &pressure), 0.25);
        // points without stiffness on either side, whose compression may be exact, have none
        assert_eq!(length(&mut begin(), &[f64::INFINITY, 0.5, 0.25, 3.0], &exact, &to, &pressure), 0.25);
        // no distance is left beyond compressions known to -+ 100
        assert_eq!(length(&mut begin(), &rho, &[1e2; 4], &to, &pressure), 1.0);
        assert_eq!(begin().go(0.25, pressure.to_vec()), [2.0, 2.0, 1.0, 1.0]);
        let away = length(&mut begin(), &rho, &exact, &[0.5, -9.0, 1.0, 1.0], &[2.0, 99.0, 1.0, 1.0]);
        assert_eq!(away, 0.5f64.powi(7));
    }

    /// What a pair's points answered together, beside their own stiffness; nothing counts as a millionth. With smoothed laws, the geometric mean of both
    /// and the stiffness of the layer, where it has one.
    #[test]
    fn lines_are_as_steep_as_the_bodies_answer() {
        let (model, unit) = (two_pairs(), [2.0, 8.0, 1.0, 1.0]);
        // 3 times the stiffness of both points
        let (dc, dp) = ([1.0, -0.5, 1.0, 0.0], [-6.0, 12.0, 0.0, 0.0]);
        let [w, v] = [model.weight[0], model.weight[1]];
        let times = ((w * 36.0 / 2.0 + v * 144.0 / 8.0) / (w * 2.0 + v * 0.25 * 8.0)).sqrt();
        let mut progress = Progress::default();
        progress.observe(&model, &unit, &dc, &dp);
        let smoothed = Layer { tangent: vec![27.0, 0.0, 1.0, 1e-3], smoothing: vec![1.0; 4], ..Layer::default() };
        let expected = [
            (Layer::default(), [2.0 * times, 8.0 * times, 1e-6, 1e-6]),
            (smoothed, [3.0 * (4.0 * times).cbrt(), 8.0 * times.sqrt(), 1e-2, 1e-3]),
        ];
        for (states, expected) in expected {
            let slopes = progress.slopes(&model, &unit, &states);
            assert!(slopes.iter().zip(expected).all(|(s, e)| (s - e).abs() < 1e-14 * e), "{slopes:?} {expected:?}");
        }
    }
}
