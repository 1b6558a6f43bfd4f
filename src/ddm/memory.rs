//! What a run remembers of its iterates besides the last one. This memory decides when the run ends and how its next steps are taken, not what the
//! solution is. So a run that goes on from a file begins without it.

use super::progress::Progress;
use super::steady::Steady;
use super::stop::{Cycle, Stagnation};
use crate::model::layer::Layer;
use crate::robin::{Sweep, Sweeper};

/// The step that led to an iterate of sweeps.
#[derive(Debug, Clone)]
pub(super) struct Last {
    /// The sweep before the step.
    pub sweep: Sweep,
    /// gamma, if the step was taken along the sweep's correction.
    pub relaxed: Option<f64>,
    /// Length of the step along its direction.
    pub length: f64,
    /// Change of the traces, 2n.
    pub moved: Vec<f64>,
}

/// The memory of a run.
#[derive(Debug, Clone)]
pub struct Memory {
    pub(super) cycle: Cycle,
    pub(super) stagnation: Stagnation,
    /// Pressures of earlier sweeps.
    pub(super) steady: Steady,
    /// Steps of Newton's method.
    pub(super) progress: Progress,
    /// Layer states of the next step of Newton's method, if the run paused.
    pub(super) states: Option<Layer>,
    /// Counters of sweeps.
    pub(super) sweeper: Sweeper,
    /// The last step of sweeps.
    pub(super) last: Option<Last>,
    /// The sweep at the last iterate, if the run paused.
    pub(super) sweep: Option<Sweep>,
    /// Sweeps of this run that another process made.
    pub(super) earlier: usize,
    /// Sweeps that the solver of linear steps had made before this run began.
    pub(super) foreign: usize,
}

impl Memory {
    /// Return the memory of a run that begins with this watch for stagnation, by a solver that had made `foreign` sweeps before.
    pub(super) fn new(stagnation: Stagnation, foreign: usize) -> Self {
        Self {
            cycle: Cycle::default(),
            stagnation,
            steady: Steady::default(),
            progress: Progress::default(),
            states: None,
            sweeper: Sweeper::default(),
            last: None,
            sweep: None,
            earlier: 0,
            foreign,
        }
    }
}
