//! What a user meets: scenes, options, messages, documents, pictures, the library; and the order of the sources.

#[path = "../common/mod.rs"]
mod common;

mod bench;
mod documents;
mod library;
mod manners;
mod options;
mod pictures;
mod planted;
mod refusals;
mod schema;
mod walls;
