//! The names of the options of PETSc's solvers, without dash and prefix.
//!
//! PETSc has no list of its options. These are in the help of PETSc 3.18 for all its solvers. Each was looked up in PETSc's sources, and takes
//! numbers, a switch, or words of a closed list: a scene may have it. `unread` adds to them what a solver of the run says in its help.

use crate::error::nearest;
use crate::petsc::is_of_family;

/// Prefix of the options of the matrix of all bodies.
pub const WHOLE: &str = "newton";

/// Options that are on or off, or that only print to the terminal.
const SWITCHES: &str = "ksp_bcgsl_cxpoly ksp_bcgsl_mrpoly ksp_bcgsl_pinv ksp_cg_single_reduction \
    ksp_chebyshev_esteig_noisy ksp_constant_null_space ksp_converged_maxits ksp_converged_use_initial_residual_norm \
    ksp_converged_use_min_initial_residual_norm ksp_dgmres_force ksp_dgmres_improve ksp_diagonal_scale \
    ksp_diagonal_scale_fix ksp_error_if_not_converged ksp_fgmres_modifypcksp ksp_fgmres_modifypcnochange \
    ksp_gmres_classicalgramschmidt ksp_gmres_modifiedgramschmidt ksp_gmres_preallocate ksp_initial_guess_nonzero \
    ksp_knoll ksp_lag_norm ksp_lgmres_constant ksp_lsqr_compute_standard_error ksp_lsqr_exact_mat_norm \
    ksp_pipegcr_unroll_w ksp_reuse_preconditioner ksp_richardson_self_scale ksp_use_explicittranspose \
    mat_cholmod_default_nesdis mat_cholmod_final_asis mat_cholmod_final_pack mat_cholmod_pack \
    mat_cholmod_prefer_upper mat_no_inode mat_no_unroll mat_superlu_conditionnumber mat_superlu_dist_3d \
    mat_superlu_dist_equil mat_superlu_dist_iterrefine mat_superlu_dist_parsymbfact \
    mat_superlu_dist_replacetinypivot mat_superlu_dist_statprint mat_superlu_equil mat_superlu_pivotgrowth \
    mat_superlu_printstat mat_superlu_replacetinypivot mat_superlu_symmetricmode pc_asm_dm_subdomains \
    pc_eisenstat_no_diagonal_scaling pc_factor_diagonal_fill pc_factor_in_place pc_factor_nonzeros_along_diagonal \
    pc_factor_pivot_in_blocks pc_factor_reuse_fill pc_factor_reuse_ordering pc_fieldsplit_detect_saddle_point \
    pc_fieldsplit_diag_use_amat pc_fieldsplit_dm_splits pc_fieldsplit_off_diag_use_amat pc_gamg_asm_use_agg \
    pc_gamg_cpu_pin_coarse_grids pc_gamg_repartition pc_gamg_reuse_interpolation \
    pc_gamg_use_parallel_coarse_grid_solver pc_gamg_use_sa_esteig pc_gasm_use_dm_subdomains \
    pc_gasm_use_hierachical_partitioning pc_hypre_boomeramg_eu_bj pc_hypre_boomeramg_keeptranspose \
    pc_hypre_boomeramg_no_CF pc_hypre_boomeramg_nodal_relaxation pc_hypre_boomeramg_print_statistics \
    pc_hypre_boomeramg_vec_interp_smooth pc_hypre_parasails_logging pc_hypre_parasails_reuse pc_jacobi_abs \
    pc_jacobi_fixdiagonal pc_kaczmarz_symmetric pc_mg_distinct_smoothup pc_mg_log pc_ml_BlockScaling \
    pc_ml_KeepAggInfo pc_ml_OldHierarchy pc_ml_repartition pc_ml_Reusable pc_ml_reuse_interpolation \
    pc_ml_SpectralNormScheme_Anorm pc_ml_Symmetrize pc_sor_backward pc_sor_forward pc_sor_local_backward \
    pc_sor_local_forward pc_sor_local_symmetric pc_sor_symmetric pc_telescope_ignore_dm \
    pc_telescope_ignore_kspcomputeoperators pc_telescope_use_coarse_dm pc_use_amat";

/// Options that take a number, or several.
const NUMBERS: &str = "ksp_atol ksp_bcgsl_ell ksp_bcgsl_xres ksp_cg_gltr_eigen_tol ksp_cg_gltr_init_pert \
    ksp_cg_gltr_max_lanczos_its ksp_cg_gltr_max_newton_its ksp_cg_gltr_newton_tol ksp_cg_radius \
    ksp_chebyshev_eigenvalues ksp_chebyshev_esteig ksp_chebyshev_esteig_steps ksp_check_norm_iteration \
    ksp_dgmres_eigen ksp_dgmres_max_eigen ksp_dgmres_ratio ksp_divtol ksp_fcg_mmax ksp_fcg_nprealloc \
    ksp_fischer_guess ksp_gcr_restart ksp_gmres_breakdown_tolerance ksp_gmres_haptol ksp_gmres_restart \
    ksp_lcd_haptol ksp_lcd_restart ksp_lgmres_augment ksp_matsolve_batch_size ksp_max_it ksp_pipefcg_mmax \
    ksp_pipefcg_nprealloc ksp_pipefgmres_shift ksp_pipegcr_mmax ksp_pipegcr_nprealloc ksp_pipelcg_lmax \
    ksp_pipelcg_lmin ksp_pipelcg_pipel ksp_richardson_scale ksp_rtol ksp_tsirm_cgls ksp_tsirm_max_it_ls \
    ksp_tsirm_size_ls ksp_tsirm_tol_ls mat_cholmod_dbound mat_cholmod_grow0 mat_cholmod_grow1 mat_cholmod_grow2 \
    mat_cholmod_maxrank mat_cholmod_nmethods mat_cholmod_nrelax mat_cholmod_print mat_cholmod_supernodal_switch \
    mat_cholmod_zrelax mat_coarsen_misk_distance mat_inode_limit mat_klu_pivot_tol mat_klu_use_btf \
    mat_superlu_diagpivotthresh mat_superlu_dist_c mat_superlu_dist_r mat_superlu_ilu_droprull \
    mat_superlu_ilu_droptol mat_superlu_ilu_fillfactor mat_superlu_ilu_filltol mat_superlu_ilu_milu \
    mat_superlu_ilu_norm mat_umfpack_aggressive mat_umfpack_alloc_init mat_umfpack_amd_dense mat_umfpack_block_size \
    mat_umfpack_dense_col mat_umfpack_dense_row mat_umfpack_droptol mat_umfpack_fixq mat_umfpack_front_alloc_init \
    mat_umfpack_irstep mat_umfpack_pivot_tolerance mat_umfpack_prl mat_umfpack_sym_pivot_tolerance pc_asm_blocks \
    pc_asm_local_blocks pc_asm_overlap pc_bjacobi_blocks pc_bjacobi_local_blocks pc_eisenstat_omega \
    pc_factor_column_pivot pc_factor_fill pc_factor_levels pc_factor_shift_amount pc_factor_zeropivot \
    pc_fieldsplit_block_size pc_fieldsplit_fields pc_gamg_agg_nsmooths pc_gamg_aggressive_coarsening \
    pc_gamg_coarse_eq_limit pc_gamg_eigenvalues pc_gamg_process_eq_limit pc_gamg_rank_reduction_factors \
    pc_gamg_square_graph pc_gamg_threshold pc_gamg_threshold_scale pc_gasm_overlap pc_gasm_total_subdomains \
    pc_hypre_boomeramg_agg_nl pc_hypre_boomeramg_agg_num_paths pc_hypre_boomeramg_eu_droptolerance \
    pc_hypre_boomeramg_eu_level pc_hypre_boomeramg_grid_sweeps_all pc_hypre_boomeramg_grid_sweeps_coarse \
    pc_hypre_boomeramg_grid_sweeps_down pc_hypre_boomeramg_grid_sweeps_up pc_hypre_boomeramg_interp_refine \
    pc_hypre_boomeramg_max_coarse_size pc_hypre_boomeramg_max_iter pc_hypre_boomeramg_max_levels \
    pc_hypre_boomeramg_max_row_sum pc_hypre_boomeramg_min_coarse_size pc_hypre_boomeramg_nodal_coarsen \
    pc_hypre_boomeramg_nodal_coarsen_diag pc_hypre_boomeramg_numfunctions pc_hypre_boomeramg_outer_relax_weight_all \
    pc_hypre_boomeramg_outer_relax_weight_level pc_hypre_boomeramg_P_max pc_hypre_boomeramg_relax_weight_all \
    pc_hypre_boomeramg_relax_weight_level pc_hypre_boomeramg_restriction_type pc_hypre_boomeramg_smooth_num_levels \
    pc_hypre_boomeramg_strong_threshold pc_hypre_boomeramg_tol pc_hypre_boomeramg_truncfactor \
    pc_hypre_boomeramg_vec_interp_qmax pc_hypre_boomeramg_vec_interp_variant pc_hypre_parasails_filter \
    pc_hypre_parasails_loadbal pc_hypre_parasails_nlevels pc_hypre_parasails_thresh pc_hypre_pilut_factorrowsize \
    pc_hypre_pilut_maxiter pc_hypre_pilut_tol pc_kaczmarz_lambda pc_mg_levels pc_mg_multiplicative_cycles \
    pc_ml_DampingFactor pc_ml_EnergyMinimization pc_ml_maxCoarseSize pc_ml_maxNlevels pc_ml_PrintLevel \
    pc_ml_Threshold pc_redundant_number pc_sor_diagonal_shift pc_sor_its pc_sor_lits pc_sor_omega pc_svd_ess_rank \
    pc_svd_zero_sing pc_telescope_reduction_factor";

/// Options that take a word of a closed list, which PETSc checks.
const WORDS: &str = "ksp_cg_dtype ksp_convergence_test ksp_fcg_truncation_type ksp_gmres_cgs_refinement_type \
    ksp_guess_type ksp_norm_type ksp_pc_side ksp_pipefcg_truncation_type ksp_pipegcr_truncation_type \
    mat_cholmod_factor mat_coarsen_type mat_klu_ordering mat_klu_row_scale mat_product_algorithm mat_superlu_colperm \
    mat_superlu_dist_colperm mat_superlu_dist_fact mat_superlu_dist_rowperm mat_superlu_iterrefine \
    mat_superlu_rowperm mat_umfpack_ordering mat_umfpack_scale mat_umfpack_strategy matmatmult_via matptap_via \
    pc_asm_local_type pc_asm_type pc_composite_type pc_factor_mat_ordering_type pc_factor_mat_solver_type \
    pc_factor_shift_type pc_fieldsplit_type pc_gamg_coarse_grid_layout_type pc_gamg_type pc_gasm_type \
    pc_hypre_boomeramg_coarsen_type pc_hypre_boomeramg_cycle_type pc_hypre_boomeramg_interp_type \
    pc_hypre_boomeramg_measure_type pc_hypre_boomeramg_parasails_sym pc_hypre_boomeramg_relax_type_all \
    pc_hypre_boomeramg_relax_type_coarse pc_hypre_boomeramg_relax_type_down pc_hypre_boomeramg_relax_type_up \
    pc_hypre_parasails_sym pc_jacobi_type pc_mg_cycle_type pc_mg_galerkin \
    pc_mg_galerkin_mat_product_algorithm pc_mg_type pc_ml_CoarsenScheme pc_ml_nullspace pc_telescope_subcomm_type";

/// Options that take one word of a list: Krylov methods and preconditioners that can solve with a symmetric positive definite matrix, or at least
/// start to; types of the program's matrices; preconditioners and smoothers of hypre. Euclid is left out: it reads a file `database` of the current
/// folder.
const LISTED: [(&str, &str); 5] = [
    (
        "ksp_type",
        "richardson chebyshev cg groppcg pipecg pipecgrr pipelcg pipeprcg pipecg2 cgne nash stcg gltr fcg pipefcg gmres \
        pipefgmres fgmres lgmres dgmres pgmres tcqmr bcgs ibcgs qmrcgs fbcgs fbcgsr bcgsl pipebcgs cgs tfqmr cr pipecr lsqr \
        preonly bicg minres symmlq lcd gcr pipegcr tsirm cgls",
    ),
    (
        "pc_type",
        "none jacobi pbjacobi vpbjacobi sor eisenstat ilu icc bjacobi asm gasm mg gamg redundant ksp svd kaczmarz telescope \
        composite fieldsplit hypre ml lu cholesky",
    ),
    ("mat_type", "aij seqaij mpiaij baij seqbaij mpibaij sbaij seqsbaij mpisbaij"),
    ("pc_hypre_type", "boomeramg parasails pilut"),
    ("pc_hypre_boomeramg_smooth_type", "Schwarz-smoothers Pilut ParaSails"),
];

/// Further options of solvers, which a scene may not have.
const OTHERS: &str = "mat_mumps_ooc_tmpdir mat_mumps_use_omp_threads mat_superlu_lwork pc_composite_pcs pc_hypre_euclid_bj \
    pc_hypre_euclid_droptolerance pc_hypre_euclid_level pc_mg_adapt_cr pc_mg_adapt_interp_coarse_space \
    pc_mg_adapt_interp_n pc_python_type vec_type";

/// The words in prefixes of nested solvers, beside the numbers of levels and blocks.
const NESTS: [&str; 11] =
    ["ksp", "pc", "sub", "mg", "levels", "coarse", "esteig", "gamg", "redundant", "telescope", "fieldsplit"];

/// Words in the names of PETSc options that print or draw. All such options have one of them in their name, except for [`LOOKING_NAMES`].
const LOOKING_WORDS: [&str; 6] = ["view", "monitor", "print", "printstat", "statprint", "log"];

/// Options that print and have no such word in their name.
const LOOKING_NAMES: &str = "ksp_converged_reason ksp_converged_rate ksp_compute_singularvalues ksp_compute_eigenvalues \
    ksp_compute_eigenvalues_explicitly ksp_final_residual mat_umfpack_prl";

/// Return whether an option of a PETSc object only looks at a solver: it prints or draws, and does not change what is computed.
pub fn looks(name: &str) -> bool {
    name.split('_').any(|word| LOOKING_WORDS.contains(&word))
        || LOOKING_NAMES.split_whitespace().any(|known| nest_of(name, known).is_some())
}

/// Return the prefix of the nested solver in an option name that ends in `leaf`: `sub_` for `sub_pc_type` with the leaf `pc_type`, and an empty
/// prefix for the leaf itself. `None` for other names.
pub(super) fn nest_of<'a>(name: &'a str, leaf: &str) -> Option<&'a str> {
    name.strip_suffix(leaf).filter(|nest| nest.is_empty() || nest.ends_with('_'))
}

/// The kind of value that an option takes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Takes {
    /// Nothing, a truth value or a number.
    Switch,
    /// Numbers, separated by commas.
    Numbers,
    /// A word.
    Word,
    /// One of the words of this list.
    OneOf(&'static str),
}

/// Return the kind of value that an option of these lists takes, given its name without prefixes.
pub(super) fn takes(name: &str) -> Option<Takes> {
    let is = |known: &str| known.eq_ignore_ascii_case(name);
    let kinds = [(Takes::Switch, SWITCHES), (Takes::Numbers, NUMBERS), (Takes::Word, WORDS)];
    let kind = kinds.into_iter().find(|(_, list)| list.split_whitespace().any(is)).map(|(kind, _)| kind);
    let listed = || LISTED.iter().find(|(known, _)| is(known)).map(|(_, words)| Takes::OneOf(words));
    kind.or_else(listed).or_else(|| control_of_mumps(name).map(|_| Takes::Numbers))
}

/// Return the number of a control of MUMPS.
fn control_of_mumps(name: &str) -> Option<usize> {
    let name = name.to_ascii_lowercase();
    let number =
        |family: &str, last| name.strip_prefix(family)?.parse().ok().filter(|number| (1..=last).contains(number));
    number("mat_mumps_icntl_", 60).or_else(|| number("mat_mumps_cntl_", 15))
}

/// Return the names of the options that a scene may have, without the controls of MUMPS.
pub(super) fn of_scenes() -> impl Iterator<Item = &'static str> {
    let lists = [SWITCHES, NUMBERS, WORDS].into_iter().flat_map(str::split_whitespace);
    lists.chain(LISTED.iter().map(|(name, _)| *name))
}

/// Return the names of all options of these lists, without the controls of MUMPS.
pub(super) fn all() -> Vec<&'static str> {
    of_scenes().chain([OTHERS, LOOKING_NAMES].into_iter().flat_map(str::split_whitespace)).collect()
}

/// Return the parts into which each `_` divides a name, the first part being the prefix of a solver. The first pair has the whole name.
pub(super) fn ends(name: &str) -> impl DoubleEndedIterator<Item = (&str, &str)> {
    std::iter::once(("", name)).chain(name.match_indices('_').map(|(at, _)| (&name[..at], &name[at + 1..])))
}

/// Return the names that an option may have without its dash and the prefix of a solver: the whole name, and the rest behind the name of a body.
pub(super) fn bare<'a>(option: &'a str, bodies: &[&str]) -> impl Iterator<Item = &'a str> {
    let is_prefix =
        |head: &str| head.is_empty() || bodies.iter().chain([&WHOLE]).any(|prefix| prefix.eq_ignore_ascii_case(head));
    ends(option.trim_start_matches('-')).filter(move |(head, _)| is_prefix(head)).map(|(_, name)| name)
}

/// Return whether a name is among those that are `known`, or a control of MUMPS. It may begin with the prefix of a nested solver.
pub(super) fn is_known(name: &str, known: &[&str]) -> bool {
    known.iter().any(|known| is_nested(name, known)) || leaves(name).any(|leaf| control_of_mumps(leaf).is_some())
}

/// Return whether a name is `known`, perhaps behind the prefix of a nested solver.
pub(super) fn is_nested(name: &str, known: &str) -> bool {
    leaves(name).any(|leaf| leaf.eq_ignore_ascii_case(known))
}

/// Return what stands in a name behind each prefix that a nested solver may have, the empty one included.
fn leaves(name: &str) -> impl Iterator<Item = &str> {
    let is_number = |word: &str| word.bytes().all(|byte| byte.is_ascii_digit());
    let is_nest = move |nest: &str| {
        // the word for a field is free, as x in fieldsplit_x_ksp_type
        nest.starts_with("fieldsplit") || nest.split('_').all(|word| is_number(word) || NESTS.contains(&word))
    };
    ends(name).filter(move |(nest, _)| is_nest(nest)).map(|(_, leaf)| leaf)
}

/// Return the name that is meant, if a name, its last part, or the name of a body before it is mistyped.
pub(super) fn corrected(name: &str, known: &[&str], bodies: &[&str]) -> Option<String> {
    let name = name.trim_start_matches('-');
    let mut parts = ends(name).rev().filter(|(head, end)| head.is_empty() || is_of_family(end));
    let (head, near) = parts.find_map(|(head, end)| Some((head, nearest(end, known.iter().copied())?)))?;
    let body = nearest(head, bodies.iter().copied()).filter(|_| !head.is_empty()).unwrap_or(head);
    let near = if body.is_empty() { near.to_owned() } else { format!("{body}_{near}") };
    (near != name).then_some(near)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_those_of_the_lists_also_nested() {
        for name in
            "KSP_type mg_levels_3_pc_sor_its fieldsplit_0_ksp_type fieldsplit_u_ksp_type ksp_pc_type mg_coarse_sub_pc_type \
             ksp_pc_side mat_mumps_icntl_4 mat_mumps_ooc_tmpdir"
                .split_whitespace()
        {
            assert!(is_known(name, &all()), "{name}");
        }
        for name in "pc_new upper_pc_type fieldsplit_u_ksp_typ mg_levels_pc_sor_it type mat_mumps_icntl_99".split(' ') {
            assert!(!is_known(name, &all()), "{name}");
        }
        for (name, near) in [
            ("ksp_tpye", Some("ksp_type")),
            ("kps_type", Some("ksp_type")),
            ("uper_pc_type", Some("upper_pc_type")),
            ("lower_sub_pc_tipe", Some("lower_sub_pc_type")),
            ("mg_levels_2_ksp_max_itt", Some("mg_levels_2_ksp_max_it")),
            ("middle_ksp_type", None),
        ] {
            assert_eq!(corrected(name, &all(), &["upper", "lower"]).as_deref(), near, "{name}");
        }
    }

    #[test]
    fn names_of_bodies_are_found_in_any_case() {
        let names = |option| bare(option, &["upper"]).collect::<Vec<_>>();
        assert_eq!(names("-UPPER_ksp_rtol"), ["UPPER_ksp_rtol", "ksp_rtol"]);
        assert_eq!(names("-lower_ksp_rtol"), ["lower_ksp_rtol"]);
    }

    #[test]
    fn options_that_look_are_told_by_their_words() {
        let looking = "ksp_view ksp_monitor_true_residual mg_levels_1_ksp_view ksp_converged_reason mat_view_info";
        assert!(looking.split(' ').all(looks));
        assert!(!"ksp_type pc_hypre_type ksp_error_if_not_converged pc_gamg_threshold".split(' ').any(looks));
    }
}
