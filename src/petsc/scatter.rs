//! Entries of a vector of several processes that one of them needs (VecScatter).

use super::indices::Indices;
use super::library::petsc;
use super::vector::Vector;
use super::{Scope, Session, ffi};
use crate::error::Result;
use std::ptr::null_mut;

/// From a vector of a scope to some of its entries on each process, and back.
pub(super) struct Scatter {
    scatter: ffi::VecScatter,
    /// Of the vector, and of the entries.
    vectors: [Vector; 2],
}

impl Scatter {
    /// Of a vector with so many rows on this process the entries of these numbers, counted through all processes; collective.
    pub fn new(session: &Session, scope: Scope, rows: usize, numbers: &[usize]) -> Result<Self> {
        let vectors = [Vector::new(session, scope, rows, 1)?, Vector::new(session, Scope::Process, numbers.len(), 1)?];
        let from = Indices::alone(numbers)?;
        let mut scatter = null_mut();
        // SAFETY: as many entries of the one as the other has.
        unsafe { petsc!(VecScatterCreate(vectors[0].vec, from.0, vectors[1].vec, null_mut(), &mut scatter)) }?;
        Ok(Self { scatter, vectors })
    }

    /// Number of the entries.
    pub fn len(&self) -> usize {
        self.vectors[1].len()
    }

    /// Copies the entries of a vector; collective.
    pub fn take(&self, vector: &[f64], entries: &mut [f64]) -> Result<()> {
        let [from, to] = &self.vectors;
        from.map(("a vector", vector), to, ("its entries", entries), |from, to| {
            self.scatter(from, to, ffi::InsertMode_INSERT_VALUES, ffi::ScatterMode_SCATTER_FORWARD)
        })
    }

    /// Adds to the entries of a vector what processes have for them; collective.
    pub fn add(&self, entries: &[f64], vector: &mut [f64]) -> Result<()> {
        let [to, from] = &self.vectors;
        from.map(("entries", entries), to, ("their vector", vector), |from, to| {
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
