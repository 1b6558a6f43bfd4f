//! Scenes: any text is a scene or one refusal that points into it, and its settings can be written down.
#![no_main]

use libfuzzer_sys::fuzz_target;
use std::path::Path;

fuzz_target!(|text: &str| {
    // beside it stands the project itself, whose Cargo.toml serves as a mesh file that is there
    if let Err(error) = winkler::internals::scene::parse(Path::new("scene.toml"), text.to_owned(), &[]) {
        assert!(!error.message().is_empty() && !error.to_string().contains("internal"), "{error}");
    }
});
