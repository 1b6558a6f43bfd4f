//! Where the time of a run goes.

use crate::file::bytes_in_proc;
use std::collections::BTreeMap;
use std::rc::Rc;
use std::time::Instant;

/// Wall seconds of the phases of a run.
#[derive(Clone)]
pub struct Clock {
    began: Instant,
    last: Instant,
    /// Seconds by phase.
    pub times: BTreeMap<String, f64>,
    /// Largest resident memory of this process so far, 10^6 bytes, at the end of each phase; empty where the system does not say.
    pub memory: BTreeMap<String, f64>,
    /// Seconds of set-up and iteration by the estimate that chose the solvers, where one was made.
    pub estimate: Option<f64>,
    /// Called at the end of each phase with its name, at the beginning of the first with none.
    pub watch: Option<Rc<Watch>>,
}

/// Called with the name of a phase that has ended, and the estimate.
pub type Watch = dyn Fn(&str, Option<f64>);

impl Default for Clock {
    fn default() -> Self {
        let now = Instant::now();
        let (times, memory) = (BTreeMap::new(), BTreeMap::new());
        Self { began: now, last: now, times, memory, estimate: None, watch: None }
    }
}

impl Clock {
    /// Begins the first phase of a mesh.
    pub fn begin(&self) {
        self.watch.iter().for_each(|watch| watch("", None));
    }

    /// Ends a phase.
    pub fn phase(&mut self, name: &str) {
        let now = Instant::now();
        *self.times.entry(name.to_owned()).or_default() += (now - self.last).as_secs_f64();
        self.last = now;
        let peak = bytes_in_proc("/proc/self/status", "VmHWM");
        self.memory.extend(peak.map(|bytes| (name.to_owned(), bytes as f64 / 1e6)));
        self.watch.iter().for_each(|watch| watch(name, self.estimate));
    }

    /// Seconds since the run began, noted as `total`.
    pub fn total(&mut self) -> f64 {
        let total = self.began.elapsed().as_secs_f64();
        self.times.insert("total".to_owned(), total);
        total
    }
}
