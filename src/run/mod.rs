//! A run: from a scene to what was found, for the library and for the command line. Its types are the [`stages`], each made from
//! the one before by [`build`], [`set_up`], [`iterate`] and [`estimate`].
//!
//! Errors are failures of the solver library, but for what functions say of their own.

mod alike;
mod balance;
pub mod clock;
mod distributed;
pub mod ended;
pub mod inner;
pub mod look;
pub mod measure;
pub mod method;
mod pairs;
mod phases;
mod plan;
pub mod preflight;
pub mod recorder;
pub mod report;
pub mod requests;
pub mod results;
mod reuse;
pub mod stages;
pub mod steps;
pub mod verdict;
pub mod words;

pub use alike::refuse_other_scenes;
pub use clock::Clock;
pub use ended::{All, Recovered};
pub use phases::{build, estimate, in_parts, iterate, made_straight, set_up, targets};
pub use recorder::Recorder;
pub use requests::Requests;
pub use reuse::build_after;
pub use stages::{Begin, Built, Done, Prepared};
