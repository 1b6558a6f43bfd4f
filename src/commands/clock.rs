//! Where the time of a run goes.

use std::collections::BTreeMap;
use std::time::Instant;

/// Wall seconds of the phases of a run.
#[derive(Debug, Clone)]
pub struct Clock {
    began: Instant,
    last: Instant,
    /// Seconds by phase.
    pub times: BTreeMap<String, f64>,
}

impl Default for Clock {
    fn default() -> Self {
        let now = Instant::now();
        Self { began: now, last: now, times: BTreeMap::new() }
    }
}

impl Clock {
    /// Ends a phase.
    pub fn phase(&mut self, name: &str) {
        let now = Instant::now();
        *self.times.entry(name.to_owned()).or_default() += (now - self.last).as_secs_f64();
        self.last = now;
    }

    /// Seconds since the run began, noted as `total`.
    pub fn total(&mut self) -> f64 {
        let total = self.began.elapsed().as_secs_f64();
        self.times.insert("total".to_owned(), total);
        total
    }
}
