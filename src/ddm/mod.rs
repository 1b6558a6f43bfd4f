//! The method: Robin-Robin domain decomposition for the nonlinear variational equation (26).
//!
//! There are two loops, each one screen: that of the paper ([`robin`]), and Newton's method (`newton`). They work on arrays over the contact
//! points (compression, pressure, tangent, weight) and on the bodies of a [`Model`](crate::model::Model). They know no dimension, no
//! element and no mesh. Where a function says nothing else, its errors are failures of the solver library; not converging is a [`Status`].

mod bound;
mod forcing;
pub mod gamma;
mod newton;
pub mod robin;
mod run;
mod solve;
mod start;
mod step;
mod stop;

pub use forcing::respond;
pub use run::{Observer, Outcome, Row, Silent};
pub use solve::{InitialGuess, Method, Solution, first_springs, solve};
pub use stop::{Inaccuracy, Status};
