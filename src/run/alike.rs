//! The check that all ranks read the same scene. Otherwise the ranks would solve no common problem, or wait for each other forever.

use crate::error::{Error, Kind, Result, few};
use crate::file::digest;
use crate::parallel::differences;
use crate::petsc::Session;
use crate::scene::Scene;
use serde_json::Value;
use std::borrow::Borrow;
use std::collections::{BTreeMap, BTreeSet};

/// Refuse, on all ranks, scenes that differ between ranks, data and tables included. Files of the mesh are not compared, as only the
/// first rank reads them. Collective.
///
/// # Errors
/// [`Kind::Scene`] with the ranks, and the keys whose values differ.
pub fn refuse_other_scenes(session: &Session, scenes: &[impl Borrow<Scene>]) -> Result<()> {
    if session.size() == 1 {
        return Ok(());
    }
    let mut values: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for scene in scenes {
        for (key, value) in keys_and_values(scene.borrow().contents()) {
            values.entry(key).or_default().push(value);
        }
    }
    let digests = values.into_iter().map(|(key, values)| (key, digest(&values))).collect();
    let differences = differences(session, &digests);
    if differences.is_empty() {
        return Ok(());
    }
    let ranks: BTreeSet<usize> = differences.iter().map(|difference| difference.rank).collect();
    let keys: BTreeSet<String> = differences.into_iter().map(|difference| format!("`{}`", difference.what)).collect();
    let (word, reads) = if ranks.len() == 1 { ("rank", "reads") } else { ("ranks", "read") };
    let (ranks, keys) = (few(ranks).join(", "), few(keys).join(", "));
    let message = format!("{word} {ranks} {reads} another scene than rank 0: other values of {keys}");
    let help = "start all ranks in the same folder, where they find the same scene, data and tables";
    Err(Error::new(Kind::Scene, message).help(help).common())
}

/// Return the values of the keys of a scene as text. Each table of data has a key of its own.
fn keys_and_values(mut contents: Value) -> Vec<(String, String)> {
    let data = contents["data"].take();
    let data = data.as_object().into_iter().flatten().map(|(name, table)| (format!("data.{name}"), table.to_string()));
    let keys = contents.as_object().into_iter().flatten().map(|(key, value)| (key.clone(), value.to_string()));
    data.chain(keys).collect()
}
