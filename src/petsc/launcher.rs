//! Launchers of MPI, and a quick start of Open MPI where no network is needed.
//!
//! By itself Open MPI searches for networks, and version 4 starts a daemon for a lone process. Start and end of MPI take, in medians of 11 and
//! of 5 runs on a busy machine with two cores:
//!
//! | | Open MPI 4.1 | Open MPI 5.0 |
//! | --- | --- | --- |
//! | lone process without settings | 0.63 s, CPU 0.079 s | 1.39 s, CPU 0.128 s |
//! | with them | 0.047 s, CPU 0.019 s | 0.11 s, CPU 0.023 s |
//! | two ranks under `mpiexec` without settings | 0.89 s | 2.17 s |
//! | with them | 0.78 s | 0.45 s |
//!
//! The settings are environment variables, which hold only while MPI starts: a child process under `mpiexec` would inherit them and break.

use crate::error::{Error, Kind, Result};
use std::env;
use std::process::Command;

/// The variables of which each launcher of several ranks sets at least one.
const LAUNCHERS: &str = "OMPI_COMM_WORLD_SIZE PMIX_RANK PMI_RANK PMI_SIZE SLURM_PROCID PALS_RANKID ALPS_APP_PE FLUX_TASK_RANK \
    MPI_LOCALRANKID";

/// The settings of a lone process.
const ALONE: [(&str, &str); 7] = [
    // no daemon: 0.2 s (Open MPI 4; version 5 has none)
    ("OMPI_MCA_ess_singleton_isolated", "1"),
    // no session folder: all lone processes would take the same one, and 102 of 400 that started 40 at a time failed (Open MPI 4)
    ("OMPI_MCA_orte_create_session_dirs", "0"),
    // no networks: 0.2 s each, and 1.3 s for `btl` in Open MPI 5
    ("OMPI_MCA_pml", "ob1"),
    ("OMPI_MCA_btl", "self"),
    // no collective operations for several machines: 2 ms CPU
    ("OMPI_MCA_coll", "self,basic,libnbc"),
    // no plugins of hwloc, and no search for cores, caches and graphics cards: 10 ms CPU each; a lone process is not bound to cores
    ("HWLOC_PLUGINS_PATH", "/nonexistent"),
    ("HWLOC_COMPONENTS", "no_os,stop"),
];

/// The settings of ranks on one machine: messages through shared memory. In Open MPI 5 `vader` is another name of `sm`.
const TOGETHER: [(&str, &str); 2] = [("OMPI_MCA_pml", "ob1"), ("OMPI_MCA_btl", "self,vader")];

/// Return whether `mpiexec` of Open MPI started all ranks on this machine.
fn are_together() -> bool {
    let size = env::var("OMPI_COMM_WORLD_SIZE");
    size.is_ok() && size == env::var("OMPI_COMM_WORLD_LOCAL_SIZE")
}

/// Settings by which launchers start more ranks than there are cores. They are environment variables, since a launcher refuses the options
/// of another one and ignores its variables. The launcher of MPICH and its relatives starts any number of ranks by itself.
pub const CROWDED: [(&str, &str); 3] = [
    // Open MPI 4: --oversubscribe
    ("OMPI_MCA_rmaps_base_oversubscribe", "1"),
    // Open MPI 5: --map-by :oversubscribe
    ("PRTE_MCA_rmaps_default_mapping_policy", ":oversubscribe"),
    // srun: --overcommit
    ("SLURM_OVERCOMMIT", "1"),
];

/// Settings of Open MPI 4, Open MPI 5 and srun by which ranks may use all cores. A rank that is bound to one core has one thread of OpenBLAS.
pub const UNBOUND: [(&str, &str); 3] = [
    ("OMPI_MCA_hwloc_base_binding_policy", "none"),
    ("PRTE_MCA_hwloc_default_binding_policy", "none"),
    ("SLURM_CPU_BIND", "none"),
];

/// Return the command that starts ranks of a program: the words of `$WINKLER_MPIEXEC`, or else `mpiexec`. Arguments to add are `-n`, the
/// number of ranks, and the program, which all launchers understand alike. More ranks than cores are allowed.
pub fn launcher() -> Command {
    let typed = env::var("WINKLER_MPIEXEC").unwrap_or_default();
    let mut words = typed.split_whitespace();
    let mut command = Command::new(words.next().unwrap_or("mpiexec"));
    command.args(words).envs(CROWDED);
    command
}

/// Return the error of a rank that MPI takes for a lone process, though a launcher started it as one of several: the launcher belongs to
/// another MPI than the program. Only the first rank prints it.
pub(super) fn refuse_stranger(size: usize, library: &str) -> Result<()> {
    let Some((started, rank)) = started(|name| env::var(name).ok()).filter(|_| size == 1) else { return Ok(()) };
    let message = format!(
        "{started} ranks were started, but each of them is alone: their launcher is not of the MPI of this program, {library}"
    );
    let error = Error::new(Kind::Solver, message).help("use the mpiexec of that MPI, or `srun --mpi=pmix`");
    Err(if rank > 0 { Error::silent(error.kind().exit_code()) } else { error })
}

/// Return the number of ranks that a launcher of MPI started, if there are several, and the number of this rank. The variables of srun
/// are left out: without a plugin for MPI it also starts programs that are no ranks.
fn started(variable: impl Fn(&str) -> Option<String>) -> Option<(usize, usize)> {
    let number = |names: [&str; 3]| names.into_iter().find_map(|name| variable(name)?.parse::<usize>().ok());
    let size = number(["OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "MPI_LOCALNRANKS"]).filter(|size| *size > 1)?;
    Some((size, number(["OMPI_COMM_WORLD_RANK", "PMI_RANK", "MPI_LOCALRANKID"]).unwrap_or(0)))
}

/// Return whether a launcher such as `mpiexec` started this process.
pub(super) fn seen() -> bool {
    LAUNCHERS.split_whitespace().any(|name| env::var_os(name).is_some())
}

/// The variables with the number of ranks that a launcher started. `SLURM_NTASKS` is not among them, since batch scripts have it, too.
const SIZES: &str = "OMPI_COMM_WORLD_SIZE PMI_SIZE MPI_LOCALNRANKS SLURM_STEP_NUM_TASKS FLUX_JOB_SIZE";

/// The variables with the number of a rank. Some launchers set one of them and none of [`SIZES`].
const NUMBERS: &str = "PMIX_RANK PMI_RANK PALS_RANKID ALPS_APP_PE";

/// Return whether a launcher started this process as one of several ranks, or may have done so.
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

/// Run `start` with the settings for a lone process or for ranks on one machine, unless the user set one of them.
pub(super) fn with_quick_start<T>(start: impl FnOnce() -> T) -> T {
    let settings = match seen() {
        false => &ALONE[..],
        true if are_together() => &TOGETHER,
        true => &[],
    };
    if settings.iter().any(|(name, _)| env::var_os(name).is_some()) {
        return start();
    }
    for (name, value) in settings {
        // SAFETY: Rust's own readers and writers of the environment share a lock. The thread that runs the program starts the session, before
        // the libraries below have threads that might read the environment.
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
    use super::{is_several, started};

    #[test]
    fn ranks_that_were_started_are_counted() {
        let of = |set: &'static [(&str, &str)]| {
            started(|name| set.iter().find(|(known, _)| *known == name).map(|(_, value)| (*value).to_owned()))
        };
        assert_eq!(of(&[]), None);
        assert_eq!(of(&[("PMI_SIZE", "1"), ("PMI_RANK", "0")]), None);
        assert_eq!(of(&[("PMI_SIZE", "4"), ("PMI_RANK", "3")]), Some((4, 3)));
        assert_eq!(of(&[("OMPI_COMM_WORLD_SIZE", "2"), ("OMPI_COMM_WORLD_RANK", "1")]), Some((2, 1)));
        assert_eq!(of(&[("SLURM_STEP_NUM_TASKS", "8"), ("SLURM_PROCID", "1")]), None);
    }

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
