//! The order of finite elements.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The polynomial order of the displacements, from 1 to 8; in space 1 or 2. In a scene it is a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[schemars(with = "usize", extend("enum" = [1, 2, 3, 4, 5, 6, 7, 8]))]
#[serde(try_from = "usize", into = "usize")]
pub struct Order(u8);

impl Order {
    /// Linear simplices.
    pub const P1: Self = Self(1);
    /// Quadratic simplices.
    pub const P2: Self = Self(2);
    /// Degree of the highest order. Interpolation at the nodes amplifies errors 5.3 times there, and the limit of
    /// steady means of contact ([`basis`](crate::contact)) was derived for orders up to it.
    pub const HIGHEST: usize = 8;

    /// Return the order of a polynomial degree, `None` unless it is from 1 to 8.
    pub fn new(degree: usize) -> Option<Self> {
        (1..=Self::HIGHEST).contains(&degree).then_some(Self(degree as u8))
    }

    /// Return the highest order of bodies of a dimension.
    pub fn highest(dimension: usize) -> Self {
        if dimension == 2 { Self(Self::HIGHEST as u8) } else { Self::P2 }
    }

    /// Return the polynomial degree.
    pub fn degree(self) -> usize {
        usize::from(self.0)
    }
}

/// The order of bodies that name none on a mesh of a script or shape, which is made in that order.
impl Default for Order {
    fn default() -> Self {
        Self::P2
    }
}

impl TryFrom<usize> for Order {
    type Error = &'static str;

    fn try_from(degree: usize) -> Result<Self, Self::Error> {
        Self::new(degree).ok_or("must be from 1 to 8")
    }
}

impl From<Order> for usize {
    fn from(order: Order) -> Self {
        order.degree()
    }
}
