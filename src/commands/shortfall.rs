//! The end of an adaptation above the error that was asked for: its status, message and exit code.

use crate::output::{Report, RunStatus};
use serde::{Deserialize, Serialize};

/// Why an adaptation ends above the error that was asked for, in words.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub enum Shortfall {
    /// A limit of meshes or cells, or of Gmsh.
    Limit(String),
    /// Pressures are singular at sharp ends of contacts, where meshes of a few times as many cells do not reach it. All
    /// other errors are small enough.
    SharpEnds(String),
}

impl Shortfall {
    /// Give a report of a run that found a solution the status and the message of this end.
    pub fn put_into(&self, report: &mut Report) {
        let (status, message) = match self {
            Self::Limit(limit) => (RunStatus::MeshLimit, format!("the error asked for is not reached: {limit}")),
            Self::SharpEnds(ends) => (RunStatus::ToleranceUnmet, format!("{}, but {ends}", report.message)),
        };
        (report.status, report.message) = (status, message);
    }

    /// Return the exit code of a run that found a solution.
    pub fn exit_code(&self) -> i32 {
        match self {
            Self::Limit(_) => 1,
            Self::SharpEnds(_) => 7,
        }
    }
}
