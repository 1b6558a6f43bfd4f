//! Why a linear solver stopped.

use super::ffi;
use std::fmt;

/// Why a linear solver stopped.
///
/// ```
/// use winkler::petsc::ConvergedReason;
/// assert!(ConvergedReason::RelativeTolerance.converged());
/// assert!(!ConvergedReason::IterationLimit.converged());
/// assert_eq!(ConvergedReason::IterationLimit.to_string(), "the iteration limit was reached (-ksp_max_it)");
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ConvergedReason {
    /// The residual is below the relative tolerance.
    RelativeTolerance,
    /// The residual is below the absolute tolerance.
    AbsoluteTolerance,
    /// The asked number of iterations is done; also the end of a direct solve.
    Iterations,
    /// Another good ending of a method of PETSc, by its number.
    OtherConverged(i32),
    /// The iteration limit was reached.
    IterationLimit,
    /// The residual grew beyond the divergence tolerance.
    DivergenceTolerance,
    /// The Krylov space broke down.
    Breakdown,
    /// The method needs a symmetric matrix or preconditioner.
    NotSymmetric,
    /// The preconditioner is not positive definite.
    IndefinitePreconditioner,
    /// The matrix is not positive definite.
    IndefiniteMatrix,
    /// Infinity or not a number came up.
    NotFinite,
    /// The preconditioner or factorisation failed, with what is known about it.
    PreconditionerFailed(String),
    /// Another bad ending of a method of PETSc, by its number.
    OtherDiverged(i32),
}

impl ConvergedReason {
    /// Reads PETSc's number; `failure` tells more about a failed preconditioner.
    pub(super) fn from_raw(raw: ffi::KSPConvergedReason, failure: impl FnOnce() -> String) -> Self {
        match raw {
            ffi::KSPConvergedReason_KSP_CONVERGED_RTOL => Self::RelativeTolerance,
            ffi::KSPConvergedReason_KSP_CONVERGED_ATOL => Self::AbsoluteTolerance,
            ffi::KSPConvergedReason_KSP_CONVERGED_ITS => Self::Iterations,
            ffi::KSPConvergedReason_KSP_DIVERGED_ITS => Self::IterationLimit,
            ffi::KSPConvergedReason_KSP_DIVERGED_DTOL => Self::DivergenceTolerance,
            ffi::KSPConvergedReason_KSP_DIVERGED_BREAKDOWN | ffi::KSPConvergedReason_KSP_DIVERGED_BREAKDOWN_BICG => {
                Self::Breakdown
            }
            ffi::KSPConvergedReason_KSP_DIVERGED_NONSYMMETRIC => Self::NotSymmetric,
            ffi::KSPConvergedReason_KSP_DIVERGED_INDEFINITE_PC => Self::IndefinitePreconditioner,
            ffi::KSPConvergedReason_KSP_DIVERGED_INDEFINITE_MAT => Self::IndefiniteMatrix,
            ffi::KSPConvergedReason_KSP_DIVERGED_NANORINF => Self::NotFinite,
            ffi::KSPConvergedReason_KSP_DIVERGED_PC_FAILED => Self::PreconditionerFailed(failure()),
            raw if raw > 0 => Self::OtherConverged(raw),
            raw => Self::OtherDiverged(raw),
        }
    }

    /// Whether the solution is to the tolerance asked for.
    pub fn converged(&self) -> bool {
        matches!(self, Self::RelativeTolerance | Self::AbsoluteTolerance | Self::Iterations | Self::OtherConverged(_))
    }
}

impl fmt::Display for ConvergedReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let text = match self {
            Self::RelativeTolerance => "the relative tolerance was reached",
            Self::AbsoluteTolerance => "the absolute tolerance was reached",
            Self::Iterations => "the asked number of iterations was done",
            Self::IterationLimit => "the iteration limit was reached (-ksp_max_it)",
            Self::DivergenceTolerance => "the residual grew beyond the divergence tolerance (-ksp_divtol)",
            Self::Breakdown => "the Krylov method broke down",
            Self::NotSymmetric => "the Krylov method needs a symmetric matrix and preconditioner",
            Self::IndefinitePreconditioner => "the preconditioner is not positive definite",
            Self::IndefiniteMatrix => "the matrix is not positive definite",
            Self::NotFinite => "infinity or not a number came up",
            Self::PreconditionerFailed(what) => {
                return write!(f, "the preconditioner could not be made: {what}");
            }
            Self::OtherConverged(raw) => return write!(f, "PETSc converged for its reason {raw}"),
            Self::OtherDiverged(raw) => return write!(f, "PETSc diverged for its reason {raw}"),
        };
        f.write_str(text)
    }
}

#[cfg(test)]
mod tests {
    use super::ConvergedReason;

    #[test]
    fn positive_numbers_are_good_endings() {
        for raw in (-12..=12).filter(|raw| *raw != 0) {
            let reason = ConvergedReason::from_raw(raw, String::new);
            assert_eq!(reason.converged(), raw > 0, "{reason}");
        }
        // An iteration that has not ended is no good ending.
        assert!(!ConvergedReason::from_raw(0, String::new).converged());
    }
}
