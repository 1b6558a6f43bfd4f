//! Keys that earlier versions had.

use crate::error::{Error, Result};
use crate::setting::{Node, Value};

/// The keys, with the names of the tables that they stood in, and what to do instead.
pub const GONE: &[(&str, &str)] = &[(
    "output.compress",
    "numbers of VTU files are written as they are: `output.precision = \"single\"` halves them, and `tar czf` compresses a folder",
)];

/// Refuse a key of an earlier version, in every table of its name.
///
/// # Errors
/// The place of the key, and what to do instead.
pub fn refuse(tree: &Node) -> Result<()> {
    GONE.iter().try_for_each(|(path, advice)| refuse_path(tree, path, path, advice))
}

fn refuse_path(node: &Node, path: &str, whole: &str, advice: &str) -> Result<()> {
    let (key, rest) = path.split_once('.').map_or((path, None), |(key, rest)| (key, Some(rest)));
    match &node.value {
        Value::List(items) => items.iter().try_for_each(|item| refuse_path(item, path, whole, advice)),
        Value::Table(entries) => entries.iter().filter(|entry| entry.key == key).try_for_each(|entry| match rest {
            Some(rest) => refuse_path(&entry.node, rest, whole, advice),
            None => Err(Error::scene(&entry.key_place, format!("there is no `{whole}` any more"))
                .label("a key of an earlier version")
                .help(advice)),
        }),
        _ => Ok(()),
    }
}
