//! Start and end of MPI and PETSc in this process, and stages of PETSc's log, which `-log_view` lists separately.

use super::blas;
use super::call::{self, petsc, string, text};
use super::error::{Error, Result};
use super::launch::{is_launched, with_quick_start};
use mpi::environment::Universe;
use mpi::topology::{Communicator, SimpleCommunicator};
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::env;
use std::io::Write;
use std::ptr::null_mut;
use std::rc::Rc;
use std::sync::Once;
use std::sync::atomic::{AtomicBool, Ordering};

/// PETSc and MPI can be started once in a process.
static STARTED: AtomicBool = AtomicBool::new(false);

/// A reference-counted token: PETSc and MPI run as long as one of its clones lives.
///
/// Every object of PETSc holds one, so that objects need no lifetimes and cannot outlive PETSc. It is neither `Send`
/// nor `Sync`, since PETSc and MUMPS belong to the thread that started them.
///
/// ```
/// use winkler::petsc::Session;
/// let session = Session::start(&[])?;
/// assert_eq!((session.rank(), session.size()), (0, 1));
/// assert!(session.petsc_version().starts_with("3.") && !session.blas_name().is_empty());
/// assert!(Session::start(&[]).is_err()); // one in a process, also after it ended
/// drop(session);
/// assert!(Session::start(&[]).is_err());
/// assert!(std::env::var_os("OMPI_MCA_pml").is_none()); // nothing is left for child processes
/// # Ok::<(), winkler::error::Error>(())
/// ```
#[derive(Clone)]
pub struct Session(Rc<Running>);

struct Running {
    /// All processes.
    world: SimpleCommunicator,
    /// Options of the user that PETSc has not read itself at its start, by their names with the dash.
    typed: RefCell<BTreeMap<String, Option<String>>>,
    /// Names of options that solvers got as defaults.
    defaults: RefCell<Vec<String>>,
    /// The token of MPI. Its drop ends MPI, after PETSc has ended.
    _universe: Universe,
}

impl Session {
    /// Start MPI and PETSc.
    ///
    /// PETSc gets the options in `words` (as typed: `-ksp_type`, `cg`), in `PETSC_OPTIONS`, and in the file of
    /// `-options_file`; it looks for no files itself. PETSc installs no signal handlers. With several ranks a panic on
    /// one of them ends all.
    ///
    /// # Errors
    /// When a session was started before in this process, when MPI runs already, or when PETSc refuses an option;
    /// PETSc's message is among the causes. PETSc waits for ever if `-options_file` names a pipe.
    pub fn start(words: &[String]) -> Result<Session> {
        start_once()?;
        let universe = with_quick_start(mpi::initialize)
            .ok_or_else(|| Error::new("MPI was already started in this process by other code"))?;
        let world = SimpleCommunicator::world();
        abort_on_panic(world.size() > 1);
        let (typed, defaults) = (RefCell::default(), RefCell::default());
        let session = Session(Rc::new(Running { world, typed, defaults, _universe: universe }));
        if let Err(error) = call::start(words) {
            // the other ranks may still wait for this one inside PETSc, and ending MPI here would wait for them
            if session.size() > 1 {
                std::mem::forget(session);
            }
            return Err(error);
        }
        session.typed().replace(left()?.into_iter().collect());
        Ok(session)
    }

    /// Return whether `mpiexec` or `srun` started this process as one of several ranks.
    pub fn is_one_of_several() -> bool {
        let sizes = ["OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "SLURM_STEP_NUM_TASKS"];
        let size = sizes.iter().find_map(|name| env::var(name).ok()?.parse::<usize>().ok());
        is_launched() && size.is_none_or(|size| size > 1)
    }

    /// Return the options of the user.
    pub(super) fn typed(&self) -> &RefCell<BTreeMap<String, Option<String>>> {
        &self.0.typed
    }

    /// Return the names of options that solvers got as defaults.
    pub(super) fn defaults(&self) -> &RefCell<Vec<String>> {
        &self.0.defaults
    }

    /// Remove the options that solvers got as defaults ([`Ksp::set_default`](super::Ksp::set_default)) from PETSc's
    /// table.
    pub fn clear_defaults(&self) {
        self.0.clear_defaults();
    }

    /// End PETSc and MPI if this is the last clone. PETSc writes its logs then.
    ///
    /// # Errors
    /// PETSc's, such as that of a log that it cannot write.
    pub fn finish(self) -> Result<()> {
        if Rc::strong_count(&self.0) == 1 { self.0.end() } else { Ok(()) }
    }

    /// Set the number of threads of OpenBLAS in this process, unless the user set OPENBLAS_NUM_THREADS or
    /// OMP_NUM_THREADS.
    ///
    /// Return whether the number is in force.
    pub fn set_blas_threads(&self, count: usize) -> bool {
        let typed = ["OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"].iter().any(|name| env::var_os(name).is_some());
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

    /// Return the version of PETSc, such as `3.18.5`.
    pub fn petsc_version(&self) -> String {
        let (mut major, mut minor, mut patch, mut release) = (0, 0, 0, 0);
        // SAFETY: four variables to write to; the function needs no running PETSc.
        unsafe { super::ffi::PetscGetVersionNumber(&mut major, &mut minor, &mut patch, &mut release) };
        format!("{major}.{minor}.{patch}")
    }

    /// Return the name of the BLAS in use: `OpenBLAS` with its kernels, as in `OpenBLAS (Haswell)`, `reference BLAS`,
    /// or the file of another one.
    pub fn blas_name(&self) -> String {
        blas::name()
    }

    /// End all ranks at once with an exit code and without destructors, after a failure that other ranks cannot know
    /// of.
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
        // SAFETY: a null pointer means all files of the C library, which PETSc prints to.
        unsafe { libc::fflush(std::ptr::null_mut()) };
        if is_launched() {
            self.0.world.abort(code);
        }
        std::process::exit(code)
    }
}

/// An option: its name with the dash, and its value if it has one.
pub type Entry = (String, Option<String>);

/// Return the options of the running PETSc that nobody has read so far, sorted by name.
pub(super) fn left() -> Result<Vec<Entry>> {
    let (mut count, mut names, mut values) = (0, null_mut(), null_mut());
    // SAFETY: PETSc returns `count` names and as many values; a value may be null. They are copied before PETSc takes
    // its two lists back.
    let mut entries: Vec<Entry> = unsafe {
        petsc!(PetscOptionsLeftGet(null_mut(), &mut count, &mut names, &mut values))?;
        let entry = |i: usize| {
            let value = *values.add(i);
            (format!("-{}", string(*names.add(i))), (!value.is_null()).then(|| string(value)))
        };
        let entries = (0..count as usize).map(entry).collect();
        petsc!(PetscOptionsLeftRestore(null_mut(), &mut count, &mut names, &mut values))?;
        entries
    };
    entries.sort();
    Ok(entries)
}

/// Note the start of a session.
fn start_once() -> Result<()> {
    if STARTED.swap(true, Ordering::SeqCst) {
        return Err(Error::new("PETSc was already started in this process").help("start one session and clone it"));
    }
    Ok(())
}

impl Running {
    /// Remove the options that solvers got as defaults from PETSc's table.
    fn clear_defaults(&self) {
        // PETSc removes every option that it has taken before
        self.defaults.take().iter().for_each(|name| drop(call::clear_option(name)));
    }

    /// End PETSc, if it runs.
    fn end(&self) -> Result<()> {
        if !call::runs() {
            return Ok(());
        }
        self.clear_defaults();
        call::end()
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        // callers that want the error call `finish`
        let _ = self.end();
    }
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

/// A guard: its stage lasts until it is dropped. Then the enclosing stage goes on.
pub struct Stage {
    is_logged: bool,
}

impl Session {
    /// Begin a stage of PETSc's log. All processes have to begin the same stages.
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
        Stage { is_logged: begin(name).is_ok() }
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
        if self.is_logged && call::runs() {
            // SAFETY: this stage was pushed, and the stages within it were dropped before.
            let _ = unsafe { petsc!(PetscLogStagePop()) };
        }
    }
}
