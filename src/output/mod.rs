//! Everything the program writes: the table on the terminal, and the files of a run.
//!
//! Nothing here knows the space dimension: points and vectors have three components, with z = 0 in the plane. A function
//! that writes to an `out` returns the errors of that writer.

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
pub mod leftovers;
mod lock;
#[cfg(feature = "cli")]
pub mod plot;
#[cfg(feature = "cli")]
pub mod progress;
pub mod report;
pub mod rows;
#[cfg(feature = "cli")]
mod scale;
pub mod steps;
mod summary;
#[cfg(feature = "cli")]
pub mod table;
mod tags;
pub mod vtu;

/// Print a line to standard output. A reader that has closed the pipe is no error.
///
/// # Errors
/// [`Kind::File`](crate::error::Kind::File) when the line is lost for another reason, as on a full disk.
pub fn say(text: impl std::fmt::Display) -> Result<()> {
    // one write for the whole text: standard output would flush after each of its lines
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
#[cfg(feature = "cli")]
pub use plot::{Axis, Color, ConvergenceSeries, Plot, Series, Style};
pub use report::{
    BalanceReport, BodyReport, EstimateReport, ForceReport, ForecastReport, InnerTimes, IntervalReport, LISTED,
    LookReport, PairReport, Report, RoundReport, busiest,
};
pub use rows::RowFile;
pub use steps::{Extent, ReactionReport, StepPairReport, StepReport, StepTable};
pub use summary::warning_lines;
#[cfg(feature = "cli")]
pub use table::IterationTable;
pub use vtu::{BodyField, CellKind, Encoding, Grid};
