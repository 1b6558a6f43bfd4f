//! Inner solvers by name: what solves the linear systems of bodies.

use serde::{Deserialize, Serialize};

/// The inner solver that the scene requests. PETSc options override it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SolverSpec {
    /// The preset; the program chooses if `None`.
    pub preset: Option<Preset>,
    /// PETSc options of the scene, as words. Those of the command line win.
    pub options: Vec<String>,
}

/// The presets of inner solvers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Preset {
    /// Sparse Cholesky factorisation by MUMPS.
    Mumps,
    /// Interior dofs eliminated once by MUMPS, and a dense system on the contact in each sweep.
    Condensed,
    /// Conjugate gradients preconditioned by hypre's BoomerAMG.
    Hypre,
    /// Conjugate gradients preconditioned by PETSc's GAMG.
    Gamg,
    /// Conjugate gradients preconditioned by an incomplete Cholesky factorisation.
    Icc,
}

impl Preset {
    /// All presets with their names in the scene.
    pub const ALL: [(&'static str, Preset); 5] = [
        ("mumps", Preset::Mumps),
        ("condensed", Preset::Condensed),
        ("hypre", Preset::Hypre),
        ("gamg", Preset::Gamg),
        ("icc", Preset::Icc),
    ];

    /// Return the name in the scene.
    pub fn name(self) -> &'static str {
        super::name_of(&Self::ALL, &self)
    }
}
