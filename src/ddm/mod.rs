//! The method: Robin-Robin domain decomposition for the nonlinear variational equation (26).
//!
//! There are two loops, each one screen: that of the paper ([`robin`]), and Newton's method (`newton`). They work on arrays over the contact
//! points (compression, pressure, tangent, weight) and on bodies through the trait [`Body`](crate::model::Body). They know no dimension, no
//! element, no mesh and no PETSc. Where a function says nothing else, its errors are failures of the solver library; not converging is a [`Status`].

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
