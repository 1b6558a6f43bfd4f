//! When a run ends, and what that is called.

use crate::model::Mechanism;
use crate::model::linear::Failure;
use crate::model::rigid::Moved;
use std::collections::VecDeque;
use std::hash::{DefaultHasher, Hash, Hasher};

/// How a run ended.
#[derive(Debug, Clone, PartialEq)]
pub enum Status {
    /// A stopping rule was met.
    Converged,
    /// The error cannot fall further in this arithmetic.
    RoundoffLimited,
    /// The limit of iterations was reached.
    IterationLimit,
    /// A number that is not finite came up in a body.
    NotFinite {
        /// The first such body.
        body: usize,
    },
    /// Energies are too large or too small for double numbers, so that no error can be told.
    OutOfRange {
        /// Energy of bodies and layers.
        energy: f64,
    },
    /// The iterates repeat.
    Cycle {
        /// Updates after which they come back; 1 where the contact stays and nothing falls.
        period: usize,
    },
    /// Neither supports nor the Robin term hold a body.
    Underconstrained(Moved),
    /// Loads move several bodies together in a way that changes no gap and that nothing holds.
    Mechanism(Mechanism),
    /// F1 falls for ever: loads push bodies where neither a support nor a contact stops them.
    Unbounded {
        /// The bodies and their motions, where they are known.
        moving: Vec<Moved>,
    },
    /// An inner solver failed.
    InnerSolver(Failure),
    /// The run thought to be at its end, and the forces of its displacements say that it is not.
    Inaccurate(Inaccuracy),
    /// Somebody outside asked for it; the run can go on from its outcome.
    Paused {
        /// The bits of [`Observer::asked`](super::Observer::asked) of all ranks.
        asked: u8,
    },
}

/// What a solution was thought to miss, and what it misses: relative errors.
#[derive(Debug, Clone, PartialEq)]
pub struct Inaccuracy {
    /// The error that the run would have ended with.
    pub told: f64,
    /// The largest of those found.
    pub found: f64,
    /// Where that is.
    pub whose: Whose,
}

/// Where an error is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Whose {
    /// In the forces on a body.
    Body(usize),
    /// In the pressures of a pair.
    Pair(usize),
    /// In what rounding leaves of all pressures.
    Rounding,
}

impl Status {
    /// Whether the last iterate is a solution.
    pub fn is_solved(&self) -> bool {
        matches!(self, Status::Converged | Status::RoundoffLimited)
    }
}

/// The paper's rho: norm of the increment of normal displacements over the norm of the displacements. Zero over zero
/// is zero.
pub fn relative_increment(step: &[f64], now: &[f64]) -> f64 {
    let norm = |v: &[f64]| crate::linalg::dot(v, v).sqrt();
    if norm(step) == 0.0 { 0.0 } else { norm(step) / norm(now) }
}

/// Watches for progress: at the rounding floor the error stays where it is.
#[derive(Debug, Clone)]
pub struct Floor {
    best: f64,
    since: usize,
    patience: usize,
    believable: f64,
}

impl Floor {
    /// Share of the best error that an iterate must reach to be progress.
    const FALLS: f64 = 0.9;

    /// Of Newton's method, whose iterates are in equilibrium: one without progress may be there. An error of all of the solution or more leaves
    /// nothing of it that is known.
    pub fn of_steps() -> Self {
        Self { best: f64::INFINITY, since: 0, patience: 1, believable: 1.0 }
    }

    /// Of sweeps: twenty without progress, as each may gain half a per cent, and an error of 1e-4 at most. Those far from any solution can have large
    /// rounding errors, too.
    pub fn of_sweeps() -> Self {
        Self { patience: 20, believable: 1e-4, ..Self::of_steps() }
    }

    /// Whether an iterate of this error would be no progress, and one that can be a solution.
    pub fn is_stuck(&self, error: f64) -> bool {
        error >= Self::FALLS * self.best && error < self.believable
    }

    /// Notes an error; true when it is time to compare it with the rounding errors.
    pub fn is_reached(&mut self, error: f64) -> bool {
        if error < Self::FALLS * self.best {
            self.best = error;
            self.since = 0;
        } else {
            self.since += 1;
        }
        self.since > 0 && self.since.is_multiple_of(self.patience) && error < self.believable
    }

    /// Whether Newton's method stands still: as many steps as a cycle has at most were no progress, and the last one moved the bodies by this `increment`, no
    /// more than half of the digits. The next step would be the same, so that only rounding is left.
    pub fn is_fixed(&self, increment: f64) -> bool {
        self.patience == 1 && self.since >= Cycle::LONGEST && increment <= f64::EPSILON.sqrt()
    }
}

/// Recognises an iteration that runs in a circle: the same traces again, or the same contact sets again and again without
/// progress.
#[derive(Debug, Default, Clone)]
pub struct Cycle {
    recent: VecDeque<Vec<f64>>,
    /// Contact sets of the last iterates, as hashes, and the least residual and F1 up to each.
    sets: VecDeque<(u64, (f64, f64))>,
    best: (f64, f64),
}

impl Cycle {
    /// Longest period looked for. Contact sets must repeat for so many of the longest periods.
    const LONGEST: usize = 8;

    /// The period, if the last update moved `trace` by more than half of its digits and it is that of 2 to 8 updates ago to half of the
    /// digits of this step, or if the contact sets `closed` of the last 64 iterates repeat with that period, or are all the same (1), and neither the
    /// residual nor F1 has fallen meanwhile.
    pub fn period(
        &mut self,
        trace: &[f64],
        closed: impl Iterator<Item = bool>,
        residual: f64,
        energy: f64,
    ) -> Option<usize> {
        self.period_of_traces(trace).or_else(|| self.period_of_sets(closed, residual, energy))
    }

    fn period_of_traces(&mut self, trace: &[f64]) -> Option<usize> {
        let half = f64::EPSILON.sqrt();
        let apart = |other: &[f64]| trace.iter().zip(other).map(|(x, y)| (x - y).powi(2)).sum::<f64>().sqrt();
        let step = self.recent.back().map_or(0.0, |last| apart(last));
        let moved = step > half * crate::linalg::dot(trace, trace).sqrt();
        let found = (2..=self.recent.len())
            .find(|&period| moved && apart(&self.recent[self.recent.len() - period]) < half * step);
        if self.recent.len() == Self::LONGEST {
            self.recent.pop_front();
        }
        self.recent.push_back(trace.to_vec());
        found
    }

    fn period_of_sets(&mut self, closed: impl Iterator<Item = bool>, residual: f64, energy: f64) -> Option<usize> {
        let mut hash = DefaultHasher::new();
        closed.for_each(|closed| closed.hash(&mut hash));
        let start = self.sets.is_empty();
        self.best = if start { (residual, energy) } else { (self.best.0.min(residual), self.best.1.min(energy)) };
        self.sets.push_back((hash.finish(), self.best));
        if self.sets.len() <= Self::LONGEST.pow(2) {
            return None;
        }
        self.sets.pop_front();
        let (then, now) = (self.sets[0].1, self.best);
        let stuck = then.0 <= now.0 && then.1 <= now.1;
        let sets: Vec<u64> = self.sets.iter().map(|set| set.0).collect();
        let repeats = |period: &usize| sets.windows(period + 1).all(|window| window[0] == window[*period]);
        (1..=Self::LONGEST).find(|period| stuck && repeats(period))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cycle_is_seen_and_a_slow_approach_is_not() {
        let mut cycle = Cycle::default();
        let none = || std::iter::empty();
        let found: Vec<_> = (0..9).map(|k| cycle.period(&[(k % 3) as f64, 1.0], none(), 1.0, 0.0)).collect();
        assert_eq!(found.iter().flatten().next(), Some(&3));
        // the same contact sets again, with peaks that grow
        let mut growing = Cycle::default();
        let grow = |k: i32| (1.1f64.powi(k) * f64::from(k % 2), k % 2 == 0);
        let found = (0..99).find_map(|k| growing.period(&[grow(k).0], [grow(k).1, true].into_iter(), 1.0, 0.0));
        assert_eq!(found, Some(2));
        let mut slow = Cycle::default();
        assert!(
            (0..100)
                .all(|k| slow.period(&[1.0 + 0.999f64.powi(k)], [true].into_iter(), 0.999f64.powi(k), 0.0).is_none())
        );
        // contact flickers, but the energy falls
        let mut falling = Cycle::default();
        let fall = |k: i32| (1.0 + 0.9f64.powi(k % 2), 0.99f64.powi(k));
        assert!(
            (0..200)
                .all(|k| falling.period(&[fall(k).0 + fall(k).1], [k % 2 == 0].into_iter(), 1.0, fall(k).1).is_none())
        );
        // nothing happens any more
        let mut still = Cycle::default();
        let found = (0..99).find_map(|k| Some(k).zip(still.period(&[1.0], [true].into_iter(), 1.0, 0.0)));
        assert_eq!(found, Some((64, 1)));
    }

    /// Traces that come back are seen at once, sets of points when all 64 repeat; periods above eight never.
    #[test]
    fn periods_are_told_apart() {
        let first =
            |each: &mut dyn FnMut(usize) -> Option<usize>| (0..200).find_map(|k| each(k).map(|period| (k, period)));
        for period in 2..=8 {
            let mut traces = Cycle::default();
            let mut each = |k: usize| traces.period(&[(k % period) as f64, 2.0], std::iter::empty(), 1.0, 0.0);
            assert_eq!(first(&mut each), Some((period, period)));
            let mut sets = Cycle::default();
            let mut each = |k: usize| sets.period(&[k as f64], [k.is_multiple_of(period), true].into_iter(), 1.0, 0.0);
            assert_eq!(first(&mut each), Some((64, period)));
            // the residual falls once in a while
            let mut falling = Cycle::default();
            let mut each = |k: usize| {
                let residual = 0.5f64.powi((k / 50) as i32);
                falling.period(&[k as f64], [k.is_multiple_of(period), true].into_iter(), residual, 0.0)
            };
            assert_eq!(first(&mut each), None);
        }
        let falls = |k: usize| 0.9f64.powi(k as i32);
        let mut traces = Cycle::default();
        assert_eq!(first(&mut |k| traces.period(&[(k % 9) as f64, 2.0], std::iter::empty(), falls(k), 0.0)), None);
        let mut sets = Cycle::default();
        assert_eq!(first(&mut |k| sets.period(&[k as f64], [k.is_multiple_of(9), true].into_iter(), 1.0, 0.0)), None);
        // steps of 1e-8 are none, and traces that differ by 1e-7 are others
        let mut small = Cycle::default();
        assert_eq!(
            first(&mut |k| small.period(&[1.0 + 1e-8 * (k % 2) as f64], std::iter::empty(), falls(k), 0.0)),
            None
        );
        let mut drifting = Cycle::default();
        let mut each =
            |k: usize| drifting.period(&[(k % 2) as f64 + 1e-7 * k as f64, 1.0], std::iter::empty(), falls(k), 0.0);
        assert_eq!(first(&mut each), None);
    }

    #[test]
    fn increments_are_shares() {
        assert!((relative_increment(&[3.0, 4.0], &[0.0, 10.0]) - 0.5).abs() < 1e-15);
        assert_eq!((relative_increment(&[0.0], &[0.0]), relative_increment(&[1.0], &[0.0])), (0.0, f64::INFINITY));
    }

    #[test]
    fn stalling_is_suspected_only_after_a_while() {
        let mut floor = Floor::of_sweeps();
        assert!((0..200).all(|k| !floor.is_reached(0.89f64.powi(k))));
        // at the 20th iterate without progress, and at every 20th from there on
        let reached: Vec<usize> = (1..=60).filter(|_| floor.is_reached(1e-5)).collect();
        assert_eq!(reached, [20, 40, 60]);
        assert!((1..20).all(|_| !floor.is_reached(1e-5)) && !floor.is_reached(1e-11));
        // nine tenths of the best are no progress, less is
        let mut near = Floor { patience: 1, ..Floor::of_sweeps() };
        assert_eq!([1e-5, 0.9 * 1e-5, 0.89e-5].map(|error| near.is_reached(error)), [false, true, false]);
        let mut far = Floor::of_sweeps();
        assert!((0..99).all(|_| !far.is_reached(1.1e-4)));
        let mut steps = Floor::of_steps();
        assert_eq!([0.9; 5].map(|error| steps.is_reached(error)), [false, true, true, true, true]);
        assert!((0..9).all(|_| !steps.is_reached(1.0)));
        let mut fixed = Floor::of_steps();
        let seen: Vec<bool> = (0..9).map(|_| fixed.is_reached(1e-6) && fixed.is_fixed(1e-9)).collect();
        assert_eq!(seen.iter().position(|seen| *seen), Some(8));
        assert!(!fixed.is_fixed(1e-7) && !fixed.is_fixed(f64::NAN));
    }
}
