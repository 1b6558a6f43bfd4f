//! A safe binding of the part of PETSc that solves linear systems, useful alone.
//!
//! Objects hold a counted token of the [`Session`] and have no lifetimes. PETSc ends with the last token. Objects are
//! neither `Send` nor `Sync`. Every call is checked, and PETSc's own message is in the [`Error`].
//! PETSc itself prints only what options request (`-ksp_monitor`, `-ksp_view`, `-log_view`, `-help`, ...). Where a
//! function says nothing else, its errors are PETSc's and those of MUMPS.
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
mod call;
mod error;
mod ffi;
mod ksp;
mod lanczos;
mod launch;
mod matrix;
mod metis;
mod mumps;
mod options;
mod patch;
mod preconditioner;
mod session;
mod subspace;
mod until;
mod vector;

pub use blas::{cholesky, cholesky_inverse, cholesky_solve};
pub use error::Error;
pub use ffi::Int;
pub use ksp::{ConvergedReason, Ksp, Solved};
pub use matrix::{Matrix, Rows};
pub use metis::{Graph, nested_dissection};
pub use mumps::Schur;
pub use options::{Options, begins_options, is_family, is_global};
pub use session::{Entry, Session, Stage};
pub use subspace::Subspace;
pub use until::{ConvergenceTest, KspIterate};
pub use vector::Scope;

/// Whether PETSc has hypre.
pub const HAS_HYPRE: bool = ffi::WINKLER_HAS_HYPRE == 1;
