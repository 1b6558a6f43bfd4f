//! All integration tests, in one program: it is linked once, and `cargo test --test all solving::methods` runs one module.

mod accuracy;
mod common;
mod estimates;
mod geometry;
mod interface;
mod invariance;
mod parallel;
mod solving;
mod stress;
