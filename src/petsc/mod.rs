//! A safe binding of the part of PETSc that solves linear systems, useful alone.
//!
//! Objects hold a counted token of the [`Session`] and have no lifetimes. PETSc ends with the last token. Objects are neither `Send` nor
//! `Sync`. Every call is checked, and PETSc's own message is in the [`Error`](crate::error::Error). PETSc itself prints only what options
//! request (`-ksp_monitor`, `-ksp_view`, `-log_view`, `-help`, ...). Where a function says nothing else, its errors are PETSc's and those of MUMPS.
//!
//! ```
//! use winkler::petsc::{Ksp, Matrix, Session};
//!
//! // 2 x - y = 1,  -x + 2 y = 1
//! let session = Session::start(&["-pc_type".to_owned(), "cholesky".to_owned()])?;
//! let mut matrix = Matrix::from_csr(&session, 1, vec![0, 2, 4], vec![0, 1, 0, 1], vec![2.0, -1.0, -1.0, 2.0])?;
//! matrix.set_spd()?;
//! let mut ksp = Ksp::new(&session, "")?;
//! ksp.set_operator(&matrix)?;
//! ksp.set_from_options()?;
//! let mut x = [0.0; 2];
//! let solved = ksp.solve(&[1.0, 1.0], &mut x)?;
//! assert!(solved.reason.converged());
//! assert!((x[0] - 1.0).abs() < 1e-12 && (x[1] - 1.0).abs() < 1e-12);
//! # Ok::<(), winkler::error::Error>(())
//! ```

#![warn(clippy::undocumented_unsafe_blocks)]

mod blas;
mod ffi;
mod files;
mod heap;
mod ksp;
mod library;
mod matrix;
mod metis;
mod mumps;
mod options;
mod patch;
mod preconditioner;
#[cfg(test)]
mod requirements;
mod session;
mod subspace;
mod substructures;
mod until;
mod vector;

pub use blas::{cholesky, cholesky_solve};
pub use ffi::Int;
pub use heap::{Heap, keep_apart, keep_at_hand, leave};
pub use ksp::{ConvergedReason, Ksp, Solved};
pub use matrix::{Matrix, Rows};
pub use metis::{Graph, has_metis, nested_dissection};
pub use mumps::Schur;
pub use options::{Entry, Options, begins_options, is_family, is_global, is_of_family};
pub use session::{CROWDED, Session, Stage, UNBOUND, launcher};
pub use subspace::Subspace;
pub use until::{Enough, Iterate};
pub use vector::Scope;

use std::cell::RefCell;
use std::ffi::{c_char, c_void};

/// Whether PETSc has hypre.
pub const HAS_HYPRE: bool = option_env!("WINKLER_HAS_HYPRE").is_some();

thread_local! {
    static CAUGHT: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
}

/// The longest text of one print statement in bytes. PETSc prints line by line.
const LONGEST: usize = 1 << 16;

/// Run `action`, and return its result and PETSc's output meanwhile, which is not shown.
///
/// ```
/// use winkler::petsc::{Ksp, Session, printed};
/// let session = Session::start(&["-help".to_owned()])?;
/// let (read, text) = printed(&session, || Ksp::new(&session, "up_")?.set_from_options());
/// assert!(read.is_ok() && text.contains("-up_ksp_rtol"));
/// # Ok::<(), winkler::error::Error>(())
/// ```
pub fn printed<T>(_session: &Session, action: impl FnOnce() -> T) -> (T, String) {
    /// A guard that restores PETSc's own printer, also when `action` panics.
    struct Restore(*mut ffi::Printf, ffi::Printf);
    impl Drop for Restore {
        fn drop(&mut self) {
            // SAFETY: as below.
            unsafe { *self.0 = self.1 };
        }
    }
    CAUGHT.take();
    // SAFETY: the variable has this type; the thread of the session alone uses PETSc, so nobody reads the hook meanwhile.
    let hook = library::running().and_then(|petsc| unsafe { petsc.address::<*mut ffi::Printf>("PetscVFPrintf") });
    // SAFETY: as above; without PETSc the action itself returns the error
    let restore = hook.ok().map(|hook| unsafe {
        let before = Restore(hook, *hook);
        *hook = append;
        before
    });
    let result = action();
    drop(restore);
    (result, String::from_utf8_lossy(&CAUGHT.take()).into_owned())
}

/// The printer of PETSc while [`printed`] runs.
unsafe extern "C" fn append(_file: *mut c_void, format: *const c_char, list: *mut c_void) -> ffi::PetscErrorCode {
    let mut text = vec![0_u8; LONGEST];
    let mut length = 0;
    // SAFETY: PETSc writes at most `LONGEST` bytes with the final zero byte; format and list are passed on from PETSc.
    let code = unsafe {
        let Ok(print) = library::open().and_then(|petsc| petsc.address::<ffi::Format>("PetscVSNPrintf")) else {
            return Default::default();
        };
        print(text.as_mut_ptr().cast(), LONGEST, format, &mut length, list)
    };
    let end = text.iter().position(|byte| *byte == 0).unwrap_or(0);
    CAUGHT.with_borrow_mut(|caught| caught.extend_from_slice(&text[..end]));
    code
}
