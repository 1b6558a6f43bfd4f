//! `steps` of `[method]`: factors of all loads, or a table with a factor for each load.

use crate::error::{Error, Kind, Located, Place, Result, Source, joined};
use crate::file::{other_encoding, with_unix_lines};
use crate::problem::body::BodySpec;
use crate::problem::history::{COMMON, History, Step, has_common, paths};
use crate::setting::{Context, Entries, Keys, Node, Setting, TableShape, Value, ValueKind, file};
use serde_json::{Value as Json, json};
use std::path::PathBuf;
use std::sync::Arc;

/// The most steps that a number may stand for.
const MOST_STEPS: usize = 1000;

/// The name of the column of times.
const TIME: &str = "time";

/// Return the shape of `steps` from a file.
fn shape() -> TableShape {
    use ValueKind::Text;
    TableShape::new("the load steps").required("table", Text, "CSV file with a column of each factor")
}

impl Setting for History {
    fn kind() -> ValueKind {
        ValueKind::Either(vec![ValueKind::PositiveInteger, ValueKind::Number.list(), shape().into()])
    }

    /// Read the load steps: so many equal ones, a list of factors, or the table of a file.
    fn read(node: &Node, context: &Context) -> Result<Self> {
        match &node.value {
            Value::List(items) => items.iter().map(Node::number).collect::<Result<_>>().map(History::of_shares),
            Value::Table(_) => {
                let keys = Keys::open(node, &shape())?;
                read_table(file(context.folder, keys.require("table")?)?)
            }
            _ => match node.count()? {
                count @ 1..=MOST_STEPS => {
                    Ok(History::of_shares((1..=count).map(|step| step as f64 / count as f64).collect()))
                }
                _ => Err(node.refuse(format!("the number of load steps must lie between 1 and {MOST_STEPS}"))),
            },
        }
    }

    fn echo(&self, _: usize) -> Json {
        let factors = |column: usize| self.steps.iter().map(|step| step.factors[column]).collect::<Json>();
        match &self.table {
            None if self.steps.is_empty() => Json::Null,
            None => factors(0),
            Some(table) => {
                let times = (TIME.to_owned(), self.steps.iter().map(|step| step.time).collect());
                let named = self.names.iter().enumerate().map(|(column, name)| (name.clone(), factors(column)));
                let columns: Entries = std::iter::once(times).chain(named).collect();
                json!({ "table": table.value.display().to_string(), "columns": columns })
            }
        }
    }
}

impl History {
    /// Match the columns of a table of load steps with the lines of the bodies that name them by `path`. Set whether some loads have no
    /// factor.
    ///
    /// # Errors
    /// A path that is no column, and a column that no line names.
    pub fn join(&mut self, bodies: &[BodySpec]) -> Result<()> {
        let Some(table) = &self.table else { return Ok(()) };
        let columns = || self.names.iter().map(String::as_str).filter(|name| *name != COMMON);
        for path in bodies.iter().flat_map(paths) {
            if self.names.iter().all(|name| *name != path.value) {
                let message = format!("the table of load steps has no column `{}`", path.value);
                let otherwise = || format!("its columns are {}", joined(self.names.iter().map(String::as_str)));
                return Err(Error::scene(&path.place, message).suggest(&path.value, columns(), otherwise));
            }
        }
        if let Some(unused) = columns().find(|name| bodies.iter().flat_map(paths).all(|path| path.value != **name)) {
            return Err(Error::scene(
                &table.place,
                format!("no load and no support has the path `{unused}` of this table"),
            )
            .help(format!(
                "path = \"{unused}\" in a line of `load` or `fix`; `{COMMON}` is the column of all lines without"
            )));
        }
        let common = self.names.iter().any(|name| name == COMMON);
        self.constant = !common && bodies.iter().any(has_common);
        Ok(())
    }
}

/// Read a table of factors: a line of names, then one line a step.
fn read_table(file: Located<PathBuf>) -> Result<History> {
    let source = text_of(&file)?;
    let mut lines = Lines::new(&source);
    let mut history = History::default();
    if let Some(place) = lines.next()? {
        let names: Vec<String> = lines.record.iter().map(str::to_owned).collect();
        check_names(&names, &place)?;
        while let Some(place) = lines.next()? {
            history.steps.push(step(&names, &lines.record, &place, history.steps.last())?);
        }
        history.names = names.into_iter().filter(|name| name != TIME).collect();
    }
    if history.is_empty() {
        return Err(Error::scene(&file.place, "the table of load steps has no steps")
            .help("a line of names, then one line of numbers a step: factor, 0.5, 1"));
    }
    history.table = Some(file);
    Ok(history)
}

/// Return the text of a table, which must be UTF-8.
fn text_of(file: &Located<PathBuf>) -> Result<Arc<Source>> {
    let bytes = crate::file::read(&file.value).map_err(|error| error.at(&file.place))?;
    let name = file.value.display().to_string();
    let refuse =
        |what: &str| Error::new(Kind::Scene, format!("{name} {what}")).help("save it as CSV in UTF-8").at(&file.place);
    if let Some(other) = other_encoding(&bytes) {
        return Err(refuse(other));
    }
    let text = String::from_utf8(with_unix_lines(bytes)).map_err(|_| refuse("is not UTF-8 text"))?;
    Ok(Arc::new(Source { name, text }))
}

/// The lines of a CSV file, one after the other.
struct Lines<'a> {
    source: &'a Arc<Source>,
    reader: csv::Reader<&'a [u8]>,
    /// The words of the line that was read last.
    record: csv::StringRecord,
}

impl<'a> Lines<'a> {
    fn new(source: &'a Arc<Source>) -> Self {
        let mut format = csv::ReaderBuilder::new();
        format.has_headers(false).flexible(true).comment(Some(b'#')).trim(csv::Trim::All);
        let reader = format.from_reader(source.text.as_bytes());
        Self { source, reader, record: csv::StringRecord::new() }
    }

    /// Read the next line and return its place; `None` at the end of the file.
    fn next(&mut self) -> Result<Option<Place>> {
        let before = self.reader.position().byte() as usize;
        let is_line = self.reader.read_record(&mut self.record).map_err(|cause| {
            let rest = self.place(before, self.source.text.len());
            Error::scene(&rest, "this is not a table").because(cause.to_string())
        })?;
        if !is_line {
            return Ok(None);
        }
        // comments and empty lines may stand before the line
        let begin = self.record.position().map_or(before, |position| position.byte() as usize);
        Ok(Some(self.place(begin, self.reader.position().byte() as usize)))
    }

    /// Return the place of a byte range, without the blanks around it.
    fn place(&self, from: usize, to: usize) -> Place {
        let span = self.source.text.get(from..to).unwrap_or_default();
        let start = from + span.len() - span.trim_start().len();
        Place { source: self.source.clone(), span: start..start + span.trim().len() }
    }
}

/// Refuse names that are no names of factors, and names that two columns have.
fn check_names(names: &[String], line: &Place) -> Result<()> {
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

/// Return the step of one line of the table. `before` is the step of the line before it.
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
