//! A safe binding of the part of PETSc that solves linear systems, useful alone.
//!
//! Objects hold a counted token of the [`Session`] and have no lifetimes. PETSc ends with the last token. Objects are neither `Send` nor
//! `Sync`. Every call is checked, and PETSc's own message is in the [`Error`](crate::error::Error). PETSc itself prints only what options
//! request (`-ksp_monitor`, `-ksp_view`, `-log_view`, `-help`, ...).
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

mod around;
mod beside;
mod blas;
mod error;
mod factor;
mod failure;
mod ffi;
mod files;
mod halves;
mod heap;
mod indices;
mod integers;
mod interpolation;
mod ksp;
mod launcher;
mod library;
mod matrix;
mod metis;
mod mumps;
mod options;
mod patch;
mod print;
mod reason;
#[cfg(test)]
mod requirements;
mod rows;
mod scatter;
mod scope;
mod session;
mod stage;
mod substructures;
mod table;
mod until;
mod vector;
mod waiting;
mod words;
mod wrap;

pub use around::Subspace;
pub use blas::{cholesky, cholesky_solve};
pub use ffi::Int;
pub use heap::{Heap, keep_apart, keep_at_hand, leave};
pub use ksp::{Ksp, Solved};
pub use launcher::{CROWDED, UNBOUND, launcher};
pub use matrix::Matrix;
pub use metis::{Graph, has_metis, nested_dissection};
pub use mumps::Schur;
pub use options::Options;
pub use reason::ConvergedReason;
pub use rows::Rows;
pub use scope::Scope;
pub use session::Session;
pub use stage::Stage;
pub use until::{Enough, Iterate};
pub use waiting::Entry;
pub use words::{begins_options, is_family, is_global, is_of_family};

/// Whether PETSc has hypre.
pub const HAS_HYPRE: bool = option_env!("WINKLER_HAS_HYPRE").is_some();

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
    print::caught(action)
}
