//! When a run stops.

/// Rules of a run. At least one of `residual` and `increment` is given; the first rule met stops.
#[derive(Debug, Clone, PartialEq)]
pub struct StopRule {
    /// Relative residual of sweeps, largest relative error of Newton's method (docs/theory.md); default 1e-8 when `increment` is not
    /// given.
    pub residual: Option<f64>,
    /// The paper's rule on the increment of normal displacements, for every body.
    pub increment: Option<f64>,
    /// Whether to stop where the error of the iteration is a tenth of that of the discretisation.
    pub balanced: bool,
    /// Most iterations; default 2000.
    pub iterations: usize,
}

impl Default for StopRule {
    fn default() -> Self {
        Self { residual: Some(1e-8), increment: None, balanced: false, iterations: 2000 }
    }
}

impl StopRule {
    /// What relative errors inside a run refer to: the tolerance of its residual; half of all digits where the increment alone ends it.
    pub fn tolerance(&self) -> f64 {
        self.residual.unwrap_or(f64::EPSILON.sqrt())
    }

    /// Whether an iterate with this number, reached by this increment (NaN before the first update), is good enough.
    pub fn is_met(&self, residual: f64, increment: f64) -> bool {
        self.residual.is_some_and(|tolerance| residual <= tolerance)
            || self.increment.is_some_and(|tolerance| increment <= tolerance)
    }
}
