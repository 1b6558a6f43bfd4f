//! `steps` of the method: shares of all loads, or a table of factors.

use super::{Decoder, Form, Keys, Node, Table, Value, file};
use crate::error::{Error, Kind, Located, Place, Result, Source, joined};
use crate::file::{other_encoding, with_unix_lines};
use crate::problem::body::BodySpec;
use crate::problem::history::{COMMON, History, Step, has_common, paths};
use std::path::PathBuf;
use std::sync::Arc;

/// Most steps that a number may stand for.
const MOST_STEPS: usize = 1000;

/// Name of the column of times.
const TIME: &str = "time";

/// The shape of `steps` from a file.
pub(super) fn table() -> Table {
    Table::new("the load steps").must("table", Form::Text, "CSV file with a column of each factor")
}

impl Decoder<'_> {
    /// Load steps.
    pub(super) fn history(&self, node: &Node) -> Result<History> {
        match &node.value {
            Value::List(items) => items.iter().map(Node::number).collect::<Result<_>>().map(History::of_shares),
            Value::Table(_) => {
                let keys = Keys::open(node, &table())?;
                read(file(self.folder, keys.require("table")?)?)
            }
            _ => match node.count()? {
                count @ 1..=MOST_STEPS => {
                    Ok(History::of_shares((1..=count).map(|step| step as f64 / count as f64).collect()))
                }
                _ => Err(node.refuse(format!("the number of load steps must lie between 1 and {MOST_STEPS}"))),
            },
        }
    }

    /// Joins a history with the lines that name its factors.
    pub(super) fn join(&self, history: &mut History, bodies: &[BodySpec]) -> Result<()> {
        let Some(table) = &history.table else { return Ok(()) };
        let columns = || history.names.iter().map(String::as_str).filter(|name| *name != COMMON);
        for path in bodies.iter().flat_map(paths) {
            if history.names.iter().all(|name| *name != path.value) {
                let message = format!("the table of load steps has no column `{}`", path.value);
                let otherwise = || format!("its columns are {}", joined(history.names.iter().map(String::as_str)));
                return Err(Error::scene(&path.place, message).suggest(&path.value, columns(), otherwise));
            }
        }
        if let Some(idle) = columns().find(|name| bodies.iter().flat_map(paths).all(|path| path.value != **name)) {
            return Err(Error::scene(
                &table.place,
                format!("no load and no support has the path `{idle}` of this table"),
            )
            .help(format!(
                "path = \"{idle}\" in a line of `load` or `fix`; `{COMMON}` is the column of all lines without"
            )));
        }
        let common = history.names.iter().any(|name| name == COMMON);
        history.constant = !common && bodies.iter().any(has_common);
        Ok(())
    }
}

/// A table of factors: a line of names, then one line a step.
fn read(file: Located<PathBuf>) -> Result<History> {
    let bytes = crate::file::read(&file.value).map_err(|error| error.at(&file.place))?;
    let name = file.value.display().to_string();
    let refuse =
        |what: &str| Error::new(Kind::Scene, format!("{name} {what}")).help("save it as CSV in UTF-8").at(&file.place);
    if let Some(other) = other_encoding(&bytes) {
        return Err(refuse(other));
    }
    let text = String::from_utf8(with_unix_lines(bytes)).map_err(|_| refuse("is not UTF-8 text"))?;
    let source = Arc::new(Source { name, text });
    let text = source.text.as_str();
    let place = |from: usize, to: usize| {
        let span = text.get(from..to).unwrap_or_default();
        let start = from + span.len() - span.trim_start().len();
        Place { source: source.clone(), span: start..start + span.trim().len() }
    };
    let mut lines = csv::ReaderBuilder::new();
    lines.has_headers(false).flexible(true).comment(Some(b'#')).trim(csv::Trim::All);
    let mut reader = lines.from_reader(text.as_bytes());
    let (mut record, mut names, mut history) = (csv::StringRecord::new(), None::<Vec<String>>, History::default());
    loop {
        let begin = reader.position().byte() as usize;
        match reader.read_record(&mut record) {
            Ok(false) => break,
            Ok(true) => {}
            Err(cause) => {
                return Err(Error::scene(&place(begin, text.len()), "this is not a table").because(cause.to_string()));
            }
        }
        let begin = record.position().map_or(begin, |position| position.byte() as usize);
        let line = place(begin, reader.position().byte() as usize);
        let Some(names) = &names else {
            let found: Vec<String> = record.iter().map(str::to_owned).collect();
            refuse_names(&found, &line)?;
            history.names = found.iter().filter(|name| *name != TIME).cloned().collect();
            names = Some(found);
            continue;
        };
        history.steps.push(step(names, &record, &line, history.steps.last())?);
    }
    if history.is_empty() {
        return Err(Error::scene(&file.place, "the table of load steps has no steps")
            .help("a line of names, then one line of numbers a step: factor, 0.5, 1"));
    }
    history.table = Some(file);
    Ok(history)
}

fn refuse_names(names: &[String], line: &Place) -> Result<()> {
    if let [name] = names
        && name.contains([';', '\t'])
    {
        return Err(Error::scene(line, "this table has one column").help("separate its columns by commas"));
    }
    let help = "the first line names the columns: `time` if there is one, `factor`, and what loads name by `path`";
    if names.iter().all(|name| name == TIME) || names.iter().any(|name| name.is_empty() || name.parse::<f64>().is_ok())
    {
        return Err(Error::scene(line, "these are no names of factors").help(help));
    }
    match (1..names.len()).find(|&column| names[..column].contains(&names[column])) {
        Some(twice) => Err(Error::scene(line, format!("two columns are called `{}`", names[twice]))),
        None => Ok(()),
    }
}

/// One line of a table, after another one.
fn step(names: &[String], record: &csv::StringRecord, line: &Place, before: Option<&Step>) -> Result<Step> {
    if record.len() != names.len() {
        let message = format!("a step has {} numbers here, not {}", names.len(), record.len());
        return Err(Error::scene(line, message).label(format!("the columns are {}", names.join(", "))));
    }
    let mut step = Step { time: before.map_or(1.0, |before| before.time + 1.0), factors: Vec::new() };
    for (name, word) in names.iter().zip(record) {
        let Some(number) = word.parse().ok().filter(|number: &f64| number.is_finite()) else {
            return Err(Error::scene(line, format!("`{name}` is `{word}`")).label("not a finite number"));
        };
        if name == TIME { step.time = number } else { step.factors.push(number) }
    }
    match before.filter(|before| before.time >= step.time) {
        Some(before) => {
            let message = format!("the time {} comes after {}", step.time, before.time);
            Err(Error::scene(line, message).label("must be later than the step before"))
        }
        None => Ok(step),
    }
}
