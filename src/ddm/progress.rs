//! Steps of Newton's method that lead nowhere.

/// Recognises steps that lead nowhere: stiff linear layers on few quadratic elements can come into a cycle of places, two of 4879
/// random scenes did.
#[derive(Debug, Clone)]
pub(super) struct Progress {
    /// Least work that a step changed, steps since, and F1 where the last step began.
    best: f64,
    since: usize,
    pub f1: f64,
}

impl Default for Progress {
    fn default() -> Self {
        Self { best: f64::INFINITY, since: 0, f1: f64::INFINITY }
    }
}

impl Progress {
    /// Whether two steps in a row have changed more than an earlier one, and the last one raised F1. Then no step does until one
    /// changes less than all before: places are those of traces, along which Newton's steps descend.
    pub fn is_lost(&mut self, change: f64, f1: f64) -> bool {
        self.since = if change < self.best { 0 } else { self.since + 1 };
        self.best = self.best.min(change);
        self.since >= 2 && f1 > self.f1
    }
}
