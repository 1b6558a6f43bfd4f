//! The time and memory of the phases of a run.

use crate::file::bytes_in_proc;
use std::collections::BTreeMap;
use std::rc::Rc;
use std::time::Instant;

/// The clock of a run, which measures its phases.
#[derive(Clone)]
pub struct Clock {
    began: Instant,
    last: Instant,
    /// Wall seconds by phase.
    pub times: BTreeMap<String, f64>,
    /// Peak resident memory of this process at the end of each phase, 10^6 bytes; empty where the system does not report it.
    pub memory: BTreeMap<String, f64>,
    /// Estimated seconds of set-up and iteration, if the choice of the solvers made an estimate.
    pub estimate: Option<f64>,
    /// Function that is called at the end of each phase with its name, and at the beginning of the first with an empty name.
    pub watch: Option<Rc<Watch>>,
}

/// A function of the name of a phase that has ended, and of the estimate.
pub type Watch = dyn Fn(&str, Option<f64>);

impl Default for Clock {
    fn default() -> Self {
        let now = Instant::now();
        let (times, memory) = (BTreeMap::new(), BTreeMap::new());
        Self { began: now, last: now, times, memory, estimate: None, watch: None }
    }
}

impl Clock {
    /// Report the beginning of the first phase of a mesh.
    pub fn begin(&self) {
        self.watch.iter().for_each(|watch| watch("", None));
    }

    /// End a phase, which began when the one before ended.
    pub fn phase(&mut self, name: &str) {
        let now = Instant::now();
        *self.times.entry(name.to_owned()).or_default() += (now - self.last).as_secs_f64();
        self.last = now;
        let peak = bytes_in_proc("/proc/self/status", "VmHWM");
        self.memory.extend(peak.map(|bytes| (name.to_owned(), bytes as f64 / 1e6)));
        self.watch.iter().for_each(|watch| watch(name, self.estimate));
    }

    /// Return the seconds since the run began, and store them as `total`.
    pub fn total(&mut self) -> f64 {
        let total = self.began.elapsed().as_secs_f64();
        self.times.insert("total".to_owned(), total);
        total
    }
}
