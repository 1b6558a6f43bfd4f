//! What is known of an iterate before a step is made from it: its layer and Robin term, the sweep, its row of the history, and whether
//! the run ends there.

use super::field::Field;
use super::iterate::Settings;
use super::layer::Layer;
use super::method::{Method, ROUGH};
use super::model::Model;
use super::origin::Origin;
use super::progress::Row;
use super::robin::{self, Robin};
use super::scale::Scale;
use super::sweep::{Sweep, Sweeper};
use super::watch::{Last, Seen, Verdict, Watch};
use crate::error::Result;
use std::time::Instant;

/// Measures the iterates of a run, one after the other.
pub(super) struct Measuring {
    clock: Instant,
    robin: Robin,
    watch: Watch,
    /// Counts sweeps.
    pub sweeper: Sweeper,
}

/// An iterate, and how it was reached.
pub(super) struct At<'a> {
    /// Updates made so far.
    pub k: usize,
    /// The iterate.
    pub iterate: &'a Field,
    /// The layers there.
    pub layer: &'a Layer,
    /// Rigid motions that were taken out of it.
    pub origin: Option<&'a Origin>,
    /// The step that led there.
    pub last: Option<&'a Last>,
}

impl Measuring {
    /// For a run that began at `clock`, with the scales of rest.
    pub fn new(clock: Instant, robin: Robin, scale: Scale) -> Self {
        Self { clock, robin, watch: Watch::new(scale), sweeper: Sweeper::default() }
    }

    /// The Robin term omega psi kappa for the sweep at an iterate. Steps of a joint method take nothing from it but a measure, for
    /// which that of the iterate `before` does as long as it is of the size.
    pub fn weight(
        &mut self,
        model: &Model,
        settings: &Settings,
        layer: &Layer,
        k: usize,
        before: Option<Vec<f64>>,
    ) -> Vec<f64> {
        let own = self.robin.weight(model, &settings.zone, layer, k);
        before.filter(|before| robin::is_of_the_size(model, before, &own)).unwrap_or(own)
    }

    /// Sweeps (41) at an iterate, and judges it: roughly for a joint method, and again if it is good by that.
    ///
    /// # Errors
    /// Failures of the solver library.
    pub fn measure(
        &mut self,
        model: &mut Model,
        settings: &Settings,
        method: &dyn Method,
        at: &At,
        weight: &mut Vec<f64>,
    ) -> Result<(Sweep, Row, Verdict)> {
        let At { k, iterate, layer, origin, last } = *at;
        model.precision(method.precision())?;
        let from = origin.map_or(&[][..], Origin::trace);
        let mut rough = method.is_joint();
        loop {
            model.robin(weight)?;
            let relaxed = last.filter(|last| last.relaxed).map(|last| (&last.sweep, last.length));
            let sweep = self.sweeper.sweep(model, iterate, layer, weight, relaxed)?;
            let seen = Seen { model, iterate, origin: from, layer, sweep: &sweep, last };
            let mut row = self.watch.measure(&seen);
            (row.iteration, row.sweeps, row.seconds) = (k, self.sweeper.sweeps, self.clock.elapsed().as_secs_f64());
            row.factorizations += method.coupled().factorizations;
            row.inner_iterations += method.coupled().inner_iterations;
            row.energy += origin.map_or(0.0, |origin| origin.energy);
            row.error = row.residual * method.amplification().sqrt();
            let verdict = self.watch.judge(&seen, &settings.stop, &row);
            // good by an old Robin term or a rough solve is not yet good by the ones that belong here
            if rough && matches!(verdict, Verdict::End(super::Status::Converged)) {
                rough = false;
                let own = self.robin.weight(model, &settings.zone, layer, k);
                if model.precision(ROUGH)? || own != *weight {
                    *weight = own;
                    continue;
                }
            }
            return Ok((sweep, row, verdict));
        }
    }
}
