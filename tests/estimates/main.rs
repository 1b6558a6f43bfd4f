//! Estimated errors and bounds against true errors.

#[path = "../common/mod.rs"]
mod common;

mod bound;
mod effectivity;
mod estimate;
mod parts;
