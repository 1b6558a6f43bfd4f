//! The sizes of meshes that adaptations ended with. The next run begins with them, and `winkler mesh --adapted` makes the mesh of them.

use crate::error::Result;
use crate::mesh;
use crate::scene::Scene;
use serde_json::Value;

/// Return the settings that an adapted mesh depends on, as a text: the key under which its sizes are saved.
///
/// Load steps are among them, since they choose the load under which meshes are adapted.
pub fn purpose(scene: &Scene) -> String {
    let mut settings = scene.settings();
    let steps = settings["method"]["steps"].take();
    ["output", "solver", "estimate"].iter().for_each(|key| settings[*key] = Value::Null);
    settings["method"] = steps;
    settings.to_string()
}

/// Save the sizes of the mesh that an adaptation ended with. The next run begins with them only if `is_reached`: the mesh has the error that
/// was asked for.
///
/// # Errors
/// The cache cannot be written.
pub fn save(purpose: &str, is_reached: bool, sizes: &str) -> Result<()> {
    mesh::keep_final(&key(purpose, is_reached), sizes)
}

/// Return the saved sizes of a mesh with the error that was asked for, or (not `is_reached`) of the best mesh of a run that did not reach it.
pub fn recall(purpose: &str, is_reached: bool) -> Option<String> {
    mesh::recall_final(&key(purpose, is_reached))
}

fn key(purpose: &str, is_reached: bool) -> String {
    if is_reached { purpose.to_owned() } else { format!("best of {purpose}") }
}
