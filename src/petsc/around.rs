//! A preconditioner in Rust around one of PETSc (PCSHELL).

use super::library::petsc;
use super::{Matrix, ffi};
use crate::error::{Error, Result};
use std::cell::RefCell;
use std::ffi::c_void;
use std::ptr::{null, null_mut};

/// Applies z = M^-1 r with the help of another preconditioner, one entry a row of this process each.
pub(super) type Apply = dyn Fn(ffi::PC, &[f64], &mut [f64]) -> Result<()>;

/// A solver's own preconditioner and the one around it.
pub(super) struct Around {
    /// The own one.
    pub inner: ffi::PC,
    /// The one around it.
    pub outer: ffi::PC,
    /// `outer` has this pointer.
    context: *mut Context,
}

/// What the callbacks work with.
struct Context {
    inner: ffi::PC,
    apply: Box<Apply>,
    /// The first failure, which PETSc knows by its number alone.
    failure: RefCell<Option<Error>>,
}

impl Around {
    /// Around a preconditioner of this matrix; `name` is what `-ksp_view` shows.
    pub fn new(matrix: &Matrix, inner: ffi::PC, name: &'static std::ffi::CStr, apply: Box<Apply>) -> Result<Self> {
        // SAFETY: a reference of our own keeps the inner one when its solver takes another.
        unsafe { petsc!(PetscObjectReference(inner.cast())) }?;
        let context = Box::into_raw(Box::new(Context { inner, apply, failure: RefCell::default() }));
        let mut around = Self { inner, outer: null_mut(), context };
        // SAFETY: a new preconditioner, whose context lives as long as our reference to it.
        unsafe {
            petsc!(PCCreate(matrix.scope().comm(matrix.session()), &mut around.outer))?;
            petsc!(PCSetType(around.outer, c"shell".as_ptr()))?;
            petsc!(PCShellSetContext(around.outer, context.cast()))?;
            petsc!(PCShellSetApply(around.outer, Some(applied)))?;
            petsc!(PCShellSetView(around.outer, Some(viewed)))?;
            petsc!(PCShellSetName(around.outer, name.as_ptr()))?;
            petsc!(PCSetOperators(around.outer, matrix.raw(), matrix.raw()))?;
        }
        Ok(around)
    }

    /// What it failed with, once.
    pub fn failure(&self) -> Option<Error> {
        // SAFETY: the context lives as long as `self`, and is shared only.
        unsafe { &*self.context }.failure.take()
    }
}

impl Drop for Around {
    fn drop(&mut self) {
        // SAFETY: the references of this type; the solver has another preconditioner by now, or is gone, so that PETSc calls back no more.
        unsafe {
            let _ = petsc!(PCDestroy(&mut self.outer));
            let _ = petsc!(PCDestroy(&mut self.inner));
            drop(Box::from_raw(self.context));
        }
    }
}

/// PCApply.
unsafe extern "C" fn applied(pc: ffi::PC, r: ffi::Vec, z: ffi::Vec) -> ffi::PetscErrorCode {
    let (mut context, mut rows, mut from, mut to) = (null_mut::<c_void>(), 0, null(), null_mut());
    // SAFETY: PETSc passes its own preconditioner with our context, and two vectors, whose arrays have that many entries here and belong to
    // nobody else until they are given back.
    let done: Result<_> = (|| unsafe {
        petsc!(PCShellGetContext(pc, (&raw mut context).cast()))?;
        let context = &*context.cast::<Context>();
        petsc!(VecGetLocalSize(r, &mut rows))?;
        petsc!(VecGetArrayRead(r, &mut from))?;
        petsc!(VecGetArray(z, &mut to))?;
        let (r_here, z_here) =
            (std::slice::from_raw_parts(from, rows as usize), std::slice::from_raw_parts_mut(to, rows as usize));
        let applied = (context.apply)(context.inner, r_here, z_here);
        petsc!(VecRestoreArrayRead(r, &mut from))?;
        petsc!(VecRestoreArray(z, &mut to))?;
        Ok(match applied {
            Ok(()) => 0,
            Err(error) => {
                context.failure.replace(Some(error));
                ERROR
            }
        })
    })();
    done.unwrap_or(ERROR)
}

/// PCView: the inner one.
unsafe extern "C" fn viewed(pc: ffi::PC, viewer: ffi::PetscViewer) -> ffi::PetscErrorCode {
    let mut context = null_mut::<c_void>();
    // SAFETY: as in `applied`.
    let done: Result<_> = (|| unsafe {
        petsc!(PCShellGetContext(pc, (&raw mut context).cast()))?;
        petsc!(PCView((*context.cast::<Context>()).inner, viewer))
    })();
    done.map_or(ERROR, |()| 0)
}

/// PETSC_ERR_LIB: a call inside failed, and its own error is recorded.
pub(super) const ERROR: ffi::PetscErrorCode = 76;
