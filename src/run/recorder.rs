//! Runs that pause: requests by signals and by time, the observer that saves their state, and the loop that continues them.

use super::look;
use super::results;
use super::stages::{All, Done, Prepared};
use crate::ddm::{self, InitialGuess, Observer, Row, Settings, Silent, Status};
use crate::error::Result;
use crate::exchange::ASKS;
use crate::interrupt::{self, ENDING, Interrupt};
use std::cell::Cell;
use std::time::{Duration, Instant};

/// An observer that saves the state and results of a run. All calls are collective. A failure to write does not end the run.
pub trait Recorder: Observer {
    /// Save the state of a run, or of its load step, from which it can continue.
    fn state(&mut self, _done: &Done) {}

    /// Save the results of a finished load step, the last of `Done::steps`, in the units of the scene, with its bodies.
    fn step(&mut self, _done: &Done, _recovered: &All) {}

    /// Save the results so far without changing the run.
    fn results(&mut self, _done: &mut Done) {}
}

impl Recorder for Silent {}
impl Recorder for Requests {}

/// Solve through all pauses until a rule or a signal ends the run. `full` is whether this is the full load. There the run may end
/// at the error of the discretisation, and the interval of gamma is computed if the scene requests it.
pub fn solve(mut ready: Prepared, full: bool, keep: &mut dyn Recorder) -> Result<Done> {
    if let InitialGuess::Continue(state) = &ready.start {
        state.rows.iter().for_each(|row| keep.row(row));
    }
    loop {
        let Prepared { mut built, mut method, start, steps, earlier, warnings } = ready;
        let (stop, interval) = (built.scene.method.stop.clone(), built.scene.method.interval && full);
        let mut settings = Settings { stop, interval, balance: built.balance().filter(|_| full), start };
        let outcome = ddm::solve(&mut built.discrete.model, &mut method, &mut settings, keep)?;
        let (recovered, look) = (None, None);
        let mut done = Done { built, method, outcome, share: 1.0, steps, earlier, warnings, recovered, look };
        let Status::Paused { asked } = done.outcome.status else {
            let recovered = results::recover(&done);
            look::look(&mut done, &recovered);
            done.recovered = Some(recovered);
            return Ok(done);
        };
        keep.state(&done);
        if signal(asked).is_some() {
            return Ok(done);
        }
        if is_snapshot(asked) {
            keep.results(&mut done);
        }
        ready = done.go_on(|outcome| InitialGuess::Continue(outcome.into_state()));
    }
}

/// Bits of [`Observer::asked`](crate::ddm::Observer::asked) that follow those of [`ENDING`].
const SNAPSHOT: u8 = 1 << ENDING.len();
const CHECKPOINT: u8 = SNAPSHOT << 1;
const _: () = assert!(CHECKPOINT == 1 << (ASKS - 1), "a message has as many kinds");

/// The requests by signals, and the time of the next checkpoint.
pub struct Requests {
    interrupt: Interrupt,
    /// Time between checkpoints, on the rank that keeps the time.
    every: Option<Duration>,
    last: Cell<Instant>,
}

impl Requests {
    /// Request a checkpoint after every `minutes`, if they are given.
    pub fn new(interrupt: &Interrupt, minutes: Option<f64>) -> Self {
        let every = minutes.and_then(|minutes| Duration::try_from_secs_f64(60.0 * minutes).ok());
        Self { interrupt: interrupt.clone(), every, last: Cell::new(Instant::now()) }
    }
}

/// As the observer of a run it passes requests on, and writes no rows.
impl Observer for Requests {
    fn row(&mut self, _row: &Row) {}

    fn asked(&self) -> u8 {
        let ending = ENDING.iter().position(|&signal| self.interrupt.asked() == Some(signal));
        let snapshot = if self.interrupt.wants_snapshot() { SNAPSHOT } else { 0 };
        let due = self.every.is_some_and(|every| self.last.get().elapsed() >= every);
        if due {
            self.last.set(Instant::now());
        }
        ending.map_or(0, |bit| 1 << bit) | snapshot | if due { CHECKPOINT } else { 0 }
    }
}

/// Return the signal that requests the end of a run, if any.
pub fn signal(asked: u8) -> Option<i32> {
    ENDING.iter().enumerate().find(|(bit, _)| asked >> bit & 1 == 1).map(|(_, &signal)| signal)
}

/// Return the name of this signal, which is empty without one.
pub fn signal_name(asked: u8) -> &'static str {
    signal(asked).map_or("", interrupt::name)
}

/// Return whether a snapshot is requested.
pub fn is_snapshot(asked: u8) -> bool {
    asked & SNAPSHOT != 0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_asks_for_checkpoints_and_nothing_else() {
        let asking = |minutes| Requests::new(&Interrupt::default(), minutes).asked();
        assert_eq!([asking(None), asking(Some(1e9)), asking(Some(0.0))], [0, 0, CHECKPOINT]);
        assert_eq!((signal(CHECKPOINT | SNAPSHOT), is_snapshot(CHECKPOINT)), (None, false));
        let reported = [0b111, 0b110, 0b100].map(signal_name);
        assert_eq!(reported, ["SIGTERM", "SIGINT", "SIGHUP"]);
    }
}
