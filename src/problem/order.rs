//! The order of finite elements.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The polynomial order of the displacements. In a scene it is a number.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[schemars(with = "usize", extend("enum" = [1, 2]))]
#[serde(try_from = "usize", into = "usize")]
pub enum Order {
    /// Linear simplices.
    #[default]
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

impl TryFrom<usize> for Order {
    type Error = &'static str;

    fn try_from(degree: usize) -> Result<Self, Self::Error> {
        match degree {
            1 => Ok(Order::P1),
            2 => Ok(Order::P2),
            _ => Err("must be 1 or 2"),
        }
    }
}

impl From<Order> for usize {
    fn from(order: Order) -> Self {
        order.degree()
    }
}
