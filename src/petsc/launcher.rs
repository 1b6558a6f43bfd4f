//! Quick start of Open MPI where no network is needed.
//!
//! Alone, Open MPI spends 0.3 s on starting a daemon and searching networks, and 0.2 s on networks where `mpiexec` starts all ranks on
//! one machine. Some settings spare that; they may hold only while MPI starts, since a child process under `mpiexec` would inherit them
//! and break.

use std::env;

/// One of these is set by whatever starts several ranks.
const LAUNCHERS: &str = "OMPI_COMM_WORLD_SIZE PMIX_RANK PMI_RANK PMI_SIZE SLURM_PROCID PALS_RANKID ALPS_APP_PE FLUX_TASK_RANK \
    MPI_LOCALRANKID";

/// What Open MPI is told when it runs alone.
///
/// Lone processes all take the same name for their session folder in /tmp; without one they cannot collide when several
/// start at once. The other names keep it from loading components that it would not choose. It also asks hwloc for the cores
/// and caches that ranks are bound to; hwloc looks for graphics cards then, on X servers, too. A lone process is not bound.
const ALONE: [(&str, &str); 13] = [
    ("OMPI_MCA_ess_singleton_isolated", "1"),
    ("OMPI_MCA_ess", "singleton"),
    ("OMPI_MCA_pmix", "isolated"),
    ("OMPI_MCA_pml", "ob1"),
    ("OMPI_MCA_btl", "self"),
    ("OMPI_MCA_coll", "self,basic,libnbc"),
    ("OMPI_MCA_orte_create_session_dirs", "0"),
    ("OMPI_MCA_shmem", "posix"),
    ("OMPI_MCA_reachable", "weighted"),
    ("OMPI_MCA_state", "app"),
    ("OMPI_MCA_errmgr", "default_app"),
    ("HWLOC_PLUGINS_PATH", "/nonexistent"),
    ("HWLOC_COMPONENTS", "no_os,stop"),
];

/// What it is told when all ranks are on one machine: to talk through shared memory.
const TOGETHER: [(&str, &str); 2] = [("OMPI_MCA_pml", "ob1"), ("OMPI_MCA_btl", "self,vader")];

/// Whether `mpiexec` of Open MPI started all ranks on this machine.
fn are_together() -> bool {
    let of = |name: &str| env::var(name).ok();
    let size = of("OMPI_COMM_WORLD_SIZE");
    size.is_some() && size == of("OMPI_COMM_WORLD_LOCAL_SIZE")
}

/// Whether a launcher such as `mpiexec` started this process.
pub(super) fn seen() -> bool {
    LAUNCHERS.split_whitespace().any(|name| env::var_os(name).is_some())
}

/// Variables in which launchers say how many ranks they started. `SLURM_NTASKS` is not among them: it is set in a batch script, too.
const SIZES: &str = "OMPI_COMM_WORLD_SIZE PMI_SIZE MPI_LOCALNRANKS SLURM_STEP_NUM_TASKS FLUX_JOB_SIZE";

/// Set by launchers that say the number of a rank, and perhaps nowhere how many there are.
const NUMBERS: &str = "PMIX_RANK PMI_RANK PALS_RANKID ALPS_APP_PE";

/// Whether a launcher started this process as one of several ranks, or may have done so.
pub(super) fn several() -> bool {
    is_several(|name| env::var(name).ok())
}

fn is_several(variable: impl Fn(&str) -> Option<String>) -> bool {
    let sizes = SIZES.split_whitespace().filter_map(&variable).filter_map(|size| size.parse::<usize>().ok());
    match sizes.max() {
        Some(largest) => largest > 1,
        None => NUMBERS.split_whitespace().any(|name| variable(name).is_some()),
    }
}

/// Runs `start` with the settings of a lone process, or of one among others on its machine, if the user set none of them.
pub(super) fn quick<T>(start: impl FnOnce() -> T) -> T {
    let settings = match seen() {
        false => &ALONE[..],
        true if are_together() => &TOGETHER,
        true => &[],
    };
    if settings.iter().any(|(name, _)| env::var_os(name).is_some()) {
        return start();
    }
    for (name, value) in settings {
        // SAFETY: Rust's own readers and writers of the environment share a lock. A session is started by the thread that
        // runs the program, before the libraries below it have threads that might read the environment.
        unsafe { env::set_var(name, value) };
    }
    let result = start();
    for (name, _) in settings {
        // SAFETY: as above.
        unsafe { env::remove_var(name) };
    }
    result
}

#[cfg(test)]
mod tests {
    use super::is_several;

    #[test]
    fn launchers_are_known_by_what_they_set() {
        for (set, several) in [
            (&[][..], false),
            (&[("OMPI_COMM_WORLD_SIZE", "2"), ("PMIX_RANK", "0")], true),
            (&[("OMPI_COMM_WORLD_SIZE", "1"), ("PMIX_RANK", "0")], false),
            (&[("PMI_RANK", "0"), ("PMI_SIZE", "3")], true),
            (&[("PMIX_RANK", "1")], true),
            // a batch script of Slurm that starts no step
            (&[("SLURM_PROCID", "0"), ("SLURM_NTASKS", "8"), ("SLURM_STEP_NUM_TASKS", "1")], false),
            (&[("SLURM_PROCID", "0"), ("SLURM_STEP_NUM_TASKS", "8")], true),
        ] {
            let of = |name: &str| set.iter().find(|(known, _)| *known == name).map(|(_, value)| (*value).to_owned());
            assert_eq!(is_several(of), several, "{set:?}");
        }
    }
}
