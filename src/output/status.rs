//! How a run or a load step ended, as reports and tables have it.

use serde::{Deserialize, Serialize};
use std::fmt;

/// How a run or a load step ended. Reports have the names of these in lower case, with hyphens.
///
/// Those without a solution begin with `Inaccurate`, and are in the order of how far the last iterate is from one.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RunStatus {
    /// A stopping rule was met.
    #[default]
    Converged,
    /// The error cannot fall further in double precision.
    RoundoffLimited,
    /// Solved on a mesh that a limit of meshes or cells, or of Gmsh, leaves above the error asked for.
    MeshLimit,
    /// Solved, but above the error asked for, because pressures are singular at sharp ends.
    ToleranceUnmet,
    /// Solved with an error that is too large.
    Inaccurate,
    /// Several steps made no progress.
    Stagnated,
    /// The limit of iterations was reached.
    IterationLimit,
    /// A signal ended the run.
    Interrupted,
    /// A number that is not finite appeared.
    NotFinite,
    /// Energies are beyond the range of numbers.
    OutOfRange,
    /// Loads move bodies in a way that nothing resists.
    Underconstrained,
    /// Loads push bodies where nothing stops them.
    Unbounded,
    /// An inner solver failed.
    InnerSolver,
}

impl RunStatus {
    /// Return whether the last iterate is a solution on its mesh, to what was asked for.
    pub fn is_solved(self) -> bool {
        matches!(self, Self::Converged | Self::RoundoffLimited)
    }
}

impl fmt::Display for RunStatus {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match serde_json::to_value(self) {
            Ok(serde_json::Value::String(name)) => f.pad(&name),
            _ => Err(fmt::Error),
        }
    }
}
