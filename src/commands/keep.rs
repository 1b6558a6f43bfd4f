//! What becomes of a run that pauses.

use super::prepared::Prepared;
use crate::ddm::{Outcome, Row};

/// Keeps what a run has. All calls are collective; what cannot be written is no reason to end the run.
pub trait Keep {
    /// The state of a run, or of its load step, from which it can go on; `earlier` are the rows of the load steps before.
    fn state(&mut self, prepared: &Prepared, outcome: &Outcome, earlier: &[Row]);

    /// The results so far, in the units of the scene.
    fn results(&mut self, prepared: &Prepared, outcome: &Outcome);
}

/// Keeps nothing.
pub struct Nothing;

impl Keep for Nothing {
    fn state(&mut self, _prepared: &Prepared, _outcome: &Outcome, _earlier: &[Row]) {}
    fn results(&mut self, _prepared: &Prepared, _outcome: &Outcome) {}
}
