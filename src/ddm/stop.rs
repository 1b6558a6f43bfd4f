//! The status with which a run ends, and the watch for stagnation.

use super::bound::EXACT;
use crate::model::Mechanism;
use crate::model::linear::Failure;
use crate::model::motions::NamedMotion;

/// How a run ended.
#[derive(Debug, Clone, PartialEq)]
pub enum Status {
    /// A stopping rule was met.
    Converged,
    /// The error cannot fall further in double precision.
    RoundoffLimited,
    /// Several steps made no progress, far from the laws.
    Stagnated,
    /// The limit of iterations was reached.
    IterationLimit,
    /// A number that is not finite appeared in a body.
    NotFinite {
        /// The first such body.
        body: usize,
    },
    /// Energies are too large or too small for double numbers, so that no error can be computed.
    OutOfRange {
        /// Energy of bodies and layers.
        energy: f64,
    },
    /// Neither supports nor the Robin term constrain a body.
    Underconstrained(NamedMotion),
    /// Loads move several bodies together in a way that changes no gap and that nothing resists.
    Mechanism(Mechanism),
    /// F1 has no minimum: loads push bodies where neither a support nor a contact stops them.
    Unbounded {
        /// The bodies and their motions, where they are known.
        moving: Vec<NamedMotion>,
    },
    /// An inner solver failed.
    InnerSolver(Failure),
    /// The run ended as solved, but the forces f - K u - B' omega p, computed with K itself, have this relative error.
    Unbalanced(f64),
    /// The run ended as solved, but roundoff of gaps and displacements may change the pressures by this share, so that
    /// no digit of them is left.
    NoDigits(f64),
    /// A signal ended the run.
    Interrupted {
        /// The bits of [`Observer::asked`](super::Observer::asked) of all ranks.
        asked: u8,
    },
}

impl Status {
    /// Whether the run ended as solved, but with a larger error.
    pub fn is_inaccurate(&self) -> bool {
        matches!(self, Status::Unbalanced(_) | Status::NoDigits(_))
    }

    /// Whether the last iterate is a solution.
    pub fn is_solved(&self) -> bool {
        matches!(self, Status::Converged | Status::RoundoffLimited)
    }

    /// Return whether other runs can begin with the result: a solution, or what a limit of iterations has left.
    pub fn is_usable(&self) -> bool {
        self.is_solved() || *self == Self::IterationLimit
    }
}

/// Return the paper's rho: the norm of the increment of normal displacements over the norm of the displacements. Zero
/// over zero is zero.
pub fn relative_increment(step: &[f64], now: &[f64]) -> f64 {
    let norm = |v: &[f64]| crate::linalg::dot(v, v).sqrt();
    if norm(step) == 0.0 { 0.0 } else { norm(step) / norm(now) }
}

/// Share to which a step must reduce the error, or the squared distance from the laws, to be progress: it takes off a
/// tenth.
const FALLS: f64 = 0.9;

/// Steps without progress after which Newton's method stagnates. One happens at the corner of a law; of 540 random
/// scenes none that went on after three was solved.
const PATIENCE: usize = 3;

/// Share to which the error must fall near the solution, where a fall by a tenth is often the luck of roundoff. Linear
/// systems are solved to a half or better ([`LinearStep::roughest`](crate::model::linear::LinearStep::roughest)), so
/// that a step of Newton's method halves the error there. None of 300 random scenes was lost by it.
const NEAR_FALLS: f64 = 0.5;

/// Share of F1 by which a fall is more than its roundoff: that of a sum of a million terms is 1e3 epsilon.
const SEEN: f64 = 1e-12;

/// Relative difference up to which errors are those of the same iterate. Below it is roundoff, which changed the errors
/// of a circle of steps by 1e-9 under a layer 1e5 times as stiff as the bodies. Above it are steps that get
/// somewhere: an error that falls by 1e-6 a step takes 2e6 steps to lose a digit.
const SAME: f64 = 1e-6;

/// Return whether F1 is less than it was `before` by more than roundoff.
pub(super) fn falls(before: f64, now: f64) -> bool {
    before - now > roundoff(now)
}

/// Return the roundoff of a value of F1.
pub(super) fn roundoff(f1: f64) -> f64 {
    SEEN * f1.abs()
}

/// A watch for stagnation of Newton's method.
///
/// Each step is measured by itself, by the squared distance from the laws at its end over that at its beginning:
/// earlier steps had other slopes. Far from the solution this distance falls while the error may rise by many orders.
/// Where a contact peels point by point, F1 alone falls ([`falls`]), and what reaches a new least F1 cannot repeat
/// itself. A step to an iterate that was there before, by its error and F1, is part of a circle. Where the square of
/// the error, in the energy norm, is below [`EXACT`], the solution is near: a distance that falls is roundoff there.
#[derive(Debug, Clone)]
pub(super) struct Stagnation {
    /// The error at the last progress in it.
    best: f64,
    /// The least F1 so far.
    least: f64,
    /// Steps since the last progress.
    since: usize,
    /// Error and F1 after each step.
    seen: Vec<[f64; 2]>,
}

impl Default for Stagnation {
    fn default() -> Self {
        Self { best: f64::INFINITY, least: f64::INFINITY, since: 0, seen: Vec::new() }
    }
}

impl Stagnation {
    /// Note a step: the error and F1 after it, the squared distance from the laws after it over that before it
    /// (`fall`), and whether the laws were smoothed, so that far from the solution the error falls with mu. Return
    /// whether the run stagnates.
    pub fn note(&mut self, error: f64, energy: f64, fall: f64, is_smoothed: bool) -> bool {
        let is_far = error.powi(2) > EXACT;
        let share = if is_far { FALLS } else { NEAR_FALLS };
        let is_better = error < share * self.best;
        if is_better {
            self.best = error;
        }
        let is_lower = falls(self.least, energy);
        self.least = self.least.min(energy);
        let is_same = |[e, f1]: &[f64; 2]| (e - error).abs() <= SAME * error && (f1 - energy).abs() <= roundoff(energy);
        let repeats = self.seen.iter().any(is_same);
        self.seen.push([error, energy]);
        let is_progress = is_better || is_lower || is_far && (is_smoothed || fall < FALLS && !repeats);
        self.since = if is_progress { 0 } else { self.since + 1 };
        self.since >= PATIENCE
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn increments_are_shares() {
        assert!((relative_increment(&[3.0, 4.0], &[0.0, 10.0]) - 0.5).abs() < 1e-15);
        assert_eq!((relative_increment(&[0.0], &[0.0]), relative_increment(&[1.0], &[0.0])), (0.0, f64::INFINITY));
    }

    #[test]
    fn three_steps_without_progress_are_stagnation() {
        let noted = |steps: &[(f64, f64, bool)], energy: &dyn Fn(usize) -> f64| {
            let mut stagnation = Stagnation::default();
            let mut note = |(k, &(error, fall, is_smoothed))| stagnation.note(error, energy(k), fall, is_smoothed);
            steps.iter().enumerate().map(&mut note).collect::<Vec<_>>()
        };
        let same = |_| -1.0;
        assert_eq!(noted(&[(1.0, 1.0, false); 4], &same), [false, false, false, true]);
        // a rising error, while the states come nearer to the laws, or while F1 falls
        assert_eq!(
            noted(&[(1e3, 0.5, false), (1e6, 0.5, false), (1e9, 0.5, false), (2e9, 0.5, false)], &same),
            [false; 4]
        );
        assert_eq!(noted(&[(1.0, 1.0, false); 4], &|k| -(k as f64)), [false; 4]);
        assert_eq!(noted(&[(1.0, 1.0, false); 4], &|k| -1.0 - 1e-13 * k as f64), [false, false, false, true]);
        // a distance of states near the solution is roundoff
        assert_eq!(noted(&[(1e-5, 0.5, false); 4], &same), [false, false, false, true]);
        assert_eq!(noted(&[(1.0, 1.0, true); 5], &same), [false; 5]);
        // a circle of two steps, each of which comes nearer to the laws
        let circle = [(1e3, 0.5, false), (9e2, 0.5, false)].repeat(3);
        assert_eq!(noted(&circle, &|k| (k % 2) as f64), [false, false, false, false, true, true]);
        // less than a tenth of the best error, or of the distance
        assert!(noted(&[(1.0, 1.0, false), (0.95, 0.95, false), (0.91, 1.0, false), (0.9, 1.0, false)], &same)[3]);
        assert!(!noted(&[(1.0, 1.0, false), (0.95, 0.95, false), (0.91, 1.0, false), (0.89, 1.0, false)], &same)[3]);
        assert_eq!(
            noted(&[(1.0, 1.0, false), (1.0, 1.0, false), (0.8, 1.0, false), (0.8, 1.0, false)], &same),
            [false; 4]
        );
    }
}
