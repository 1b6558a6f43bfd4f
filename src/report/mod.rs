//! The page and the pictures of a run, made from its files alone.
//!
//! Unless a function says otherwise, its errors are those of the files that it reads and of the templates.

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
