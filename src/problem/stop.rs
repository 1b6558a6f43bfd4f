//! The rules that stop a run.

/// The rules that stop a run. At least one of `residual` and `increment` is given. The first rule that is met ends the run.
#[derive(Debug, Clone, PartialEq)]
pub struct StopRule {
    /// Tolerance of the relative residual of sweeps, or of the largest relative error of Newton's method (docs/theory.md). The default
    /// is 1e-8 if `increment` is not given.
    pub residual: Option<f64>,
    /// Tolerance of the paper's rule: the relative increment of normal displacements, in every body.
    pub increment: Option<f64>,
    /// Whether to stop where the error of the iteration is a tenth of the error of the discretisation.
    pub balanced: bool,
    /// The most iterations; 2000 by default.
    pub iterations: usize,
}

impl Default for StopRule {
    fn default() -> Self {
        Self { residual: Some(1e-8), increment: None, balanced: false, iterations: 2000 }
    }
}

impl StopRule {
    /// Return the tolerance that relative errors inside a run refer to. It is that of the residual, or the square root of machine epsilon
    /// where the increment alone ends the run.
    pub fn tolerance(&self) -> f64 {
        self.residual.unwrap_or(f64::EPSILON.sqrt())
    }

    /// Return whether an iterate meets a rule. `residual` and `increment` are relative; the increment is NaN before the first update.
    pub fn is_met(&self, residual: f64, increment: f64) -> bool {
        self.residual.is_some_and(|tolerance| residual <= tolerance)
            || self.increment.is_some_and(|tolerance| increment <= tolerance)
    }
}
