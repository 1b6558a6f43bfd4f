//! Runs that pause: the observer that saves their state, and the loop that continues them.

use super::ended::All;
use super::requests;
use super::stages::{Done, Prepared};
use super::{look, results};
use crate::ddm::{self, Observer, Settings, Silent, Start, Status};
use crate::error::Result;

/// An observer that saves the state and results of a run. All calls are collective. A failure to write does not end the run.
pub trait Recorder: Observer {
    /// Save the state of a run, or of its load step, from which it can continue.
    fn state(&mut self, _done: &Done) {}

    /// Save the results of a finished load step, the last of [`Done::steps`], in the units of the scene, with its bodies.
    fn step(&mut self, _done: &Done, _recovered: &All) {}

    /// Save the results so far without changing the run.
    fn results(&mut self, _done: &mut Done) {}
}

impl Recorder for Silent {}

/// Solve through all pauses until a rule or a signal ends the run. `full` is whether this is the full load. There the run may end
/// at the error of the discretisation, and the interval of gamma is computed if the scene requests it.
pub fn solve(mut ready: Prepared, full: bool, keep: &mut dyn Recorder) -> Result<Done> {
    if let Start::Continue(state) = &ready.start {
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
        if requests::signal(asked).is_some() {
            return Ok(done);
        }
        if requests::is_snapshot(asked) {
            keep.results(&mut done);
        }
        ready = done.go_on(|outcome| Start::Continue(outcome.into_state()));
    }
}
