//! Estimated errors and bounds against true errors.

mod bound;
mod effectivity;
mod estimate;
mod parts;
