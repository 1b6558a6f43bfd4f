//! Scene files: from TOML to a checked [`Scene`]. Every refusal names file and line, and says what to do.
//!
//! [`load`] reads the file into a tree of values, applies the overrides of the command line, and decodes the tree (`decode`) by the keys
//! that the structs of the scene declare (module `setting`). The scene that results (`spec`) is then checked (`check`).
//!
//! An override is `KEY=VALUE`, or an option that is short for one. KEY is a dotted path. Items of lists are numbered from 0
//! (`contact.0.layer.power.a`); a table with a name also goes by its name (`body.upper.order`). VALUE is TOML, or a bare text. The place of a
//! new value lies in the text of the option, so that later refusals point there.

mod check;
mod decode;
mod gone;
mod spec;
#[cfg(test)]
mod tests;

pub use decode::schema;
pub use spec::{AdaptSpec, Most, OutputSpec, Precision, Scene};

use crate::error::{Error, Kind, Place, Result, Source, few};
use crate::setting::{Node, TableEntry, Value, document, value as toml_value};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Read and check a scene file, after applying `overrides` in their order: `KEY=VALUE` as given to `--set`, or options that are short for
/// it. The mesh file must exist; it is not read.
///
/// # Errors
/// Refusals point at the text of the scene or of the override. A file that cannot be read is [`Kind::File`].
pub fn load(path: &Path, overrides: &[String]) -> Result<Scene> {
    parse(path, text(path)?, overrides)
}

/// Check the [`text`] of a scene file like [`load`], which reads it from `path`.
///
/// # Errors
/// Those of [`load`], but for reading the file.
pub fn parse(path: &Path, text: String, overrides: &[String]) -> Result<Scene> {
    let source = Arc::new(Source { name: path.display().to_string(), text });
    let mut tree = document(&source)?;
    for text in overrides {
        apply(&mut tree, text)?;
    }
    let scene = decode::scene(&tree, path).map_err(gone::explain)?;
    scene.verify().map_err(|refusal| refusal.error.at(tree.place_of(&refusal.key)))?;
    Ok(scene)
}

/// Return the folder of examples, if the source that the program was built from is still there.
pub fn examples() -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("meshes");
    folder.is_dir().then_some(folder)
}

/// Read the text of a scene file.
///
/// # Errors
/// [`Kind::File`] if the file cannot be read or is no text.
pub fn text(path: &Path) -> Result<String> {
    if path.is_dir() {
        let error = Error::new(Kind::File, format!("{} is a folder, not a scene file", path.display()));
        let inside = path.join("scene.toml");
        return Err(match inside.is_file() {
            true => error.help(format!("did you mean {}?", inside.display())),
            false => error,
        });
    }
    let bytes = crate::file::read(path).map_err(|error| match path.try_exists() {
        Ok(false) => {
            let examples = examples().map_or(String::new(), |folder| format!("; examples are in {}", folder.display()));
            error.help(format!("`winkler new NAME` writes a scene to begin with{examples}"))
        }
        _ => error,
    })?;
    let bytes = crate::file::with_unix_lines(bytes);
    if let Some(other) = crate::file::other_encoding(&bytes) {
        return Err(Error::new(Kind::File, format!("{} {other}", path.display())).help("save the scene file as UTF-8"));
    }
    String::from_utf8(bytes).map_err(|error| {
        let valid = error.utf8_error().valid_up_to();
        let line = 1 + error.as_bytes()[..valid].iter().filter(|byte| **byte == b'\n').count();
        Error::new(Kind::File, format!("{} is not UTF-8 text, see line {line}", path.display()))
            .help("save the scene file as UTF-8")
    })
}

/// Options with a value, and the key that each sets.
const SHORT: [(&str, &str); 2] = [("--method", "method.name"), ("--tolerance", "adapt.error")];

/// Options without a value, and the key that each sets to true.
const FLAGS: [(&str, &str); 4] =
    [("--estimate", "estimate"), ("--vtu", "output.vtu"), ("--msh", "output.msh"), ("--report", "output.report")];

/// Apply one override to the tree of a scene. It is `KEY=VALUE`, or an option with its value as typed (`--over KEY=VALUE`,
/// `--tolerance 1e-3`, `--vtu`).
fn apply(tree: &mut Node, text: &str) -> Result<()> {
    let text = text.trim_end();
    let text = if text.starts_with("--") { text.to_owned() } else { format!("--set {text}") };
    let end = text.find(' ').unwrap_or(text.len());
    let option = text[..end].to_owned();
    let source = Arc::new(Source { name: option.clone(), text });
    let place = Place { source: source.clone(), span: 0..end };
    let key_of = |list: &[(&str, &'static str)]| list.iter().find(|(name, _)| *name == option).map(|(_, key)| *key);
    if let Some(path) = key_of(&FLAGS) {
        return put(tree, path, &place, Node { place: place.clone(), value: Value::Boolean(true) });
    }
    if let Some(path) = key_of(&SHORT) {
        return put(tree, path, &place, value(&source, end)?);
    }
    set(tree, &source, end + 1)
}

/// Put a node at a dotted path of tables. `place` becomes the place of keys that are new.
fn put(tree: &mut Node, path: &str, place: &Place, new: Node) -> Result<()> {
    let mut node = tree;
    for name in path.split('.') {
        node = child(node, &KeySegment { name, place: place.clone(), parent: "", before_number: false })?;
    }
    *node = new;
    Ok(())
}

/// Apply the `KEY=VALUE` that begins at byte `start` of the source.
fn set(tree: &mut Node, source: &Arc<Source>, start: usize) -> Result<()> {
    let text = source.text.as_str();
    let at = |span: Range<usize>| Place { source: source.clone(), span };
    let Some(equals) = text[start.min(text.len())..].find('=').map(|equals| start + equals) else {
        let option = &source.name;
        return Err(Error::new(Kind::Usage, format!("{option} without `=`"))
            .at(&at(0..text.len()))
            .help(format!("write {option} KEY=VALUE, such as {option} contact.0.layer.power.a=0.3")));
    };
    let path = segments(text, start..equals);
    for span in &path {
        let key = &text[span.clone()];
        if key.is_empty() || !key.chars().all(|c| c.is_ascii_alphanumeric() || "_-*?[]!".contains(c)) {
            return Err(Error::scene(&at(start..equals), "this is not a key of the scene")
                .help("a key is names and numbers joined by points: body.1.young"));
        }
    }
    let new = value(source, equals + 1)?;
    let mut node = tree;
    for (depth, span) in path.iter().enumerate() {
        let parent = text[start..span.start].trim_end().trim_end_matches('.').trim_end();
        let before_number = path.get(depth + 1).is_some_and(|next| is_number(&text[next.clone()]));
        node = child(node, &KeySegment { name: &text[span.clone()], place: at(span.clone()), parent, before_number })?;
    }
    *node = new;
    Ok(())
}

struct KeySegment<'a> {
    /// The key: a name, or the number of an item.
    name: &'a str,
    /// Place of the key in the option.
    place: Place,
    parent: &'a str,
    /// Whether the next key of the path is the number of an item.
    before_number: bool,
}

/// Return the byte range of each key of a dotted path, without the spaces around it.
fn segments(text: &str, path: Range<usize>) -> Vec<Range<usize>> {
    let mut start = path.start;
    let segment = |part: &str| {
        let from = start + part.len() - part.trim_start().len();
        start += part.len() + 1;
        from..from + part.trim().len()
    };
    text[path].split('.').map(segment).collect()
}

/// Return the value that begins at byte `offset`: TOML, or a bare text.
fn value(source: &Arc<Source>, offset: usize) -> Result<Node> {
    let bare = source.text[offset..].trim_start();
    let span = source.text.len() - bare.len()..source.text.len();
    let place = Place { source: source.clone(), span };
    if bare.is_empty() {
        return Err(Error::scene(&place, "the value is missing").help("an empty text is written \"\""));
    }
    match toml_value(source, place.span.start) {
        Ok(node) => Ok(node),
        // this was meant as TOML: a table, a list, a quoted text, a number too large to hold
        Err(error) if bare.starts_with(['{', '[', '"', '\'']) || bare.parse::<f64>().is_ok() => Err(error),
        Err(_) => Ok(Node { place, value: Value::String(bare.to_owned()) }),
    }
}

/// Return the child of a node to which a step leads. A value that has no children becomes an empty table, and a key that its table does
/// not have is added.
fn child<'a>(node: &'a mut Node, step: &KeySegment<'_>) -> Result<&'a mut Node> {
    let new = || Node { place: step.place.clone(), value: Value::Table(Vec::new()) };
    if !matches!(node.value, Value::List(_) | Value::Table(_)) {
        *node = new();
    }
    match &mut node.value {
        Value::List(items) => {
            let index = item_index(items, step)?;
            Ok(&mut items[index])
        }
        Value::Table(entries) => {
            let index = entries.iter().position(|entry| entry.key == step.name).unwrap_or(entries.len());
            if index == entries.len() {
                if step.before_number {
                    return Err(Error::scene(&step.place, format!("`{}` has no items to choose from", step.name))
                        .help("the scene has no such list"));
                }
                entries.push(TableEntry { key: step.name.to_owned(), key_place: step.place.clone(), node: new() });
            }
            Ok(&mut entries[index].node)
        }
        _ => Err(Error::scene(&step.place, "there is nothing below this")),
    }
}

/// Return the index of the item that a step names by its number, or by the name of its table.
fn item_index(items: &[Node], step: &KeySegment<'_>) -> Result<usize> {
    let KeySegment { name, place, parent, .. } = step;
    let count = match items.len() {
        1 => "1 item".to_owned(),
        count => format!("{count} items"),
    };
    let numbers = match items.len() {
        0 => None,
        1 => Some("the only item is number 0".to_owned()),
        count => Some(format!("they are numbered 0 to {}", count - 1)),
    };
    let refuse = |message: String, help: Option<String>| {
        let error = Error::scene(place, message);
        Err(match help {
            Some(help) => error.help(help),
            None => error,
        })
    };
    if is_number(name) {
        return match name.parse::<usize>() {
            Ok(index) if index < items.len() => Ok(index),
            _ => refuse(format!("`{parent}` has {count}, there is no number {name}"), numbers),
        };
    }
    if let Some(index) = items.iter().position(|item| item.name_in() == Some(name)) {
        return Ok(index);
    }
    let names: Vec<&str> = items.iter().filter_map(Node::name_in).collect();
    let help = if names.is_empty() { numbers } else { Some(format!("their names: {}", few(names).join(", "))) };
    refuse(format!("`{parent}` is a list of {count}; `{name}` is no number"), help)
}

fn is_number(text: &str) -> bool {
    !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit())
}
