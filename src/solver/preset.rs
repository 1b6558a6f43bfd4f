//! Which inner solver a body gets when the user typed no PETSc option, and the defaults of each.

use super::options;
use crate::error::Result;
use crate::petsc::Session;
use crate::scene::Preset;

/// Options of algebraic multigrid by hypre for elasticity with many solves a set-up; docs/solvers.md has the
/// measurements behind them.
const HYPRE: [(&str, &str); 7] = [
    ("pc_hypre_type", "boomeramg"),
    ("pc_hypre_boomeramg_coarsen_type", "PMIS"),
    ("pc_hypre_boomeramg_interp_type", "ext+i-cc"),
    ("pc_hypre_boomeramg_P_max", "4"),
    ("pc_hypre_boomeramg_strong_threshold", "0.25"),
    ("pc_hypre_boomeramg_nodal_coarsen", "4"),
    ("pc_hypre_boomeramg_relax_type_all", "Chebyshev"),
];

/// Relative tolerance of an inner Krylov solve: relative to the outer residual, because corrections are solved.
const TOLERANCE: &str = "1e-6";

/// Dofs of a body in space above which multigrid beats a factorisation.
const LARGE: usize = 150_000;

/// The preset for a scene that names none, with the reason.
pub fn choose(dimension: usize, largest_body: usize) -> (Preset, String) {
    match (dimension, largest_body) {
        (2, _) => (Preset::Mumps, "plane bodies factor fast".to_owned()),
        (_, dofs) if dofs <= LARGE => (Preset::Mumps, format!("{dofs} dofs in the largest body, few enough to factor")),
        (_, dofs) => (Preset::Hypre, format!("{dofs} dofs in the largest body, too many to factor")),
    }
}

/// Sets the defaults of a body's solver: after the typed options, and only for the KSP and PC in force.
///
/// # Errors
/// Failures of PETSc's options database.
pub fn apply(session: &Session, body: &str, preset: Preset) -> Result<()> {
    let default = |name: &str, value: &str| options::set_default(session, body, name, Some(value));
    let table = session.options();
    let in_force = |name: &str| table.get(&format!("-{body}_{name}")).unwrap_or_default();
    default("pc_type", if preset == Preset::Mumps { "cholesky" } else { "hypre" })?;
    let pc = in_force("pc_type");
    let direct = matches!(pc.as_str(), "cholesky" | "lu");
    default("ksp_type", if direct { "preonly" } else { "cg" })?;
    options::prefer_mumps(session, body)?;
    let ksp = in_force("ksp_type");
    if ksp != "preonly" {
        default("ksp_rtol", TOLERANCE)?;
        if matches!(ksp.as_str(), "cg" | "fcg" | "pipecg") {
            // r'M^-1 r: with a good preconditioner the energy of the error, which the outer residual measures
            default("ksp_norm_type", "natural")?;
        }
    }
    if pc == "hypre" && matches!(in_force("pc_hypre_type").as_str(), "" | "boomeramg") {
        for (name, value) in HYPRE {
            default(name, value)?;
        }
    }
    Ok(())
}
