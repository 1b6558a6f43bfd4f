//! `--set KEY=VALUE`, and options that are short for it: replaces any value of the scene before it is checked.
//!
//! KEY is a dotted path in which items of lists are numbered from 0 (`contact.0.layer.power.a`), and tables with a name go by it, too
//! (`body.upper.order`). VALUE is TOML, or a bare text. What is replaced then stands in the words of the option, so later refusals point there.

use super::read::{self, Entry, Node, Value};
use crate::error::{Error, Kind, Place, Result, Source, few};
use std::ops::Range;
use std::sync::Arc;

/// Options that are short for `--set`, and the key that they set.
const SHORT: [(&str, &str); 3] =
    [("--method", "method.name"), ("--tolerance", "adapt.error"), ("--checkpoint", "output.checkpoint")];

/// Options without a value, which set a key to true.
const FLAGS: [(&str, &str); 5] = [
    ("--estimate", "estimate"),
    ("--vtu", "output.vtu"),
    ("--msh", "output.msh"),
    ("--report", "output.report"),
    ("--trust-geo", "trust_geo"),
];

/// Applies one override to the tree of a scene: `KEY=VALUE`, or an option with its value as typed (`--over KEY=VALUE`,
/// `--tolerance 1e-3`, `--vtu`).
pub(super) fn apply(tree: &mut Node, text: &str) -> Result<()> {
    let text = text.trim_end();
    let text = if text.starts_with("--") { text.to_owned() } else { format!("--set {text}") };
    let end = text.find(' ').unwrap_or(text.len());
    let option = text[..end].to_owned();
    let source = Arc::new(Source { name: option.clone(), text });
    let place = Place { source: source.clone(), span: 0..end };
    let among = |list: &[(&str, &'static str)]| list.iter().find(|(name, _)| *name == option).map(|(_, key)| *key);
    if let Some(path) = among(&FLAGS) {
        return put(tree, path, &place, Node { place: place.clone(), value: Value::Boolean(true) });
    }
    if let Some(path) = among(&SHORT) {
        return put(tree, path, &place, value(&source, end)?);
    }
    set(tree, &source, end + 1)
}

/// Puts a node at a path of tables, whose keys stand at `place`.
fn put(tree: &mut Node, path: &str, place: &Place, new: Node) -> Result<()> {
    let mut node = tree;
    for name in path.split('.') {
        node = descend(node, &Key { name, place: place.clone() }, "", false)?;
    }
    *node = new;
    Ok(())
}

/// Applies the `KEY=VALUE` that begins at a byte of the source.
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
        let key = Key { name: &text[span.clone()], place: at(span.clone()) };
        let parent = &text[start..span.start.saturating_sub(1).max(start)];
        let indexed = path.get(depth + 1).is_some_and(|next| is_number(&text[next.clone()]));
        node = descend(node, &key, parent, indexed)?;
    }
    *node = new;
    Ok(())
}

struct Key<'a> {
    name: &'a str,
    place: Place,
}

/// Byte ranges of the parts of a dotted path, without the spaces around them.
fn segments(text: &str, path: Range<usize>) -> Vec<Range<usize>> {
    let mut start = path.start;
    let segment = |part: &str| {
        let from = start + part.len() - part.trim_start().len();
        start += part.len() + 1;
        from..from + part.trim().len()
    };
    text[path].split('.').map(segment).collect()
}

/// The value that stands at `offset`: TOML, or a bare text.
fn value(source: &Arc<Source>, offset: usize) -> Result<Node> {
    let bare = source.text[offset..].trim_start();
    let span = source.text.len() - bare.len()..source.text.len();
    let place = Place { source: source.clone(), span };
    if bare.is_empty() {
        return Err(Error::scene(&place, "the value is missing").help("an empty text is written \"\""));
    }
    match read::value(source, place.span.start) {
        Ok(node) => Ok(node),
        // What was meant as TOML: a table, a list, a quoted text, a number too large to hold.
        Err(error) if bare.starts_with(['{', '[', '"', '\'']) || bare.parse::<f64>().is_ok() => Err(error),
        Err(_) => Ok(Node { place, value: Value::String(bare.to_owned()) }),
    }
}

/// The child of a node that a key names; made if it is not there. `indexed` says that an item of it is wanted next.
fn descend<'a>(node: &'a mut Node, key: &Key<'_>, parent: &str, indexed: bool) -> Result<&'a mut Node> {
    if !matches!(node.value, Value::List(_) | Value::Table(_)) {
        *node = Node { place: key.place.clone(), value: Value::Table(Vec::new()) };
    }
    match &mut node.value {
        Value::List(items) => {
            let count = match items.len() {
                1 => "1 item".to_owned(),
                count => format!("{count} items"),
            };
            let refuse = |message: String| {
                let error = Error::scene(&key.place, message);
                match items.len() {
                    0 => error,
                    1 => error.help("the only item is number 0"),
                    count => error.help(format!("they are numbered 0 to {}", count - 1)),
                }
            };
            if !is_number(key.name) {
                let mut named = (0..items.len()).filter(|&item| items[item].name_in() == Some(key.name));
                return match named.next() {
                    Some(item) => Ok(&mut items[item]),
                    None => {
                        let error = refuse(format!("`{parent}` is a list of {count}; `{}` is no number", key.name));
                        let names: Vec<&str> = items.iter().filter_map(Node::name_in).collect();
                        Err(if names.is_empty() {
                            error
                        } else {
                            error.help(format!("their names: {}", few(names).join(", ")))
                        })
                    }
                };
            }
            match key.name.parse::<usize>() {
                Ok(index) if index < items.len() => Ok(&mut items[index]),
                _ => Err(refuse(format!("`{parent}` has {count}, there is no number {}", key.name))),
            }
        }
        Value::Table(entries) => {
            let index = entries.iter().position(|entry| entry.key == key.name).unwrap_or(entries.len());
            if index == entries.len() {
                if indexed {
                    return Err(Error::scene(&key.place, format!("`{}` has no items to choose from", key.name))
                        .help("the scene has no such list"));
                }
                let node = Node { place: key.place.clone(), value: Value::Table(Vec::new()) };
                entries.push(Entry { key: key.name.to_owned(), key_place: key.place.clone(), node });
            }
            Ok(&mut entries[index].node)
        }
        _ => Err(Error::scene(&key.place, "there is nothing below this")),
    }
}

fn is_number(text: &str) -> bool {
    !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit())
}
