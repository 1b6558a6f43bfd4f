//! The one error type of the program: what went wrong, where, and what to do about it.
//!
//! Modules make errors as data; `cli` prints them, once (see [`Error::render`]). Not converging is not an
//! error but a [`Status`](crate::ddm::Status) of a run.

use annotate_snippets::{AnnotationKind, Group, Level, Renderer, Snippet};
use std::fmt;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A text that the user wrote: a scene file, an option of the command line, or a line of a Rust program.
#[derive(Debug, PartialEq, Eq)]
pub struct Source {
    /// Name of the file, or the option of the command line (`--set`).
    pub name: String,
    /// The whole text; of an option, the option and its value.
    pub text: String,
}

/// A place in a [`Source`]: what a caret points to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    /// The text.
    pub source: Arc<Source>,
    /// Byte range in it.
    pub span: Range<usize>,
}

impl Place {
    /// The line of the Rust program that calls the function with this attribute (`#[track_caller]`); `word` is what the caret marks.
    #[track_caller]
    pub fn here(word: &str) -> Self {
        let caller = std::panic::Location::caller();
        // the word stands on the line of the call, so that a refusal shows the number of that line
        let above = "\n".repeat(caller.line() as usize - 1);
        let span = above.len()..above.len() + word.len();
        Self { source: Arc::new(Source { name: caller.file().to_owned(), text: above + word }), span }
    }
}

/// A value and the place where the user wrote it.
#[derive(Debug, Clone, PartialEq)]
pub struct Located<T> {
    /// The value.
    pub value: T,
    /// Where it stands.
    pub place: Place,
}

impl<T> Located<T> {
    /// Joins a value with its place.
    pub fn new(value: T, place: Place) -> Self {
        Self { value, place }
    }
}

impl Located<String> {
    /// A name and the line of the Rust program where it stands: see [`Place::here`].
    #[track_caller]
    pub fn here(name: &str) -> Self {
        Self::new(name.to_owned(), Place::here(name))
    }
}

/// What kind of thing failed; it fixes the exit code of the process (docs/command-line.md).
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
    /// A signal with this number ended the program before it had results: exit code 128 and the number, as a shell has it.
    Stopped(i32),
}

/// What a shell adds to the number of the signal that ended a program.
const SIGNALLED: i32 = 128;

impl Kind {
    /// Exit code of the process for this kind of error.
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

/// An error that a user can act on; `{:?}` is the whole message, too, which `main` of a program prints.
pub struct Error(Box<Inner>);

struct Inner {
    kind: Kind,
    message: String,
    place: Option<Place>,
    label: String,
    file: Option<(PathBuf, Option<usize>)>,
    help: Option<String>,
    causes: Vec<String>,
    agreed: bool,
    common: bool,
}

/// Result with [`Error`].
pub type Result<T, E = Error> = std::result::Result<T, E>;

impl Error {
    /// An error of a kind; `message` is a fragment without a full stop.
    pub fn new(kind: Kind, message: impl Into<String>) -> Self {
        Error(Box::new(Inner {
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

    /// A refusal of something that stands at `place` in the scene.
    pub fn scene(place: &Place, message: impl Into<String>) -> Self {
        let mut error = Self::new(Kind::Scene, message);
        error.0.place = Some(place.clone());
        error
    }

    /// A refusal of a mesh file, with the line where that is known.
    pub fn mesh(path: &Path, line: Option<usize>, message: impl Into<String>) -> Self {
        let mut error = Self::new(Kind::Mesh, message);
        error.0.file = Some((path.to_owned(), line));
        error
    }

    /// A failure of the file system; `verb` says what was tried ("read", "create").
    pub fn file(path: &Path, verb: &str, cause: &std::io::Error) -> Self {
        let mut error = Self::new(Kind::File, format!("cannot {verb} {}", path.display()));
        error.0.causes.push(cause.to_string());
        error
    }

    /// The end of a rank whose fellow has the words: not printed, same exit code.
    pub fn silent(exit_code: i32) -> Self {
        let kinds = [Kind::Usage, Kind::Scene, Kind::Mesh, Kind::Solver, Kind::File];
        let stopped = (exit_code > SIGNALLED).then(|| Kind::Stopped(exit_code - SIGNALLED));
        let kind = kinds.into_iter().find(|kind| kind.exit_code() == exit_code).or(stopped).unwrap_or(Kind::Solver);
        Self::new(kind, String::new())
    }

    /// Whether another rank prints the words.
    pub fn is_silent(&self) -> bool {
        self.0.message.is_empty()
    }

    /// Marks that every rank ends with this error.
    pub fn agreed(mut self) -> Self {
        self.0.agreed = true;
        self
    }

    /// Whether every rank ends with this error, so that nobody waits for this one.
    pub fn is_agreed(&self) -> bool {
        self.0.agreed
    }

    /// Marks that every rank has found this error by itself, with the same words.
    pub fn common(mut self) -> Self {
        (self.0.agreed, self.0.common) = (true, true);
        self
    }

    /// Whether every rank has found this error by itself, so that one of them prints it.
    pub fn is_common(&self) -> bool {
        self.0.common
    }

    /// Points at a place in the scene.
    pub fn at(mut self, place: &Place) -> Self {
        self.0.place = Some(place.clone());
        self
    }

    /// Says next to the caret what is wrong there.
    pub fn label(mut self, label: impl Into<String>) -> Self {
        self.0.label = label.into();
        self
    }

    /// Says what to do about it.
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.0.help = Some(help.into());
        self
    }

    /// Advises the known name that `name` may be a slip of, or else what `otherwise` says.
    pub fn suggest<'a>(
        self,
        name: &str,
        known: impl IntoIterator<Item = &'a str>,
        otherwise: impl FnOnce() -> String,
    ) -> Self {
        self.help(suggestion(name, known).unwrap_or_else(otherwise))
    }

    /// Adds a cause, printed on a line of its own.
    pub fn because(mut self, cause: impl Into<String>) -> Self {
        self.0.causes.push(cause.into());
        self
    }

    /// The kind.
    pub fn kind(&self) -> Kind {
        self.0.kind
    }

    /// The message alone.
    pub fn message(&self) -> &str {
        &self.0.message
    }

    /// The advice, if there is one.
    pub fn advice(&self) -> Option<&str> {
        self.0.help.as_deref()
    }

    /// The whole message as a terminal shows it: message, file, line, caret, causes, help.
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
            // the words of an option say where they stand
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
        // `main` prints a word of its own before it
        let text = self.render(false);
        f.write_str(text.strip_prefix("error: ").unwrap_or(&text))
    }
}

impl std::error::Error for Error {}

/// A number as people write it: far from one with an exponent, not with three hundred digits.
pub fn shown(value: f64) -> String {
    match value.abs() {
        size if size != 0.0 && size.is_finite() && !(1e-5..1e16).contains(&size) => format!("{value:e}"),
        _ => value.to_string(),
    }
}

/// Names in a row joined by "with", words that they begin with said once: `rotation about x and y`.
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
    groups.into_iter().map(group).collect::<Vec<_>>().join(" with ")
}

/// Most names in a sentence: with ten letters each and their quotes, two lines of a terminal of 80 columns.
const NAMES: usize = 12;

/// The first of many names, and the number of others: of a few names all.
pub fn few(names: impl IntoIterator<Item = impl ToString>) -> Vec<String> {
    let mut names: Vec<String> = names.into_iter().map(|name| name.to_string()).collect();
    let others = names.len().saturating_sub(NAMES);
    // a single other one is said as fast as counted
    if others > 1 {
        names.truncate(NAMES);
        names.push(format!("{others} others"));
    }
    names
}

/// The known name nearest to `name`, if one is near enough to be a slip of the keyboard.
pub fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    known
        .into_iter()
        .map(|candidate| (strsim::damerau_levenshtein(name, candidate), candidate))
        .filter(|(distance, _)| *distance <= 1 + name.len() / 4)
        .min_by_key(|(distance, candidate)| (*distance, candidate.to_string()))
        .map(|(_, candidate)| candidate)
}

/// The same as advice.
pub fn suggestion<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<String> {
    nearest(name, known).map(|near| format!("did you mean `{near}`?"))
}

/// The text that the caret of a rendered error marks.
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
        assert_eq!(joined(names), "translation along x with rotation about x, y and z");
        assert_eq!(joined(["x", "y"]), "x with y");
        assert_eq!(joined(["translation along y", "rotation"]), "translation along y with rotation");
        assert_eq!([1e308, -2.1e5, 0.0, 1e-7, f64::NAN].map(shown), ["1e308", "-210000", "0", "1e-7", "NaN"]);
    }
}
