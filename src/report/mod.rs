//! Results of a run for the eye, made from its files alone: one page, and single pictures.
//!
//! Errors are those of the files that are read and of the templates, but for what functions say of their own.

pub mod bands;
pub mod body;
mod contact;
mod figure;
mod files;
pub mod page;
mod raster;
mod solid;
mod space;
mod vtu;
mod words;

pub use figure::draw;
pub use page::{FILE, save};
