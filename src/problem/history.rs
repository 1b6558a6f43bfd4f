//! Histories of loads: factors of loads and prescribed displacements, step by step.
//!
//! A line of the scene (a load or a support) with a `path` takes the factor of that name.
//!
//! In a scene they are `steps` of `[method]`: factors of all loads, or a table with a factor for each load.

use super::body::BodySpec;
use super::check::{Check, Fault, positive};
use super::compile::{Compile, Names};
use super::contact::ContactSpec;
use super::geometry::Geometry;
use super::load::{LoadKind, Support};
use super::read::{Either, Form, refused};
use crate::error::{Error, Located, Result as Checked, joined};
use crate::expression::Field;
use crate::file::other_encoding;
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::json;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// The name of the factor of all lines without a `path`.
const COMMON: &str = "factor";

/// The factors of loads and prescribed displacements, step by step.
#[derive(Debug, Clone, Default, PartialEq, JsonSchema)]
#[schemars(with = "Either<usize, Either<Vec<f64>, StepsKeys>>")]
pub struct History {
    /// Names of the factors.
    pub names: Vec<String>,
    /// The steps. Without steps there is one run under the full loads.
    pub steps: Vec<LoadStep>,
    /// The file of the table of factors, if there is one.
    pub table: Option<Located<PathBuf>>,
    /// Whether some loads have no factor and stay constant.
    pub constant: bool,
    /// Number of steps that were solved before this process started.
    pub begun: usize,
}

/// A step of a history.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadStep {
    /// Time; it increases from step to step.
    pub time: f64,
    /// One factor for each name of the history.
    pub factors: Vec<f64>,
}

impl History {
    /// Return a history in which all loads have the same factors `shares`, at times 1, 2, ...
    pub fn of_shares(shares: Vec<f64>) -> Self {
        let step = |(number, share): (usize, f64)| LoadStep { time: (number + 1) as f64, factors: vec![share] };
        let steps = shares.into_iter().enumerate().map(step).collect();
        Self { names: vec![COMMON.to_owned()], steps, ..Self::default() }
    }

    /// Return the names of the factors in expressions. Without load steps the common factor is 1.
    pub fn factor_names(&self) -> Vec<String> {
        if self.is_empty() { vec![COMMON.to_owned()] } else { self.names.clone() }
    }

    /// Return whether there are no steps, but one run under the full loads.
    pub fn is_empty(&self) -> bool {
        self.steps.is_empty()
    }

    /// Return whether the factors come from a table. Lines then may have factors of their own, and the last step need
    /// not be the full load.
    pub fn is_table(&self) -> bool {
        self.table.is_some()
    }

    /// Return a history of one step: the first one with the largest sum of absolute factors.
    pub fn heaviest(&self) -> Self {
        let size = |step: &&LoadStep| step.factors.iter().map(|factor| factor.abs()).sum::<f64>();
        let step = self.steps.iter().rev().max_by(|a, b| size(a).total_cmp(&size(b)));
        Self { steps: step.into_iter().cloned().collect(), ..self.clone() }
    }

    /// Return whether nothing acts in a step.
    pub fn is_at_rest(&self, step: usize) -> bool {
        !self.constant && self.steps[step].factors.iter().all(|factor| *factor == 0.0)
    }

    /// Return whether a support has another displacement in a step than in the one before.
    pub fn moves(&self, step: usize, bodies: &[BodySpec]) -> bool {
        let differs = |path: Option<&Located<String>>| self.factor(step, path) != self.factor(step - 1, path);
        let is_moved = |fix: &Support| fix.is_moved() && differs(fix.path.as_ref());
        step > 0 && bodies.iter().flat_map(|body| &body.fix).any(is_moved)
    }

    /// Return the factor at a step for a line with this path; 1 if the history has no such factor.
    fn factor(&self, step: usize, path: Option<&Located<String>>) -> f64 {
        let name = path.filter(|_| self.is_table()).map_or(COMMON, |path| &path.value);
        let column = self.names.iter().position(|known| known == name);
        column.map_or(1.0, |column| self.steps[step].factors[column])
    }

    /// Give all loads, prescribed displacements and contacts the factors of a step. Without such a step these are 1.
    pub fn apply(&self, step: usize, bodies: &mut [BodySpec], contacts: &mut [ContactSpec]) {
        let of_step = self.steps.get(step).map(|step| step.factors.clone());
        let factors = of_step.clone().unwrap_or_else(|| vec![1.0; self.names.len().max(1)]);
        for contact in contacts {
            let own = of_step.as_ref().map_or(1.0, |_| self.contact_factor(step, contact));
            contact.set_step(&factors, own);
        }
        let common = of_step.as_ref().map_or(1.0, |_| self.factor(step, None));
        for body in bodies.iter_mut() {
            let Some(temperature) = &mut body.temperature else { continue };
            body.heat_factor = if temperature.factors().next().is_some() { 1.0 } else { common };
            temperature.value = temperature.in_step(&factors);
        }
        if of_step.is_none() {
            return;
        }
        for body in bodies {
            body.load.iter_mut().for_each(|load| load.factor = self.factor(step, load.path.as_ref()));
            body.fix.iter_mut().for_each(|fix| fix.factor = self.factor(step, fix.path.as_ref()));
            body.force_factor = common;
        }
    }
}

impl History {
    /// Return the factor of the forces and motions of a contact at a step. That of a preload without a path is 1 in
    /// every step.
    fn contact_factor(&self, step: usize, contact: &ContactSpec) -> f64 {
        match contact.path.as_ref().filter(|_| self.is_table()) {
            None if contact.preload.is_some() => 1.0,
            path => self.factor(step, path),
        }
    }

    /// Return whether a contact keeps in a step what the step before has found: its preload has the same factor in
    /// both.
    pub fn locks(&self, step: usize, contact: &ContactSpec) -> bool {
        let factor = |step: usize| self.contact_factor(step, contact);
        contact.preload.is_some() && step > 0 && factor(step) == factor(step - 1)
    }
}

/// Return the paths of the loads and supports of a body.
pub fn paths(body: &BodySpec) -> impl Iterator<Item = &Located<String>> {
    let loads = body.load.iter().filter_map(|load| load.path.as_ref());
    loads.chain(body.fix.iter().filter_map(|fix| fix.path.as_ref()))
}

/// Return whether a body has a load or a prescribed displacement without a path that is not zero.
fn has_common(body: &BodySpec) -> bool {
    let acts = |kind: &LoadKind| match kind {
        LoadKind::Pressure(pressure) => !pressure.is_zero(),
        LoadKind::Traction(vector) | LoadKind::Force { total: vector, .. } => !vector.iter().all(Field::is_zero),
        LoadKind::Moment(moment) => !moment.fields().iter().all(Field::is_zero),
        LoadKind::Turning { force, moment } => !force.iter().chain(moment.fields()).all(Field::is_zero),
    };
    body.force.as_ref().is_some_and(|force| !force.iter().all(Field::is_zero))
        || body.temperature.as_ref().is_some_and(|temperature| !temperature.is_zero())
        || body.load.iter().any(|load| load.path.is_none() && acts(&load.kind))
        || body.fix.iter().any(|fix| fix.path.is_none() && fix.is_moved())
}

/// The most steps that a number may stand for.
const MOST_STEPS: i64 = 1000;

const TIME: &str = "time";

/// Columns of `steps.csv` beside those of the factors.
const OWN_COLUMNS: [&str; 4] = ["step", "status", "iterations", "residual"];

/// The key of `steps` from a file.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct StepsKeys {
    /// CSV file with a column of each factor
    table: Located<PathBuf>,
}

/// So many equal load steps, a list of factors, or the table of a file.
impl<'de> Deserialize<'de> for History {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let Located { value, place } = Located::<Form<f64, StepsKeys>>::deserialize(deserializer)?;
        match value {
            Form::Integer(count) if (1..=MOST_STEPS).contains(&count) => {
                Ok(History::of_shares((1..=count).map(|step| step as f64 / count as f64).collect()))
            }
            Form::Integer(count) => Err(refused(
                Error::scene(&place, format!("`steps` is {count}"))
                    .label(format!("the number of load steps must lie between 1 and {MOST_STEPS}")),
            )),
            Form::List(factors) => Ok(History::of_shares(factors)),
            Form::Table(StepsKeys { table }) => Ok(History { table: Some(table), ..History::default() }),
            other => Err(other.instead_of("a whole number, a list or a table", &place)),
        }
    }
}

/// The table of load steps is read.
impl Compile for History {
    fn compile(&mut self, names: &Names<'_>) -> Checked<()> {
        let Some(mut table) = self.table.take() else { return Ok(()) };
        table.compile(names)?;
        *self = read_table(table)?;
        Ok(())
    }
}

impl Serialize for History {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let factors = |column: usize| self.steps.iter().map(|step| step.factors[column]).collect::<Vec<f64>>();
        match &self.table {
            None if self.steps.is_empty() => serializer.serialize_none(),
            None => factors(0).serialize(serializer),
            Some(table) => {
                let times = (TIME.to_owned(), self.steps.iter().map(|step| step.time).collect());
                let named = self.names.iter().enumerate().map(|(column, name)| (name.clone(), factors(column)));
                let columns: BTreeMap<String, Vec<f64>> = std::iter::once(times).chain(named).collect();
                json!({ "table": table.display().to_string(), "columns": columns }).serialize(serializer)
            }
        }
    }
}

impl Check for History {
    /// Check factors of all loads. Those of a table were checked when its file was read.
    fn check(&self, _: Geometry) -> Result<(), Fault> {
        if self.is_table() {
            return Ok(());
        }
        for (k, step) in self.steps.iter().enumerate() {
            step.factors.iter().try_for_each(|factor| positive(&k.to_string(), "the factor", *factor))?;
        }
        match self.steps.last() {
            Some(last) if last.factors != [1.0] => {
                let help = "end the list with 1; a table may end anywhere: steps = { table = \"path.csv\" }";
                Err(Fault::new("", "the last load step is not the full load", "", help))
            }
            _ => Ok(()),
        }
    }
}

impl History {
    /// Match the columns of a table of load steps with the lines of the bodies that name them by `path`. Set whether
    /// some loads have no factor.
    ///
    /// # Errors
    /// A path without a table or that is no column, and a column that no line names.
    pub fn join(&mut self, bodies: &[BodySpec], contacts: &[ContactSpec]) -> Checked<()> {
        let all = || bodies.iter().flat_map(paths).chain(contacts.iter().filter_map(|contact| contact.path.as_ref()));
        let Some(table) = &self.table else {
            let Some(path) = all().next() else { return Ok(()) };
            let error = Error::scene(&path.place, "`path` without a table of load steps");
            return Err(error.help("name the table, [method] steps = { table = \"path.csv\" }, or remove `path`"));
        };
        let columns = || self.names.iter().map(String::as_str).filter(|name| *name != COMMON);
        for path in all() {
            if self.names.iter().all(|name| *name != path.value) {
                let message = format!("the table of load steps has no column `{}`", path.value);
                let otherwise = || format!("its columns are {}", joined(self.names.iter().map(String::as_str)));
                return Err(Error::scene(&path.place, message).suggest(&path.value, columns(), otherwise));
            }
        }
        let is_variable = |name: &str| {
            let of_contacts = contacts.iter().flat_map(ContactSpec::factors);
            let temperatures = bodies.iter().filter_map(|body| body.temperature.as_ref());
            let mut factors = of_contacts.chain(temperatures.flat_map(|temperature| temperature.factors()));
            factors.any(|factor| self.names[factor] == name)
        };
        let is_unused = |name: &&str| all().all(|path| path.value != **name) && !is_variable(name);
        if let Some(unused) = columns().find(is_unused) {
            return Err(Error::scene(
                &table.place,
                format!("no load, support or contact has the path `{unused}` of this table"),
            )
            .help(format!(
                "path = \"{unused}\" in a line of `load` or `fix`, or in a contact, or the variable `{unused}` in its gap, force or motion or in a temperature; `{COMMON}` is the column of \
                 all lines without"
            )));
        }
        let common = self.names.iter().any(|name| name == COMMON);
        self.constant = !common && (bodies.iter().any(has_common) || contacts.iter().any(ContactSpec::acts));
        Ok(())
    }
}

/// Read a table of factors: a line of names, then one line a step.
fn read_table(file: Located<PathBuf>) -> Checked<History> {
    let bytes = crate::file::read(&file).map_err(|error| error.at(&file.place))?;
    let name = file.display().to_string();
    if let Some(other) = other_encoding(&bytes) {
        return Err(Error::scene(&file.place, format!("{name} {other}")).help("save it as CSV in UTF-8"));
    }
    let mut format = csv::ReaderBuilder::new();
    format.has_headers(false).flexible(true).comment(Some(b'#')).trim(csv::Trim::All);
    let (mut reader, mut record) = (format.from_reader(&bytes[..]), csv::StringRecord::new());
    let mut history = History::default();
    let mut names: Vec<String> = Vec::new();
    while reader.read_record(&mut record).map_err(|cause| {
        let error = Error::scene(&file.place, format!("{name} is not a table"));
        error.because(cause.to_string()).help("save it as CSV in UTF-8")
    })? {
        let end = reader.position().byte() as usize;
        let refuse = |message: String| {
            let line = 1 + bytes[..end].trim_ascii_end().iter().filter(|byte| **byte == b'\n').count();
            Error::scene(&file.place, format!("{name}:{line}: {message}"))
        };
        if names.is_empty() {
            names = record.iter().map(str::to_owned).collect();
            check_names(&names).map_err(|(message, help)| refuse(message).help(help))?;
        } else {
            history.steps.push(step(&names, &record, history.steps.last()).map_err(refuse)?);
        }
    }
    if history.is_empty() {
        return Err(Error::scene(&file.place, "the table of load steps has no steps")
            .help("a line of names, then one line of numbers a step: factor, 0.5, 1"));
    }
    history.names = names.into_iter().filter(|name| name != TIME).collect();
    history.table = Some(file);
    Ok(history)
}

/// Refuse names that are no names of factors, and names that two columns have. The error is a message and advice.
fn check_names(names: &[String]) -> Result<(), (String, &'static str)> {
    if matches!(names, [name] if name.contains([';', '\t'])) {
        return Err(("this table has one column".to_owned(), "separate its columns by commas"));
    }
    let help = "the first line names the columns: `time` if there is one, `factor`, and what loads name by `path`";
    let is_none = |name: &String| name.is_empty() || name.parse::<f64>().is_ok();
    if names.iter().all(|name| name == TIME) || names.iter().any(is_none) {
        return Err(("these are no names of factors".to_owned(), help));
    }
    if let Some(taken) = names.iter().find(|name| OWN_COLUMNS.contains(&name.as_str())) {
        return Err((
            format!("a column is called `{taken}`"),
            "steps.csv has a column of its own with this name: take another one",
        ));
    }
    match (1..names.len()).find(|&column| names[..column].contains(&names[column])) {
        Some(twice) => Err((format!("two columns are called `{}`", names[twice]), help)),
        None => Ok(()),
    }
}

/// Return the step of one line of the table. `before` is the step of the line before it.
fn step(names: &[String], record: &csv::StringRecord, before: Option<&LoadStep>) -> Result<LoadStep, String> {
    if record.len() != names.len() {
        return Err(format!("a step has {} numbers here, not {}", names.len(), record.len()));
    }
    let mut step = LoadStep { time: before.map_or(1.0, |before| before.time + 1.0), factors: Vec::new() };
    for (name, word) in names.iter().zip(record) {
        let number = word.parse().ok().filter(|number: &f64| number.is_finite());
        let number = number.ok_or_else(|| format!("`{name}` is `{word}`, not a finite number"))?;
        if name == TIME { step.time = number } else { step.factors.push(number) }
    }
    match before.filter(|before| before.time >= step.time) {
        Some(before) => Err(format!("the time {} comes after {}", step.time, before.time)),
        None => Ok(step),
    }
}
