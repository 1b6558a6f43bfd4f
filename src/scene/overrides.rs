//! `--set KEY=VALUE`, and options that are short for it. They replace values of the scene before it is checked.
//!
//! KEY is a dotted path. Items of lists are numbered from 0 (`contact.0.layer.power.a`); a table with a name also goes by its name
//! (`body.upper.order`). VALUE is TOML, or a bare text. The place of a new value lies in the text of the option, so that later refusals
//! point there.

use crate::error::{Error, Kind, Place, Result, Source, few};
use crate::setting::{Entry, Node, Value, value as toml_value};
use std::ops::Range;
use std::sync::Arc;

/// Options with a value, and the key that each sets.
const SHORT: [(&str, &str); 3] =
    [("--method", "method.name"), ("--tolerance", "adapt.error"), ("--checkpoint", "output.checkpoint")];

/// Options without a value, and the key that each sets to true.
const FLAGS: [(&str, &str); 5] = [
    ("--estimate", "estimate"),
    ("--vtu", "output.vtu"),
    ("--msh", "output.msh"),
    ("--report", "output.report"),
    ("--trust-geo", "trust_geo"),
];

/// Apply one override to the tree of a scene. It is `KEY=VALUE`, or an option with its value as typed (`--over KEY=VALUE`,
/// `--tolerance 1e-3`, `--vtu`).
///
/// # Errors
/// A text without `=`, a path that leads nowhere, and values that are not TOML.
pub(super) fn apply(tree: &mut Node, text: &str) -> Result<()> {
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
        node = child(node, &Step { name, place: place.clone(), parent: "", before_number: false })?;
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
        node = child(node, &Step { name: &text[span.clone()], place: at(span.clone()), parent, before_number })?;
    }
    *node = new;
    Ok(())
}

/// One key of a dotted path.
struct Step<'a> {
    /// The key: a name, or the number of an item.
    name: &'a str,
    /// Place of the key in the option.
    place: Place,
    /// The path before the key.
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
fn child<'a>(node: &'a mut Node, step: &Step<'_>) -> Result<&'a mut Node> {
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
                entries.push(Entry { key: step.name.to_owned(), key_place: step.place.clone(), node: new() });
            }
            Ok(&mut entries[index].node)
        }
        _ => Err(Error::scene(&step.place, "there is nothing below this")),
    }
}

/// Return the index of the item that a step names by its number, or by the name of its table.
fn item_index(items: &[Node], step: &Step<'_>) -> Result<usize> {
    let Step { name, place, parent, .. } = step;
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
