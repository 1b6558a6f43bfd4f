//! Finite elements on one body: P1 and P2 simplices, in the plane those of any order, linear elasticity, assembly into
//! sparse rows.
//!
//! Data flow: [`Mesh`](crate::mesh::Mesh) group -> [`Space`] -> [`assemble`] -> K and [`Loads`] {f, supports}.
//! Afterwards [`displacement`] has the stresses of a displacement. Degrees of freedom are numbered `D * node +
//! component`.

pub mod assemble;
pub mod balance;
pub mod displacement;
pub mod elasticity;
pub mod element;
mod facets;
mod frame;
pub mod interpolation;
pub mod lagrange;
mod recovery;
pub mod rigid;
pub mod space;
mod split;
pub mod surface;
#[cfg(test)]
mod tests;

pub use crate::linalg::{cross, length, minus, pad, unit};
pub use assemble::{Loads, NodalBlock, NodalForces, NodeGraph, support};
pub use elasticity::Elasticity;
pub use element::EDGES;
pub use facets::{Facets, area_vector};
pub use frame::{Frame, completed, place};
pub use interpolation::Prolongation;
pub use recovery::{Errors, Recovery};
pub use rigid::{PointExtent, RigidMotion};
pub use space::Space;
pub use split::{Split, jumping};
