//! Start and end of MPI and PETSc in this process.

use super::files::Files;
use super::library::petsc;
use super::{blas, launcher, library, waiting};
use crate::error::{Error, Kind, Result};
use mpi::environment::Universe;
use mpi::topology::{Communicator, SimpleCommunicator};
use mpi::traits::Root;
use std::cell::OnceCell;
use std::ffi::OsStr;
use std::io::Write;
use std::os::unix::ffi::OsStrExt;
use std::path::PathBuf;
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
        launcher::several()
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
        let universe = launcher::with_quick_start(mpi::initialize)
            .ok_or_else(|| Error::new(Kind::Solver, "MPI was already started in this process by other code"))?;
        let world = SimpleCommunicator::world();
        launcher::refuse_stranger(world.size() as usize, &mpi_name())?;
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
        let checked = if self.rank() == 0 { Files::check(words) } else { Ok(Files::default()) };
        let Files { home, left_out } = broadcast_home(self.world(), checked)?;
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
        if self.size() > 1 || launcher::seen() {
            self.0.world.abort(code);
        }
        std::process::exit(code)
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        // callers that want the error call `finish`
        let _ = library::end();
        drop(waiting::take());
    }
}

/// Return the name and version of MPI: its first line and words up to a comma, as Open MPI appends its package and date.
fn mpi_name() -> String {
    let text = mpi::environment::library_version().unwrap_or_default();
    text.split([',', '\n', '\0']).next().unwrap_or_default().split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Return on all ranks the file of the home folder that rank 0 found, or an error if rank 0 has one. Collective.
fn broadcast_home(world: &SimpleCommunicator, checked: Result<Files>) -> Result<Files> {
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
    Ok(Files { home: (length > 0).then(|| PathBuf::from(OsStr::from_bytes(&bytes))), ..files })
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
