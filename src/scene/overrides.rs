//! Options of the command line that change a scene.
//!
//! An override is `KEY=VALUE`, or an option that is short for one. KEY is a dotted path. Items of lists are numbered
//! from 0 (`contact.0.layer.power.a`); a table with a name also goes by its name (`body.upper.order`). VALUE is TOML,
//! or a bare text. Spans of new keys and values lie in the text of the option, so that later refusals point there.

use super::refuse::syntax;
use crate::error::{Error, Kind, Place, Result, Source, few};
use crate::problem::read::Sources;
use std::ops::Range;
use std::sync::Arc;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Options with a value, and the key that each sets.
const SHORT: [(&str, &str); 2] = [("--method", "method.name"), ("--tolerance", "adapt.error")];

/// Options without a value, and the key that each sets to true.
const FLAGS: [(&str, &str); 4] =
    [("--estimate", "estimate"), ("--vtu", "output.vtu"), ("--msh", "output.msh"), ("--report", "output.report")];

/// An option as typed, which is `KEY=VALUE` or an option with its value (`--over KEY=VALUE`, `--tolerance 1e-3`,
/// `--vtu`).
pub struct Typed {
    source: Arc<Source>,
    /// Where its spans begin among those of the scene.
    begin: usize,
}

/// A value of a scene, or a table on the way to one.
type Value<'i> = Spanned<DeValue<'i>>;

/// A key of a path.
struct Step<'a> {
    /// The key: a name, or the number of an item.
    name: &'a str,
    /// Its span in the option.
    span: Range<usize>,
    /// The path before it.
    parent: &'a str,
    /// Whether the next key of the path is the number of an item.
    before_number: bool,
}

impl Typed {
    /// Return an option, and add it to the texts of the scene.
    pub fn new(text: &str, sources: &mut Sources) -> Self {
        let text = text.trim_end();
        let text = if text.starts_with("--") { text.to_owned() } else { format!("--set {text}") };
        let name = text.split(' ').next().unwrap_or_default().to_owned();
        let source = Arc::new(Source { name, text });
        Self { begin: sources.add(source.clone()), source }
    }

    /// Change a scene as the option says.
    ///
    /// # Errors
    /// An option without a value, a key that is none, a value that is no TOML, and items that a list does not have.
    pub fn apply<'i>(&'i self, scene: &mut DeTable<'i>) -> Result<()> {
        let name = self.source.name.as_str();
        let key_of = |list: &[(&str, &'static str)]| list.iter().find(|(known, _)| *known == name).map(|(_, key)| *key);
        let step = |key| Step { name: key, span: 0..name.len(), parent: "", before_number: false };
        let steps = |path: &'static str| path.split('.').map(step).collect::<Vec<_>>();
        if let Some(path) = key_of(&FLAGS) {
            let yes = Spanned::new(self.global(&(0..name.len())), DeValue::Boolean(true));
            return self.put(scene, &steps(path), yes);
        }
        if let Some(path) = key_of(&SHORT) {
            return self.put(scene, &steps(path), self.value(name.len())?);
        }
        self.set(scene, name.len() + 1)
    }

    /// Return the place of a span of the option.
    fn place(&self, span: Range<usize>) -> Place {
        Place { source: self.source.clone(), span }
    }

    /// Return a span of the option as one of the scene.
    fn global(&self, span: &Range<usize>) -> Range<usize> {
        self.begin + span.start..self.begin + span.end
    }

    /// Apply the `KEY=VALUE` that begins at byte `start` of the option.
    fn set<'i>(&'i self, scene: &mut DeTable<'i>, start: usize) -> Result<()> {
        let text = self.source.text.as_str();
        let Some(equals) = text[start.min(text.len())..].find('=').map(|equals| start + equals) else {
            let option = &self.source.name;
            return Err(Error::new(Kind::Usage, format!("{option} without `=`"))
                .at(&self.place(0..text.len()))
                .help(format!("write {option} KEY=VALUE, such as {option} contact.0.layer.power.a=0.3")));
        };
        let spans = segments(text, start..equals);
        let mut steps = Vec::new();
        for (depth, span) in spans.iter().enumerate() {
            let name = &text[span.clone()];
            if name.is_empty() || !name.chars().all(|c| c.is_alphanumeric() || "_-*?[]!/".contains(c)) {
                return Err(Error::scene(&self.place(start..equals), "this is not a key of the scene")
                    .help("a key is names and numbers joined by points: body.1.young"));
            }
            let parent = text[start..span.start].trim_end().trim_end_matches('.').trim_end();
            let before_number = spans.get(depth + 1).is_some_and(|next| is_number(&text[next.clone()]));
            steps.push(Step { name, span: span.clone(), parent, before_number });
        }
        self.put(scene, &steps, self.value(equals + 1)?)
    }

    /// Return the value that begins at byte `offset`: TOML, or a bare text.
    fn value(&self, offset: usize) -> Result<Value<'_>> {
        let bare = self.source.text[offset..].trim_start();
        let start = self.source.text.len() - bare.len();
        let whole = start..self.source.text.len();
        if bare.is_empty() {
            return Err(Error::scene(&self.place(whole), "the value is missing").help("an empty text is written \"\""));
        }
        match DeValue::parse(bare) {
            Ok(value) => Ok(moved(value, self.begin + start)),
            // this was meant as TOML: a table, a list, a quoted text
            Err(error) if bare.starts_with(['{', '[', '"', '\'']) || bare.parse::<f64>().is_ok() => {
                Err(syntax(&self.source, start, &error))
            }
            Err(_) => Ok(Spanned::new(self.global(&whole), DeValue::String(bare.into()))),
        }
    }

    /// Put a value at the end of a path. Tables that are missing on the way are made.
    fn put<'i>(&self, scene: &mut DeTable<'i>, steps: &[Step<'_>], new: Value<'i>) -> Result<()> {
        let [step, rest @ ..] = steps else { return Ok(()) };
        let mut node = self.entry(scene, step)?;
        for step in rest {
            node = self.child(node, step)?;
        }
        *node = new;
        Ok(())
    }

    /// Return the value of a key of a table; a new key has an empty table.
    fn entry<'t, 'i>(&self, table: &'t mut DeTable<'i>, step: &Step<'_>) -> Result<&'t mut Value<'i>> {
        if step.before_number && !table.contains_key(step.name) {
            return Err(Error::scene(
                &self.place(step.span.clone()),
                format!("`{}` has no items to choose from", step.name),
            )
            .help("the scene has no such list"));
        }
        let key = Spanned::new(self.global(&step.span), step.name.to_owned().into());
        Ok(table.entry(key).or_insert_with(|| self.empty(step)))
    }

    fn empty<'i>(&self, step: &Step<'_>) -> Value<'i> {
        Spanned::new(self.global(&step.span), DeValue::Table(DeTable::new()))
    }

    /// Return the value below a value to which a step leads. A value that has nothing below it becomes an empty table.
    fn child<'t, 'i>(&self, node: &'t mut Value<'i>, step: &Step<'_>) -> Result<&'t mut Value<'i>> {
        if !node.get_ref().is_array() && !node.get_ref().is_table() {
            *node = self.empty(step);
        }
        match node.get_mut() {
            DeValue::Array(items) => {
                let index = self.index(items, step)?;
                Ok(&mut (**items)[index])
            }
            DeValue::Table(table) => self.entry(table, step),
            _ => Err(Error::scene(&self.place(step.span.clone()), "there is nothing below this")),
        }
    }

    /// Return the index of the item that a step names by its number, or by the name of its table.
    fn index(&self, items: &[Value<'_>], step: &Step<'_>) -> Result<usize> {
        let Step { name, span, parent, .. } = step;
        let name_of = |item| -> Option<&str> { Value::get_ref(item).get("name")?.get_ref().as_str() };
        let found = if is_number(name) {
            name.parse().ok().filter(|index| *index < items.len())
        } else {
            items.iter().position(|item| name_of(item) == Some(name))
        };
        found.ok_or_else(|| {
            let count = format!("{} item{}", items.len(), if items.len() == 1 { "" } else { "s" });
            let message = if is_number(name) {
                format!("`{parent}` has {count}, there is no number {name}")
            } else {
                format!("`{parent}` is a list of {count}; `{name}` is no number")
            };
            let error = Error::scene(&self.place(span.clone()), message);
            let known: Vec<&str> = items.iter().filter_map(name_of).collect();
            match items.len() {
                _ if !is_number(name) && !known.is_empty() => {
                    error.help(format!("their names: {}", few(known).join(", ")))
                }
                0 => error,
                1 => error.help("the only item is number 0"),
                count => error.help(format!("they are numbered 0 to {}", count - 1)),
            }
        })
    }
}

/// Return a value with its spans moved by `begin`.
fn moved(value: Value<'_>, begin: usize) -> Value<'_> {
    let at = |span: Range<usize>| span.start + begin..span.end + begin;
    let span = at(value.span());
    let value = match value.into_inner() {
        DeValue::Array(items) => DeValue::Array(items.into_iter().map(|item| moved(item, begin)).collect()),
        DeValue::Table(table) => {
            let entries = table.into_iter().map(|(key, value)| {
                let place = at(key.span());
                (Spanned::new(place, key.into_inner()), moved(value, begin))
            });
            DeValue::Table(entries.collect())
        }
        other => other,
    };
    Spanned::new(span, value)
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

fn is_number(text: &str) -> bool {
    !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit())
}
