//! What a run tells while it goes on: rows, states and fields of load steps; and the signals that end it.

use super::results;
use super::stages::{All, Done, Prepared};
use crate::ddm::{self, Observer, Row, Silent};
use crate::error::Result;
use crate::exchange::ASKS;
use crate::interrupt::{self, ENDING, Interrupt};

/// An observer that saves states and results of a run. All calls are collective. A failure to write does not end the
/// run.
pub trait Recorder: Observer {
    /// Save the states from which another process can go on: at the end of a load step, and of a run that a signal
    /// ends.
    fn state(&mut self, _done: &Done) {}

    /// Save the results of a finished load step, the last of `Done::steps`, in the units of the scene, with its bodies.
    fn step(&mut self, _done: &Done, _recovered: &All) {}
}

impl Recorder for Silent {}
impl Recorder for Interrupt {}

/// Solve until a rule or a signal ends the run. `full` is whether this is the full load. There the interval of gamma is
/// computed if the scene requests it.
pub fn solve(ready: Prepared, full: bool, keep: &mut dyn Recorder) -> Result<Done> {
    let Prepared { mut built, mut method, start, steps, largest, earlier, warnings } = ready;
    let wants_interval = built.scene.method.interval && full;
    let stop = &built.scene.method.stop;
    let outcome = ddm::solve(&mut built.discrete.model, &mut method, stop, wants_interval, start, keep)?;
    let mut done = Done { built, method, outcome, steps, largest, earlier, warnings, recovered: None };
    done.recovered = Some(results::recover(&done));
    Ok(done)
}

const _: () = assert!(ENDING.len() == ASKS, "a message has as many signals");

/// As the observer of a run, an interrupt passes on the signals that end it, and writes no rows.
impl Observer for Interrupt {
    fn row(&mut self, _row: &Row) {}

    fn asked(&self) -> u8 {
        let ending = ENDING.iter().position(|&signal| Interrupt::asked(self) == Some(signal));
        ending.map_or(0, |bit| 1 << bit)
    }
}

/// Return the signal that ends a run, from the bits of [`Observer::asked`](crate::ddm::Observer::asked).
pub fn signal(asked: u8) -> Option<i32> {
    ENDING.iter().enumerate().find(|(bit, _)| asked >> bit & 1 == 1).map(|(_, &signal)| signal)
}

/// Return the name of this signal, which is empty without one.
pub fn signal_name(asked: u8) -> &'static str {
    signal(asked).map_or("", interrupt::name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signals_are_bits() {
        assert_eq!((Observer::asked(&Interrupt::default()), signal(0)), (0, None));
        let reported = [0b111, 0b110, 0b100].map(signal_name);
        assert_eq!(reported, ["SIGTERM", "SIGINT", "SIGHUP"]);
    }
}
