//! The options that stand in a scene. They choose solvers and set parameters of solvers, and do nothing else.
//!
//! PETSc's options also write files, remove folders, call a shell, load libraries and read more options. A scene may come from anybody, so it
//! may only have the options listed below. Their names are those in the help of PETSc 3.18 for the solvers of [`probe`](super::probe). Each was
//! looked up in PETSc's sources, and takes numbers, a switch, or words of a closed list. An option that PETSc adds later is not among them.

use super::looks;
use super::probe::{METHODS, PRECONDITIONERS};
use super::typed::Prefixes;
use crate::error::{Error, Kind, Result, nearest};
use crate::petsc::{Session, is_global};
use std::cell::RefCell;
use std::collections::BTreeSet;

thread_local! {
    /// Names of the scene's options in PETSc's table, which is one for the process. They are weaker than typed ones, and are removed with the scene.
    static OF_SCENE: RefCell<BTreeSet<String>> = const { RefCell::new(BTreeSet::new()) };
}

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

/// Options that take a word of the lists below.
const LISTED: &str = "ksp_type pc_type mat_type pc_hypre_type pc_hypre_boomeramg_smooth_type";

/// Matrix types that the program's matrices can have.
const MATRICES: [&str; 9] = ["aij", "seqaij", "mpiaij", "baij", "seqbaij", "mpibaij", "sbaij", "seqsbaij", "mpisbaij"];

/// Preconditioners of hypre. `euclid` is left out: it reads a file `database` of the current folder.
const OF_HYPRE: [&str; 3] = ["boomeramg", "parasails", "pilut"];

/// Smoothers of hypre's multigrid, likewise without Euclid.
const SMOOTHERS: [&str; 3] = ["Schwarz-smoothers", "Pilut", "ParaSails"];

/// Controls of MUMPS that a scene may not set. Controls 1 to 3 are numbers of Fortran files that MUMPS writes to, and 22 lets MUMPS write its
/// factors to a disk.
const WRITING: [&str; 4] = ["1", "2", "3", "22"];

/// The kind of value that an option takes.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Takes {
    /// Nothing, a truth value or a number.
    Switch,
    /// Numbers, separated by commas.
    Numbers,
    /// A word.
    Word,
    /// The name of a solver of PETSc.
    Method,
    /// The name of a preconditioner of PETSc.
    Preconditioner,
    /// One of these words.
    OneOf(&'static [&'static str]),
}

/// Return the kind of value that an option takes, given its name without dash; `None` if a scene may not have it. The name may begin with the
/// prefixes of a body and of nested solvers.
fn takes(name: &str) -> Option<Takes> {
    ends(name).find_map(takes_of_leaf)
}

/// Return a name, and the rest of the name behind each `_`.
fn ends(name: &str) -> impl Iterator<Item = &str> {
    std::iter::once(name).chain(name.match_indices('_').map(|(at, _)| &name[at + 1..]))
}

/// Return the kind of value that an option without prefixes takes.
fn takes_of_leaf(name: &str) -> Option<Takes> {
    let is_in = |list: &str| list.split_whitespace().any(|known| known.eq_ignore_ascii_case(name));
    let control = |family: &str| name.strip_prefix(family).filter(|number| is_number(number));
    let may_set = |number: &str| !WRITING.contains(&number.trim_start_matches('0'));
    Some(match name.to_ascii_lowercase().as_str() {
        "ksp_type" => Takes::Method,
        "pc_type" => Takes::Preconditioner,
        "mat_type" => Takes::OneOf(&MATRICES),
        "pc_hypre_type" => Takes::OneOf(&OF_HYPRE),
        "pc_hypre_boomeramg_smooth_type" => Takes::OneOf(&SMOOTHERS),
        _ if control("mat_mumps_icntl_").is_some_and(may_set) => Takes::Numbers,
        _ if control("mat_mumps_cntl_").is_some() => Takes::Numbers,
        _ if is_in(SWITCHES) => Takes::Switch,
        _ if is_in(NUMBERS) => Takes::Numbers,
        _ if is_in(WORDS) => Takes::Word,
        _ => return None,
    })
}

/// Return whether a text is a natural number.
fn is_number(text: &str) -> bool {
    !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit())
}

impl Takes {
    /// Return whether a value is of this kind; an option without a value has an empty one. No such value can name a file or a viewer.
    fn allows(self, value: &str) -> bool {
        let has = |list: &[&str]| list.iter().any(|known| known.eq_ignore_ascii_case(value));
        let is_default = |word: &str| ["default", "decide"].iter().any(|known| known.eq_ignore_ascii_case(word));
        let is_number = |word: &str| word.parse::<f64>().is_ok() || is_default(word);
        let is_sign = |sign: char| sign.is_ascii_alphanumeric() || "_-+/".contains(sign);
        match self {
            Self::Switch => {
                value.is_empty() || has(&["true", "false", "yes", "no", "on", "off"]) || value.split(',').all(is_number)
            }
            Self::Numbers => value.split(',').all(is_number),
            Self::Word => value.starts_with(|sign: char| sign.is_ascii_alphanumeric()) && value.chars().all(is_sign),
            Self::Method => METHODS.split_whitespace().any(|known| known == value),
            Self::Preconditioner => preconditioners().any(|known| known == value),
            Self::OneOf(words) => has(words),
        }
    }

    /// Return what the user may write, for a message.
    fn words(self) -> String {
        match self {
            Self::Switch => "nothing, true or false, or a number".to_owned(),
            Self::Numbers => "a number, or several with commas between them".to_owned(),
            Self::Word => "a word".to_owned(),
            Self::Method => format!("one of {METHODS}"),
            Self::Preconditioner => format!("one of {}", preconditioners().collect::<Vec<_>>().join(" ")),
            Self::OneOf(words) => format!("one of {}", words.join(" ")),
        }
    }
}

/// Return the names of PETSc's preconditioners. A name may come several times.
fn preconditioners() -> impl Iterator<Item = &'static str> {
    PRECONDITIONERS.split_whitespace().map(|word| word.split(':').next().unwrap_or(word))
}

/// Split the words of a scene's options into options, each with its value if it has one.
///
/// # Errors
/// A word that belongs to no option.
pub fn pairs(words: &[String]) -> Result<Vec<(&str, Option<&str>)>> {
    let (mut words, mut pairs) = (words.iter().peekable(), Vec::new());
    while let Some(word) = words.next() {
        if !word.starts_with('-') {
            return Err(Error::new(Kind::Scene, format!("`{word}` is no PETSc option"))
                .help("options start with a dash and take one value: -ksp_rtol 1e-10"));
        }
        let is_value = |next: &&String| !next.starts_with('-') || next.parse::<f64>().is_ok();
        pairs.push((word.as_str(), words.next_if(is_value).map(String::as_str)));
    }
    Ok(pairs)
}

/// Check that an option chooses a solver or sets a parameter of one, and can do nothing else: then a scene may have it.
///
/// ```
/// use winkler::solver::options::check_of_scene;
/// for (name, value) in [("-ksp_type", "cg"), ("-upper_mg_levels_1_pc_type", "sor"), ("-mat_mumps_icntl_14", "50")] {
///     assert!(check_of_scene(name, Some(value)).is_ok());
/// }
/// for (name, value) in [("-ksp_view", ":file"), ("-pc_type", "python"), ("-ksp_rtol", ":file"), ("-mat_mumps_icntl_1", "7")] {
///     assert!(check_of_scene(name, Some(value)).is_err());
/// }
/// ```
///
/// # Errors
/// Any other option, and a value that such an option does not take.
pub fn check_of_scene(name: &str, value: Option<&str>) -> Result<()> {
    let bare = name.strip_prefix('-').unwrap_or(name);
    let is_plain = bare.chars().all(|sign| sign.is_ascii_alphanumeric() || sign == '_');
    let Some(takes) = takes(bare).filter(|_| is_plain && !is_global(bare)) else {
        return Err(refused(name, value));
    };
    if takes.allows(value.unwrap_or_default()) {
        return Ok(());
    }
    let given = value.map_or("nothing".to_owned(), |value| format!("`{value}`"));
    let error = Error::new(Kind::Solver, format!("in a scene {name} takes {}, not {given}", takes.words()));
    Err(error.help("what PETSc takes besides is for the command line"))
}

/// Return the error for an option that a scene may not have.
fn refused(name: &str, value: Option<&str>) -> Error {
    let typed = value.map_or(name.to_owned(), |value| format!("{name} {value}"));
    let help = || {
        "a scene chooses solvers and sets their parameters; what else PETSc can do is for the command line: winkler solve SCENE "
            .to_owned()
            + &typed
    };
    let error = Error::new(Kind::Solver, format!("a scene may not have the option {name}"));
    error.help(corrected(name).unwrap_or_else(help))
}

/// Return advice with the option that a mistyped name may stand for. There is none for an option that asks PETSc to show something.
fn corrected(name: &str) -> Option<String> {
    let lists = [SWITCHES, NUMBERS, WORDS, LISTED];
    let known: Vec<&str> = lists.iter().flat_map(|list| list.split_whitespace()).collect();
    let bare = name.trim_start_matches('-');
    if looks(bare) {
        return None;
    }
    let mut ends = ends(bare).map(|end| (&bare[..bare.len() - end.len()], nearest(end, known.iter().copied())));
    ends.find_map(|(prefix, near)| near.map(|near| format!("did you mean -{prefix}{near}?")))
}

/// Set an option that stands in the scene, unless the command line has the same option, or the plain one for an option of one
/// body.
///
/// # Errors
/// The option is not one that a scene may have, or PETSc refuses the name.
pub fn set_of_scene(session: &Session, bodies: &[&str], name: &str, value: Option<&str>) -> Result<()> {
    check_of_scene(name, value)?;
    let options = session.options();
    let is_typed = |name: &str| options.has(name) && !OF_SCENE.with_borrow(|names| names.contains(name));
    let plain = Prefixes::new(bodies).split(name).map(|(_, bare)| format!("-{bare}"));
    if is_typed(name) || plain.is_some_and(|plain| is_typed(&plain)) {
        return Ok(());
    }
    options.set(name, value)?;
    OF_SCENE.with_borrow_mut(|names| names.insert(name.to_owned()));
    Ok(())
}

/// Take the scene's options out of PETSc's table, so that another scene of the process starts from the typed options.
pub fn withdraw(session: &Session) -> Result<()> {
    OF_SCENE.take().iter().try_for_each(|name| session.options().clear(name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solvers_and_their_parameters_pass() {
        for (name, value) in [
            ("-ksp_rtol", "1e-8"),
            ("-KSP_Type", "gmres"),
            ("-upper_ksp_type", "minres"),
            ("-newton_mg_coarse_pc_hypre_boomeramg_relax_type_all", "symmetric-SOR/Jacobi"),
            ("-pc_hypre_boomeramg_P_max", "4"),
            ("-mg_levels_3_esteig_ksp_max_it", "12"),
            ("-ksp_chebyshev_esteig", "0,0.1,0,1.1"),
            ("-pc_fieldsplit_fields", "0,1"),
            ("-ksp_knoll", ""),
            ("-ksp_reuse_preconditioner", "false"),
            ("-pc_hypre_boomeramg_print_statistics", "1"),
            ("-sub_pc_factor_mat_ordering_type", "rcm"),
            ("-mat_mumps_cntl_7", "1e-3"),
            ("-ksp_divtol", "inf"),
        ] {
            let value = Some(value).filter(|value| !value.is_empty());
            assert!(check_of_scene(name, value).is_ok(), "{name} {value:?}");
        }
    }

    #[test]
    fn what_writes_loads_or_reads_is_refused() {
        for option in [
            "-ksp_view :f",
            "-ksp_monitor",
            "-upper_ksp_view_mat binary:f",
            "-draw_save $(touch f)",
            "-log_view :f",
            "-options_file f",
            "-OPTIONS_FILE f",
            "-prefix_push x_",
            "-dll_append f.so",
            "-mat_mumps_ooc_tmpdir f",
            "-mat_mumps_icntl_01 7",
            "-mat_mumps_icntl_22 1",
            "-mat_mumps_icntl_+4 7",
            "-pc_type shell",
            "-pc_type hpddm",
            "-ksp_type python",
            "-pc_python_type a.b",
            "-pc_hypre_type euclid",
            "-pc_hypre_boomeramg_smooth_type Euclid",
            "-ksp_rtol 1e-8:f",
            "-ksp_norm_type :f",
            "-ksp_norm_type ../f",
            "-ksp_norm_type ${HOME}",
            "-pc_factor_mat_ordering_type",
            "--ksp_type cg",
            "-ksp type cg",
            "-help",
            "-h",
            "-",
        ] {
            let (name, value) = option.split_once(' ').map_or((option, None), |(name, value)| (name, Some(value)));
            assert!(check_of_scene(name, value).is_err(), "{option}");
        }
    }

    #[test]
    fn advice_is_a_name_or_the_command_line() {
        let advice = |name| check_of_scene(name, Some("x")).unwrap_err().advice().unwrap_or_default().to_owned();
        assert!(advice("-ksp_tpye").contains("-ksp_type"));
        assert!(advice("-ksp_view").ends_with("winkler solve SCENE -ksp_view x"));
        assert!(advice("-draw_save").contains("command line"));
    }
}
