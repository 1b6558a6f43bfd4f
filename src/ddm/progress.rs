//! Steps of Newton's method that lead nowhere.

/// Recognises contact sets that follow each other in a circle, or one point at a time: of 4879 random scenes of stiff layers on few
/// quadratic elements two came into a cycle. Then the laws have a barrier, until a step changes less than half of all before.
#[derive(Debug, Clone)]
pub(super) struct Progress {
    /// Least work that a step changed, and the steps since one has halved it.
    best: f64,
    since: usize,
    /// Energy per area, now and where it began.
    barrier: f64,
    first: f64,
    /// What it falls to in a step.
    rate: f64,
}

/// What the barrier falls to in a step: the usual 0.1 of barrier methods (Nocedal and Wright, Numerical Optimization, 2006, section 19.3). Where
/// that is too fast it becomes its root.
const RATE: f64 = 0.1;

/// Steps in a row without progress before there is a barrier: contact that has just been found may take one.
const PATIENCE: usize = 2;

impl Default for Progress {
    fn default() -> Self {
        Self { best: f64::INFINITY, since: 0, barrier: 0.0, first: 0.0, rate: RATE }
    }
}

impl Progress {
    /// The barrier after a step that changed this work, sum omega (p - p_q)(c_q - c), and at most `largest` of it per area: on a law with a
    /// barrier mu, p times the gap is mu where the layer is open, so it begins where no point changes more, however few of all they are, and
    /// falls with each step. Where that ends without progress, it begins again and falls slower: close enough to the path of the solutions over
    /// mu, Newton's method follows it.
    pub fn barrier(&mut self, change: f64, largest: f64) -> f64 {
        self.since = if change < 0.5 * self.best { 0 } else { self.since + 1 };
        self.best = self.best.min(change);
        if self.since == 0 {
            self.barrier = 0.0;
        } else if self.barrier > f64::EPSILON.sqrt() * self.first {
            self.barrier *= self.rate;
        } else if self.since >= PATIENCE {
            if self.barrier > 0.0 {
                self.rate = self.rate.sqrt();
            }
            self.first = largest;
            self.barrier = self.first;
        }
        self.barrier
    }
}
