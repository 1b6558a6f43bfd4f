//! How far a step of Newton's method goes, and on which lines the laws are resolved.
//!
//! States (c, p) in equilibrium are an affine set, so that those on the way of a step need no solve. A state is off its
//! states (c_q, p_q) on the laws by e = p - p_q = -rho (c - c_q). The step goes to a state c' on the tangents, so that
//! with s = c' - c_q it begins with
//!
//! ```text
//! dc = s + e/rho,   dp = kappa s - e,   dp_q = kappa/(1 + kappa/rho) (dc + dp/rho) = kappa s,   de = dp - dp_q = -e
//! ```
//!
//! and sum omega e^2/rho falls, with any weights and any rho, until a law turns a corner. Where the whole step is no
//! nearer to the laws, a shorter one is. Smoothed laws have no corner.
//!
//! Any slope leads to the same solution. The bodies answer with dp = -S dc between states in equilibrium: the longest
//! waves as stiffly as in the last step, where sum omega dp^2/rho = sum omega dc^2 rho over a pair, the shortest like
//! single nodes. The laws themselves are best resolved with the slopes of the last step. Where they are smoothed, many
//! points move at once, some of which are hardly pressed and some nearly fixed. There the slope is the geometric mean
//! of three stiffnesses: of single nodes, of the bodies in the last step, and of the layer of the point itself.

use crate::model::Model;
use crate::model::layer::{Layer, meeting_slopes};
use crate::model::motions::PART;

/// What Newton's method remembers of its steps.
#[derive(Debug, Clone, Default)]
pub(super) struct Progress {
    /// Slopes rho as long as no step has shown how the bodies answer, n.
    unit: Vec<f64>,
    /// Pressures in equilibrium with the iterate, n; empty before the first.
    pressure: Vec<f64>,
    /// Slopes for each pair after the last step, as multiples of
    /// [`meeting_slopes`](crate::model::layer::meeting_slopes); empty before the second.
    answer: Vec<f64>,
    /// The way out of slow convergence.
    pub path: Path,
}

/// How often a step is halved: to less than a hundredth. From 3 to 14 times 4000 random scenes took the same number of
/// steps within a per cent.
const HALVINGS: i32 = 7;

/// Share of a step's length by which the squared distance from the laws must fall (Armijo's rule with its usual
/// constant). Of 540 random scenes all had the same histories as with zero.
const ARMIJO: f64 = 1e-4;

/// The part of a linear step that is taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct StepLength {
    /// 1 for a whole step.
    pub length: f64,
    /// Ratio of the squared distance from the laws at its end to that at its beginning; 1 where there is none to
    /// compare with.
    pub fall: f64,
    /// Whether no part of the step comes nearer to the laws, so that the least one is taken.
    pub is_lost: bool,
    /// Whether parts of the step were compared. The first step of a run, and the first after a descent, is taken whole.
    pub is_measured: bool,
}

impl Progress {
    /// Begin a run on a model.
    pub fn new(model: &Model) -> Self {
        Self { unit: meeting_slopes(model), ..Self::default() }
    }

    /// Return the stiffnesses with which the bodies answered the last step, n.
    pub fn answers(&self, model: &Model) -> Vec<f64> {
        let mut answers = self.unit.clone();
        for (pair, answer) in self.answer.iter().enumerate() {
            answers[model.range(pair)].iter_mut().for_each(|slope| *slope *= answer);
        }
        answers
    }

    /// Return rho, n: the slopes on which laws are resolved after a step from `states`.
    pub fn slopes(&self, model: &Model, states: &Layer) -> Vec<f64> {
        let mut slopes = self.answers(model);
        if !states.smoothing.is_empty() {
            let nodes_and_layers = self.unit.iter().zip(&states.tangent);
            slopes
                .iter_mut()
                .zip(nodes_and_layers)
                .for_each(|(slope, (&node, &layer))| *slope = mean(*slope, node, layer));
        }
        slopes
    }

    /// Keep how the bodies answered a step that changed compressions and pressures by dc and dp, n each, of
    /// equilibrium. Points whose dc may be the `roundoff` of c, n, show nothing.
    fn observe(&mut self, model: &Model, dc: &[f64], dp: &[f64], roundoff: &[f64]) {
        let unit = &self.unit;
        self.answer.resize(model.pairs.len(), 1.0);
        for (pair, answer) in self.answer.iter_mut().enumerate() {
            let (mut pressures, mut compressions) = (0.0, 0.0);
            for q in model.range(pair).filter(|&q| unit[q] < f64::INFINITY && dc[q].abs() > 2.0 * roundoff[q]) {
                pressures += model.area[q] * dp[q].powi(2) / unit[q];
                compressions += model.area[q] * dc[q].powi(2) * unit[q];
            }
            let stiffness = (pressures / compressions).sqrt();
            if stiffness.is_finite() {
                // softer are motions of whole bodies, stiffer is rounding
                *answer = stiffness.clamp(PART, PART.recip());
            }
        }
    }

    /// Return the length of a step from the compressions `from`, known to their `roundoff`, to the compressions c and
    /// the pressures p, n each: the part of the way that comes nearer to the laws with the smoothing of `states`, from
    /// which the step is taken.
    pub fn step_length(
        &mut self,
        model: &Model,
        states: &Layer,
        [from, roundoff]: [&[f64]; 2],
        [c, p]: [&[f64]; 2],
    ) -> StepLength {
        if self.pressure.is_empty() {
            return StepLength { length: 1.0, fall: 1.0, is_lost: false, is_measured: false };
        }
        let change = |from: &[f64], to: &[f64]| to.iter().zip(from).map(|(to, from)| to - from).collect::<Vec<f64>>();
        self.observe(model, &change(from, c), &change(&self.pressure, p), roundoff);
        let rho = &self.slopes(model, states)[..];
        let off = |t: f64| {
            let (compression, pressure) = (&between(from, c, t)[..], &between(&self.pressure, p, t)[..]);
            Equilibrium { compression, roundoff, pressure, rho }.distance(model, &states.smoothing)
        };
        let here = off(0.0);
        let mut tried = (0..HALVINGS).map(|halvings| 0.5f64.powi(halvings)).map(|t| (t, off(t)));
        let found = tried.find(|&(t, there)| there <= (1.0 - ARMIJO * t) * here);
        // where F1 cannot fall either, the step is half of the least tried length
        let shortest = 0.5f64.powi(HALVINGS);
        let (length, there) = found.unwrap_or_else(|| (shortest, off(shortest)));
        self.path.note(length, !states.smoothing.is_empty());
        let fall = if here == 0.0 { 1.0 } else { there / here };
        StepLength { length, fall, is_lost: found.is_none(), is_measured: true }
    }

    /// Forget the pressures of the iterate, so that the next step is taken whole.
    pub fn forget_pressure(&mut self) {
        self.pressure.clear();
    }

    /// Return the pressures this part of the way to `pressure`, n, which are those of the iterate from now on.
    pub fn go(&mut self, length: f64, pressure: Vec<f64>) -> Vec<f64> {
        self.pressure = if length < 1.0 { between(&self.pressure, &pressure, length) } else { pressure };
        self.pressure.clone()
    }
}

/// Return the geometric mean of stiffnesses of the bodies, of a node and of a smoothed layer, as far as there are such:
/// a layer at an infinite gap has none.
fn mean(bodies: f64, node: f64, layer: f64) -> f64 {
    let both = (bodies * node).sqrt();
    if layer > 0.0 { both.powf(2.0 / 3.0) * layer.cbrt() } else { both }
}

fn between(from: &[f64], to: &[f64], t: f64) -> Vec<f64> {
    from.iter().zip(to).map(|(from, to)| from + t * (to - from)).collect()
}

/// Steps of the laws themselves that are not taken whole before the laws are smoothed. With one, 58 slender scenes took
/// 335 steps, with two 321.
const SHORTENED: usize = 2;

/// Ratio of mu at the beginning to the mean squared distance D of the states, and of D to mu where the path is lost. D
/// counts the mismatch of few points, while the contact is far from its final place. With ratios from 30 to 300,
/// peeling beams with linear layers took the same number of steps within one; with 1 they took nine times as many.
/// Without the way back a block that leans on its edge runs in a cycle of whole steps, with D from 20 to 3e5 mu.
const AHEAD: f64 = 100.0;

/// The state of a run's paths.
///
/// They are the remedy for slow convergence. Where slender bodies peel off each other, the contact moves by about one
/// point a step, however Newton's method begins. Laws smoothed by an energy per area mu
/// ([`Law::resolve`](crate::contact::law::Law::resolve)) have no corner, so that many points move at once. In
/// equilibrium with smoothed laws, the duality gap is at most mu times the area. As mu falls, the states follow the
/// central path of interior-point methods to the laws themselves.
///
/// mu is measured by the squared distance e^2/rho of states in equilibrium from the laws, which is an energy per area,
/// too. D, its mean over all points, shows how far Newton's method has come.
///
/// ```text
/// enter    at the second step with the laws themselves that is not taken whole:  mu = 100 D
/// step     mu <- min(mu, D),  D from the smoothed laws: mu stays while the states are far, and falls as fast as
///          Newton's method converges
/// lost     mu <- D where D is more than 100 mu
/// leave    when mu times the area is below what the tolerance of the run can detect
/// ```
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
    /// Return sum omega e^2/rho with e = p - p_q: the squared distance from the laws with this smoothing. Components of
    /// e below the roundoff level are ignored, so that states that differ by roundoff have the same distance.
    ///
    /// On a line of infinite slope, at a point that both sides hold, the state is that at c itself. Its e counts by the
    /// stiffest tangent of the pair: a rigid part may still move, and its Newton steps may run in a circle.
    pub fn distance(&self, model: &Model, smoothing: &[f64]) -> f64 {
        let Self { compression, roundoff, pressure, rho } = *self;
        let resolved = Layer::resolve(model, compression, pressure, rho, smoothing);
        let mut slopes = rho.to_vec();
        for range in (0..model.pairs.len()).map(|pair| model.range(pair)) {
            let stiffest = resolved.tangent[range.clone()].iter().copied().fold(0.0, f64::max);
            slopes[range].iter_mut().filter(|slope| **slope == f64::INFINITY).for_each(|slope| *slope = stiffest);
        }
        let known = |q: usize| slopes[q] * roundoff[q] + f64::EPSILON * (pressure[q].abs() + resolved.pressure[q]);
        // `clamp` keeps NaN, which is not nearer than any distance
        let difference = |q: usize| ((pressure[q] - resolved.pressure[q]).abs() - known(q)).clamp(0.0, f64::INFINITY);
        let squared = |(q, e): (usize, f64)| model.area[q] * e.powi(2) / slopes[q];
        (0..model.points()).map(|q| (q, difference(q))).filter(|(_, e)| *e != 0.0).map(squared).sum()
    }
}

impl Path {
    /// Note a step of this length with or without smoothing.
    pub fn note(&mut self, length: f64, is_smoothed: bool) {
        self.steps += usize::from(is_smoothed);
        self.shortened += usize::from(length < 1.0 && !is_smoothed);
    }

    /// Return mu of the next step at each point, n, after a step to `state` with `smoothing`; empty for the laws
    /// themselves. Smoothing below the energy `unseen` does not change the result any more.
    pub fn smoothing(&mut self, model: &Model, state: &Equilibrium, smoothing: &[f64], unseen: f64) -> Vec<f64> {
        let enters = smoothing.is_empty();
        if enters && self.shortened < SHORTENED {
            return Vec::new();
        }
        self.shortened = 0;
        let area: f64 = model.area.iter().sum();
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

    /// Points with p = 4 c and p = c^2, n = 4: a step to the laws goes all the way, one that goes far beyond a part of
    /// it, one away from the laws none of it.
    #[test]
    fn a_step_goes_as_far_as_it_comes_nearer() {
        let model = two_pairs();
        let rho = [2.0, 0.5, 0.25, 3.0];
        let (from, start, exact) = ([0.5, 0.5, 1.0, 1.0], [2.0, 4.0, 1.0, 1.0], [0.0; 4]);
        let length = |progress: &mut Progress, rho: &[f64; 4], roundoff: &[f64; 4], c: &[f64; 4], p: &[f64; 4]| {
            progress.unit = rho.to_vec();
            let step = progress.step_length(&model, &Layer::default(), [&from, roundoff], [c, p]);
            (!step.is_lost).then_some(step.length)
        };
        let begin = || Progress { pressure: start.to_vec(), ..Progress::default() };
        let mut progress = Progress::default();
        // the first step has no pressures to begin with
        assert_eq!(length(&mut progress, &rho, &exact, &[9.0; 4], &[0.0; 4]), Some(1.0));
        assert_eq!(progress.go(1.0, start.to_vec()), start);
        // the second point is on p = 4 c then
        assert_eq!(length(&mut progress, &rho, &exact, &[0.5, 0.75, 1.0, 1.0], &[2.0, 3.0, 1.0, 1.0]), Some(1.0));
        // from p = 4 to p = -4 where the law has 6
        let (to, pressure) = ([0.5, 1.5, 1.0, 1.0], [2.0, -4.0, 1.0, 1.0]);
        assert_eq!(length(&mut begin(), &rho, &exact, &to, &pressure), Some(0.25));
        // points without stiffness on either side, whose compression may be exact, have none
        assert_eq!(length(&mut begin(), &[f64::INFINITY, 0.5, 0.25, 3.0], &exact, &to, &pressure), Some(0.25));
        // no distance is left beyond compressions known to -+ 100
        assert_eq!(length(&mut begin(), &rho, &[1e2; 4], &to, &pressure), Some(1.0));
        assert_eq!(begin().go(0.25, pressure.to_vec()), [2.0, 2.0, 1.0, 1.0]);
        let away = length(&mut begin(), &rho, &exact, &[0.5, -9.0, 1.0, 1.0], &[2.0, 99.0, 1.0, 1.0]);
        assert_eq!(away, None);
    }

    /// A point that both sides hold is off the law p = 4 c of its pair by 1, which counts by the stiffness 4.
    #[test]
    fn held_points_have_a_distance() {
        let (model, rho) = (two_pairs(), [f64::INFINITY, 0.5, 0.25, 3.0]);
        let distance = |p: f64| {
            let (pressure, roundoff) = (&[p, 2.0, 1.0, 1.0], &[0.0; 4]);
            Equilibrium { compression: &[0.5, 0.5, 1.0, 1.0], roundoff, pressure, rho: &rho }.distance(&model, &[])
        };
        assert_eq!(distance(2.0), 0.0);
        assert!((distance(3.0) - model.area[0] / 4.0).abs() < 1e-14);
    }

    /// What a pair's points answered together, beside their own stiffness; nothing counts as a millionth. With smoothed
    /// laws, the geometric mean of both and the stiffness of the layer, where it has one.
    #[test]
    fn lines_are_as_steep_as_the_bodies_answer() {
        let (model, unit) = (two_pairs(), [2.0, 8.0, 1.0, 1.0]);
        // 3 times the stiffness of both points
        let (dc, dp) = ([1.0, -0.5, 1.0, 0.0], [-6.0, 12.0, 0.0, 0.0]);
        let [w, v] = [model.area[0], model.area[1]];
        let times = ((w * 36.0 / 2.0 + v * 144.0 / 8.0) / (w * 2.0 + v * 0.25 * 8.0)).sqrt();
        let mut progress = Progress { unit: unit.to_vec(), ..Progress::default() };
        progress.observe(&model, &dc, &dp, &[0.0; 4]);
        let smoothed = Layer { tangent: vec![27.0, 0.0, 1.0, 1e-3], smoothing: vec![1.0; 4], ..Layer::default() };
        let expected = [
            (Layer::default(), [2.0 * times, 8.0 * times, 1e-6, 1e-6]),
            (smoothed, [3.0 * (4.0 * times).cbrt(), 8.0 * times.sqrt(), 1e-2, 1e-3]),
        ];
        for (states, expected) in expected {
            let slopes = progress.slopes(&model, &states);
            assert!(slopes.iter().zip(expected).all(|(s, e)| (s - e).abs() < 1e-14 * e), "{slopes:?} {expected:?}");
        }
    }

    /// Points with p = 4 c and p = c^2, n = 4: the path begins at the second shortened step with 100 times the mean
    /// distance, falls with it, rises where the distance is more than 100 times as large, and ends where nobody sees
    /// it.
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
        let area: f64 = model.area.iter().sum();
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
