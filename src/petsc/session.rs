//! The life of MPI and PETSc in this process.

use super::files::Files;
use super::library::petsc;
use super::{blas, kernels, launcher, library, waiting};
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

/// A counted token: PETSc and MPI run as long as one of its clones lives.
///
/// Every PETSc object holds one, so objects need no lifetimes and cannot outlive PETSc. Neither `Send` nor `Sync`:
/// PETSc and MUMPS belong to the thread that started them.
///
/// ```
/// use winkler::petsc::Session;
/// let session = Session::start(&[])?;
/// assert_eq!((session.rank(), session.size()), (0, 1));
/// assert_eq!(session.petsc_version(), None); // PETSc itself waits till something needs it
/// let ksp = winkler::petsc::Ksp::new(&session, "")?;
/// assert!(session.petsc_version().is_some_and(|version| version.starts_with("3.")));
/// assert!(!session.blas_name().is_empty());
/// assert!(Session::start(&[]).is_err()); // one a process, also after it ended
/// drop((ksp, session));
/// assert!(Session::start(&[]).is_err());
/// assert!(std::env::var_os("OMPI_MCA_btl").is_none()); // nothing is left for child processes
/// # Ok::<(), winkler::error::Error>(())
/// ```
#[derive(Clone)]
pub struct Session(Rc<Running>);

struct Running {
    world: SimpleCommunicator,
    /// Files of options in the current folder that are not read.
    left_out: OnceCell<Vec<String>>,
    /// Its drop ends MPI, after PETSc.
    _universe: Universe,
}

impl Session {
    /// Starts MPI, then PETSc (at once, or where a lone process gives it no options, when it is first needed) with the options in `words`
    /// (as typed: `-ksp_type`, `cg`), in `PETSC_OPTIONS`, in `.petscrc` of the home folder and in the file of `-options_file`. PETSc installs
    /// no signal handlers. With several ranks a panic on one of them ends them all.
    ///
    /// # Errors
    /// `Kind::Solver` when a session was started before in this process, when MPI runs already, or when PETSc refuses
    /// an option; PETSc's message is among the causes. A file of options that is none, or that leads back to itself; ranks but the first
    /// have a silent error then.
    pub fn start(words: &[String]) -> Result<Session> {
        let session = Self::start_mpi()?;
        if let Err(error) = session.start_petsc(words) {
            // The other ranks may still wait for this one inside PETSc; ending MPI here would wait for them.
            if session.size() > 1 {
                std::mem::forget(session);
            }
            return Err(error);
        }
        Ok(session)
    }

    /// Return whether a launcher such as `mpiexec` started this process as one of several ranks: the others wait until it starts MPI,
    /// or for ever if it ends before.
    pub fn is_one_of_several() -> bool {
        launcher::several()
    }

    /// Start MPI alone, with which ranks can compare what they are to do before PETSc reads options.
    ///
    /// # Errors
    /// When a session was started before in this process, or MPI runs already.
    pub fn start_mpi() -> Result<Session> {
        if STARTED.swap(true, Ordering::SeqCst) {
            return Err(Error::new(Kind::Solver, "PETSc was already started in this process")
                .help("start one session and clone it"));
        }
        kernels::choose();
        let universe = launcher::quick(mpi::initialize)
            .ok_or_else(|| Error::new(Kind::Solver, "MPI was already started in this process by other code"))?;
        let world = SimpleCommunicator::world();
        abort_on_panic(world.size() > 1);
        Ok(Session(Rc::new(Running { world, left_out: OnceCell::new(), _universe: universe })))
    }

    /// Files of PETSc options in the current folder that PETSc alone would have read, `.petscrc` and `petscrc`, on the first rank.
    pub fn left_out(&self) -> &[String] {
        self.0.left_out.get().map_or(&[], Vec::as_slice)
    }

    /// Start PETSc, after MPI, as [`start`](Self::start) does; once in a process. Collective.
    ///
    /// # Errors
    /// PETSc refuses an option; the other ranks may wait for this one inside PETSc then. A file of options that is none, or that leads back to
    /// itself; ranks but the first have a silent error then.
    pub fn start_petsc(&self, words: &[String]) -> Result<()> {
        let looked = if self.rank() == 0 { Files::look(words) } else { Ok(Files::default()) };
        let Files { home, left_out } = of_first(self.world(), looked)?;
        let may_wait = self.size() == 1 && library::may_wait(words, home.as_deref());
        // a session starts once
        let _ = self.0.left_out.set(left_out);
        if may_wait { Ok(()) } else { library::start(words, home.as_deref()) }
    }

    /// Ends PETSc and MPI if this is the last clone, and tells what goes wrong with it: PETSc writes its logs then.
    ///
    /// # Errors
    /// PETSc's, as of a log that it cannot write.
    pub fn finish(self) -> Result<()> {
        if Rc::strong_count(&self.0) == 1 { library::end() } else { Ok(()) }
    }

    /// Lets OpenBLAS use `count` threads in this process, unless the user set OPENBLAS_NUM_THREADS or OMP_NUM_THREADS.
    /// Returns whether the number is in force.
    pub fn set_blas_threads(&self, count: usize) -> bool {
        let typed = ["OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"].iter().any(|name| std::env::var_os(name).is_some());
        !typed && super::blas::set_threads(count)
    }

    /// Number of this process among [`size`](Self::size), from 0.
    pub fn rank(&self) -> usize {
        self.0.world.rank() as usize
    }

    /// Number of processes.
    pub fn size(&self) -> usize {
        self.0.world.size() as usize
    }

    /// The communicator of all processes.
    pub fn world(&self) -> &SimpleCommunicator {
        &self.0.world
    }

    /// Version of PETSc at run time, such as `3.18.5`; `None` while nothing has needed it.
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

    /// Name of the BLAS in use: `OpenBLAS` with its kernels, as `OpenBLAS (Haswell)`, `MKL`, `BLIS`, `reference BLAS`, ..., or the file of
    /// another one.
    pub fn blas_name(&self) -> String {
        match (blas::name(), kernels::name()) {
            (name, Some(kernels)) => format!("{name} ({kernels})"),
            (name, None) => name,
        }
    }

    /// Ends all ranks at once with an exit code, running no destructor: for a failure that other ranks cannot know of.
    /// This is `MPI_Abort`, except that a process started without a launcher just exits, without MPI's banner.
    ///
    /// ```no_run
    /// # let session = winkler::petsc::Session::start(&[]).unwrap();
    /// session.abort(5);
    /// ```
    pub fn abort(&self, code: i32) -> ! {
        // Nothing can be done about an output that is closed.
        let _ = std::io::stdout().flush();
        // SAFETY: a null file means all files of the C library.
        unsafe { super::ffi::fflush(std::ptr::null_mut()) };
        if self.size() > 1 || launcher::seen() {
            self.0.world.abort(code);
        }
        std::process::exit(code)
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        // who wants to know of an error calls `finish`
        let _ = library::end();
        drop(waiting::take());
    }
}

/// What the first rank found, on all of them: whether it failed, and the file of the home folder.
fn of_first(world: &SimpleCommunicator, looked: Result<Files>) -> Result<Files> {
    if world.size() == 1 {
        return looked;
    }
    let root = world.process_at_rank(0);
    let mut code = looked.as_ref().map_or_else(|error| error.kind().exit_code(), |_| 0);
    root.broadcast_into(&mut code);
    if code != 0 {
        return Err(looked.err().map_or(Error::silent(code), Error::agreed));
    }
    let files = looked?;
    let mut bytes = files.home.as_ref().map_or(Vec::new(), |path| path.as_os_str().as_bytes().to_vec());
    let mut length = bytes.len() as u64;
    root.broadcast_into(&mut length);
    bytes.resize(length as usize, 0);
    if length > 0 {
        // MPI takes no empty message
        root.broadcast_into(&mut bytes[..]);
    }
    Ok(Files { home: (length > 0).then(|| PathBuf::from(OsStr::from_bytes(&bytes))), ..files })
}

/// Makes a panic on one rank end the others too, which would wait for it for ever.
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
