//! The method: Robin-Robin domain decomposition for the nonlinear variational equation (26).
//!
//! Start with [`iterate`]: the loop. It works on point arrays (compression, pressure, tangent, weight) and on
//! bodies that answer the verbs of [`Body`]; it knows no dimension, no element, no mesh and no PETSc.

mod balance;
pub mod body;
mod closing;
mod coarse;
mod cone;
mod fall;
pub mod field;
pub mod forecast;
pub mod gamma;
pub mod held;
pub mod interval;
pub mod iterate;
mod joint;
pub mod layer;
mod lift;
pub mod line;
pub mod linear;
mod measure;
pub mod method;
pub mod model;
mod origin;
mod progress;
pub mod rigid;
pub mod ritz;
pub mod robin;
mod scale;
mod steady;
pub mod stop;
pub mod sweep;
mod watch;
pub mod zone;

pub use balance::{Discretisation, SHARE};
pub use body::{Body, BodyCounts, Energy, Matrices, Solved};
pub use closing::{automatic_start, rigid_closing};
pub use field::Field;
pub use forecast::Forecast;
pub use interval::Interval;
pub use iterate::{Outcome, Settings, Status, solve};
pub use joint::Joint;
pub use layer::Layer;
pub use lift::prepare;
pub use model::{Adrift, BodySlot, Exchange, Model, Motion, Segment, Serial};
pub use progress::{Observer, Row, Silent};
pub use rigid::Motions;
pub use robin::RobinRule;
pub use stop::StopRule;
pub use sweep::Sweep;
pub use zone::RobinZone;
