//! The lines of an input file and of the files that it includes, and their words.

use super::frame::{Coordinates, real};
use crate::error::{Error, Result};
use crate::file::read;
use std::path::{Path, PathBuf};

/// Files that may stand in each other by `*INCLUDE`. More are taken for a file that includes itself.
const DEEPEST: usize = 32;

/// A line: the index of its file, and its number, counted from 1.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct SourceLine {
    file: usize,
    line: usize,
}

/// A file that is being read.
struct Open {
    file: usize,
    line: usize,
    text: String,
    /// Position of the next line in bytes.
    next: usize,
}

/// A keyword or a data line, without blanks at its ends.
pub enum InputLine {
    /// A keyword with its parameters, without the star.
    Keyword(String),
    /// Data.
    Data(String),
}

/// The lines of a file, and of those that it includes, in turn.
#[derive(Default)]
pub struct LineReader {
    files: Vec<PathBuf>,
    open: Vec<Open>,
    /// A line that was read too early.
    early: Option<(SourceLine, String)>,
    /// Bytes of all files so far.
    pub bytes: usize,
}

impl LineReader {
    /// Start with the first line of a file.
    pub fn new(path: &Path, bytes: &[u8]) -> Self {
        let mut lines = Self::default();
        lines.push(path.to_owned(), bytes);
        lines
    }

    fn push(&mut self, path: PathBuf, bytes: &[u8]) {
        let text = String::from_utf8_lossy(bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes)).into_owned();
        self.bytes += text.len();
        self.open.push(Open { file: self.files.len(), line: 0, text, next: 0 });
        self.files.push(path);
    }

    /// Continue with the lines of another file, whose name is relative to the folder of the file that names it.
    ///
    /// # Errors
    /// The file cannot be read, or it includes itself.
    pub fn include(&mut self, name: &str, at: SourceLine) -> Result<()> {
        let name = name.trim().trim_matches(['"', '\'']);
        if self.open.len() >= DEEPEST {
            return Err(self.refuse(at, format!("`{name}` is included within itself")));
        }
        let folder = self.files[at.file].parent().unwrap_or(Path::new(""));
        let path = folder.join(name);
        let bytes = read(&path).map_err(|error| {
            self.refuse(at, format!("`{name}` stands here to be included, but cannot be read"))
                .because(error.message().to_owned())
                .help("names of files are relative to the folder of the file that includes them")
        })?;
        self.push(path, &bytes);
        Ok(())
    }

    /// Return an error at a line.
    pub fn refuse(&self, at: SourceLine, message: impl Into<String>) -> Error {
        Error::mesh(&self.files[at.file], Some(at.line), message)
    }

    /// Return a line in words.
    pub fn show(&self, at: SourceLine) -> String {
        match at.file {
            0 => format!("line {}", at.line),
            file => format!("line {} of {}", at.line, self.files[file].display()),
        }
    }

    /// Return the next line that is not empty and no comment.
    fn line(&mut self) -> Option<(SourceLine, String)> {
        if let Some(early) = self.early.take() {
            return Some(early);
        }
        while let Some(open) = self.open.last_mut() {
            let Some(rest) = open.text.get(open.next..).filter(|rest| !rest.is_empty()) else {
                self.open.pop();
                continue;
            };
            let line = rest.split('\n').next().unwrap_or_default();
            (open.next, open.line) = (open.next + line.len() + 1, open.line + 1);
            let line = line.trim();
            if !line.is_empty() && !line.starts_with("**") {
                return Some((SourceLine { file: open.file, line: open.line }, line.to_owned()));
            }
        }
        None
    }

    /// Return the next keyword or data line. A keyword that ends with a comma goes on in the next line, if that has
    /// parameters.
    pub fn next(&mut self) -> Option<(SourceLine, InputLine)> {
        let (at, line) = self.line()?;
        let Some(keyword) = line.strip_prefix('*') else { return Some((at, InputLine::Data(line))) };
        let mut keyword = keyword.to_owned();
        while keyword.ends_with(',') {
            match self.line() {
                Some((_, more)) if !more.starts_with('*') && is_parameters(&more) => keyword += &more,
                other => {
                    self.early = other;
                    break;
                }
            }
        }
        Some((at, InputLine::Keyword(keyword)))
    }
}

/// Return whether a line has parameters of a keyword, and no data.
fn is_parameters(line: &str) -> bool {
    line.contains('=') || line.trim_end_matches(',').trim().eq_ignore_ascii_case("GENERATE")
}

/// A result with a message in words.
pub type TextResult<T> = std::result::Result<T, String>;

/// A keyword with its parameters.
pub struct Keyword {
    /// The keyword in capitals.
    pub name: String,
    parameters: Vec<(String, String)>,
    /// Its line.
    pub at: SourceLine,
}

impl Keyword {
    /// Read a line without its star.
    pub fn new(line: &str, at: SourceLine) -> Self {
        let mut words = line.split(',').map(str::trim);
        let name = words.next().unwrap_or_default().to_ascii_uppercase();
        let name = name.split_whitespace().collect::<Vec<_>>().join(" ");
        let pair = |word: &str| {
            let (key, value) = word.split_once('=').unwrap_or((word, ""));
            (key.trim().to_ascii_uppercase(), value.trim().to_owned())
        };
        Self { name, parameters: words.map(pair).collect(), at }
    }

    /// Return the value of a parameter, which may be empty.
    pub fn get(&self, key: &str) -> Option<&str> {
        self.parameters.iter().find(|(known, _)| known == key).map(|(_, value)| value.as_str())
    }
}

/// Return a name of the file in small letters.
pub fn spelled(word: &str) -> String {
    word.trim().trim_matches('"').to_ascii_lowercase()
}

/// Return a number of a node or element.
pub fn count(word: &str) -> TextResult<u64> {
    word.trim().parse().map_err(|_| format!("`{}` is no number", word.trim()))
}

/// Return the numbers of a data line. Empty ones are zero.
pub fn reals(words: &[&str]) -> TextResult<Vec<f64>> {
    let number = |word: &&str| {
        if word.is_empty() { Ok(0.0) } else { real(word).ok_or_else(|| format!("`{word}` is no number")) }
    };
    words.iter().map(number).collect()
}

/// Return the kind of coordinates of `*NODE`.
pub fn coordinates(keyword: &Keyword) -> TextResult<Coordinates> {
    match keyword.get("SYSTEM").unwrap_or("R").to_ascii_uppercase().as_str() {
        "R" => Ok(Coordinates::Rectangular),
        "C" => Ok(Coordinates::Cylindrical),
        other => {
            Err(format!("nodes with SYSTEM={other} are not read: give rectangular (R) or cylindrical (C) coordinates"))
        }
    }
}

/// Return first and last number and step of a data line that generates a set. A file of so many `bytes` has no more of
/// them.
pub fn generated(set: &str, words: &[&str], bytes: usize) -> TextResult<[u64; 3]> {
    let [first, last] = [count(words[0])?, count(words.get(1).copied().unwrap_or(words[0]))?];
    let step = words.get(2).filter(|word| !word.is_empty()).map_or(Ok(1), |word| count(word))?.max(1);
    if last.saturating_sub(first) / step >= bytes as u64 {
        Err(format!("the set `{set}` has more members, from {first} to {last}, than the file has bytes"))
    } else {
        Ok([first, last, step])
    }
}
