//! Signals that request the program to end.
//!
//! A signal ends the program at once where nothing would be lost, with the exit code that a shell uses for it. After [`Interrupt::hold`], the first
//! signal only sets a flag, and the run checks the flag where it can end properly; a second signal ends the program at once. Handlers set
//! flags and do nothing else.

use crate::error::{Error, Kind, Result};
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXFSZ};
use signal_hook::flag;
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

impl Interrupt {
    /// Install the handlers. Signals end the program until [`hold`](Interrupt::hold) is called. SIGHUP stays ignored under `nohup`. With a
    /// limit on the size of files, writing fails with an error that has a message.
    ///
    /// # Errors
    /// The system refuses a handler.
    pub fn watch() -> Result<Self> {
        let interrupt = Self::default();
        interrupt.at_once.store(true, Ordering::SeqCst);
        let installed = interrupt.install();
        installed.map_err(|cause| Error::new(Kind::File, "signals cannot be watched").because(cause.to_string()))?;
        Ok(interrupt)
    }

    fn install(&self) -> std::io::Result<()> {
        for signal in ENDING.into_iter().filter(|&signal| signal != SIGHUP || !is_ignored(signal)) {
            // handlers run in this order: the shutdown is tested before the flag is set, so that only the second signal ends the program
            flag::register_conditional_shutdown(signal, Kind::Stopped(signal).exit_code(), self.at_once.clone())?;
            flag::register(signal, self.at_once.clone())?;
            flag::register_usize(signal, self.asked.clone(), signal as usize)?;
        }
        flag::register(SIGXFSZ, Arc::default()).map(|_| ())
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
    signal_hook::low_level::signal_name(signal).unwrap_or("a signal")
}

/// Whether the program was started with a signal ignored, as by `nohup`.
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| u64::from_str_radix(line.strip_prefix("SigIgn:")?.trim(), 16).ok());
    mask.is_some_and(|mask| mask >> (signal - 1) & 1 == 1)
}
