//! Ranks that do not read the same: a run would be of no problem at all, or hang where they part.

use crate::error::{Error, Kind, Result, few};
use crate::file::digest;
use crate::parallel::differences;
use crate::petsc::Session;
use crate::scene::Scene;
use serde_json::Value;
use std::borrow::Borrow;
use std::collections::{BTreeMap, BTreeSet};

/// Refuse, on all ranks, scenes that are not the same on all of them, with their data and tables. The files of the mesh do not count: the
/// first rank alone reads them. Collective.
///
/// # Errors
/// The ranks, and the keys whose values differ.
pub fn refuse_other_scenes(session: &Session, scenes: &[impl Borrow<Scene>]) -> Result<()> {
    if session.size() == 1 {
        return Ok(());
    }
    let mut values: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for scene in scenes {
        for (key, value) in parts(scene.borrow().contents()) {
            values.entry(key).or_default().push(value);
        }
    }
    let facts = values.into_iter().map(|(key, values)| (key, digest(&values))).collect();
    let found = differences(session, &facts);
    if found.is_empty() {
        return Ok(());
    }
    let ranks: BTreeSet<usize> = found.iter().map(|difference| difference.rank).collect();
    let keys: BTreeSet<String> = found.into_iter().map(|difference| format!("`{}`", difference.what)).collect();
    let (word, reads) = if ranks.len() == 1 { ("rank", "reads") } else { ("ranks", "read") };
    let (ranks, keys) = (few(ranks).join(", "), few(keys).join(", "));
    let message = format!("{word} {ranks} {reads} another scene than rank 0: other values of {keys}");
    let help = "start all ranks in the same folder, where they find the same scene, data and tables";
    Err(Error::new(Kind::Scene, message).help(help).common())
}

/// Return the values of the keys of a scene as text, each table of data by its own name.
fn parts(mut contents: Value) -> Vec<(String, String)> {
    let data = contents["data"].take();
    let data = data.as_object().into_iter().flatten().map(|(name, of)| (format!("data.{name}"), of.to_string()));
    let keys = contents.as_object().into_iter().flatten().map(|(key, value)| (key.clone(), value.to_string()));
    data.chain(keys).collect()
}
