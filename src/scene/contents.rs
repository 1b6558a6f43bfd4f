//! What a scene asks for, wherever its files are. Scenes with equal contents have the same answer.

use super::Scene;
use crate::file::digest;
use serde_json::{Value, json};

impl Scene {
    /// Return the settings without the names of files and folders. The name of each data file is replaced by a digest of its numbers;
    /// the settings have the numbers of tables themselves. The contents of the mesh's files are not included.
    pub fn contents(&self) -> Value {
        let mut settings = self.settings();
        let mut remove = |place: &str, keys: &[&str]| {
            if let Some(table) = settings.pointer_mut(place).and_then(Value::as_object_mut) {
                keys.iter().for_each(|key| drop(table.remove(*key)));
            }
        };
        remove("", &["scene"]);
        remove("/mesh", &["geo", "msh"]);
        remove("/method/steps", &["table"]);
        remove("/output", &["dir"]);
        for data in self.data.values() {
            settings["data"][&data.spec.name]["file"] = json!(digest(&data.numbers().collect::<Vec<f64>>()));
        }
        settings
    }

    /// Return the contents without the keys that change neither problem nor method: title, units and output.
    pub fn problem(&self) -> Value {
        let mut contents = self.contents();
        if let Some(table) = contents.as_object_mut() {
            ["title", "units", "output"].iter().for_each(|key| drop(table.remove(*key)));
        }
        contents
    }
}
