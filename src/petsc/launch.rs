//! How a process starts MPI: under a launcher, or alone.

use std::env;

/// Return whether a launcher such as `mpiexec` or `srun` started this process, by the variables of Open MPI, PMIx and
/// PMI.
pub(super) fn is_launched() -> bool {
    ["OMPI_COMM_WORLD_SIZE", "PMIX_RANK", "PMI_RANK"].iter().any(|name| env::var_os(name).is_some())
}

/// The settings of Open MPI for a process without a launcher. Start and end of PETSc take 0.06 s with all of them, and
/// 0.5 s with none (medians of twelve on two cores).
const ALONE: [(&str, &str); 4] = [
    // no daemon: 0.15 s (Open MPI 4; version 5 has none)
    ("OMPI_MCA_ess_singleton_isolated", "1"),
    // no search for networks: 0.2 s
    ("OMPI_MCA_pml", "ob1"),
    // no folder in /tmp: all processes would take the same one, and 29 of 400 that started 40 at a time failed
    ("OMPI_MCA_orte_create_session_dirs", "0"),
    // no search for cores, caches and graphics cards: 0.03 s
    ("HWLOC_COMPONENTS", "no_os,stop"),
];

/// Run `start` with the settings of a process without a launcher, unless the user set one of them.
///
/// They are environment variables, which hold only while MPI starts: a child process under `mpiexec` would inherit them
/// and break.
pub(super) fn with_quick_start<T>(start: impl FnOnce() -> T) -> T {
    if is_launched() || ALONE.iter().any(|(name, _)| env::var_os(name).is_some()) {
        return start();
    }
    for (name, value) in ALONE {
        // SAFETY: Rust's own readers and writers of the environment share a lock. The thread that runs the program
        // starts the session, before the libraries below have threads that might read the environment.
        unsafe { env::set_var(name, value) };
    }
    let result = start();
    for (name, _) in ALONE {
        // SAFETY: as above.
        unsafe { env::remove_var(name) };
    }
    result
}
