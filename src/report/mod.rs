//! The page and the pictures of a run, made from its files alone.
//!
//! Unless a function says otherwise, its errors are those of the files that it reads and of the templates.

mod bands;
mod body;
mod contact;
mod figure;
mod files;
mod page;
mod picture;
mod view;
mod vtu;
mod words;

pub use figure::draw;
pub use page::{FILE, save};
