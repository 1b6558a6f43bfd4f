//! Vectors: headers of PETSc, made once, over slices of Rust. The scope of an object is one process or all.

use super::call::petsc;
use super::error::{Error, Result};
use super::{Int, Session, ffi};
use mpi::collective::SystemOperation;
use mpi::ffi::{MPI_Comm, RSMPI_COMM_SELF};
use mpi::raw::AsRaw;
use mpi::traits::CommunicatorCollectives;
use std::ptr::{null, null_mut};

/// PETSC_DETERMINE: PETSc sums the local sizes over the processes.
pub(super) const DETERMINE: Int = -1;

/// A vector of PETSc with the entries of this process.
pub(super) struct Vector {
    pub(super) vec: ffi::Vec,
    len: usize,
    _session: Session,
}

impl Vector {
    /// Create a vector without memory of its own, for [`map`](Self::map). It has `rows` entries on this process.
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

    /// Create a vector with memory of its own and these values.
    pub(super) fn owned(session: &Session, scope: Scope, values: &[f64], block_size: usize) -> Result<Vector> {
        let (comm, mut vec) = (scope.comm(session), null_mut());
        // SAFETY: PETSc allocates the memory itself.
        unsafe {
            match scope {
                Scope::Process => petsc!(VecCreateSeq(comm, values.len() as Int, &mut vec))?,
                Scope::World => petsc!(VecCreateMPI(comm, values.len() as Int, DETERMINE, &mut vec))?,
            }
        }
        let vector = Vector { vec, len: values.len(), _session: session.clone() };
        let mut array = null_mut();
        // SAFETY: PETSc's array is as long as `values`, for which the vector was created; nobody else has it between
        // Get and Restore.
        unsafe {
            petsc!(VecSetBlockSize(vec, block_size as Int))?;
            petsc!(VecGetArray(vec, &mut array))?;
            slice_mut(array, values.len()).copy_from_slice(values);
            petsc!(VecRestoreArray(vec, &mut array))?;
        }
        Ok(vector)
    }

    /// Return the number of entries of this process.
    pub(super) fn len(&self) -> usize {
        self.len
    }

    /// Run `call`, which reads the slice `x` as this vector and writes to the slice `y` as the vector `to`. Messages
    /// name both slices.
    ///
    /// # Errors
    /// When a slice is not as long as its vector, and those of the call.
    pub(super) fn map(
        &self,
        (x_name, x): (&str, &[f64]),
        to: &Vector,
        (y_name, y): (&str, &mut [f64]),
        call: impl FnOnce(ffi::Vec, ffi::Vec) -> Result<()>,
    ) -> Result<()> {
        check_length(x_name, x.len(), self.len)?;
        check_length(y_name, y.len(), to.len)?;
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

/// A guard: the vector has the given memory until the guard is dropped.
struct Placed<'a>(&'a Vector);

impl<'a> Placed<'a> {
    fn new(vector: &'a Vector, values: *const f64) -> Result<Self> {
        // SAFETY: [`Vector::map`] calls PETSc, which reads and writes, only while the slices live.
        unsafe { petsc!(VecPlaceArray(vector.vec, values)) }?;
        Ok(Placed(vector))
    }
}

impl Drop for Placed<'_> {
    fn drop(&mut self) {
        // SAFETY: a guard exists only after an array was placed.
        let _ = unsafe { petsc!(VecResetArray(self.0.vec)) };
    }
}

/// Return an array of PETSc as a slice. The pointer may be null or dangling if `len` is 0.
///
/// # Safety
/// The array has `len` entries, and nobody writes to it while the slice lives.
pub(super) unsafe fn slice<'a, T>(first: *const T, len: usize) -> &'a [T] {
    // SAFETY: the caller's promise.
    if len == 0 { &[] } else { unsafe { std::slice::from_raw_parts(first, len) } }
}

/// Return an array of PETSc as a mutable slice. The pointer may be null or dangling if `len` is 0.
///
/// # Safety
/// The array has `len` entries, and nobody else uses it while the slice lives.
pub(super) unsafe fn slice_mut<'a, T>(first: *mut T, len: usize) -> &'a mut [T] {
    // SAFETY: the caller's promise.
    if len == 0 { &mut [] } else { unsafe { std::slice::from_raw_parts_mut(first, len) } }
}

/// Check that a slice has one entry for each row. Messages name it `what`.
pub(super) fn check_length(what: &str, length: usize, rows: usize) -> Result<()> {
    if length == rows {
        return Ok(());
    }
    Err(Error::new(format!("{what} has {length} entries for a matrix of {rows} rows")))
}

/// The processes that own an object together. Calls on an object of all processes are collective.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scope {
    /// This process alone.
    Process,
    /// All processes of the session. Each owns some rows.
    World,
}

impl Scope {
    /// Return the MPI communicator.
    pub(super) fn comm(self, session: &Session) -> MPI_Comm {
        match self {
            // SAFETY: the constant of MPI itself.
            Scope::Process => unsafe { RSMPI_COMM_SELF },
            Scope::World => session.world().as_raw(),
        }
    }

    /// Replace `values` by their sum over the processes.
    pub(super) fn sum(self, session: &Session, values: &mut [f64]) {
        if self == Scope::World {
            let mine = values.to_vec();
            session.world().all_reduce_into(&mine[..], values, SystemOperation::sum());
        }
    }
}
