//! A preconditioner in Rust around one of PETSc (PCSHELL).

use super::library::petsc;
use super::vector::{Vector, slice, slice_mut};
use super::{Matrix, ffi};
use crate::error::{Error, Result};
use std::cell::{Cell, RefCell};
use std::ffi::c_void;
use std::ptr::{null, null_mut};

/// A space of vectors P y on which a matrix A is solved exactly, Q = P (P'AP)^-1 P'. Around a preconditioner M, both symmetric, it makes
///
/// ```text
/// z = Q r + (I - Q A) M (I - A Q) r
/// ```
///
/// a multiplicative Schwarz step before and after M. Slices have one entry a row of this process each; calls are collective.
pub trait Subspace {
    /// x += Q r, r -= A Q r.
    ///
    /// # Errors
    /// Failures of the solver library.
    fn start(&self, r: &mut [f64], x: &mut [f64]) -> Result<()>;

    /// z -= Q A z.
    ///
    /// # Errors
    /// Failures of the solver library.
    fn project(&self, z: &mut [f64]) -> Result<()>;
}

/// The preconditioner inside another.
struct Inner {
    pc: ffi::PC,
    /// Headers of its argument and its result.
    vectors: [Vector; 2],
}

impl Inner {
    /// z = M r.
    fn apply(&self, r: &[f64], z: &mut [f64]) -> Result<()> {
        // SAFETY: the preconditioner reads one and writes to the other.
        self.vectors[0].map(("r", r), &self.vectors[1], ("z", z), |r, z| unsafe { petsc!(PCApply(self.pc, r, z)) })
    }
}

/// A preconditioner of a solver and the one around it.
pub(super) struct Around {
    /// The one around it.
    pub outer: ffi::PC,
    /// `outer` has this pointer.
    context: *mut Context,
}

/// What the callbacks work with.
struct Context {
    inner: Inner,
    subspace: Box<dyn Subspace>,
    /// Whether it is applied to residuals with Q r = 0 alone.
    is_started: Cell<bool>,
    /// The first failure, which PETSc knows by its number alone.
    failure: RefCell<Option<Error>>,
}

impl Context {
    fn apply(&self, r: &[f64], z: &mut [f64]) -> Result<()> {
        if self.is_started.get() {
            self.inner.apply(r, z)?;
            return self.subspace.project(z);
        }
        let (mut rest, mut x) = (r.to_vec(), vec![0.0; r.len()]);
        self.subspace.start(&mut rest, &mut x)?;
        self.inner.apply(&rest, z)?;
        self.subspace.project(z)?;
        z.iter_mut().zip(&x).for_each(|(z, x)| *z += x);
        Ok(())
    }
}

impl Around {
    pub fn new(
        matrix: &Matrix,
        inner: ffi::PC,
        name: &'static std::ffi::CStr,
        subspace: Box<dyn Subspace>,
    ) -> Result<Self> {
        // SAFETY: a reference of our own keeps the inner one when its solver takes another.
        unsafe { petsc!(PetscObjectReference(inner.cast())) }?;
        let whole = || Vector::new(matrix.session(), matrix.scope(), matrix.rows(), matrix.block_size());
        let inner = Inner { pc: inner, vectors: [whole()?, whole()?] };
        let context = Box::into_raw(Box::new(Context {
            inner,
            subspace,
            is_started: Cell::new(false),
            failure: RefCell::default(),
        }));
        let mut around = Self { outer: null_mut(), context };
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

    fn context(&self) -> &Context {
        // SAFETY: the context lives as long as `self`, and is shared only.
        unsafe { &*self.context }
    }

    /// The preconditioner inside.
    pub fn inner(&self) -> ffi::PC {
        self.context().inner.pc
    }

    /// x += Q r and r -= A Q r. From then on, until what is returned is dropped, it takes residuals to have Q r = 0.
    ///
    /// # Errors
    /// Failures of the solver library.
    pub fn start(&self, r: &mut [f64], x: &mut [f64]) -> Result<Started<'_>> {
        let context = self.context();
        context.subspace.start(r, x)?;
        context.is_started.set(true);
        Ok(Started(&context.is_started))
    }

    /// What it failed with, once.
    pub fn failure(&self) -> Option<Error> {
        self.context().failure.take()
    }
}

impl Drop for Around {
    fn drop(&mut self) {
        // SAFETY: the references of this type; the solver has another preconditioner by now, or is gone, so that PETSc calls back no more.
        unsafe {
            let _ = petsc!(PCDestroy(&mut self.outer));
            let mut context = Box::from_raw(self.context);
            let _ = petsc!(PCDestroy(&mut context.inner.pc));
        }
    }
}

/// While it lives, residuals are those of a solve that was started in the space.
pub(super) struct Started<'a>(&'a Cell<bool>);

impl Drop for Started<'_> {
    fn drop(&mut self) {
        self.0.set(false);
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
        let (r_here, z_here) = (slice(from, rows as usize), slice_mut(to, rows as usize));
        let applied = context.apply(r_here, z_here);
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
        petsc!(PCView((*context.cast::<Context>()).inner.pc, viewer))
    })();
    done.map_or(ERROR, |()| 0)
}

/// PETSC_ERR_LIB: a call inside failed, and its own error is recorded.
pub(super) const ERROR: ffi::PetscErrorCode = 76;
