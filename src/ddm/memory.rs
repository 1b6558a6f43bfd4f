//! What a run remembers of its iterates beside the last one: how far and how fast it came. It decides when a run ends and how exact
//! inner solvers are, not what the solution is, so a run that goes on from a file begins without it.

use super::progress::Progress;
use super::steady::Steady;
use super::stop::{Cycle, Floor};
use crate::model::layer::Layer;
use crate::robin::{Sweep, Sweeper};

/// The step of a sweep that led to an iterate.
#[derive(Debug, Clone)]
pub(super) struct Last {
    /// The sweep before it.
    pub sweep: Sweep,
    /// gamma, if it went along the sweep's correction.
    pub relaxed: Option<f64>,
    /// How far it went along its direction.
    pub length: f64,
    /// Change of the traces.
    pub moved: Vec<f64>,
}

/// The memory of a run.
#[derive(Debug, Clone)]
pub struct Memory {
    pub(super) cycle: Cycle,
    pub(super) floor: Floor,
    /// Pressures of earlier sweeps.
    pub(super) steady: Steady,
    /// Of Newton's method.
    pub(super) progress: Progress,
    /// Layer states of the next step where a run paused.
    pub(super) states: Option<Layer>,
    /// Of sweeps: what was done, the last step, and the sweep at the iterate where a run paused.
    pub(super) sweeper: Sweeper,
    pub(super) last: Option<Last>,
    pub(super) sweep: Option<Sweep>,
    /// Sweeps of this run that another process made, and those that the solver of linear steps had made before it began.
    pub(super) earlier: usize,
    pub(super) foreign: usize,
}

impl Memory {
    /// Of a run with this floor of rounding, by a solver that had made so many sweeps before.
    pub(super) fn new(floor: Floor, foreign: usize) -> Self {
        Self {
            cycle: Cycle::default(),
            floor,
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
