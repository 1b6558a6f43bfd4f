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
    _session: Session,
}

impl Vector {
    /// A vector without memory of its own, for [`place`](Self::place).
    pub(super) fn new(session: &Session, scope: Scope, rows: usize, block_size: usize) -> Result<Vector> {
        let (comm, mut vec) = (scope.comm(session), null_mut());
        let (block, rows) = (block_size as Int, rows as Int);
        match scope {
            Scope::Process => petsc!(VecCreateSeqWithArray(comm, block, rows, null(), &mut vec))?,
            Scope::World => petsc!(VecCreateMPIWithArray(comm, block, rows, DETERMINE, null(), &mut vec))?,
        }
        Ok(Vector { vec, _session: session.clone() })
    }

    /// A vector with memory of its own.
    pub(super) fn owned(session: &Session, scope: Scope, values: &[f64], block_size: usize) -> Result<Vector> {
        let (comm, mut vec) = (scope.comm(session), null_mut());
        match scope {
            Scope::Process => petsc!(VecCreateSeq(comm, values.len() as Int, &mut vec))?,
            Scope::World => petsc!(VecCreateMPI(comm, values.len() as Int, DETERMINE, &mut vec))?,
        }
        let vector = Vector { vec, _session: session.clone() };
        petsc!(VecSetBlockSize(vec, block_size as Int))?;
        let mut array = null_mut();
        petsc!(VecGetArray(vec, &mut array))?;
        // SAFETY: PETSc's array has as many entries as the vector has here, which was made that long above.
        unsafe { std::slice::from_raw_parts_mut(array, values.len()) }.copy_from_slice(values);
        petsc!(VecRestoreArray(vec, &mut array))?;
        Ok(vector)
    }

    /// Lets the vector use memory of the caller until the guard is dropped; it must be as long as the vector, and
    /// writable if PETSc will write to the vector.
    pub(super) fn place(&self, values: *const f64) -> Result<Placed<'_>> {
        petsc!(VecPlaceArray(self.vec, values))?;
        Ok(Placed(self))
    }
}

impl Drop for Vector {
    fn drop(&mut self) {
        let _ = petsc!(VecDestroy(&mut self.vec));
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
        let _ = petsc!(VecResetArray(self.0.vec));
    }
}
