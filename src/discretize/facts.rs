//! Facts of a body that its parts on several ranks keep.

use super::approach::Outer;
use crate::fem::Extent;
use serde::{Deserialize, Serialize};

/// Facts of a whole body, and the points of the mesh that its nodes come from.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct BodyFacts {
    /// Point of the mesh of each node.
    pub points: Vec<u32>,
    /// Number of nodes of the body and their extent.
    pub extent: Extent,
    /// Number of cells.
    pub cells: usize,
    /// Area (volume) of the body; in a body of revolution the volume of the rings.
    pub volume: f64,
    /// Means over the body of the moduli along x, y, z ([`moduli`](super::elastic::moduli)).
    pub moduli: [f64; 3],
    /// Nodes at which the body is loaded or constrained.
    pub outer: Outer,
}

impl BodyFacts {
    /// Restrict the facts to the nodes in the sorted slice `nodes`, which are renumbered by their positions there.
    pub fn on(&self, nodes: &[u32]) -> Self {
        Self {
            points: nodes.iter().map(|&node| self.points[node as usize]).collect(),
            outer: self.outer.on(nodes),
            ..*self
        }
    }
}
