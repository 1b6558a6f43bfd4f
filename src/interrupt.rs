//! Signals that request the program to end.
//!
//! A signal ends the program at once where nothing would be lost, with the exit code that a shell uses for it. After
//! [`Interrupt::hold`], the first signal only sets a flag, and the run checks the flag where it can end properly; a
//! second signal ends the program at once.
//!
//! The first thread waits for signals, and the work of the program is done in a second one. So a library in which the
//! work goes on for ever cannot hold a signal up, and one that installs handlers of its own, as METIS does for SIGTERM,
//! cannot take it.

use crate::error::{Error, Kind, Result};
use nix::sys::signal::{SigSet, Signal};
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXFSZ};
use signal_hook::{flag, low_level};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// The signals that end a run, in the order in which several are reported.
pub const ENDING: [i32; 3] = [SIGTERM, SIGINT, SIGHUP];

/// The requests by signals to this process. Clones share them.
#[derive(Debug, Clone, Default)]
pub struct Interrupt {
    /// Whether the next signal ends the program at once.
    at_once: Arc<AtomicBool>,
    /// Number of the signal that requested the end; 0 for none.
    asked: Arc<AtomicUsize>,
}

/// Bytes of the stack of the second thread, as many as Linux gives the first one.
const STACK: usize = 8 << 20;

impl Interrupt {
    /// Do the work of the program in a second thread, and exit with the code that it returns. This thread waits for
    /// signals. They end the program until [`hold`](Interrupt::hold) is called. SIGHUP stays ignored under `nohup`.
    /// With a limit on the size of files, writing fails with an error that has a message.
    ///
    /// # Errors
    /// The system refuses a thread or a handler.
    pub fn watch(work: impl FnOnce(&Interrupt) -> i32 + Send + 'static) -> Result<i32> {
        let interrupt = Self::default();
        interrupt.at_once.store(true, Ordering::SeqCst);
        let ended = interrupt.begin(work);
        Err(Error::new(Kind::File, "signals cannot be watched").because(ended.to_string()))
    }

    /// Begin the work, and wait for signals. Return why that is not possible.
    fn begin(&self, work: impl FnOnce(&Interrupt) -> i32 + Send + 'static) -> std::io::Error {
        let interrupt = self.clone();
        // the hook for panics has printed a message
        let work = move || std::process::exit(catch_unwind(AssertUnwindSafe(|| work(&interrupt))).unwrap_or(101));
        let wait = || -> std::io::Result<std::convert::Infallible> {
            let ending = self.install()?;
            std::thread::Builder::new().name("main".to_owned()).stack_size(STACK).spawn(work)?;
            // the system prefers the first thread for a signal, if that waits for it
            ending.thread_block()?;
            loop {
                self.note(ending.wait()? as i32);
            }
        };
        match wait() {
            Err(cause) => cause,
        }
    }

    /// Install handlers for a signal that another thread takes all the same, as it may where it starts a process.
    /// Return the signals that end the program.
    fn install(&self) -> std::io::Result<SigSet> {
        let mut ending = SigSet::empty();
        for signal in ENDING.into_iter().filter(|&signal| signal != SIGHUP || !is_ignored(signal)) {
            // handlers run in this order: the shutdown is tested before the flag is set, so that only the second signal
            // ends the program
            flag::register_conditional_shutdown(signal, Kind::Stopped(signal).exit_code(), self.at_once.clone())?;
            flag::register(signal, self.at_once.clone())?;
            flag::register_usize(signal, self.asked.clone(), signal as usize)?;
            ending.add(Signal::try_from(signal)?);
        }
        flag::register(SIGXFSZ, Arc::default())?;
        Ok(ending)
    }

    /// Do for a signal what the handlers do.
    fn note(&self, signal: i32) {
        if self.at_once.swap(true, Ordering::SeqCst) {
            low_level::exit(Kind::Stopped(signal).exit_code());
        }
        self.asked.store(signal as usize, Ordering::SeqCst);
    }

    /// From now on, let the first signal set the flag only.
    pub fn hold(&self) {
        self.at_once.store(self.asked().is_some(), Ordering::SeqCst);
    }

    /// From now on, let a signal end the program at once again.
    ///
    /// # Errors
    /// A signal came since [`hold`](Interrupt::hold): the error ends the program with a message.
    pub fn release(&self) -> Result<()> {
        self.at_once.store(true, Ordering::SeqCst);
        self.asked().map_or(Ok(()), |signal| Err(ended(signal)))
    }

    /// Return the signal that requested the end, if one did.
    pub fn asked(&self) -> Option<i32> {
        match self.asked.load(Ordering::SeqCst) {
            0 => None,
            signal => Some(signal as i32),
        }
    }
}

/// Return the error of a program that a signal ended before there was anything to write.
pub fn ended(signal: i32) -> Error {
    Error::new(Kind::Stopped(signal), format!("ended by {} before the iteration began", name(signal)))
        .help("all that was computed before is written")
}

/// Return the name of a signal that ends a run.
pub fn name(signal: i32) -> &'static str {
    low_level::signal_name(signal).unwrap_or("a signal")
}

/// Whether the program was started with a signal ignored, as by `nohup`.
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| u64::from_str_radix(line.strip_prefix("SigIgn:")?.trim(), 16).ok());
    mask.is_some_and(|mask| mask >> (signal - 1) & 1 == 1)
}
