//! The order of finite elements.

use serde::{Deserialize, Serialize};

/// The polynomial order of the displacements.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Order {
    /// Linear simplices.
    P1,
    /// Quadratic simplices.
    P2,
}

impl Order {
    /// Return the polynomial degree: 1 or 2.
    pub fn degree(self) -> usize {
        match self {
            Order::P1 => 1,
            Order::P2 => 2,
        }
    }
}
