//! The status with which a run ends, and what ends it: the watches for roundoff, cycles and pressures that still move, and the error of the mesh.

use crate::error::Result;
use crate::model::field::Field;
use crate::model::layer::Layer;
use crate::model::linear::{Failure, LinearStep};
use crate::model::rigid::Moved;
use crate::model::{Mechanism, Model};
use std::collections::VecDeque;
use std::hash::{DefaultHasher, Hash, Hasher};

/// How a run ended.
#[derive(Debug, Clone, PartialEq)]
pub enum Status {
    /// A stopping rule was met.
    Converged,
    /// The error cannot fall further in double precision.
    RoundoffLimited,
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
    /// The iterates repeat.
    Cycle {
        /// Updates after which they repeat; 1 if the contact stays the same and nothing falls.
        period: usize,
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
    /// The run ended as solved, but the forces of its displacements show a larger error.
    Inaccurate(Inaccuracy),
    /// A request from outside paused the run; it can go on from its outcome.
    Paused {
        /// The bits of [`Observer::asked`](super::Observer::asked) of all ranks.
        asked: u8,
    },
}

/// The error with which a run ended, and the larger one that was found afterwards, both relative.
#[derive(Debug, Clone, PartialEq)]
pub struct Inaccuracy {
    /// The error that the run would have ended with.
    pub reported: f64,
    /// The largest error that was found.
    pub found: f64,
    /// Where that error is.
    pub whose: Whose,
}

/// The place of an error.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Whose {
    /// In the forces on a body.
    Body(usize),
    /// In the pressures of a pair.
    Pair(usize),
    /// In the roundoff of all pressures.
    Rounding,
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

/// A watch for stagnation: at the roundoff level the error stops falling.
#[derive(Debug, Clone)]
pub struct Stagnation {
    /// The least error so far.
    best: f64,
    /// Iterates since the last progress.
    since: usize,
    /// Iterates without progress after which the roundoff level is suspected.
    patience: usize,
    /// Errors from here on are not explained by roundoff.
    believable: f64,
}

impl Stagnation {
    /// Share of the best error that an iterate must reach to be progress.
    const FALLS: f64 = 0.9;

    /// Return the watch for Newton's method. Its iterates are in equilibrium, so one iteration without progress suggests that the roundoff level
    /// is reached. A relative error of one or more leaves no digit of the solution.
    pub fn of_steps() -> Self {
        Self { best: f64::INFINITY, since: 0, patience: 1, believable: 1.0 }
    }

    /// Return the watch for sweeps. It waits for twenty iterates without progress, as each may gain half a per cent. The error must be below 1e-4,
    /// because iterates far from any solution can have large rounding errors, too.
    pub fn of_sweeps() -> Self {
        Self { patience: 20, believable: 1e-4, ..Self::of_steps() }
    }

    /// Whether an iterate with this error would be no progress, and can be a solution.
    pub fn is_stuck(&self, error: f64) -> bool {
        error >= Self::FALLS * self.best && error < self.believable
    }

    /// Note an error. Return whether it is time to compare it with the rounding errors.
    pub fn is_reached(&mut self, error: f64) -> bool {
        if error < Self::FALLS * self.best {
            self.best = error;
            self.since = 0;
        } else {
            self.since += 1;
        }
        self.since > 0 && self.since.is_multiple_of(self.patience) && error < self.believable
    }

    /// Whether Newton's method stands still. As many steps as the longest cycle has were no progress, and the relative `increment` of the last one
    /// is in the second half of the digits. The next step would be the same, so that only roundoff is left.
    pub fn is_fixed(&self, increment: f64) -> bool {
        self.patience == 1 && self.since >= Cycle::LONGEST && increment <= f64::EPSILON.sqrt()
    }
}

/// A watch for cycles: traces that come back, or contact sets that repeat without progress.
#[derive(Debug, Default, Clone)]
pub struct Cycle {
    /// Traces of the last iterates.
    recent: VecDeque<Vec<f64>>,
    /// Contact sets of the last iterates.
    sets: VecDeque<ContactSet>,
}

/// The contact set of an iterate.
#[derive(Debug, Clone, Copy)]
struct ContactSet {
    /// Hash of the set of closed points.
    hash: u64,
    /// Least residual of the run up to this iterate.
    residual: f64,
    /// Least F1 of the run up to this iterate.
    energy: f64,
}

impl Cycle {
    /// Longest period looked for. Contact sets must repeat for so many of the longest periods.
    const LONGEST: usize = 8;

    /// Note an iterate, and return the period of a cycle, if there is one:
    /// - from 2 to 8, if the traces are those of so many updates ago to half of the digits of the last update, which is itself not below half of
    ///   the digits of `trace`;
    /// - from 1 to 8, if the contact sets `closed` of the last 64 iterates repeat with this period, and neither the residual nor F1 (`energy`) has
    ///   fallen meanwhile. With the period 1 the contact sets are all the same.
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
        let distance = |other: &[f64]| trace.iter().zip(other).map(|(x, y)| (x - y).powi(2)).sum::<f64>().sqrt();
        let step = self.recent.back().map_or(0.0, |last| distance(last));
        let has_moved = step > half * crate::linalg::dot(trace, trace).sqrt();
        let found = (2..=self.recent.len())
            .find(|&period| has_moved && distance(&self.recent[self.recent.len() - period]) < half * step);
        if self.recent.len() == Self::LONGEST {
            self.recent.pop_front();
        }
        self.recent.push_back(trace.to_vec());
        found
    }

    fn period_of_sets(&mut self, closed: impl Iterator<Item = bool>, residual: f64, energy: f64) -> Option<usize> {
        let mut hash = DefaultHasher::new();
        closed.for_each(|closed| closed.hash(&mut hash));
        let mut now = ContactSet { hash: hash.finish(), residual, energy };
        if let Some(last) = self.sets.back() {
            (now.residual, now.energy) = (last.residual.min(residual), last.energy.min(energy));
        }
        self.sets.push_back(now);
        if self.sets.len() <= Self::LONGEST.pow(2) {
            return None;
        }
        self.sets.pop_front();
        let then = self.sets[0];
        let is_stuck = then.residual <= now.residual && then.energy <= now.energy;
        let hashes: Vec<u64> = self.sets.iter().map(|set| set.hash).collect();
        let repeats = |period: &usize| hashes.windows(period + 1).all(|window| window[0] == window[*period]);
        (1..=Self::LONGEST).find(|period| is_stuck && repeats(period))
    }
}

/// Share of an earlier residual below which the pressures of that iterate give an estimate.
const FALLEN: f64 = 0.1;

/// Earlier iterates, whose residuals fall from each to the next at least to the share [`FALLEN`].
///
/// They estimate the error of the pressures from their change while the residual fell.
///
/// A last step that moves nothing proves little. It may have been short, or along modes that do not change the contact, while other modes are far
/// from their end. In the long run, errors fall as the residual does. While the residual falls to a share s of its earlier value, a pressure
/// changes by 1 - s of its earlier error. So s/(1 - s) of that change is left as its error.
#[derive(Debug, Default, Clone)]
pub struct Steady {
    past: Vec<PastIterate>,
}

/// An earlier iterate.
#[derive(Debug, Clone)]
struct PastIterate {
    residual: f64,
    /// n.
    pressure: Vec<f64>,
}

impl Steady {
    /// Estimate the largest error of the pressures `now` (n) of an iterate with this residual; zero if it is the first one. Changes above their `peak`
    /// count as the peak: laws are far from linear there, so that larger errors say nothing about those that follow.
    pub fn missing(&self, residual: f64, now: &[f64], peak: f64) -> f64 {
        // from a good start the residual may never have fallen so far
        let earlier = self.past.iter().rfind(|earlier| residual <= FALLEN * earlier.residual).or(self.past.first());
        earlier.map_or(0.0, |earlier| {
            let change = largest_difference(&earlier.pressure, now).min(peak);
            // without a fall of the residual, no smaller error is known
            if residual < earlier.residual { change * residual / (earlier.residual - residual) } else { change }
        })
    }

    /// Note an iterate.
    pub fn note(&mut self, residual: f64, pressure: &[f64]) {
        self.past.retain(|earlier| earlier.residual > residual);
        if self.past.last().is_none_or(|earlier| residual <= FALLEN * earlier.residual) {
            self.past.push(PastIterate { residual, pressure: pressure.to_vec() });
        }
    }
}

fn largest_difference(before: &[f64], now: &[f64]) -> f64 {
    before.iter().zip(now).fold(0.0, |most, (before, now)| most.max((now - before).abs()))
}

/// An estimator of the error of the discrete solution relative to the continuous one.
pub trait Discretisation {
    /// Estimate the relative error of the discrete solution near an iterate, in the norm of [`Row::error`](super::Row). It is the part of the error
    /// that lies in the space of the iterates, so that it bounds the accuracy of nodal values.
    fn error(&mut self, model: &mut Model, linear: &mut dyn LinearStep, iterate: &Field, layer: &Layer) -> Result<f64>;
}

/// Largest error of the iteration, as a share of the error of the discretisation.
pub const SHARE: f64 = 0.1;

/// The stop rule. It asks for few estimates, because one costs about as much as a Newton step.
pub(super) struct BalanceRule {
    estimator: Box<dyn Discretisation>,
    /// The last estimate; before the first one, a relative error of one.
    last: f64,
}

impl BalanceRule {
    pub fn new(estimator: Box<dyn Discretisation>) -> Self {
        Self { estimator, last: 1.0 }
    }

    /// Whether an iterate with this estimated error is good enough. If it is by the last estimate, a new estimate at this iterate has to confirm it.
    pub fn is_met(
        &mut self,
        model: &mut Model,
        linear: &mut dyn LinearStep,
        iterate: &Field,
        layer: &Layer,
        error: f64,
    ) -> Result<bool> {
        if error.is_nan() || error > SHARE * self.last {
            return Ok(false);
        }
        self.last = self.estimator.error(model, linear, iterate, layer)?;
        Ok(error <= SHARE * self.last)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exchange::Serial;
    use crate::robin::Sweeps;
    use std::cell::Cell;
    use std::rc::Rc;

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
        let mut floor = Stagnation::of_sweeps();
        assert!((0..200).all(|k| !floor.is_reached(0.89f64.powi(k))));
        // at the 20th iterate without progress, and at every 20th from there on
        let reached: Vec<usize> = (1..=60).filter(|_| floor.is_reached(1e-5)).collect();
        assert_eq!(reached, [20, 40, 60]);
        assert!((1..20).all(|_| !floor.is_reached(1e-5)) && !floor.is_reached(1e-11));
        // nine tenths of the best are no progress, less is
        let mut near = Stagnation { patience: 1, ..Stagnation::of_sweeps() };
        assert_eq!([1e-5, 0.9 * 1e-5, 0.89e-5].map(|error| near.is_reached(error)), [false, true, false]);
        let mut far = Stagnation::of_sweeps();
        assert!((0..99).all(|_| !far.is_reached(1.1e-4)));
        let mut steps = Stagnation::of_steps();
        assert_eq!([0.9; 5].map(|error| steps.is_reached(error)), [false, true, true, true, true]);
        assert!((0..9).all(|_| !steps.is_reached(1.0)));
        let mut fixed = Stagnation::of_steps();
        let seen: Vec<bool> = (0..9).map(|_| fixed.is_reached(1e-6) && fixed.is_fixed(1e-9)).collect();
        assert_eq!(seen.iter().position(|seen| *seen), Some(8));
        assert!(!fixed.is_fixed(1e-7) && !fixed.is_fixed(f64::NAN));
    }

    /// One mode with the factor 0.99: its error is a hundred times each of its steps.
    #[test]
    fn a_slow_mode_is_not_still() {
        let mut steady = Steady::default();
        let error = |k: i32| 0.99f64.powi(k);
        for k in 0..1000 {
            if k > 300 {
                let missing = steady.missing(error(k), &[1.0 - error(k)], 1.0);
                assert!((missing / error(k) - 1.0).abs() < 1e-9, "{k}: {missing}");
            }
            steady.note(error(k), &[1.0 - error(k)]);
        }
        assert!(steady.past.len() < 12, "{} iterates are kept", steady.past.len());
    }

    /// A step that is short, or a residual that grew in between, hides nothing.
    #[test]
    fn neither_short_steps_nor_peaks_deceive() {
        let mut steady = Steady::default();
        assert_eq!(steady.missing(1e-9, &[3.0], 3.0), 0.0);
        let iterates = [(1.0, 0.0), (1e-5, 0.9), (1e-2, 0.95), (1e-3, 0.999), (0.99e-3, 0.999)];
        iterates.iter().for_each(|(residual, p)| steady.note(*residual, &[*p]));
        // since 1e-2 the pressure has moved by 0.049
        let missing = steady.missing(0.99e-3, &[0.999], 1.0);
        assert!((missing / (0.049 * 0.099 / 0.901) - 1.0).abs() < 1e-9, "{missing}");
        // from a start that was nearly as good
        let mut near = Steady::default();
        near.note(2e-8, &[1.0]);
        assert!((near.missing(1e-8, &[1.5], 1.5) - 0.5).abs() < 1e-12);
        assert_eq!(near.missing(3e-8, &[1.5], 1.5), 0.5);
        // a change from pressures above the peak gives no estimate
        let mut wild = Steady::default();
        wild.note(1.0, &[1e30]);
        assert!(wild.missing(1e-10, &[1.0], 1.0) < 1.1e-10);
    }

    struct Fixed(Rc<Cell<usize>>, Vec<f64>);

    impl Discretisation for Fixed {
        fn error(&mut self, _: &mut Model, _: &mut dyn LinearStep, _: &Field, _: &Layer) -> Result<f64> {
            self.0.set(self.0.get() + 1);
            Ok(self.1.remove(0))
        }
    }

    #[test]
    fn it_asks_first_when_worth_it_and_again_to_confirm() {
        let asked = Rc::new(Cell::new(0));
        let mut balance = BalanceRule::new(Box::new(Fixed(asked.clone(), vec![0.1, 0.02, 0.02])));
        let mut model = Model::new(Vec::new(), Vec::new(), std::rc::Rc::new(Serial));
        let layer = Layer::default();
        let mut linear = Sweeps::with_robin_term();
        let mut ask = |error: f64| {
            let met = balance.is_met(&mut model, &mut linear, &Field::default(), &layer, error).unwrap();
            (met, asked.get())
        };
        assert_eq!(ask(f64::NAN), (false, 0));
        assert_eq!(ask(0.2), (false, 0));
        // 0.02 > 0.1 * 0.1
        assert_eq!(ask(0.02), (false, 1));
        assert_eq!(ask(0.015), (false, 1));
        // worth asking again, and the answer is now 0.02
        assert_eq!(ask(0.009), (false, 2));
        assert_eq!(ask(0.0019), (true, 3));
    }
}
