//! Functions that are given by files, heights of measured surfaces and profiles, for the expressions of a scene.
//!
//! Data flow: file -> numbers in rows (`read`) -> [`Grid`], knots of a profile, or triangulation (`arrange`) -> value and gradient at any
//! place ([`Data::sample`]).

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
