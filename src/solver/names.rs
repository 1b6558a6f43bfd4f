//! Common names of the options of PETSc's solvers, without dash and prefix. The refusal of a mistyped option suggests
//! the nearest of them.

use crate::error::nearest;

/// Prefix of the options of the matrix of all bodies.
pub const WHOLE: &str = "newton";

/// The names, also of the solvers that are nested in others most often.
const COMMON: &str = "ksp_type ksp_rtol ksp_atol ksp_divtol ksp_max_it ksp_norm_type ksp_pc_side ksp_gmres_restart ksp_initial_guess_nonzero \
    ksp_reuse_preconditioner ksp_error_if_not_converged ksp_monitor ksp_monitor_true_residual ksp_converged_reason ksp_view ksp_view_eigenvalues \
    ksp_chebyshev_eigenvalues ksp_chebyshev_esteig ksp_richardson_scale pc_type pc_factor_mat_solver_type pc_factor_mat_ordering_type pc_factor_levels \
    pc_factor_fill pc_factor_shift_type pc_factor_shift_amount pc_sor_omega pc_sor_its pc_jacobi_type pc_bjacobi_blocks pc_asm_overlap pc_asm_type \
    pc_fieldsplit_type pc_fieldsplit_block_size pc_redundant_number pc_mg_levels pc_mg_cycle_type pc_mg_type pc_gamg_type pc_gamg_threshold \
    pc_gamg_agg_nsmooths pc_gamg_coarse_eq_limit pc_gamg_aggressive_coarsening pc_hypre_type pc_hypre_boomeramg_coarsen_type \
    pc_hypre_boomeramg_interp_type pc_hypre_boomeramg_strong_threshold pc_hypre_boomeramg_relax_type_all pc_hypre_boomeramg_P_max \
    pc_hypre_boomeramg_agg_nl pc_hypre_boomeramg_max_iter pc_hypre_boomeramg_max_levels pc_hypre_boomeramg_nodal_coarsen \
    pc_hypre_boomeramg_truncfactor pc_hypre_boomeramg_print_statistics mat_view mat_mumps_icntl_14 mat_mumps_icntl_35 mat_mumps_cntl_1 mat_mumps_cntl_7 \
    mg_levels_ksp_type mg_levels_ksp_max_it mg_levels_pc_type mg_coarse_ksp_type mg_coarse_pc_type sub_ksp_type sub_pc_type sub_pc_factor_levels";

/// Words in the names of PETSc options that print or draw.
const LOOKING: [&str; 5] = ["view", "monitor", "log", "reason", "print"];

/// Return whether an option only looks at a solver: it prints or draws, and does not change what is computed.
pub fn looks(name: &str) -> bool {
    name.split('_').any(|word| LOOKING.contains(&word))
}

/// Return the prefix of the nested solver in an option name that ends in `leaf`: `sub_` for `sub_pc_type` with the leaf
/// `pc_type`, and an empty prefix for the leaf itself. `None` for other names.
pub(super) fn nest_of<'a>(name: &'a str, leaf: &str) -> Option<&'a str> {
    name.strip_suffix(leaf).filter(|nest| nest.is_empty() || nest.ends_with('_'))
}

/// Return a name without the prefix of a body or of the matrix of all bodies.
pub(super) fn bare<'a>(name: &'a str, bodies: &[&str]) -> &'a str {
    let name = name.trim_start_matches('-');
    let rest = |prefix: &&str| {
        let (head, rest) = (name.get(..prefix.len())?, name.get(prefix.len()..)?);
        rest.strip_prefix('_').filter(|_| head.eq_ignore_ascii_case(prefix))
    };
    bodies.iter().chain([&WHOLE]).filter_map(rest).min_by_key(|rest| rest.len()).unwrap_or(name)
}

/// Return whether a name without prefix is one of the common ones, or a control of MUMPS.
pub(super) fn is_common(bare: &str) -> bool {
    COMMON.split_whitespace().any(|known| known.eq_ignore_ascii_case(bare)) || is_control_of_mumps(bare)
}

/// Return whether a name without prefix is a control of MUMPS.
pub(super) fn is_control_of_mumps(bare: &str) -> bool {
    bare.starts_with("mat_mumps_icntl_") || bare.starts_with("mat_mumps_cntl_")
}

/// Common types of KSP and of PC.
const KSP_TYPES: &str = "cg fcg pipecg groppcg minres gmres fgmres bcgs richardson chebyshev preonly";
const PC_TYPES: &str = "cholesky lu icc ilu hypre gamg mg jacobi pbjacobi bjacobi sor asm none";

/// Return `KSP` or `PC` if an option sets the type of such an object, which may be inside another solver. The result is
/// `None` for other options.
pub(super) fn object_of_type(name: &str) -> Option<&'static str> {
    [("ksp_type", "KSP"), ("pc_type", "PC")].into_iter().find_map(|(leaf, object)| nest_of(name, leaf).map(|_| object))
}

/// Return advice for an option, as the user wrote it, whose value is no type of PETSc.
pub(super) fn type_instead(name: &str, value: &str) -> String {
    let (nest, known) = name.strip_suffix("pc_type").map_or(("", KSP_TYPES), |nest| (nest, PC_TYPES));
    if value == "mumps" {
        let package = format!("{nest}pc_type cholesky {nest}pc_factor_mat_solver_type mumps");
        return format!("MUMPS is a package of a factorisation: {package}");
    }
    let near = nearest(value, known.split(' ')).map(|near| format!("did you mean {name} {near}?"));
    near.unwrap_or_else(|| "`-help` lists the types".to_owned())
}

/// Return what takes the place of an option of PETSc that no solver of this program can have.
pub(super) fn instead(bare: &str) -> Option<&'static str> {
    match bare {
        "mat_type" | "vec_type" => Some("matrices are AIJ and vectors standard ones, in the memory of the host"),
        _ if bare.starts_with("snes_") => Some(
            "Newton's method is not PETSc's SNES: `method.stop` in the scene ends it, and history.csv has its residuals",
        ),
        _ => None,
    }
}

/// Return the common name that is meant, perhaps with the prefix of a body, if one is near enough for a typing mistake.
pub(super) fn meant(name: &str, bodies: &[&str]) -> Option<String> {
    let name = name.trim_start_matches('-');
    let common = || COMMON.split_whitespace();
    // the prefix may be mistyped, or the rest
    let with_prefix = common().find_map(|known| {
        let prefix = nest_of(name, known)?.trim_end_matches('_');
        nearest(prefix, bodies.iter().chain([&WHOLE]).copied()).map(|body| format!("{body}_{known}"))
    });
    with_prefix.or_else(|| {
        let rest = bare(name, bodies);
        let prefix = &name[..name.len() - rest.len()];
        nearest(rest, common()).map(|near| format!("{prefix}{near}"))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_common_name_is_meant() {
        for (name, near) in [
            ("-ksp_tpye", Some("ksp_type")),
            ("-kps_type", Some("ksp_type")),
            ("-uper_pc_type", Some("upper_pc_type")),
            ("-upper_sub_pc_tipe", Some("upper_sub_pc_type")),
            ("-newton_pc_hypre_tpe", Some("newton_pc_hypre_type")),
            ("-middle_ksp_type", None),
            ("-shift", None),
        ] {
            assert_eq!(meant(name, &["upper", "lower"]).as_deref(), near, "{name}");
        }
        assert!(is_common("KSP_type") && is_common("mat_mumps_icntl_7") && !is_common("ksp_typ"));
        assert_eq!(
            ["-UPPER_ksp_rtol", "-lower_ksp_rtol"].map(|name| bare(name, &["upper"])),
            ["ksp_rtol", "lower_ksp_rtol"]
        );
    }
}
