//! The order of finite elements.

use crate::error::Result;
use crate::setting::{Context, Node, Setting, ValueKind};
use serde::{Deserialize, Serialize};
use serde_json::Value as Json;

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

impl Setting for Order {
    fn kind() -> ValueKind {
        ValueKind::OneOf(&[1, 2])
    }

    fn read(node: &Node, _: &Context) -> Result<Self> {
        Ok(if node.count()? == 2 { Order::P2 } else { Order::P1 })
    }

    fn echo(&self, _: usize) -> Json {
        self.degree().into()
    }
}
