//! Overrides: up to four lines, each as typed behind `--set` or as a short option, applied to a whole scene.
#![no_main]

use libfuzzer_sys::fuzz_target;
use std::path::Path;

/// Its place, for the mesh beside it to be found from any folder.
const PATH: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../meshes/groove/scene.toml");
const SCENE: &str = include_str!("../../meshes/groove/scene.toml");

fuzz_target!(|text: &str| {
    let overrides: Vec<String> = text.lines().take(4).map(str::to_owned).collect();
    if let Err(error) = winkler::internals::scene::parse(Path::new(PATH), SCENE.to_owned(), &overrides) {
        assert!(!error.message().is_empty() && !error.to_string().is_empty());
    }
});
