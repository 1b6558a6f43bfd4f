//! Exchange of entries of a distributed vector that a process needs or contributes to (VecScatter).

use super::indices::Indices;
use super::library::petsc;
use super::vector::Vector;
use super::{Scope, Session, ffi};
use crate::error::Result;
use std::ptr::null_mut;

/// A map from a distributed vector to the entries that this process needs, and back.
pub(super) struct Scatter {
    scatter: ffi::VecScatter,
    /// PETSc's header of the distributed vector.
    distributed: Vector,
    /// PETSc's header of the entries on this process.
    entries: Vector,
}

impl Scatter {
    /// Prepare the exchange of the entries with the global indices `indices`. Collective. The vector has `owned` entries on this process.
    pub fn new(session: &Session, scope: Scope, owned: usize, indices: &[usize]) -> Result<Self> {
        let distributed = Vector::new(session, scope, owned, 1)?;
        let entries = Vector::new(session, Scope::Process, indices.len(), 1)?;
        let from = Indices::alone(indices)?;
        let mut scatter = null_mut();
        // SAFETY: as many entries of the one as the other has.
        unsafe { petsc!(VecScatterCreate(distributed.vec, from.0, entries.vec, null_mut(), &mut scatter)) }?;
        Ok(Self { scatter, distributed, entries })
    }

    /// Return the number of entries on this process.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Copy the entries of a distributed vector to this process. Collective.
    pub fn gather(&self, vector: &[f64], entries: &mut [f64]) -> Result<()> {
        self.distributed.map(("a vector", vector), &self.entries, ("its entries", entries), |from, to| {
            self.scatter(from, to, ffi::InsertMode_INSERT_VALUES, ffi::ScatterMode_SCATTER_FORWARD)
        })
    }

    /// Add the entries of all processes to a distributed vector. Collective.
    pub fn scatter_add(&self, entries: &[f64], vector: &mut [f64]) -> Result<()> {
        self.entries.map(("entries", entries), &self.distributed, ("their vector", vector), |from, to| {
            self.scatter(from, to, ffi::InsertMode_ADD_VALUES, ffi::ScatterMode_SCATTER_REVERSE)
        })
    }

    fn scatter(&self, from: ffi::Vec, to: ffi::Vec, insert: ffi::InsertMode, mode: ffi::ScatterMode) -> Result<()> {
        // SAFETY: reads the one and writes to the other, both of the sizes that it was made for.
        unsafe {
            petsc!(VecScatterBegin(self.scatter, from, to, insert, mode))?;
            petsc!(VecScatterEnd(self.scatter, from, to, insert, mode))
        }
    }
}

impl Drop for Scatter {
    fn drop(&mut self) {
        // SAFETY: the one reference of this type.
        let _ = unsafe { petsc!(VecScatterDestroy(&mut self.scatter)) };
    }
}
