//! What the user wrote: TOML -> checked [`Scene`]. Every refusal names file, line, and the way out.
pub mod expression;
mod spec;
pub use spec::*;
