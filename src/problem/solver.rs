//! Inner solvers by name.

use serde::{Deserialize, Serialize};

/// Inner solver asked for in the scene; PETSc options override it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SolverSpec {
    /// A preset, or the program's choice.
    pub preset: Option<Preset>,
    /// PETSc options of the scene, as words, weaker than those of the command line.
    pub options: Vec<String>,
}

/// Presets of inner solvers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Preset {
    /// Sparse Cholesky factorisation by MUMPS.
    Mumps,
    /// The interior eliminated once by MUMPS, a dense problem on the contact in each sweep.
    Condensed,
    /// Conjugate gradients preconditioned by hypre's BoomerAMG.
    Hypre,
    /// Conjugate gradients preconditioned by PETSc's GAMG.
    Gamg,
    /// Conjugate gradients preconditioned by an incomplete Cholesky factorisation.
    Icc,
}

impl Preset {
    /// Every preset with its name in the scene.
    pub const ALL: [(&'static str, Preset); 5] = [
        ("mumps", Preset::Mumps),
        ("condensed", Preset::Condensed),
        ("hypre", Preset::Hypre),
        ("gamg", Preset::Gamg),
        ("icc", Preset::Icc),
    ];

    /// Its name in the scene.
    pub fn name(self) -> &'static str {
        super::name_of(&Self::ALL, &self)
    }
}
