//! Contact of two surfaces: search, common pieces, and the arrays that the solution methods work on.
//!
//! Data flow: two [`Side`]s -> [`pieces`] (integration points that both sides share) -> [`ContactPair`]
//! (areas, rows B_a and B_b, gaps), which does not depend on the dimension. The laws of layers are in [`law`].

mod basis;
mod fine;
pub mod law;
mod mirror;
mod normal;
mod pair;
pub mod pieces;
mod point;
mod review;
mod side;
mod slip;

pub use basis::PressureBasis;
pub use fine::{Fine, FinePoint, FinePoints};
pub use mirror::Mirrors;
pub use pair::{ContactPair, ENTRY_ROUNDING, Measure, PairFault, add, assemble, moment_in_scene};
pub use pieces::Coverage;
pub use review::{Chords, ends};
pub use side::Side;
pub use slip::{Tangents, Turns};
