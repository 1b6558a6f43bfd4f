//! How far a step of Newton's method goes.
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

use crate::model::Model;
use crate::model::layer::Layer;

/// What Newton's method remembers of its steps.
#[derive(Debug, Clone, Default)]
pub(super) struct Progress {
    /// Pressures in equilibrium with the iterate, n; empty before the first.
    pressure: Vec<f64>,
    /// Steps in a row that came no nearer to the laws, and all of them.
    row: usize,
    failures: usize,
}

/// How often a step is halved: to less than a hundredth. From 3 to 14 times 4000 random scenes took the same number of steps within a per cent
/// (docs/methods.md).
const HALVINGS: usize = 7;

/// Slopes of the lines, as multiples of [`meeting_slopes`](crate::model::layer::meeting_slopes), one after the other: the range in which random scenes take the
/// same steps.
const SLOPES: [f64; 3] = [1.0, 10.0, 0.1];

impl Progress {
    /// rho, n: slopes on which places are met now.
    pub fn slopes(&self, rho: &[f64]) -> Vec<f64> {
        rho.iter().map(|rho| SLOPES[self.failures % SLOPES.len()] * rho).collect()
    }

    /// The share of the way from compressions `from`, known to their `digits`, to the state (c, p), n each, that a step goes. Distances from the
    /// laws count beyond these digits and those of the pressures: steps between states that differ by rounding are not shortened. Where no
    /// slope brought it nearer to the laws, which motions without resistance do, it goes all the way.
    pub fn share(&mut self, model: &Model, rho: &[f64], [from, digits]: [&[f64]; 2], [c, p]: [&[f64]; 2]) -> f64 {
        if self.pressure.is_empty() {
            return 1.0;
        }
        let off = |t: f64| {
            let (c, p) = (between(from, c, t), between(&self.pressure, p, t));
            let met = Layer::meet(model, &c, &p, rho);
            let known = |q: usize| rho[q] * digits[q] + f64::EPSILON * (p[q].abs() + met.pressure[q]);
            // a distance that is no number stays none: it is not nearer
            let apart = |q: usize| ((p[q] - met.pressure[q]).abs() - known(q)).clamp(0.0, f64::INFINITY);
            // lines of infinite slope lead to places at c itself
            let sloped = (0..c.len()).filter(|&q| rho[q] < f64::INFINITY);
            sloped.map(|q| model.weight[q] * apart(q).powi(2) / rho[q]).sum::<f64>()
        };
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
        let mut progress = Progress::default();
        let (from, start, exact) = ([0.5, 0.5, 1.0, 1.0], vec![2.0, 4.0, 1.0, 1.0], [0.0; 4]);
        // the first step has no pressures to begin with
        assert_eq!(progress.share(&model, &rho, [&from, &exact], [&[9.0; 4], &[0.0; 4]]), 1.0);
        assert_eq!(progress.go(1.0, start.clone()), start);
        // the second point is on p = 4 c then
        assert_eq!(progress.share(&model, &rho, [&from, &exact], [&[0.5, 0.75, 1.0, 1.0], &[2.0, 3.0, 1.0, 1.0]]), 1.0);
        // from p = 4 to p = -4 where the law has 6
        let (to, pressure) = ([0.5, 1.5, 1.0, 1.0], [2.0, -4.0, 1.0, 1.0]);
        assert_eq!(progress.share(&model, &rho, [&from, &exact], [&to, &pressure]), 0.25);
        // points without stiffness on either side, whose compression may be exact, have none
        let hard = [f64::INFINITY, 0.5, 0.25, 3.0];
        assert_eq!(progress.clone().share(&model, &hard, [&from, &exact], [&to, &pressure]), 0.25);
        // no distance is left beyond compressions known to -+ 100
        assert_eq!(progress.clone().share(&model, &rho, [&from, &[1e2; 4]], [&to, &pressure]), 1.0);
        assert_eq!(progress.go(0.25, pressure.to_vec()), [2.0, 2.0, 1.0, 1.0]);
        assert_eq!(progress.slopes(&rho), rho);
        let (bent, away) = ([0.5, 1.0, 1.0, 1.0], [[0.5, 2.0, 1.0, 1.0], [2.0, -9.0, 1.0, 1.0]]);
        let away = |progress: &mut Progress| progress.share(&model, &rho, [&bent, &exact], [&away[0], &away[1]]);
        assert_eq!([away(&mut progress), away(&mut progress)], [0.5f64.powi(7); 2]);
        assert_eq!(progress.slopes(&rho), rho.map(|rho| 0.1 * rho));
        assert_eq!(away(&mut progress), 1.0);
        assert_eq!(progress.slopes(&rho), rho);
    }
}
