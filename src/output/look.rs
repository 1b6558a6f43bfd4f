//! The result of the last look, for `report.json`. The last look sums the forces anew from the displacements of a result.

use serde::Serialize;

/// The relative errors that the last look found; they are lower bounds.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct LookReport {
    /// Error in the energy norm; null if it is not finite, like the others.
    pub error: Option<f64>,
    /// Error of the pressures, relative to the largest.
    pub pressure: Option<f64>,
    /// Out-of-balance force of a body, relative to its contact forces.
    pub imbalance: Option<f64>,
    /// The body or the bodies with the largest of these errors.
    pub at: Vec<String>,
    /// Number of cells in the sums.
    pub cells: usize,
    /// Wall seconds.
    pub seconds: f64,
}
