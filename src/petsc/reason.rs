//! Why a linear solver stopped.

use super::ffi;
use std::fmt;

/// The reason why a linear solver stopped; it is displayed as a sentence.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ConvergedReason {
    /// PETSc's number of the reason, positive for convergence.
    pub number: ffi::KSPConvergedReason,
    text: String,
}

impl ConvergedReason {
    /// Translate PETSc's number. `failure` returns the reason of a failed preconditioner.
    pub(super) fn from_raw(raw: ffi::KSPConvergedReason, failure: impl FnOnce() -> String) -> Self {
        let text = match raw {
            ffi::KSPConvergedReason_KSP_CONVERGED_RTOL => "the relative tolerance was reached",
            ffi::KSPConvergedReason_KSP_CONVERGED_ATOL => "the absolute tolerance was reached",
            // a direct solve ends with this reason, too
            ffi::KSPConvergedReason_KSP_CONVERGED_ITS => "the asked number of iterations was done",
            ffi::KSPConvergedReason_KSP_DIVERGED_ITS => "the iteration limit was reached (-ksp_max_it)",
            ffi::KSPConvergedReason_KSP_DIVERGED_DTOL => {
                "the residual grew beyond the divergence tolerance (-ksp_divtol)"
            }
            ffi::KSPConvergedReason_KSP_DIVERGED_BREAKDOWN | ffi::KSPConvergedReason_KSP_DIVERGED_BREAKDOWN_BICG => {
                "the Krylov method broke down"
            }
            ffi::KSPConvergedReason_KSP_DIVERGED_NONSYMMETRIC => {
                "the Krylov method needs a symmetric matrix and preconditioner"
            }
            ffi::KSPConvergedReason_KSP_DIVERGED_INDEFINITE_PC => "the preconditioner is not positive definite",
            ffi::KSPConvergedReason_KSP_DIVERGED_INDEFINITE_MAT => "the matrix is not positive definite",
            ffi::KSPConvergedReason_KSP_DIVERGED_NANORINF => "infinity or not a number came up",
            ffi::KSPConvergedReason_KSP_DIVERGED_PC_FAILED => {
                &format!("the preconditioner could not be made: {}", failure())
            }
            raw if raw > 0 => &format!("PETSc converged for its reason {raw}"),
            raw => &format!("PETSc diverged for its reason {raw}"),
        };
        Self { number: raw, text: text.to_owned() }
    }

    /// Return whether the solver converged. An iteration that has not ended did not.
    pub fn converged(&self) -> bool {
        self.number > 0
    }
}

impl fmt::Display for ConvergedReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}
