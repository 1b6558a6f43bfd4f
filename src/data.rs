//! Functions given by files: heights of measured surfaces and profiles, for the expressions of a scene.
//!
//! Data flow: a file -> `read` numbers in rows -> arranged as a [`Grid`], as knots of a profile or as a triangulation -> values
//! and gradients at any place.

mod arrange;
mod function;
mod grid;
mod knots;
mod npy;
mod read;
mod roughness;
mod rows;
mod rule;
mod scattered;
#[cfg(test)]
mod tests;
mod text;

pub use function::{Data, Library};
pub use grid::Grid;
pub use roughness::{Roughness, Summits};
pub use rule::{DataSpec, Interpolation, Outside, Sample};
