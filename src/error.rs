//! The one error type of the program: what went wrong, where, and what to do about it.
//!
//! Modules return errors as data; `cli` prints them, once (see [`Error::render`]). Not converging is not an error but a
//! [`Status`](crate::ddm::Status) of a run.

use crate::petsc;
use annotate_snippets::{AnnotationKind, Group, Level, Renderer, Snippet};
use std::fmt;
use std::ops::{Deref, Range};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A text that the user wrote: a scene file, an option of the command line, or a line of a Rust program.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Source {
    /// Name of the file, or the option of the command line (`--set`).
    pub name: String,
    /// The whole text; for an option, the option and its value.
    pub text: String,
}

/// A place in a [`Source`], to which a caret points. The default is no place.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Place {
    /// The text.
    pub source: Arc<Source>,
    /// Byte range in it.
    pub span: Range<usize>,
}

impl Place {
    /// Return the line of the Rust program that calls the function with the attribute `#[track_caller]`; `word` is what
    /// the caret marks.
    #[track_caller]
    pub fn here(word: &str) -> Self {
        let caller = std::panic::Location::caller();
        // the word is put on the line of the call, so that an error shows the number of that line
        let above = "\n".repeat(caller.line() as usize - 1);
        let span = above.len()..above.len() + word.len();
        Self { source: Arc::new(Source { name: caller.file().to_owned(), text: above + word }), span }
    }
}

/// A value and the place where the user wrote it, for refusals. It can be used like the value.
#[derive(Debug, Clone, Default)]
pub struct Located<T> {
    /// The value.
    pub value: T,
    /// Its place.
    pub place: Place,
}

impl<T> Located<T> {
    /// Join a value with its place.
    pub fn new(value: T, place: Place) -> Self {
        Self { value, place }
    }
}

impl<T> Deref for Located<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.value
    }
}

/// A value without a place.
impl<T> From<T> for Located<T> {
    fn from(value: T) -> Self {
        Self { value, place: Place::default() }
    }
}

/// Values are equal wherever they stand.
impl<T: PartialEq> PartialEq for Located<T> {
    fn eq(&self, other: &Self) -> bool {
        self.value == other.value
    }
}

impl Located<String> {
    /// Return a name with its line in the Rust program: see [`Place::here`].
    #[track_caller]
    pub fn here(name: &str) -> Self {
        Self::new(name.to_owned(), Place::here(name))
    }
}

/// The kind of an error, which determines the exit code of the process (docs/command-line.md).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// The command line: exit code 2.
    Usage,
    /// The scene file or an override of it: exit code 3.
    Scene,
    /// The mesh, or Gmsh: exit code 4.
    Mesh,
    /// PETSc, a PETSc option, or MPI: exit code 5.
    Solver,
    /// The file system: exit code 6.
    File,
    /// A signal with this number ended the program before it had results: exit code 128 plus the number, as in a shell.
    Stopped(i32),
}

/// The number that a shell adds to the signal that ended a program.
const SIGNALLED: i32 = 128;

impl Kind {
    /// Return the exit code of the process for this kind of error.
    pub fn exit_code(self) -> i32 {
        match self {
            Kind::Usage => 2,
            Kind::Scene => 3,
            Kind::Mesh => 4,
            Kind::Solver => 5,
            Kind::File => 6,
            Kind::Stopped(signal) => SIGNALLED + signal,
        }
    }
}

/// An error that a user can act on. `{:?}` also formats the whole message, because `main` of a program prints that.
pub struct Error(Box<ErrorData>);

struct ErrorData {
    kind: Kind,
    message: String,
    place: Option<Place>,
    /// Text next to the caret.
    label: String,
    /// File and line of a mesh.
    file: Option<(PathBuf, Option<usize>)>,
    help: Option<String>,
    causes: Vec<String>,
    /// Whether every rank ends with this error.
    agreed: bool,
    /// Whether every rank has found this error by itself.
    common: bool,
}

/// Result with [`Error`].
pub type Result<T, E = Error> = std::result::Result<T, E>;

impl Error {
    /// Return an error of a kind; `message` is a fragment without a full stop.
    pub fn new(kind: Kind, message: impl Into<String>) -> Self {
        Error(Box::new(ErrorData {
            kind,
            message: message.into(),
            place: None,
            label: String::new(),
            file: None,
            help: None,
            causes: Vec::new(),
            agreed: false,
            common: false,
        }))
    }

    /// Return an error about something at `place` in the scene.
    pub fn scene(place: &Place, message: impl Into<String>) -> Self {
        Self::new(Kind::Scene, message).at(place)
    }

    /// Return an error about a mesh file, with the line if it is known.
    pub fn mesh(path: &Path, line: Option<usize>, message: impl Into<String>) -> Self {
        let mut error = Self::new(Kind::Mesh, message);
        error.0.file = Some((path.to_owned(), line));
        error
    }

    /// Return an error of the file system; `verb` says what was tried ("read", "create").
    pub fn file(path: &Path, verb: &str, cause: &std::io::Error) -> Self {
        let mut error = Self::new(Kind::File, format!("cannot {verb} {}", path.display()));
        error.0.causes.push(cause.to_string());
        error
    }

    /// Return an error without a message, which is not printed, with the same exit code as the error of another rank
    /// that has the message.
    pub fn silent(exit_code: i32) -> Self {
        let kinds = [Kind::Usage, Kind::Scene, Kind::Mesh, Kind::Solver, Kind::File];
        let stopped = (exit_code > SIGNALLED).then(|| Kind::Stopped(exit_code - SIGNALLED));
        let kind = kinds.into_iter().find(|kind| kind.exit_code() == exit_code).or(stopped).unwrap_or(Kind::Solver);
        Self::new(kind, String::new())
    }

    /// Whether another rank prints the message.
    pub fn is_silent(&self) -> bool {
        self.0.message.is_empty()
    }

    /// Mark that every rank ends with this error.
    pub fn agreed(mut self) -> Self {
        self.0.agreed = true;
        self
    }

    /// Whether every rank ends with this error, so that no rank waits for this one.
    pub fn is_agreed(&self) -> bool {
        self.0.agreed
    }

    /// Mark that every rank has found this error by itself, with the same message.
    pub fn common(mut self) -> Self {
        (self.0.agreed, self.0.common) = (true, true);
        self
    }

    /// Whether every rank has found this error by itself, so that one of them prints it.
    pub fn is_common(&self) -> bool {
        self.0.common
    }

    /// Point at a place in the scene.
    pub fn at(mut self, place: &Place) -> Self {
        if *place != Place::default() {
            self.0.place = Some(place.clone());
        }
        self
    }

    /// Point at a place in the scene, unless the error has a place.
    pub fn or_at(self, place: &Place) -> Self {
        if self.0.place.is_some() { self } else { self.at(place) }
    }

    /// Say next to the caret what is wrong there.
    pub fn label(mut self, label: impl Into<String>) -> Self {
        self.0.label = label.into();
        self
    }

    /// Say what to do about the error.
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.0.help = Some(help.into());
        self
    }

    /// Suggest the known name that `name` may be a misspelling of; if there is none, give the advice `otherwise`.
    pub fn suggest<'a>(
        self,
        name: &str,
        known: impl IntoIterator<Item = &'a str>,
        otherwise: impl FnOnce() -> String,
    ) -> Self {
        self.help(suggestion(name, known).unwrap_or_else(otherwise))
    }

    /// Add a cause, which is printed on a line of its own.
    pub fn because(mut self, cause: impl Into<String>) -> Self {
        self.0.causes.push(cause.into());
        self
    }

    /// Return message, label, span and advice as one text, for a library whose errors are texts.
    pub fn packed(&self) -> String {
        let span = self.0.place.as_ref().map(|place| place.span.clone());
        serde_json::json!([self.0.message, self.0.label, span, self.0.help]).to_string()
    }

    /// Return the error about the scene that was [packed](Self::packed), without its place, and its span; `None` for
    /// any other text.
    pub fn unpacked(text: &str) -> Option<(Self, Option<Range<usize>>)> {
        let (message, label, span, help): (String, String, _, _) = serde_json::from_str(text).ok()?;
        let error = Self::new(Kind::Scene, message).label(label);
        Some((Self(Box::new(ErrorData { help, ..*error.0 })), span))
    }

    /// Return the kind.
    pub fn kind(&self) -> Kind {
        self.0.kind
    }

    /// Return the message alone.
    pub fn message(&self) -> &str {
        &self.0.message
    }

    /// Return the causes.
    pub fn causes(&self) -> &[String] {
        &self.0.causes
    }

    /// Return the advice, if there is one.
    pub fn advice(&self) -> Option<&str> {
        self.0.help.as_deref()
    }

    /// Return the whole message as a terminal shows it: message, file, line, caret, causes, help.
    pub fn render(&self, color: bool) -> String {
        let inner = &*self.0;
        let renderer = if color { Renderer::styled() } else { Renderer::plain() };
        let file = inner.file.as_ref().map(|(path, line)| match line {
            Some(line) => format!("{}:{line}", path.display()),
            None => path.display().to_string(),
        });
        let title = match &file {
            Some(file) => format!("{file}: {}", inner.message),
            None => inner.message.clone(),
        };
        let mut group = Group::with_title(Level::ERROR.primary_title(title.as_str()));
        if let Some(place) = &inner.place {
            let mut annotation = AnnotationKind::Primary.span(place.span.clone());
            if !inner.label.is_empty() {
                annotation = annotation.label(inner.label.as_str());
            }
            let Source { name, text } = &*place.source;
            let mut snippet = Snippet::source(text.as_str()).annotation(annotation);
            // the text of an option shows by itself where it is
            if !name.starts_with("--") {
                snippet = snippet.path(name.as_str());
            }
            group = group.element(snippet);
        }
        for cause in &inner.causes {
            group = group.element(Level::NOTE.message(cause.as_str()));
        }
        if let Some(help) = &inner.help {
            group = group.element(Level::HELP.message(help.as_str()));
        }
        renderer.render(&[group])
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.render(false))
    }
}

impl fmt::Debug for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_silent() {
            return f.write_str("another rank has the message");
        }
        // `main` prints `Error: ` before it
        let text = self.render(false);
        f.write_str(text.strip_prefix("error: ").unwrap_or(&text))
    }
}

impl std::error::Error for Error {}

/// An error of the solver library.
impl From<petsc::Error> for Error {
    fn from(error: petsc::Error) -> Self {
        let petsc::Error { message, causes, help } = error;
        let mut all = Self::new(Kind::Solver, message);
        (all.0.causes, all.0.help) = (causes, help);
        all
    }
}

/// Format a number as people write it: numbers far from one have an exponent, not three hundred digits.
pub fn shown(value: f64) -> String {
    match value.abs() {
        size if size != 0.0 && size.is_finite() && !(1e-5..1e16).contains(&size) => format!("{value:e}"),
        _ => value.to_string(),
    }
}

/// Join names by "and"; the first words of consecutive names are written once: `rotation about x and y`.
pub fn joined<'a>(names: impl IntoIterator<Item = &'a str>) -> String {
    let mut groups: Vec<(&str, Vec<&str>)> = Vec::new();
    for name in names {
        let (kind, last) = name.rsplit_once(' ').unwrap_or((name, ""));
        match groups.last_mut() {
            Some((before, list)) if *before == kind && !last.is_empty() => list.push(last),
            _ => groups.push((kind, vec![last])),
        }
    }
    let group = |(kind, mut list): (&str, Vec<&str>)| {
        let last = list.pop().unwrap_or_default();
        let list = if list.is_empty() { last.to_owned() } else { format!("{} and {last}", list.join(", ")) };
        format!("{kind} {list}").trim_end().to_owned()
    };
    groups.into_iter().map(group).collect::<Vec<_>>().join(" and ")
}

/// Most names in a sentence: with ten letters each and their quotes, they fill two lines of a terminal of 80 columns.
const NAMES: usize = 12;

/// Return all of a few names, or the first of many and the number of the others.
pub fn few(names: impl IntoIterator<Item = impl ToString>) -> Vec<String> {
    let mut names: Vec<String> = names.into_iter().map(|name| name.to_string()).collect();
    let others = names.len().saturating_sub(NAMES);
    // a single other name is as short as its count
    if others > 1 {
        names.truncate(NAMES);
        names.push(format!("{others} others"));
    }
    names
}

/// Return the known name nearest to `name`, if one is near enough for a typing mistake.
pub fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    known
        .into_iter()
        .map(|candidate| (strsim::damerau_levenshtein(name, candidate), candidate))
        .filter(|(distance, _)| *distance <= 1 + name.len() / 4)
        .min_by_key(|(distance, candidate)| (*distance, candidate.to_string()))
        .map(|(_, candidate)| candidate)
}

/// Return the nearest known name as advice.
pub fn suggestion<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<String> {
    nearest(name, known).map(|near| format!("did you mean `{near}`?"))
}

/// Return the text that the caret of a rendered error marks.
#[cfg(test)]
pub(crate) fn caret(error: &Error) -> String {
    let shown = error.render(false);
    let lines: Vec<&str> = shown.lines().collect();
    let marks = lines.iter().position(|line| line.trim_start().trim_start_matches('|').trim_start().starts_with('^'));
    let Some(marks) = marks.filter(|at| *at > 0) else {
        return String::new();
    };
    let start = lines[marks].chars().position(|c| c == '^').unwrap_or(0);
    let length = lines[marks].chars().skip(start).take_while(|c| *c == '^').count();
    lines[marks - 1].chars().skip(start).take(length).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_numbers_are_short() {
        let names = ["translation along x", "rotation about x", "rotation about y", "rotation about z"];
        assert_eq!(joined(names), "translation along x and rotation about x, y and z");
        assert_eq!(joined(["x", "y"]), "x and y");
        assert_eq!(joined(["translation along y", "rotation"]), "translation along y and rotation");
        assert_eq!([1e308, -2.1e5, 0.0, 1e-7, f64::NAN].map(shown), ["1e308", "-210000", "0", "1e-7", "NaN"]);
    }
}
