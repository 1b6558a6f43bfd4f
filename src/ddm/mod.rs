//! The method: Robin-Robin domain decomposition for the nonlinear variational equation (26).
//!
//! There are two loops, each one screen: that of the paper ([`robin`]), and Newton's method (`newton`). They work on arrays over the contact
//! points (compression, pressure, tangent, weight) and on bodies through the trait [`Body`](crate::model::Body). They know no dimension, no
//! element, no mesh and no PETSc. Where a function says nothing else, its errors are failures of the solver library; not converging is a [`Status`].

mod bound;
pub mod gamma;
mod newton;
mod progress;
pub mod robin;
mod run;
mod solve;
mod start;
mod stop;

pub use bound::Reached;
pub use newton::{resisting, respond};
pub use run::{Observer, Row, Silent};
pub use solve::{InitialGuess, Method, Outcome, Settings, State, first_springs, solve};
pub use stop::{Discretisation, Inaccuracy, SHARE, Status, Whose};
