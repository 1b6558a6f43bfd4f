//! What the last look at a result found, for `report.json`.

use serde::Serialize;

/// Relative errors of a result by forces that are summed anew from its displacements, at least so large.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct LookReport {
    /// Error in the energy norm; null if it is not finite, like the others.
    pub error: Option<f64>,
    /// Error of the pressures, relative to the largest.
    pub pressure: Option<f64>,
    /// Share of its contact forces that a body lacks in balance.
    pub imbalance: Option<f64>,
    /// The body or the bodies with the largest of them.
    pub at: Vec<String>,
    /// Cells gone over.
    pub cells: usize,
    /// Wall seconds.
    pub seconds: f64,
}
