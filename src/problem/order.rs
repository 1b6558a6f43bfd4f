//! The order of finite elements.

use crate::error::Result;
use crate::setting::{Context, Node, Setting, ValueKind};
use serde::{Deserialize, Serialize};
use serde_json::Value as Json;

/// The polynomial order of the displacements, from 1 to 8; in space 1 or 2.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Order(u8);

impl Order {
    /// Linear simplices.
    pub const P1: Self = Self(1);
    /// Quadratic simplices.
    pub const P2: Self = Self(2);
    /// Degree of the highest order.
    pub const HIGHEST: usize = 8;

    /// Return the order of a polynomial degree, `None` unless it is from 1 to 8.
    pub fn new(degree: usize) -> Option<Self> {
        (1..=Self::HIGHEST).contains(&degree).then_some(Self(degree as u8))
    }

    /// Return the polynomial degree.
    pub fn degree(self) -> usize {
        usize::from(self.0)
    }

    /// Return the order of the mesh that gives bodies of this order their shape: 1 or 2.
    pub fn of_shape(self) -> Self {
        self.min(Self::P2)
    }
}

impl Setting for Order {
    fn kind() -> ValueKind {
        ValueKind::OneOf(&[1, 2, 3, 4, 5, 6, 7, 8])
    }

    fn read(node: &Node, _: &Context) -> Result<Self> {
        let degree = node.count()?;
        Self::new(degree).ok_or_else(|| node.refuse("orders are from 1 to 8"))
    }

    fn echo(&self, _: usize) -> Json {
        self.degree().into()
    }
}
