//! Estimated errors and bounds against true errors.

mod bound;
mod carrier;
mod effectivity;
mod ends;
mod estimate;
mod forces;
mod orders;
mod parts;
mod regions;
