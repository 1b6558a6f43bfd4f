//! Everything the program writes: the table on the terminal, and the files of a run.
//!
//! Nothing here knows the space dimension: points and vectors have three components, z = 0 in the plane. What is
//! written to an `out` has the errors of that.

#[cfg(feature = "cli")]
mod chart;
pub mod checksums;
pub mod collection;
pub mod contact;
pub mod contacts;
pub mod folder;
mod format;
pub mod gmsh;
pub mod history;
mod largest;
pub mod leftovers;
mod lock;
mod look;
#[cfg(feature = "cli")]
pub mod plot;
#[cfg(feature = "cli")]
pub mod progress;
pub mod report;
pub mod rows;
pub mod steps;
mod summary;
#[cfg(feature = "cli")]
pub mod table;
mod tags;
pub mod vtu;

/// Prints a line to standard output. A reader that has gone is no reason to stop.
///
/// # Errors
/// What is printed is lost otherwise, as on a full disk.
pub fn say(text: impl std::fmt::Display) -> Result<()> {
    // in one piece: standard output would pass each of its lines on by itself
    let mut out = std::io::stdout();
    match out.write_all(format!("{text}\n").as_bytes()).and_then(|()| out.flush()) {
        Err(cause) if cause.kind() != ErrorKind::BrokenPipe => {
            Err(Error::file(Path::new("standard output"), "write", &cause))
        }
        _ => Ok(()),
    }
}

use crate::error::{Error, Result};
use std::io::{ErrorKind, Write};
use std::path::Path;

pub use checksums::Checksums;
pub use contact::ContactTable;
pub use contacts::PairRow;
pub use folder::{Folder, make_folder, safe_name, write_whole};
pub use format::{sci, seconds, trimmed};
pub use history::HistoryWriter;
pub use look::LookReport;
#[cfg(feature = "cli")]
pub use plot::{Axis, Color, ConvergenceSeries, Plot, Series, Style};
pub use report::{
    BalanceReport, BodyReport, EstimateReport, ForceReport, ForecastReport, InnerTimes, IntervalReport, LISTED,
    PairReport, Report, RoundReport, busiest,
};
pub use rows::RowFile;
pub use steps::{Extent, ReactionReport, StepPairReport, StepReport, StepTable};
pub use summary::warning_lines;
#[cfg(feature = "cli")]
pub use table::{IterationTable, Verbosity};
pub use vtu::{BodyField, CellKind, Encoding, Grid};
