//! The inner solver that a body gets when the user typed no PETSc option, and the default options of each.

use super::cost::{self, BodyFacts};
use super::options::Chosen;
use crate::error::{Error, Kind, Result};
use crate::petsc::HAS_HYPRE;
use crate::problem::method::Preset;

/// Options of hypre's algebraic multigrid for elasticity with many solves for each set-up. Chebyshev smoothing makes a
/// solve 2.6 times faster than hypre's default at the same number of iterations.
const HYPRE: [(&str, &str); 7] = [
    ("pc_hypre_type", "boomeramg"),
    ("pc_hypre_boomeramg_coarsen_type", "PMIS"),
    ("pc_hypre_boomeramg_interp_type", "ext+i-cc"),
    ("pc_hypre_boomeramg_P_max", "4"),
    ("pc_hypre_boomeramg_strong_threshold", "0.25"),
    ("pc_hypre_boomeramg_nodal_coarsen", "4"),
    ("pc_hypre_boomeramg_relax_type_all", "Chebyshev"),
];

/// Options that differ where a new preconditioner is set up for nearly every solve. The set-up is four times cheaper,
/// and the iterations are twice as many.
const MADE_OFTEN: [(&str, &str); 4] = [
    ("pc_hypre_boomeramg_coarsen_type", "HMIS"),
    ("pc_hypre_boomeramg_interp_type", "ext+i"),
    ("pc_hypre_boomeramg_agg_nl", "1"),
    ("pc_hypre_boomeramg_nodal_coarsen", "6"),
];

/// The coarse one of two levels of multigrid for quadratic elements. The fine level has a smoother for all nodes, the
/// coarse one algebraic multigrid for the linear elements with the same vertices. Together they take half the work and
/// memory of algebraic multigrid for all nodes.
const QUADRATIC: [(&str, &str); 2] = [("mg_coarse_ksp_type", "preonly"), ("mg_coarse_pc_type", ALGEBRAIC)];

/// The algebraic multigrid of this PETSc. That of PETSc itself takes more iterations than hypre (docs/solvers.md).
const ALGEBRAIC: &str = if HAS_HYPRE { "hypre" } else { "gamg" };

/// The smoother of the level with quadratic elements.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Smoother {
    /// Symmetric Gauss-Seidel, which converges for every matrix that is symmetric and positive definite.
    GaussSeidel,
    /// Chebyshev's method, for rows on several ranks. Gauss-Seidel within each rank takes steps that are twice too
    /// long, or more, at the borders between ranks, so that its preconditioner may not be positive definite. Steps of
    /// Chebyshev's method do not depend on the ranks, and take 1.2 to 1.4 times as long on one rank.
    Chebyshev,
}

impl Smoother {
    /// Return the options (name, value) of the fine level.
    fn options(self) -> [(&'static str, &'static str); 3] {
        let (ksp, steps, pc) = match self {
            Smoother::GaussSeidel => ("richardson", "1", "sor"),
            Smoother::Chebyshev => ("chebyshev", "2", "pbjacobi"),
        };
        [("mg_levels_ksp_type", ksp), ("mg_levels_ksp_max_it", steps), ("mg_levels_pc_type", pc)]
    }
}

/// Relative tolerance of an inner Krylov solve. It is relative to the outer residual, because solves are for
/// corrections.
pub const INNER_TOLERANCE: f64 = 1e-6;

/// Number of interface dofs up to which the cost of a dense factorisation need not be compared: it takes 9e6
/// operations, less than a millisecond.
const TINY: usize = 300;

/// Return the preset for a plane body whose scene names none, with the reason as text. A factorisation costs little in
/// the plane, so only lack of memory speaks against it; `memory` are the bytes that earlier bodies have left. In space
/// [`cost`] decides.
pub fn in_plane(body: &BodyFacts, memory: usize) -> (Preset, String) {
    let &BodyFacts { dofs, interface, .. } = body;
    let what = format!("{dofs} dofs in the plane, {interface} of them on the contact");
    let megabytes = |preset: Preset| body.bytes_in_plane(preset) / 1_000_000;
    let fits = |preset: Preset| body.bytes_in_plane(preset) < memory;
    // some dofs can be eliminated, and some remain
    let can_condense = (1..dofs).contains(&interface);
    let dense = (interface as f64).powi(3) / 3.0;
    let pays = interface <= TINY || dense <= cost::plane_factor_work(dofs);
    if can_condense && pays && fits(Preset::Condensed) {
        (Preset::Condensed, format!("{what}, about {} MB", megabytes(Preset::Condensed)))
    } else if fits(Preset::Mumps) {
        (Preset::Mumps, format!("{what}, about {} MB", megabytes(Preset::Mumps)))
    } else {
        let free = memory / 1_000_000;
        (Preset::Hypre, format!("{what}: a factor takes about {} MB, {free} are free", megabytes(Preset::Mumps)))
    }
}

/// Check that PETSc has the solver that a scene asks for.
///
/// # Errors
/// When it is hypre, and PETSc was built without it.
pub fn check(asked: Option<Preset>, has_hypre: bool) -> Result<()> {
    if asked != Some(Preset::Hypre) || has_hypre {
        return Ok(());
    }
    Err(Error::new(Kind::Solver, "the solver `hypre` is asked for, but PETSc was built without hypre")
        .help("take PETSc's own multigrid, --set solver=gamg, or a PETSc with hypre"))
}

/// Set the options that suit multigrid of a matrix that changes with nearly every solve. To be called before [`apply`].
pub fn made_often(chosen: &mut Chosen) {
    MADE_OFTEN.iter().for_each(|(name, value)| chosen.set_default(name, value));
}

/// Return the name of the solver that the options in force choose.
pub fn in_words(chosen: &Chosen) -> String {
    let word = |name: &str| chosen.get(name).unwrap_or_default();
    let inside = ["pc_factor_mat_solver_type", "mg_coarse_pc_type"].map(word).into_iter().find(|word| !word.is_empty());
    let inside = inside.map_or(String::new(), |word| format!(" by {word}"));
    format!("{} + {}{inside}", word("ksp_type"), word("pc_type"))
}

/// Set the default options of a solver where the user typed nothing, and only for the KSP and PC in force. A condensed
/// body has no KSP and no defaults. With a `smoother`, multigrid has a level for quadratic elements, unless the user
/// typed an option of hypre.
pub fn apply(chosen: &mut Chosen, preset: Preset, smoother: Option<Smoother>) {
    let has_levels = smoother.is_some() && !chosen.has_typed_of("pc_hypre_");
    let pc = match preset {
        Preset::Condensed => return,
        Preset::Mumps => "cholesky",
        Preset::Hypre if has_levels => "mg",
        Preset::Hypre => ALGEBRAIC,
        Preset::Gamg => "gamg",
        Preset::Icc => "icc",
    };
    chosen.set_default("pc_type", pc);
    let is = |chosen: &Chosen, name: &str, values: &[&str]| values.contains(&chosen.get(name).unwrap_or_default());
    let direct = is(chosen, "pc_type", &["cholesky", "lu"]);
    chosen.set_default("ksp_type", if direct { "preonly" } else { "cg" });
    if let Some(smoother) = smoother.filter(|_| is(chosen, "pc_type", &["mg"])) {
        let options = smoother.options().into_iter().chain(QUADRATIC);
        options.for_each(|(name, value)| chosen.set_default(name, value));
    }
    chosen.prefer_mumps();
    if !is(chosen, "ksp_type", &["preonly"]) {
        chosen.set_default("ksp_rtol", &format!("{INNER_TOLERANCE:e}"));
        // PETSc's own default is 1e-50, whatever the unit of forces is
        chosen.set_default("ksp_atol", "0");
        if is(chosen, "ksp_type", &["cg", "fcg", "pipecg"]) {
            // the natural norm is that of r'M^-1 r; with a good preconditioner M this is the energy of the error, which
            // the outer residual measures
            chosen.set_default("ksp_norm_type", "natural");
        }
    }
    for nest in ["", "mg_coarse_"] {
        let of = |name: &str| format!("{nest}{name}");
        if is(chosen, &of("pc_type"), &["hypre"]) && is(chosen, &of("pc_hypre_type"), &["", "boomeramg"]) {
            HYPRE.iter().for_each(|(name, value)| chosen.set_default(&of(name), value));
        }
    }
    if is(chosen, "pc_type", &["icc"]) && preset == Preset::Icc {
        chosen.set_default("pc_factor_levels", "1");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hypre_is_refused_only_where_it_is_missing_and_asked_for() {
        assert!(check(Some(Preset::Hypre), true).is_ok() && check(None, false).is_ok());
        assert!(check(Some(Preset::Gamg), false).is_ok());
        let error = check(Some(Preset::Hypre), false).expect_err("no hypre");
        assert!(error.render(false).contains("solver=gamg"), "{error}");
    }

    /// Bodies in the plane are condensed where that pays, and multigrid is for a factor that does not fit into memory.
    #[test]
    fn a_body_in_the_plane_is_condensed_where_that_pays() {
        let block = BodyFacts { dofs: 98_000, interface: 1024, ..BodyFacts::default() };
        let preset = |body: &BodyFacts, memory: usize| in_plane(body, memory).0;
        assert_eq!(preset(&block, 8_000_000_000), Preset::Condensed);
        // a sheet whose dofs are mostly on the contact gains nothing by condensation
        let sheet = BodyFacts { dofs: 40_000, interface: 20_000, ..BodyFacts::default() };
        assert_eq!(preset(&sheet, 8_000_000_000), Preset::Mumps);
        assert_eq!(preset(&block, 50_000_000), Preset::Hypre);
    }
}
