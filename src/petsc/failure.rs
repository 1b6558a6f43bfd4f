//! Preconditioners and factorisations that fail, and getting over it.

use super::library::petsc;
use super::{Int, Ksp, ffi};
use crate::error::Result;
use std::ptr::null_mut;

impl Ksp {
    /// What went wrong in making the preconditioner, such as a zero pivot; `None` if nothing did.
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

    /// Forgets a preconditioner that failed if the matrix has changed since: PETSc's interface to MUMPS never factors
    /// again after a failure.
    pub(super) fn recover(&self) -> Result<()> {
        let Some(before) = self.failed_at.get() else {
            return Ok(());
        };
        if self.updates.get() == before {
            return Ok(());
        }
        self.failed_at.set(None);
        self.forget()
    }

    /// Forgets the preconditioner, and nothing else.
    pub(super) fn forget(&self) -> Result<()> {
        let pc = self.pc()?;
        let (mut matrix, mut same) = (null_mut(), null_mut());
        // SAFETY: the reset lets the matrix go; our reference keeps it till it is set again.
        unsafe {
            petsc!(PCGetOperators(pc, &mut matrix, &mut same))?;
            petsc!(PetscObjectReference(matrix.cast()))?;
            let set = petsc!(PCReset(pc)).and_then(|()| petsc!(KSPSetOperators(self.ksp, matrix, matrix)));
            petsc!(PetscObjectDereference(matrix.cast()))?;
            set
        }
    }

    /// Whether MUMPS' factorisation ran out of the space, or of the buffers for messages, that its analysis foresaw: what it takes on
    /// several ranks depends on when they answer.
    pub(super) fn lacks_room(&self) -> bool {
        let info = || self.mumps_info(self.pc().ok()?);
        self.failure().is_some() && info().is_some_and(|(first, _)| matches!(first, -8 | -9 | -17 | -20))
    }

    /// Gives the next factorisation, which is not begun, `percent` more space than MUMPS' analysis foresees.
    pub(super) fn set_room(&self, percent: Int) -> Result<()> {
        let (pc, mut factor) = (self.pc()?, null_mut());
        // SAFETY: the matrix of the factors belongs to the preconditioner; PETSc refuses one that is not of MUMPS.
        unsafe {
            petsc!(PCFactorSetUpMatSolverType(pc))?;
            petsc!(PCFactorGetMatrix(pc, &mut factor))?;
            petsc!(MatMumpsSetIcntl(factor, 14, percent))
        }
    }

    /// Remembers with which matrix the preconditioner failed, if it did.
    pub(super) fn note_failure(&self) -> Result<()> {
        let failed = self.failed_reason()? != ffi::PCFailedReason_PC_NOERROR;
        self.failed_at.set(failed.then(|| self.updates.get()));
        Ok(())
    }

    /// PETSc's number for a failure of the preconditioner.
    fn failed_reason(&self) -> Result<ffi::PCFailedReason> {
        let mut reason = ffi::PCFailedReason_PC_NOERROR;
        let pc = self.pc()?;
        // SAFETY: the preconditioner of this solver.
        unsafe { petsc!(PCGetFailedReason(pc, &mut reason)) }?;
        Ok(reason)
    }

    /// MUMPS' INFOG(1) and INFOG(2), where MUMPS factors.
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
