//! A preconditioner in Rust around one of PETSc (PCSHELL): an exact solve in a subspace before and after the
//! preconditioner of a solver.

use super::call::petsc;
use super::error::{Error, Result};
use super::vector::{Vector, slice, slice_mut};
use super::{Matrix, ffi};
use std::cell::{Cell, RefCell};
use std::ffi::{CStr, c_void};
use std::ptr::{null, null_mut};

/// A space of vectors P y in which a matrix A is solved exactly, by Q = P (P'AP)^-1 P'.
///
/// A and the preconditioner M are symmetric. Together with the space, M becomes
///
/// ```text
/// z = Q r + (I - Q A) M (I - A Q) r
/// ```
///
/// which is a multiplicative Schwarz step before and after M. Slices have one entry for each row of this process. Calls
/// are collective.
pub trait Subspace {
    /// Add Q (r - A z) to z.
    fn correct(&self, r: &[f64], z: &mut [f64]) -> Result<()>;
}

/// The preconditioner M inside a wrapper, and the matrix A.
struct InnerPc {
    pc: ffi::PC,
    /// PETSc's headers of an argument and a result.
    vectors: [Vector; 2],
}

impl InnerPc {
    /// Compute z = M r.
    fn apply(&self, r: &[f64], z: &mut [f64]) -> Result<()> {
        // SAFETY: the preconditioner reads one and writes to the other.
        self.vectors[0].map(("r", r), &self.vectors[1], ("z", z), |r, z| unsafe { petsc!(PCApply(self.pc, r, z)) })
    }

    /// Return r - A x.
    fn residual(&self, r: &[f64], x: &[f64]) -> Result<Vec<f64>> {
        let (mut matrix, mut rest) = (null_mut(), vec![0.0; r.len()]);
        // SAFETY: the matrix of the preconditioner, which reads one vector and writes to the other.
        let multiply = |x, y| unsafe {
            petsc!(PCGetOperators(self.pc, &mut matrix, null_mut()))?;
            petsc!(MatMult(matrix, x, y))
        };
        self.vectors[0].map(("x", x), &self.vectors[1], ("A x", &mut rest), multiply)?;
        rest.iter_mut().zip(r).for_each(|(rest, r)| *rest = r - *rest);
        Ok(rest)
    }
}

/// A PCSHELL around another preconditioner.
pub(super) struct Wrapper {
    /// PETSc's handle of the PCSHELL.
    pub pc: ffi::PC,
    /// The data of the callbacks. `pc` has the same pointer.
    context: *mut CallbackData,
}

/// The data of the callbacks.
struct CallbackData {
    inner: InnerPc,
    subspace: Box<dyn Subspace>,
    /// Whether all residuals have Q r = 0 up to rounding, because the solve was started in the space.
    is_started: Cell<bool>,
    /// The first failure. PETSc itself passes on an error number only.
    failure: RefCell<Option<Error>>,
}

impl CallbackData {
    /// Compute z from r. If Q r = 0 up to rounding, then z is Q r + (I - Q A) M r (Tang, Nabben, Vuik, Erlangga, J.
    /// Sci. Comput. 39, 2009, "A-DEF2"). The term Q r takes what rounding leaves of residuals in the space out again.
    /// Without it, conjugate gradients do not reduce that part, and r'z becomes negative when little else is left of r.
    fn apply(&self, r: &[f64], z: &mut [f64]) -> Result<()> {
        if self.is_started.get() {
            self.inner.apply(r, z)?;
            return self.subspace.correct(r, z);
        }
        let mut x = vec![0.0; r.len()];
        self.subspace.correct(r, &mut x)?;
        self.inner.apply(&self.inner.residual(r, &x)?, z)?;
        z.iter_mut().zip(&x).for_each(|(z, x)| *z += x);
        self.subspace.correct(r, z)
    }
}

impl Wrapper {
    pub fn new(matrix: &Matrix, inner: ffi::PC, name: &'static CStr, subspace: Box<dyn Subspace>) -> Result<Self> {
        // SAFETY: a reference of our own keeps the inner one when its solver takes another.
        unsafe { petsc!(PetscObjectReference(inner.cast())) }?;
        let new = || Vector::new(matrix.session(), matrix.scope(), matrix.rows(), matrix.block_size());
        let inner = InnerPc { pc: inner, vectors: [new()?, new()?] };
        let context = CallbackData { inner, subspace, is_started: Cell::new(false), failure: RefCell::default() };
        let context = Box::into_raw(Box::new(context));
        let mut wrapper = Self { pc: null_mut(), context };
        // SAFETY: a new preconditioner, whose context lives as long as our reference to it.
        unsafe {
            petsc!(PCCreate(matrix.scope().comm(matrix.session()), &mut wrapper.pc))?;
            petsc!(PCSetType(wrapper.pc, c"shell".as_ptr()))?;
            petsc!(PCShellSetContext(wrapper.pc, context.cast()))?;
            petsc!(PCShellSetApply(wrapper.pc, Some(apply)))?;
            petsc!(PCShellSetView(wrapper.pc, Some(view)))?;
            petsc!(PCShellSetName(wrapper.pc, name.as_ptr()))?;
            petsc!(PCSetOperators(wrapper.pc, matrix.raw(), matrix.raw()))?;
        }
        Ok(wrapper)
    }

    fn context(&self) -> &CallbackData {
        // SAFETY: the context lives as long as `self`, and is shared only.
        unsafe { &*self.context }
    }

    /// Return the preconditioner inside.
    pub fn inner(&self) -> ffi::PC {
        self.context().inner.pc
    }

    /// Set x = Q b and `rest` = b - A x, and take all residuals to have Q r = 0 up to rounding until the guard is
    /// dropped.
    pub fn start(&self, rest: &mut Vec<f64>, x: &mut [f64]) -> Result<Started<'_>> {
        let context = self.context();
        x.fill(0.0);
        context.subspace.correct(rest, x)?;
        *rest = context.inner.residual(rest, x)?;
        context.is_started.set(true);
        Ok(Started(&context.is_started))
    }

    /// Take out the error of the last application, if it failed.
    pub fn failure(&self) -> Option<Error> {
        self.context().failure.take()
    }
}

impl Drop for Wrapper {
    fn drop(&mut self) {
        // SAFETY: the references of this type; the solver has another preconditioner by now, or is gone, so that PETSc
        // calls back no more.
        unsafe {
            let _ = petsc!(PCDestroy(&mut self.pc));
            let mut context = Box::from_raw(self.context);
            let _ = petsc!(PCDestroy(&mut context.inner.pc));
        }
    }
}

/// The guard of a solve that was started in the subspace.
pub(super) struct Started<'a>(&'a Cell<bool>);

impl Drop for Started<'_> {
    fn drop(&mut self) {
        self.0.set(false);
    }
}

/// The callback for PCApply.
unsafe extern "C" fn apply(pc: ffi::PC, r: ffi::Vec, z: ffi::Vec) -> ffi::PetscErrorCode {
    let (mut context, mut rows, mut from, mut to) = (null_mut::<c_void>(), 0, null(), null_mut());
    // SAFETY: PETSc passes its own preconditioner with our context, and two vectors, whose arrays have that many
    // entries here and belong to nobody else until they are given back.
    let done: Result<_> = (|| unsafe {
        petsc!(PCShellGetContext(pc, (&raw mut context).cast()))?;
        let context = &*context.cast::<CallbackData>();
        petsc!(VecGetLocalSize(r, &mut rows))?;
        petsc!(VecGetArrayRead(r, &mut from))?;
        petsc!(VecGetArray(z, &mut to))?;
        let applied = context.apply(slice(from, rows as usize), slice_mut(to, rows as usize));
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

/// The callback for PCView, which shows the inner preconditioner.
unsafe extern "C" fn view(pc: ffi::PC, viewer: ffi::PetscViewer) -> ffi::PetscErrorCode {
    let mut context = null_mut::<c_void>();
    // SAFETY: as in `apply`.
    let done: Result<_> = (|| unsafe {
        petsc!(PCShellGetContext(pc, (&raw mut context).cast()))?;
        petsc!(PCView((*context.cast::<CallbackData>()).inner.pc, viewer))
    })();
    done.map_or(ERROR, |()| 0)
}

/// PETSC_ERR_LIB: a call inside failed, and its own error is recorded.
pub(super) const ERROR: ffi::PetscErrorCode = 76;
