//! Preconditioners and factorisations that fail, and how a solver recovers.

use super::library::petsc;
use super::{Int, Ksp, ffi};
use crate::error::Result;
use std::ptr::null_mut;

impl Ksp {
    /// Return why the set-up of the preconditioner failed, such as a zero pivot, or `None` if it did not.
    pub fn failure(&self) -> Option<String> {
        let pc = self.pc().ok()?;
        let text = match self.failed_reason().ok()? {
            ffi::PCFailedReason_PC_NOERROR => return None,
            ffi::PCFailedReason_PC_FACTOR_STRUCT_ZEROPIVOT => "a zero pivot in the pattern of the factorisation",
            ffi::PCFailedReason_PC_FACTOR_NUMERIC_ZEROPIVOT => "a zero pivot in the factorisation",
            ffi::PCFailedReason_PC_FACTOR_OUTMEMORY => "not enough memory for the factorisation",
            ffi::PCFailedReason_PC_FACTOR_OTHER => "the factorisation failed",
            ffi::PCFailedReason_PC_SUBPC_ERROR => "a preconditioner inside it failed",
            _ => "its set-up failed",
        };
        Some(match self.mumps_info(pc) {
            Some((first, second)) => {
                format!("{text}; MUMPS says INFOG(1)={first}, INFOG(2)={second}")
            }
            None => text.to_owned(),
        })
    }

    /// Reset a preconditioner that failed if the matrix has changed since. PETSc's interface to MUMPS never factors again after a failure.
    pub(super) fn recover(&self) -> Result<()> {
        let Some(before) = self.failed_at.get() else {
            return Ok(());
        };
        if self.updates.get() == before {
            return Ok(());
        }
        self.failed_at.set(None);
        self.reset()
    }

    /// Reset the preconditioner, and keep the matrix and everything else.
    pub(super) fn reset(&self) -> Result<()> {
        let pc = self.pc()?;
        let (mut matrix, mut same) = (null_mut(), null_mut());
        // SAFETY: the reset drops the matrix; our reference keeps it until it is set again.
        unsafe {
            petsc!(PCGetOperators(pc, &mut matrix, &mut same))?;
            petsc!(PetscObjectReference(matrix.cast()))?;
            let set = petsc!(PCReset(pc)).and_then(|()| petsc!(KSPSetOperators(self.ksp, matrix, matrix)));
            petsc!(PetscObjectDereference(matrix.cast()))?;
            set
        }
    }

    /// Return whether MUMPS' factorisation needed more space or message buffers than its analysis foresaw.
    ///
    /// The need of several ranks depends on the order of their messages.
    pub(super) fn lacks_space(&self) -> bool {
        let info = || self.mumps_info(self.pc().ok()?);
        self.failure().is_some() && info().is_some_and(|(first, _)| matches!(first, -8 | -9 | -17 | -20))
    }

    /// Allow the next factorisation `percent` more space than MUMPS' analysis foresees. To be called before its set-up.
    pub(super) fn set_extra_space(&self, percent: Int) -> Result<()> {
        let (pc, mut factor) = (self.pc()?, null_mut());
        // SAFETY: the matrix of the factors belongs to the preconditioner; PETSc refuses one that is not of MUMPS.
        unsafe {
            petsc!(PCFactorSetUpMatSolverType(pc))?;
            petsc!(PCFactorGetMatrix(pc, &mut factor))?;
            petsc!(MatMumpsSetIcntl(factor, 14, percent))
        }
    }

    /// Note with which values of the matrix the preconditioner failed, if it did.
    pub(super) fn note_failure(&self) -> Result<()> {
        let failed = self.failed_reason()? != ffi::PCFailedReason_PC_NOERROR;
        self.failed_at.set(failed.then(|| self.updates.get()));
        Ok(())
    }

    /// Return PETSc's reason for a failure of the preconditioner.
    fn failed_reason(&self) -> Result<ffi::PCFailedReason> {
        let mut reason = ffi::PCFailedReason_PC_NOERROR;
        let pc = self.pc()?;
        // SAFETY: the preconditioner of this solver.
        unsafe { petsc!(PCGetFailedReason(pc, &mut reason)) }?;
        Ok(reason)
    }

    /// Return MUMPS' INFOG(1) and INFOG(2), if MUMPS factors.
    fn mumps_info(&self, pc: ffi::PC) -> Option<(Int, Int)> {
        if self.factor_package()? != "mumps" {
            return None;
        }
        let mut factor = null_mut();
        let (mut first, mut second) = (0, 0);
        // SAFETY: MUMPS has factored, and the factors belong to the preconditioner.
        unsafe {
            petsc!(PCFactorGetMatrix(pc, &mut factor)).ok()?;
            petsc!(MatMumpsGetInfog(factor, 1, &mut first)).ok()?;
            petsc!(MatMumpsGetInfog(factor, 2, &mut second)).ok()?;
        }
        Some((first, second))
    }
}
