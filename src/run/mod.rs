//! A run: from a scene to what was found, for the library and for the command line. Its types are the [`stages`], each made from
//! the one before by [`build`], [`set_up`], [`iterate`] and [`estimate`].
//!
//! Errors are failures of the solver library, but for what functions say of their own.

mod alike;
pub mod asking;
mod balance;
mod beyond;
pub mod clock;
mod deal;
pub mod ended;
pub mod inner;
pub mod keep;
pub mod look;
pub mod measure;
pub mod method;
mod phases;
mod plan;
pub mod preflight;
pub mod report;
pub mod results;
pub mod stages;
pub mod steps;
pub mod verdict;
pub mod words;

pub use alike::refuse_other_scenes;
pub use asking::Asking;
pub use clock::Clock;
pub use ended::{All, Recovered};
pub use keep::Keep;
pub use phases::{build, build_with, estimate, in_parts, iterate, made_straight, set_up, targets};
pub use stages::{Begin, Built, Done, Ready};
