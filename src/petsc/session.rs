//! Start and end of MPI and PETSc in this process, the launchers of MPI, and stages of PETSc's log, which `-log_view` lists separately.

use super::blas;
use super::files::OptionFiles;
use super::library::{self, petsc, text};
use crate::error::{Error, Kind, Result};
use mpi::environment::Universe;
use mpi::topology::{Communicator, SimpleCommunicator};
use mpi::traits::Root;
use std::cell::OnceCell;
use std::env;
use std::ffi::OsStr;
use std::io::Write;
use std::os::unix::ffi::OsStrExt;
use std::path::PathBuf;
use std::process::Command;
use std::rc::Rc;
use std::sync::Once;
use std::sync::atomic::{AtomicBool, Ordering};

/// PETSc and MPI can be started once in a process.
static STARTED: AtomicBool = AtomicBool::new(false);

/// A reference-counted token: PETSc and MPI run as long as one of its clones lives.
///
/// Every object of PETSc holds one, so that objects need no lifetimes and cannot outlive PETSc. It is neither `Send` nor `Sync`, since PETSc
/// and MUMPS belong to the thread that started them.
///
/// ```
/// use winkler::petsc::Session;
/// let session = Session::start(&[])?;
/// assert_eq!((session.rank(), session.size()), (0, 1));
/// assert_eq!(session.petsc_version(), None); // PETSc itself starts when something needs it
/// let ksp = winkler::petsc::Ksp::new(&session, "")?;
/// assert!(session.petsc_version().is_some_and(|version| version.starts_with("3.")));
/// assert!(!session.blas_name().is_empty());
/// assert!(Session::start(&[]).is_err()); // one in a process, also after it ended
/// drop((ksp, session));
/// assert!(Session::start(&[]).is_err());
/// assert!(std::env::var_os("OMPI_MCA_btl").is_none()); // nothing is left for child processes
/// # Ok::<(), winkler::error::Error>(())
/// ```
#[derive(Clone)]
pub struct Session(Rc<Running>);

struct Running {
    world: SimpleCommunicator,
    /// The files of options in the current folder that are not read.
    left_out: OnceCell<Vec<String>>,
    /// The token of MPI. Its drop ends MPI, after PETSc has ended.
    _universe: Universe,
}

impl Session {
    /// Start MPI and PETSc.
    ///
    /// PETSc gets the options in `words` (as typed: `-ksp_type`, `cg`), in `PETSC_OPTIONS`, in `.petscrc` of the home folder, and in the file
    /// of `-options_file`. A lone process without options starts PETSc when it is first needed. PETSc installs no signal handlers. With
    /// several ranks a panic on one of them ends all.
    ///
    /// # Errors
    /// `Kind::Solver` when a session was started before in this process, when MPI runs already, or when PETSc refuses an option; PETSc's
    /// message is among the causes. Also when a file of options is not a text file or leads back to itself; only rank 0 prints that error.
    pub fn start(words: &[String]) -> Result<Session> {
        let session = Self::start_mpi()?;
        if let Err(error) = session.start_petsc(words) {
            // the other ranks may still wait for this one inside PETSc, and ending MPI here would wait for them
            if session.size() > 1 {
                std::mem::forget(session);
            }
            return Err(error);
        }
        Ok(session)
    }

    /// Return whether a launcher such as `mpiexec` started this process as one of several ranks.
    ///
    /// The other ranks wait until this process starts MPI. If it ends before, they wait for ever.
    pub fn is_one_of_several() -> bool {
        several()
    }

    /// Start MPI alone, so that ranks can compare their input before PETSc reads options.
    ///
    /// # Errors
    /// When a session was started before in this process, or MPI runs already. When the launcher of several ranks belongs to another MPI.
    pub fn start_mpi() -> Result<Session> {
        if STARTED.swap(true, Ordering::SeqCst) {
            return Err(Error::new(Kind::Solver, "PETSc was already started in this process")
                .help("start one session and clone it"));
        }
        let universe = with_quick_start(mpi::initialize)
            .ok_or_else(|| Error::new(Kind::Solver, "MPI was already started in this process by other code"))?;
        let world = SimpleCommunicator::world();
        refuse_stranger(world.size() as usize, &mpi_name())?;
        abort_on_panic(world.size() > 1);
        Ok(Session(Rc::new(Running { world, left_out: OnceCell::new(), _universe: universe })))
    }

    /// Return the files of PETSc options in the current folder that are not read, `.petscrc` and `petscrc`, on rank 0.
    pub fn left_out(&self) -> &[String] {
        self.0.left_out.get().map_or(&[], Vec::as_slice)
    }

    /// Start PETSc after MPI, as [`start`](Self::start) does; once in a process. Collective.
    ///
    /// # Errors
    /// When PETSc refuses an option; other ranks may then wait for this one inside PETSc. When a file of options is not a text file or leads
    /// back to itself; only rank 0 prints that error.
    pub fn start_petsc(&self, words: &[String]) -> Result<()> {
        let checked = if self.rank() == 0 { OptionFiles::check(words) } else { Ok(OptionFiles::default()) };
        let OptionFiles { home, left_out } = broadcast_home(self.world(), checked)?;
        let may_wait = self.size() == 1 && library::may_wait(words, home.as_deref());
        // it was not set before, since PETSc starts once
        let _ = self.0.left_out.set(left_out);
        if may_wait { Ok(()) } else { library::start(words, home.as_deref()) }
    }

    /// End PETSc and MPI if this is the last clone. PETSc writes its logs then.
    ///
    /// # Errors
    /// PETSc's, such as that of a log that it cannot write.
    pub fn finish(self) -> Result<()> {
        if Rc::strong_count(&self.0) == 1 { library::end() } else { Ok(()) }
    }

    /// Set the number of threads of OpenBLAS in this process, unless the user set OPENBLAS_NUM_THREADS or OMP_NUM_THREADS.
    ///
    /// Return whether the number is in force.
    pub fn set_blas_threads(&self, count: usize) -> bool {
        let typed = ["OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"].iter().any(|name| std::env::var_os(name).is_some());
        !typed && blas::set_threads(count)
    }

    /// Return the rank of this process, from 0.
    pub fn rank(&self) -> usize {
        self.0.world.rank() as usize
    }

    /// Return the number of processes.
    pub fn size(&self) -> usize {
        self.0.world.size() as usize
    }

    /// Return the communicator of all processes.
    pub fn world(&self) -> &SimpleCommunicator {
        &self.0.world
    }

    /// Return the version of the running PETSc, such as `3.18.5`; `None` if it was not started.
    pub fn petsc_version(&self) -> Option<String> {
        if !library::runs() {
            return None;
        }
        let (mut major, mut minor, mut patch, mut release) = (0, 0, 0, 0);
        // SAFETY: four variables to write to.
        match unsafe { petsc!(PetscGetVersionNumber(&mut major, &mut minor, &mut patch, &mut release)) } {
            Ok(()) => Some(format!("{major}.{minor}.{patch}")),
            Err(_) => None,
        }
    }

    /// Return the name of the BLAS in use: `OpenBLAS` with its kernels, as in `OpenBLAS (Haswell)`, `MKL`, `BLIS`, `reference BLAS`, ..., or
    /// the file of an unknown one.
    pub fn blas_name(&self) -> String {
        match (blas::name(), blas::kernels()) {
            (name, Some(kernels)) => format!("{name} ({kernels})"),
            (name, None) => name,
        }
    }

    /// Return the kernels to set in `OPENBLAS_CORETYPE`, if OpenBLAS does not use the instruction sets of this processor.
    pub fn faster_blas_kernels(&self) -> Option<&'static str> {
        blas::faster_kernels()
    }

    /// End all ranks at once with an exit code and without destructors, after a failure that other ranks cannot know of.
    ///
    /// This is `MPI_Abort`, except that a process without a launcher just exits, without MPI's banner.
    ///
    /// ```no_run
    /// # let session = winkler::petsc::Session::start(&[]).unwrap();
    /// session.abort(5);
    /// ```
    pub fn abort(&self, code: i32) -> ! {
        // an output that is closed cannot be flushed
        let _ = std::io::stdout().flush();
        // SAFETY: a null pointer means all files of the C library.
        unsafe { super::ffi::fflush(std::ptr::null_mut()) };
        if self.size() > 1 || seen() {
            self.0.world.abort(code);
        }
        std::process::exit(code)
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        // callers that want the error call `finish`
        let _ = library::end();
    }
}

/// Return the name and version of MPI: its first line and words up to a comma, as Open MPI appends its package and date.
fn mpi_name() -> String {
    let text = mpi::environment::library_version().unwrap_or_default();
    text.split([',', '\n', '\0']).next().unwrap_or_default().split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Return on all ranks the file of the home folder that rank 0 found, or an error if rank 0 has one. Collective.
fn broadcast_home(world: &SimpleCommunicator, checked: Result<OptionFiles>) -> Result<OptionFiles> {
    if world.size() == 1 {
        return checked;
    }
    let root = world.process_at_rank(0);
    let mut code = checked.as_ref().map_or_else(|error| error.kind().exit_code(), |_| 0);
    root.broadcast_into(&mut code);
    if code != 0 {
        return Err(checked.err().map_or(Error::silent(code), Error::agreed));
    }
    let files = checked?;
    let mut bytes = files.home.as_ref().map_or(Vec::new(), |path| path.as_os_str().as_bytes().to_vec());
    let mut length = bytes.len() as u64;
    root.broadcast_into(&mut length);
    bytes.resize(length as usize, 0);
    if length > 0 {
        // MPI refuses an empty message
        root.broadcast_into(&mut bytes[..]);
    }
    Ok(OptionFiles { home: (length > 0).then(|| PathBuf::from(OsStr::from_bytes(&bytes))), ..files })
}

/// Let a panic on one rank end the others, too, which would wait for it for ever.
fn abort_on_panic(several: bool) {
    static ONCE: Once = Once::new();
    if !several {
        return;
    }
    ONCE.call_once(|| {
        let print = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |panic| {
            print(panic);
            if mpi::environment::is_initialized() && !mpi::environment::is_finalized() {
                SimpleCommunicator::world().abort(101);
            }
        }));
    });
}

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
fn refuse_stranger(size: usize, library: &str) -> Result<()> {
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
///
/// By itself Open MPI searches for networks, and version 4 starts a daemon for a lone process. Start and end of MPI take, in medians of 11 and
/// of 5 runs on a busy machine with two cores:
///
/// | | Open MPI 4.1 | Open MPI 5.0 |
/// | --- | --- | --- |
/// | lone process without settings | 0.63 s, CPU 0.079 s | 1.39 s, CPU 0.128 s |
/// | with them | 0.047 s, CPU 0.019 s | 0.11 s, CPU 0.023 s |
/// | two ranks under `mpiexec` without settings | 0.89 s | 2.17 s |
/// | with them | 0.78 s | 0.45 s |
///
/// The settings are environment variables, which hold only while MPI starts: a child process under `mpiexec` would inherit them and break.
fn with_quick_start<T>(start: impl FnOnce() -> T) -> T {
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

/// A guard: its stage lasts until it is dropped. Then the enclosing stage goes on.
pub struct Stage {
    is_logged: bool,
}

impl Session {
    /// Begin a stage of PETSc's log, if PETSc runs. All processes have to begin the same stages.
    ///
    /// ```
    /// use winkler::petsc::Session;
    /// let session = Session::start(&["-log_view".to_owned(), ":/dev/null".to_owned()])?;
    /// let outer = session.stage("set-up");
    /// drop(session.stage("linear solve"));
    /// drop(session.stage("linear solve"));
    /// drop(outer);
    /// # Ok::<(), winkler::error::Error>(())
    /// ```
    pub fn stage(&self, name: &str) -> Stage {
        // a failure of the log does not end a run
        Stage { is_logged: library::runs() && begin(name).is_ok() }
    }
}

fn begin(name: &str) -> Result<()> {
    let (text, mut stage) = (text(name)?, -1);
    // SAFETY: PETSc copies the text, and the number of the stage comes from PETSc.
    unsafe {
        petsc!(PetscLogStageGetId(text.as_ptr(), &mut stage))?;
        if stage < 0 {
            petsc!(PetscLogStageRegister(text.as_ptr(), &mut stage))?;
        }
        petsc!(PetscLogStagePush(stage))
    }
}

impl Drop for Stage {
    fn drop(&mut self) {
        if self.is_logged && library::runs() {
            // SAFETY: this stage was pushed, and the stages within it were dropped before.
            let _ = unsafe { petsc!(PetscLogStagePop()) };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
