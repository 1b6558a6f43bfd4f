//! What a user meets: scenes, options, messages, documents, pictures, the library; and the order of the sources.

mod bench;
mod documents;
mod library;
mod lines;
mod manners;
mod options;
mod origins;
mod pictures;
mod refusals;
mod schema;
mod walls;
