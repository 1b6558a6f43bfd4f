//! Inner solvers by name: what solves the linear systems of bodies.

use crate::setting::words;
use serde::{Deserialize, Serialize};

/// The inner solver that the scene requests. PETSc options override it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SolverSpec {
    /// The preset; the program chooses if `None`.
    pub preset: Option<Preset>,
    /// PETSc options of the scene, as words. Those of the command line win.
    pub options: Vec<String>,
}

words! {
    /// The presets of inner solvers.
    #[derive(Serialize, Deserialize)]
    pub enum Preset "solver" {
        /// Sparse Cholesky factorisation by MUMPS.
        Mumps = "mumps",
        /// Interior dofs eliminated once by MUMPS, and a dense system on the contact in each sweep.
        Condensed = "condensed",
        /// Conjugate gradients preconditioned by hypre's BoomerAMG.
        Hypre = "hypre",
        /// Conjugate gradients preconditioned by PETSc's GAMG.
        Gamg = "gamg",
        /// Conjugate gradients preconditioned by an incomplete Cholesky factorisation.
        Icc = "icc",
    }
}
