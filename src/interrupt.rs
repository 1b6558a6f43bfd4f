//! Signals that ask the program to end, or to write what it has.
//!
//! A signal ends the program at once where nothing would be lost, with the exit code that a shell gives it. While something is
//! [held](Interrupt::hold), the first signal is only noted, and whoever holds asks for it where he can end well; a second one ends the
//! program all the same. Handlers set flags and do nothing else.

use crate::error::{Error, Kind, Result};
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGUSR1, SIGXFSZ};
use signal_hook::flag;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// The signals that end a run, in the order in which they are told where several came.
pub const ENDING: [i32; 3] = [SIGTERM, SIGINT, SIGHUP];

/// What the signals of this process asked for. Clones share it.
#[derive(Debug, Clone, Default)]
pub struct Interrupt {
    /// Whether the next signal ends the program.
    at_once: Arc<AtomicBool>,
    /// Number of the signal that asked for the end; 0 for none.
    asked: Arc<AtomicUsize>,
    snapshot: Arc<AtomicBool>,
}

impl Interrupt {
    /// Notes signals from now on; until something is held they end the program. SIGHUP stays ignored under `nohup`. A limit on the
    /// size of files becomes an error of writing, which has words.
    ///
    /// # Errors
    /// The system refuses a handler.
    pub fn watch() -> Result<Self> {
        let interrupt = Self::default();
        interrupt.at_once.store(true, Ordering::SeqCst);
        let all = || -> std::io::Result<()> {
            for signal in ENDING.into_iter().filter(|&signal| signal != SIGHUP || !is_ignored(signal)) {
                // in this order: the first signal that is noted lets the second one end the program
                flag::register_conditional_shutdown(
                    signal,
                    Kind::Stopped(signal).exit_code(),
                    interrupt.at_once.clone(),
                )?;
                flag::register(signal, interrupt.at_once.clone())?;
                flag::register_usize(signal, interrupt.asked.clone(), signal as usize)?;
            }
            flag::register(SIGUSR1, interrupt.snapshot.clone())?;
            flag::register(SIGXFSZ, Arc::default()).map(|_| ())
        };
        all().map_err(|cause| Error::new(Kind::File, "signals cannot be watched").because(cause.to_string()))?;
        Ok(interrupt)
    }

    /// From now on the first signal is only noted.
    pub fn hold(&self) {
        self.at_once.store(self.asked().is_some(), Ordering::SeqCst);
    }

    /// From now on a signal ends the program again.
    ///
    /// # Errors
    /// A signal was noted meanwhile: the end of the program, in words.
    pub fn release(&self) -> Result<()> {
        self.at_once.store(true, Ordering::SeqCst);
        self.asked().map_or(Ok(()), |signal| Err(ended(signal)))
    }

    /// The signal that asked for the end.
    pub fn asked(&self) -> Option<i32> {
        match self.asked.load(Ordering::SeqCst) {
            0 => None,
            signal => Some(signal as i32),
        }
    }

    /// Whether somebody asked for a snapshot since the last call.
    pub fn wants_snapshot(&self) -> bool {
        self.snapshot.swap(false, Ordering::SeqCst)
    }
}

/// The end by a signal before there was anything to write.
pub fn ended(signal: i32) -> Error {
    Error::new(Kind::Stopped(signal), format!("ended by {} before the iteration began", name(signal)))
        .help("all that was computed before is written")
}

/// Name of a signal that ends a run.
pub fn name(signal: i32) -> &'static str {
    signal_hook::low_level::signal_name(signal).unwrap_or("a signal")
}

/// Whether the program was started with a signal ignored, as by `nohup`.
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| u64::from_str_radix(line.strip_prefix("SigIgn:")?.trim(), 16).ok());
    mask.is_some_and(|mask| mask >> (signal - 1) & 1 == 1)
}
