//! How far a step of Newton's method goes, and on which lines it meets the laws.
//!
//! States (c, p) in equilibrium are an affine set, so that those on the way of a step need no solve. A state is off its places (c_q, p_q) on the
//! laws by e = p - p_q = -rho (c - c_q). The step goes to a state c' on the tangents, so that with s = c' - c_q it begins with
//!
//! ```text
//! dc = s + e/rho,   dp = kappa s - e,   dp_q = kappa/(1 + kappa/rho) (dc + dp/rho) = kappa s,   de = dp - dp_q = -e
//! ```
//!
//! and sum omega e^2/rho falls, with any weights and any rho, until a law turns a corner. Where the whole step is no nearer to the laws, a shorter
//! one is; where that is too short, the tangents belong to the wrong side of a corner, and places on lines of another slope are on other sides.
//!
//! Any slope leads to the same solution. The best are near those with which the bodies answer, dp = -S dc between states in equilibrium: the longest waves with that
//! of the last step, sum omega dp^2/rho = sum omega dc^2 rho over a pair, the shortest with that of single nodes. The geometric mean is the nearest to both.

use crate::model::Model;
use crate::model::layer::Layer;
use crate::model::rigid::PART;

/// What Newton's method remembers of its steps.
#[derive(Debug, Clone, Default)]
pub(super) struct Progress {
    /// Pressures in equilibrium with the iterate, n; empty before the first.
    pressure: Vec<f64>,
    /// Steps in a row that came no nearer to the laws, and all of them.
    row: usize,
    failures: usize,
    /// Slopes for each pair after the last step, as multiples of [`meeting_slopes`](crate::model::surface::meeting_slopes); empty before the second.
    answer: Vec<f64>,
}

/// How often a step is halved: to less than a hundredth. From 3 to 14 times 4000 random scenes took the same number of steps within a per cent
/// (docs/methods.md).
const HALVINGS: usize = 7;

/// Slopes of the lines, as multiples of those by the bodies' answer, one after the other: the range in which random scenes take the same
/// steps within a few per cent.
const SLOPES: [f64; 3] = [1.0, 10.0, 0.1];

impl Progress {
    /// rho, n: slopes on which places are met now, of meeting slopes `unit`, n.
    pub fn slopes(&self, model: &Model, unit: &[f64]) -> Vec<f64> {
        let times = SLOPES[self.failures % SLOPES.len()];
        let mut slopes: Vec<f64> = unit.iter().map(|unit| times * unit).collect();
        for (pair, answer) in self.answer.iter().enumerate() {
            slopes[model.range(pair)].iter_mut().for_each(|slope| *slope *= answer);
        }
        slopes
    }

    /// Keeps how the bodies answered a step that changed compressions and pressures by dc and dp, n each, of equilibrium.
    fn observe(&mut self, model: &Model, unit: &[f64], dc: &[f64], dp: &[f64]) {
        self.answer.resize(model.pairs.len(), 1.0);
        for (pair, answer) in self.answer.iter_mut().enumerate() {
            let finite = model.range(pair).filter(|&q| unit[q] < f64::INFINITY);
            let squares =
                finite.map(|q| [dp[q].powi(2) / unit[q], dc[q].powi(2) * unit[q]].map(|x| model.weight[q] * x));
            let [p, c] = squares.fold([0.0; 2], |sum, square| [sum[0] + square[0], sum[1] + square[1]]);
            if (p / c).is_finite() {
                // softer are motions of whole bodies, which `fit` finds
                *answer = (p / c).clamp(PART, PART.recip()).sqrt().sqrt();
            }
        }
    }

    /// The share of the way from compressions `from`, known to their `digits`, to the state (c, p), n each, that a step goes, where meeting slopes are `unit`.
    /// Where no slope brought it nearer to the laws, which motions without resistance do, it goes all the way.
    pub fn share(&mut self, model: &Model, unit: &[f64], [from, digits]: [&[f64]; 2], [c, p]: [&[f64]; 2]) -> f64 {
        if self.pressure.is_empty() {
            return 1.0;
        }
        let rho = self.slopes(model, unit);
        let change = |from: &[f64], to: &[f64]| to.iter().zip(from).map(|(to, from)| to - from).collect::<Vec<f64>>();
        self.observe(model, unit, &change(from, c), &change(&self.pressure, p));
        let off = |t: f64| distance(model, &rho, [&between(from, c, t), digits], &between(&self.pressure, p, t));
        let here = off(0.0);
        let mut shares = (0..=HALVINGS as i32).map(|halvings| 0.5f64.powi(halvings));
        if let Some(share) = shares.find(|&t| off(t) <= here) {
            self.row = 0;
            return share;
        }
        self.failures += 1;
        self.row = (self.row + 1) % SLOPES.len();
        if self.row == 0 { 1.0 } else { 0.5f64.powi(HALVINGS as i32) }
    }

    /// Forgets the pressures of an iterate that was left.
    pub fn forget(&mut self) {
        self.pressure.clear();
    }

    /// The pressures a share of the way to `pressure`, n, which are those of the iterate from now on.
    pub fn go(&mut self, share: f64, pressure: Vec<f64>) -> Vec<f64> {
        self.pressure = if share < 1.0 { between(&self.pressure, &pressure, share) } else { pressure };
        self.pressure.clone()
    }
}

/// How far a state in equilibrium, of compressions c known to their `digits` and pressures p, n each, is from its places on the laws: sum omega
/// e^2/rho. Distances count beyond these digits and those of the pressures: states that differ by rounding are as far.
pub(super) fn distance(model: &Model, rho: &[f64], [c, digits]: [&[f64]; 2], p: &[f64]) -> f64 {
    let met = Layer::meet(model, c, p, rho);
    let known = |q: usize| rho[q] * digits[q] + f64::EPSILON * (p[q].abs() + met.pressure[q]);
    // a distance that is no number stays none: it is not nearer
    let apart = |q: usize| ((p[q] - met.pressure[q]).abs() - known(q)).clamp(0.0, f64::INFINITY);
    // lines of infinite slope lead to places at c itself
    let sloped = (0..c.len()).filter(|&q| rho[q] < f64::INFINITY);
    sloped.map(|q| model.weight[q] * apart(q).powi(2) / rho[q]).sum()
}

fn between(from: &[f64], to: &[f64], t: f64) -> Vec<f64> {
    from.iter().zip(to).map(|(from, to)| from + t * (to - from)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::sample::two_pairs;

    /// Of points with p = 4 c and p = c^2, n = 4: a step to the laws goes all the way, one that goes far beyond a part of it, one away from the
    /// laws almost none of it, with another slope next, and the third of these all.
    #[test]
    fn a_step_goes_as_far_as_it_comes_nearer() {
        let model = two_pairs();
        let rho = [2.0, 0.5, 0.25, 3.0];
        let begin = |pressure: &[f64; 4]| Progress { pressure: pressure.to_vec(), ..Progress::default() };
        let (from, start, exact) = ([0.5, 0.5, 1.0, 1.0], [2.0, 4.0, 1.0, 1.0], [0.0; 4]);
        let mut progress = Progress::default();
        // the first step has no pressures to begin with
        assert_eq!(progress.share(&model, &rho, [&from, &exact], [&[9.0; 4], &[0.0; 4]]), 1.0);
        assert_eq!(progress.go(1.0, start.to_vec()), start);
        // the second point is on p = 4 c then
        assert_eq!(progress.share(&model, &rho, [&from, &exact], [&[0.5, 0.75, 1.0, 1.0], &[2.0, 3.0, 1.0, 1.0]]), 1.0);
        // from p = 4 to p = -4 where the law has 6
        let (to, pressure) = ([0.5, 1.5, 1.0, 1.0], [2.0, -4.0, 1.0, 1.0]);
        let share =
            |rho: &[f64; 4], digits: &[f64; 4]| begin(&start).share(&model, rho, [&from, digits], [&to, &pressure]);
        assert_eq!(share(&rho, &exact), 0.25);
        // points without stiffness on either side, whose compression may be exact, have none
        assert_eq!(share(&[f64::INFINITY, 0.5, 0.25, 3.0], &exact), 0.25);
        // no distance is left beyond compressions known to -+ 100
        assert_eq!(share(&rho, &[1e2; 4]), 1.0);
        assert_eq!(begin(&start).go(0.25, pressure.to_vec()), [2.0, 2.0, 1.0, 1.0]);
        let mut progress = begin(&[2.0, 2.0, 1.0, 1.0]);
        assert_eq!(progress.slopes(&model, &rho), rho);
        let (bent, away) = ([0.5, 1.0, 1.0, 1.0], [[0.5, 2.0, 1.0, 1.0], [2.0, -9.0, 1.0, 1.0]]);
        let away = |progress: &mut Progress| progress.share(&model, &rho, [&bent, &exact], [&away[0], &away[1]]);
        assert_eq!([away(&mut progress), away(&mut progress)], [0.5f64.powi(7); 2]);
        // the first pair answered with dp = -11 to dc = 1 where rho is 0.5, the second not at all
        let answered = rho.map(|rho| 22f64.sqrt() * rho);
        let answered = [answered[0], answered[1], 0.25, 3.0];
        let near =
            |slopes: Vec<f64>, times: f64| slopes.iter().zip(answered).all(|(s, a)| (s - times * a).abs() < 1e-12 * a);
        assert!(near(progress.slopes(&model, &rho), 0.1));
        assert_eq!(away(&mut progress), 1.0);
        assert!(near(progress.slopes(&model, &rho), 1.0));
    }

    /// The geometric mean of what a pair's points answered together and of their own stiffness; nothing counts as a thousandth.
    #[test]
    fn lines_are_as_steep_as_the_bodies_answer() {
        let (model, mut progress) = (two_pairs(), Progress::default());
        let unit = [2.0, 8.0, 1.0, 1.0];
        // 3 times the stiffness of both points
        progress.observe(&model, &unit, &[1.0, -0.5, 1.0, 0.0], &[-6.0, 12.0, 0.0, 0.0]);
        let [w, v] = [model.weight[0], model.weight[1]];
        let times = ((w * 36.0 / 2.0 + v * 144.0 / 8.0) / (w * 2.0 + v * 0.25 * 8.0)).sqrt();
        let slopes = progress.slopes(&model, &unit);
        let expected = [2.0 * times.sqrt(), 8.0 * times.sqrt(), 1e-3f64.sqrt(), 1e-3f64.sqrt()];
        assert!(slopes.iter().zip(expected).all(|(s, e)| (s - e).abs() < 1e-14 * e), "{slopes:?} {expected:?}");
    }
}
