//! Facts of a body that its parts on several ranks keep.

use super::approach::Outer;
use crate::fem::Extent;
use serde::{Deserialize, Serialize};

/// Facts of a whole body, and where its nodes come from.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct BodyFacts {
    /// The number of each node among the points of the mesh.
    pub points: Vec<u32>,
    /// How many nodes the body has, and where.
    pub extent: Extent,
    /// Number of cells.
    pub cells: usize,
    /// Area (volume) of the body; of one of revolution that of the rings.
    pub volume: f64,
    /// Means of the moduli along x, y, z over it ([`moduli`](super::elastic::moduli)).
    pub moduli: [f64; 3],
    /// Where it is loaded and held.
    pub outer: Outer,
}

impl BodyFacts {
    /// Restrict to some nodes, sorted, which get the numbers of their places.
    pub fn on(&self, nodes: &[u32]) -> Self {
        Self {
            points: nodes.iter().map(|&node| self.points[node as usize]).collect(),
            outer: self.outer.on(nodes),
            ..*self
        }
    }
}
