//! Vectors: PETSc's headers, made once, over slices that belong to Rust.

use super::library::petsc;
use super::{Int, Scope, Session, ffi};
use crate::error::Result;
use std::ptr::{null, null_mut};

/// PETSC_DETERMINE: the sum over the processes.
pub(super) const DETERMINE: Int = -1;

/// A PETSc vector: the entries of this process.
pub(super) struct Vector {
    pub(super) vec: ffi::Vec,
    len: usize,
    _session: Session,
}

impl Vector {
    /// A vector without memory of its own, for [`place`](Self::place).
    pub(super) fn new(session: &Session, scope: Scope, rows: usize, block_size: usize) -> Result<Vector> {
        let (comm, mut vec) = (scope.comm(session), null_mut());
        let (block, len, rows) = (block_size as Int, rows, rows as Int);
        // SAFETY: without an array PETSc touches no entry before one is placed.
        unsafe {
            match scope {
                Scope::Process => petsc!(VecCreateSeqWithArray(comm, block, rows, null(), &mut vec))?,
                Scope::World => petsc!(VecCreateMPIWithArray(comm, block, rows, DETERMINE, null(), &mut vec))?,
            }
        }
        Ok(Vector { vec, len, _session: session.clone() })
    }

    /// A vector with memory of its own.
    pub(super) fn owned(session: &Session, scope: Scope, values: &[f64], block_size: usize) -> Result<Vector> {
        let (comm, mut vec) = (scope.comm(session), null_mut());
        // SAFETY: PETSc makes the memory itself.
        unsafe {
            match scope {
                Scope::Process => petsc!(VecCreateSeq(comm, values.len() as Int, &mut vec))?,
                Scope::World => petsc!(VecCreateMPI(comm, values.len() as Int, DETERMINE, &mut vec))?,
            }
        }
        let vector = Vector { vec, len: values.len(), _session: session.clone() };
        let mut array = null_mut();
        // SAFETY: PETSc's array has as many entries as the vector has here, which was made that long above; nobody else has it
        // between Get and Restore.
        unsafe {
            petsc!(VecSetBlockSize(vec, block_size as Int))?;
            petsc!(VecGetArray(vec, &mut array))?;
            std::slice::from_raw_parts_mut(array, values.len()).copy_from_slice(values);
            petsc!(VecRestoreArray(vec, &mut array))?;
        }
        Ok(vector)
    }

    /// Number of entries of this process.
    pub(super) fn len(&self) -> usize {
        self.len
    }

    /// Lets the vector use memory of the caller until the guard is dropped.
    ///
    /// # Safety
    /// The memory is as long as the vector, lives as long as the guard, and is writable and nobody else's if PETSc will write to the
    /// vector.
    pub(super) unsafe fn place(&self, values: *const f64) -> Result<Placed<'_>> {
        // SAFETY: the caller's promise.
        unsafe { petsc!(VecPlaceArray(self.vec, values)) }?;
        Ok(Placed(self))
    }
}

impl Drop for Vector {
    fn drop(&mut self) {
        // SAFETY: the one reference of this wrapper.
        let _ = unsafe { petsc!(VecDestroy(&mut self.vec)) };
    }
}

/// A vector over memory of the caller.
pub(super) struct Placed<'a>(&'a Vector);

impl Placed<'_> {
    pub(super) fn vec(&self) -> ffi::Vec {
        self.0.vec
    }
}

impl Drop for Placed<'_> {
    fn drop(&mut self) {
        // SAFETY: an array was placed, or there were no guard.
        let _ = unsafe { petsc!(VecResetArray(self.0.vec)) };
    }
}
