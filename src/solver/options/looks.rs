//! Options that look at a solver and leave it as it is.

/// Words of which one is in the name of every option of PETSc that prints or draws.
const WORDS: [&str; 6] = ["view", "monitor", "print", "printstat", "statprint", "log"];

/// Names, or their ends, of options that print without such a word.
const NAMES: &str = "ksp_converged_reason ksp_converged_rate ksp_compute_singularvalues ksp_compute_eigenvalues \
    ksp_compute_eigenvalues_explicitly ksp_final_residual mat_umfpack_prl";

/// Whether an option of an object, named without dash and prefix of a body, prints or draws and does not change what is computed.
///
/// ```
/// use winkler::solver::options::looks;
/// for name in ["ksp_view", "ksp_monitor_true_residual", "mg_levels_1_ksp_view", "ksp_converged_reason", "mat_view_info"] {
///     assert!(looks(name), "{name}");
/// }
/// for name in ["ksp_type", "ksp_rtol", "pc_type", "pc_hypre_type", "mat_type", "ksp_error_if_not_converged", "pc_gamg_threshold"] {
///     assert!(!looks(name), "{name}");
/// }
/// ```
pub fn looks(name: &str) -> bool {
    name.split('_').any(|word| WORDS.contains(&word))
        || NAMES
            .split_whitespace()
            .any(|known| name.strip_suffix(known).is_some_and(|nest| nest.is_empty() || nest.ends_with('_')))
}
