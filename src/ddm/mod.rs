//! The method: Robin-Robin domain decomposition for the nonlinear variational equation (26).
//!
//! Start with the two loops: [`robin`](self), the paper's, and Newton's, each one screen. They work on point arrays (compression,
//! pressure, tangent, weight) and on bodies that answer the verbs of [`Body`]; they know no dimension, no element, no mesh and no
//! PETSc.

pub mod acceleration;
mod balance;
pub mod body;
mod bound;
mod coefficient;
mod extend;
pub mod field;
pub mod forecast;
pub mod gamma;
pub mod history;
pub mod interval;
pub mod layer_state;
pub mod line;
pub mod linear;
pub mod model;
mod newton;
mod origin;
pub mod rigid;
pub mod ritz;
mod robin;
mod run;
mod scale;
pub mod solve;
pub mod start;
pub mod stop;
pub mod sweep;
mod sweeps;

pub use balance::{Discretisation, SHARE};
pub use body::{Body, BodyCounts, Energy, Matrices, Solved};
pub use coefficient::Coefficient;
pub use extend::prepare;
pub use field::Field;
pub use forecast::Forecast;
pub use history::{Observer, Row, Silent};
pub use interval::Interval;
pub use layer_state::Layer;
pub use linear::{LinearStep, Solution};
pub use model::{BodySlot, Exchange, Mechanism, Model, Motion, Segment, Serial, Sprung};
pub use rigid::{Motions, Moved};
pub use solve::{Method, Outcome, Settings, Start, first_springs, solve};
pub use stop::Status;
pub use sweep::Sweep;
pub use sweeps::Sweeps;
