//! The method: Robin-Robin domain decomposition for the nonlinear variational equation (26).
//!
//! There are two loops, each one screen: that of the paper ([`robin`](self)), and Newton's method. They work on arrays over the contact points
//! (compression, pressure, tangent, weight) and on bodies through the trait [`Body`](crate::model::Body). They know no dimension, no element,
//! no mesh and no PETSc.

pub mod acceleration;
mod balance;
mod bound;
mod fit;
mod forcing;
pub mod forecast;
pub mod gamma;
pub mod history;
mod initial;
pub mod linear;
mod memory;
mod newton;
mod path;
mod progress;
mod robin;
mod roundoff;
mod run;
mod scale;
pub mod solve;
pub mod start;
mod steady;
pub mod stop;

use crate::model::origin;
pub use balance::{Discretisation, SHARE};
pub use bound::Reached;
pub use forecast::Forecast;
pub use history::{Observer, Row, Silent};
pub use initial::{Start, State, first_springs};
pub use solve::{Method, Outcome, Settings, solve};
pub use stop::{Inaccuracy, Status, Whose};
