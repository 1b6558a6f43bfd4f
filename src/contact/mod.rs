//! Contact of two surfaces: search, common pieces, and the arrays that the solution methods work on.
//!
//! Data flow: two [`Side`]s -> [`pieces`] (integration points that both sides share) -> [`ContactPair`]
//! (areas, rows B_a and B_b, gaps), which does not depend on the dimension. The laws of layers are in [`law`].

mod basis;
mod chords;
mod cover;
mod ends;
mod faces;
pub mod fine;
pub mod law;
mod near;
pub mod order;
mod pair;
pub mod pieces;
mod rim;
pub mod side;

pub use crate::fem::{cross, pad};
pub use basis::Carriers;
pub use chords::Chords;
pub use cover::{Coverage, Left};
pub use ends::End;
pub use faces::{Faces, ROUNDING};
pub use fine::Fine;
pub use law::{LayerLaw, Response};
pub use pair::{ContactPair, Fault, LostPieces, OwnSurface, add, assemble, moment_in_scene};
pub use side::{Side, length, unit};
