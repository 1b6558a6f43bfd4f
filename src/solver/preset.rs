//! Which inner solver a body gets when the user typed no PETSc option, and the defaults of each.

use super::memory;
use super::options::Chosen;
use crate::problem::solver::Preset;

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

/// What differs where the preconditioner is made anew for nearly every solve: four times cheaper to make, twice the iterations.
const MADE_OFTEN: [(&str, &str); 4] = [
    ("pc_hypre_boomeramg_coarsen_type", "HMIS"),
    ("pc_hypre_boomeramg_interp_type", "ext+i"),
    ("pc_hypre_boomeramg_agg_nl", "1"),
    ("pc_hypre_boomeramg_nodal_coarsen", "6"),
];

/// Two levels of multigrid for quadratic elements: a smoother for all nodes, algebraic multigrid for the linear elements with the same
/// vertices. Of the work and memory of algebraic multigrid for all nodes it needs half.
const QUADRATIC: [(&str, &str); 2] = [("mg_coarse_ksp_type", "preonly"), ("mg_coarse_pc_type", "hypre")];

/// The smoother of the level of quadratic elements.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Smoother {
    /// Gauss-Seidel there and back, which converges for every matrix that is symmetric and positive definite.
    GaussSeidel,
    /// For rows of several ranks. Gauss-Seidel within each rank takes steps up to twice too long, or more, at their borders: the
    /// preconditioner is not positive definite any more (two spheres of 74 799 dofs on three ranks). Steps of Chebyshev's method do not
    /// depend on the ranks, and take 1.2 to 1.4 times as long on one.
    Chebyshev,
}

impl Smoother {
    fn options(self) -> [(&'static str, &'static str); 3] {
        let (ksp, steps, pc) = match self {
            Smoother::GaussSeidel => ("richardson", "1", "sor"),
            Smoother::Chebyshev => ("chebyshev", "2", "pbjacobi"),
        };
        [("mg_levels_ksp_type", ksp), ("mg_levels_ksp_max_it", steps), ("mg_levels_pc_type", pc)]
    }
}

/// Relative tolerance of an inner Krylov solve: relative to the outer residual, because corrections are solved.
const TOLERANCE: &str = "1e-6";

/// Retained dofs up to which a dense factorisation costs nothing worth comparing.
const SMALL: usize = 300;

/// What the choice of a solver in the plane depends on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Size {
    /// Dofs of the body.
    pub dofs: usize,
    /// Dofs that a condensed body would retain.
    pub retained: usize,
    /// Bytes that the bodies before have left.
    pub memory: usize,
}

impl Size {
    /// Whether an interior is there to be eliminated, and a rest that remains.
    pub fn can_condense(&self) -> bool {
        (1..self.dofs).contains(&self.retained)
    }

    /// Estimated bytes of a solver that factors, in the plane.
    pub fn bytes(&self, preset: Preset) -> usize {
        let dense = if preset == Preset::Condensed { memory::of_condensed(self.retained) } else { 0 };
        memory::in_plane(self.dofs) + dense
    }
}

/// The preset for a body in the plane whose scene names none, with the reason: there a factorisation costs little, and only
/// memory speaks against it. In space [`cost`](super::cost) decides.
///
/// ```
/// use winkler::{problem::solver::Preset, solver::preset::{Size, in_plane}};
/// let size = Size { dofs: 98_000, retained: 1024, memory: 8_000_000_000 };
/// assert_eq!(in_plane(&size).0, Preset::Condensed);
/// // a sheet that is nothing but contact has nothing to gain
/// assert_eq!(in_plane(&Size { dofs: 40_000, retained: 20_000, ..size }).0, Preset::Mumps);
/// // too little memory for a factor: multigrid
/// assert_eq!(in_plane(&Size { memory: 50_000_000, ..size }).0, Preset::Hypre);
/// ```
pub fn in_plane(size: &Size) -> (Preset, String) {
    let &Size { dofs, retained, memory } = size;
    let what = format!("{dofs} dofs in the plane, {retained} of them on the contact");
    let megabytes = |preset: Preset| size.bytes(preset) / 1_000_000;
    let fits = |preset: Preset| size.bytes(preset) < memory;
    let dense = (retained as f64).powi(3) / 3.0;
    let pays = retained <= SMALL || dense <= memory::work_in_plane(dofs);
    if size.can_condense() && pays && fits(Preset::Condensed) {
        (Preset::Condensed, format!("{what}, about {} MB", megabytes(Preset::Condensed)))
    } else if fits(Preset::Mumps) {
        (Preset::Mumps, format!("{what}, about {} MB", megabytes(Preset::Mumps)))
    } else {
        let free = memory / 1_000_000;
        (Preset::Hypre, format!("{what}: a factor takes about {} MB, {free} are free", megabytes(Preset::Mumps)))
    }
}

/// Sets, before [`apply`], what is better for multigrid of a matrix that changes with nearly every solve.
pub fn made_often(chosen: &mut Chosen) {
    MADE_OFTEN.iter().for_each(|(name, value)| chosen.set_default(name, value));
}

/// The solver that the options in force make, in words.
pub fn in_words(chosen: &Chosen) -> String {
    let word = |name: &str| chosen.get(name).unwrap_or_default();
    let inside = ["pc_factor_mat_solver_type", "mg_coarse_pc_type"].map(word).into_iter().find(|word| !word.is_empty());
    let inside = inside.map_or(String::new(), |word| format!(" by {word}"));
    format!("{} + {}{inside}", word("ksp_type"), word("pc_type"))
}

/// Sets the defaults of a solver: after the typed options, and only for the KSP and PC in force. A condensed body has no KSP and no
/// defaults. With a `smoother` multigrid has a level for quadratic elements, unless the user speaks of hypre.
pub fn apply(chosen: &mut Chosen, preset: Preset, smoother: Option<Smoother>) {
    let levels = smoother.is_some() && !chosen.has_typed_of("pc_hypre_");
    let pc = match preset {
        Preset::Condensed => return,
        Preset::Mumps => "cholesky",
        Preset::Hypre if levels => "mg",
        Preset::Hypre => "hypre",
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
        chosen.set_default("ksp_rtol", TOLERANCE);
        // PETSc's own is 1e-50, whatever the unit of forces is
        chosen.set_default("ksp_atol", "0");
        if is(chosen, "ksp_type", &["cg", "fcg", "pipecg"]) {
            // r'M^-1 r: with a good preconditioner the energy of the error, which the outer residual measures
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
