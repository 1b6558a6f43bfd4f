//! Meshes that adaptations ended with, remembered by what they are for: the next run begins with one, and `winkler mesh --adapted` writes it.

use crate::error::Result;
use crate::mesh;
use crate::scene::Scene;
use serde_json::Value;

/// Return all that an adaptation is for, as text. Load steps are a part of it, since they choose the load under which meshes are adapted.
pub fn purpose(scene: &Scene) -> String {
    let mut settings = scene.settings();
    let steps = settings["method"]["steps"].take();
    ["output", "solver", "estimate"].iter().for_each(|key| settings[*key] = Value::Null);
    settings["method"] = steps;
    settings.to_string()
}

/// Keep the sizes of the mesh that an adaptation ended with, and whether its error is the one that was asked for: only then does the next run
/// begin with them.
///
/// # Errors
/// The cache cannot be written.
pub fn keep(purpose: &str, is_reached: bool, sizes: &str) -> Result<()> {
    mesh::keep_final(&named(purpose, is_reached), sizes)
}

/// The sizes of a mesh with the error that was asked for, or else of the best one of a run that did not reach it.
pub fn recall(purpose: &str, is_reached: bool) -> Option<String> {
    mesh::recall_final(&named(purpose, is_reached))
}

fn named(purpose: &str, is_reached: bool) -> String {
    if is_reached { purpose.to_owned() } else { format!("best of {purpose}") }
}
