//! Vectors: PETSc's headers, made once, over slices that belong to Rust.

use super::library::petsc;
use super::{Int, Scope, Session, ffi};
use crate::error::{Error, Kind, Result};
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
    /// A vector without memory of its own, for [`map`](Self::map).
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
            slice_mut(array, values.len()).copy_from_slice(values);
            petsc!(VecRestoreArray(vec, &mut array))?;
        }
        Ok(vector)
    }

    /// Number of entries of this process.
    pub(super) fn len(&self) -> usize {
        self.len
    }

    /// Has `call` read the slice `x` as this vector and write to the slice `y` as another one; both have their names in messages.
    ///
    /// # Errors
    /// A slice that is not as long as its vector; those of the call.
    pub(super) fn map(
        &self,
        (x_name, x): (&str, &[f64]),
        to: &Vector,
        (y_name, y): (&str, &mut [f64]),
        call: impl FnOnce(ffi::Vec, ffi::Vec) -> Result<()>,
    ) -> Result<()> {
        same(x_name, x.len(), self.len)?;
        same(y_name, y.len(), to.len)?;
        let _read = Placed::new(self, x.as_ptr())?;
        let _written = Placed::new(to, y.as_mut_ptr())?;
        call(self.vec, to.vec)
    }
}

impl Drop for Vector {
    fn drop(&mut self) {
        // SAFETY: the one reference of this wrapper.
        let _ = unsafe { petsc!(VecDestroy(&mut self.vec)) };
    }
}

/// A vector over memory as long as it is, until this is dropped.
struct Placed<'a>(&'a Vector);

impl<'a> Placed<'a> {
    fn new(vector: &'a Vector, values: *const f64) -> Result<Self> {
        // SAFETY: nothing is read or written before a call of PETSc, which [`Vector::map`] makes while the slices live.
        unsafe { petsc!(VecPlaceArray(vector.vec, values)) }?;
        Ok(Placed(vector))
    }
}

impl Drop for Placed<'_> {
    fn drop(&mut self) {
        // SAFETY: an array was placed, or there were no guard.
        let _ = unsafe { petsc!(VecResetArray(self.0.vec)) };
    }
}

/// An array of PETSc, which has no place where it has no entries.
///
/// # Safety
/// That many entries, which nobody writes to while the slice lives.
pub(super) unsafe fn slice<'a, T>(first: *const T, len: usize) -> &'a [T] {
    // SAFETY: the caller's promise.
    if len == 0 { &[] } else { unsafe { std::slice::from_raw_parts(first, len) } }
}

/// The same to write to.
///
/// # Safety
/// That many entries, which belong to nobody else while the slice lives.
pub(super) unsafe fn slice_mut<'a, T>(first: *mut T, len: usize) -> &'a mut [T] {
    // SAFETY: the caller's promise.
    if len == 0 { &mut [] } else { unsafe { std::slice::from_raw_parts_mut(first, len) } }
}

/// Checks the length of a slice.
pub(super) fn same(what: &str, length: usize, rows: usize) -> Result<()> {
    if length == rows {
        return Ok(());
    }
    Err(Error::new(Kind::Solver, format!("{what} has {length} entries for a matrix of {rows} rows")))
}
