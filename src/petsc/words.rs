//! Lists of words: those that begin options of PETSc, and the options of PETSc as a whole, which belong to no solver.

/// The words after the prefix with which the options of a solver begin: its objects, and objects nested in them.
const FAMILIES: &str = "ksp pc mat sub mg fieldsplit vec esteig redundant telescope deflation hpddm lsc matmatmult matproduct \
    matptap mattransposematmult";

/// The options of PETSc as a whole. PETSc reads some of them only at its end.
const GLOBAL: &str = "log log_all log_exclude log_exclude_actions log_exclude_objects log_mpe log_nvtx log_perfstubs \
    log_summary log_sync log_threshold log_trace log_view log_view_gpu_energy log_view_gpu_time log_view_memory \
    options_file options_file_yaml options_left options_monitor options_monitor_cancel options_string_yaml \
    options_suppress_deprecated_warnings options_view malloc malloc_coalesce malloc_debug malloc_dump malloc_hbw \
    malloc_info malloc_requested_size malloc_test malloc_view malloc_view_threshold on_error_abort \
    on_error_attach_debugger on_error_emacs on_error_malloc_dump on_error_mpiabort help version info info_exclude \
    memory_view objects_dump error_output_none error_output_stdout debug_terminal debugger_nodes debugger_pause \
    debugger_ranks start_in_debugger stop_for_debugger fp_trap no_signal_handler check_pointer_intensity citations \
    history get_total_flops shared_tmp not_shared_tmp tmp mpi_return_on_error nox nox_warning display x_virtual \
    skip_petscrc process_view petsc_ci petsc_ci_portable_error_output petsc_sleep use_gpu_aware_mpi saws_options \
    splitreduction_async vecscatter_view build_twosided";

/// The first words of options that PETSc reads when it creates a device, a window or a file.
const GLOBAL_WORDS: &str = "draw drawaxis viewer device cuda hip lg prefix";

/// Further words that begin options of PETSc, besides [`FAMILIES`] and the options of PETSc as a whole.
const MORE_WORDS: &str = "snes ts tao dm is da dmda dmplex petscspace petscfv petscds sf sfnode partitioner petscpartitioner \
    vecscatter ao pf ps eps svd st bv hypre mumps npc no not winklerprobe";

fn has(words: &str, word: &str) -> bool {
    words.split_whitespace().any(|known| known == word)
}

/// Return the first word of an option without its dash.
fn first(name: &str) -> &str {
    name.split('_').next().unwrap_or(name)
}

/// Return whether an option, without its dash, is one of PETSc as a whole.
pub fn is_global(name: &str) -> bool {
    has(GLOBAL, name) || has(GLOBAL_WORDS, first(name))
}

/// Return whether options of PETSc begin with this word.
pub fn begins_options(word: &str) -> bool {
    [FAMILIES, GLOBAL_WORDS, MORE_WORDS].iter().any(|words| has(words, word))
        || GLOBAL.split_whitespace().any(|name| first(name) == word)
}

/// Return whether a word names a family of objects; such words stand alone or between two `_` (`-sub_ksp_type`).
pub fn is_family(word: &str) -> bool {
    has(FAMILIES, word)
}

/// Return whether an option, without its dash and the prefix of its solver, belongs to a family of objects.
pub fn is_of_family(bare: &str) -> bool {
    bare.split_once('_').is_some_and(|(first, _)| is_family(first))
}
