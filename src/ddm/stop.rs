//! The status with which a run ends, and the watch for stagnation.

use crate::model::Mechanism;
use crate::model::linear::Failure;
use crate::model::rigid::Moved;

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
    Underconstrained(Moved),
    /// Loads move several bodies together in a way that changes no gap and that nothing resists.
    Mechanism(Mechanism),
    /// F1 has no minimum: loads push bodies where neither a support nor a contact stops them.
    Unbounded {
        /// The bodies and their motions, where they are known.
        moving: Vec<Moved>,
    },
    /// An inner solver failed.
    InnerSolver(Failure),
    /// The run ended as solved, but its result has a larger error.
    Inaccurate(Inaccuracy),
    /// A signal ended the run.
    Interrupted {
        /// The bits of [`Observer::asked`](super::Observer::asked) of all ranks.
        asked: u8,
    },
}

/// The relative error of a result that is none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Inaccuracy {
    /// The forces f - K u - B' omega p, computed with K itself, are not zero.
    Unbalanced(f64),
    /// Roundoff of gaps and displacements may change all digits of the pressures.
    Roundoff(f64),
}

impl Status {
    /// Whether the last iterate is a solution.
    pub fn is_solved(&self) -> bool {
        matches!(self, Status::Converged | Status::RoundoffLimited)
    }
}

/// Return the paper's rho: the norm of the increment of normal displacements over the norm of the displacements. Zero over zero is zero.
pub fn relative_increment(step: &[f64], now: &[f64]) -> f64 {
    let norm = |v: &[f64]| crate::linalg::dot(v, v).sqrt();
    if norm(step) == 0.0 { 0.0 } else { norm(step) / norm(now) }
}

/// Share to which a step must reduce the error, or the squared distance from the laws, to be progress: it takes off a tenth.
const FALLS: f64 = 0.9;

/// Steps without progress after which Newton's method stagnates. One happens at the corner of a law; of 540 random scenes none that went on after three
/// was solved.
const PATIENCE: usize = 3;

/// A watch for stagnation of Newton's method.
///
/// Each step is measured by itself, by the squared distance from the laws at its end over that at its beginning: earlier steps had other slopes. Far from
/// the solution this distance falls while the error may rise by many orders.
#[derive(Debug, Clone)]
pub(super) struct Stagnation {
    /// The error at the last progress in it.
    best: f64,
    /// Steps since the last progress.
    since: usize,
}

impl Default for Stagnation {
    fn default() -> Self {
        Self { best: f64::INFINITY, since: 0 }
    }
}

impl Stagnation {
    /// Note a step: the error after it, the `fall` of the squared distance from the laws in it, and whether the laws were smoothed, in which case the
    /// error falls with mu. Return whether the run stagnates.
    pub fn note(&mut self, error: f64, fall: f64, is_smoothed: bool) -> bool {
        let is_better = error < FALLS * self.best;
        if is_better {
            self.best = error;
        }
        self.since = if is_better || is_smoothed || fall < FALLS { 0 } else { self.since + 1 };
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
        let noted = |steps: &[(f64, f64, bool)]| {
            let mut stagnation = Stagnation::default();
            steps
                .iter()
                .map(|&(error, fall, is_smoothed)| stagnation.note(error, fall, is_smoothed))
                .collect::<Vec<_>>()
        };
        assert_eq!(noted(&[(1.0, 1.0, false); 4]), [false, false, false, true]);
        // a rising error, while the states come nearer to the laws
        assert_eq!(noted(&[(1e3, 0.5, false), (1e6, 0.5, false), (1e9, 0.5, false), (1e9, 0.5, false)]), [false; 4]);
        assert_eq!(noted(&[(1.0, 1.0, true); 5]), [false; 5]);
        // less than a tenth of the best error, or of the distance
        assert!(noted(&[(1.0, 1.0, false), (0.95, 0.95, false), (0.91, 1.0, false), (0.9, 1.0, false)])[3]);
        assert!(!noted(&[(1.0, 1.0, false), (0.95, 0.95, false), (0.91, 1.0, false), (0.89, 1.0, false)])[3]);
        assert_eq!(noted(&[(1.0, 1.0, false), (1.0, 1.0, false), (0.8, 1.0, false), (0.8, 1.0, false)]), [false; 4]);
    }
}
