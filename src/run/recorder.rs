//! Runs that pause: who watches them and keeps what they have, and how they go on.

use super::ended::All;
use super::requests;
use super::stages::{Done, Prepared};
use super::{look, results};
use crate::ddm::{self, Observer, Settings, Silent, Start, Status};
use crate::error::Result;

/// An observer that keeps what a run has. All calls are collective; what cannot be written is no reason to end the run.
pub trait Recorder: Observer {
    /// Keeps the state of a run, or of its load step, from which it can go on.
    fn state(&mut self, _done: &Done) {}

    /// Keeps the results of a load step that has ended, the last of [`Done::steps`], in the units of the scene, with
    /// its bodies.
    fn step(&mut self, _done: &Done, _recovered: &All) {}

    /// Keeps the results so far, and leaves the run as it is.
    fn results(&mut self, _done: &mut Done) {}
}

impl Recorder for Silent {}

/// Solves through all pauses until a rule or a signal ends the run. At the full load it may end at the error of the discretisation,
/// and the interval of gamma is found if the scene asks for it.
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
