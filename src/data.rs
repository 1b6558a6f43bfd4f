//! Functions that are given by files, heights of measured surfaces and profiles, for the expressions of a scene.
//!
//! Data flow: file -> numbers in rows (`read`) -> points without a height counted (`gaps`), a trend subtracted (`trend`), gaps filled
//! (`fill`) -> [`Grid`], knots of a profile, or triangulation (`arrange`) -> value and gradient at any place ([`Data::sample`]).

mod arrange;
mod fill;
mod function;
mod gaps;
mod grid;
mod knots;
mod npy;
mod raster;
mod read;
mod roughness;
mod rows;
mod rule;
mod scattered;
#[cfg(test)]
mod tests;
mod text;
mod trend;

pub use function::{Data, Library};
pub use grid::Grid;
pub use raster::has_header;
pub use roughness::{Roughness, Summits};
pub use rule::{DataSpec, Detrend, Fill, Interpolation, Missing, Outside, Sample};
pub use trend::Trend;
