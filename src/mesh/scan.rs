//! The numbers and lines of a `.msh` file from front to back, text or binary, with the line for messages.
//!
//! A record is a line of a text file, or some bytes of a binary one. [`Scanner::begin`] reads it, and the numbers are
//! then taken from it.

use crate::error::{Error, Result};
use std::io::{BufRead, Read};
use std::path::Path;

/// A reader of a `.msh` file.
pub struct Scanner<'a> {
    /// The file that the user knows, for messages.
    pub path: &'a Path,
    input: &'a mut dyn BufRead,
    /// Whether numbers are binary, as the `$MeshFormat` section says.
    pub binary: bool,
    /// Number of the line that was read last, counted from 1.
    line: usize,
    /// Name of the section being read, without `$`; empty between sections.
    section: String,
    /// Whether the bytes were made from the file at `path`, so that lines in them mean nothing to the user.
    made: bool,
    /// The record.
    record: Vec<u8>,
    /// Position of the next number in the record.
    at: usize,
}

/// What is wrong with an entry of a file, and what to do.
pub struct ScanError {
    pub what: String,
    pub help: String,
}

impl ScanError {
    /// Make a flaw with its advice.
    pub fn new(what: impl Into<String>, help: impl Into<String>) -> Self {
        Self { what: what.into(), help: help.into() }
    }
}

/// Advice for a file that is damaged.
pub const DAMAGED: &str = "the file is damaged, or was cut short: save the mesh again with Gmsh";

/// Largest number of bytes of a line. Longer ones are no text.
const LONGEST: u64 = 1 << 16;

/// Largest number of bytes for which memory is taken before they are there.
const TRUSTED: usize = 1 << 12;

impl<'a> Scanner<'a> {
    /// Start at the first byte of a file. `made` tells whether the bytes were made from the file at `path`.
    pub fn new(path: &'a Path, input: &'a mut dyn BufRead, made: bool) -> Self {
        Self { path, input, binary: false, line: 0, section: String::new(), made, record: Vec::new(), at: 0 }
    }

    /// Return an error at the last line of a text file, or in the section of a binary one.
    pub fn error(&self, message: impl Into<String>) -> Error {
        match (self.made, self.binary, self.section.as_str()) {
            (true, ..) | (_, true, "") => Error::mesh(self.path, None, message),
            (_, true, section) => Error::mesh(self.path, None, format!("{} in ${section}", message.into())),
            _ => Error::mesh(self.path, Some(self.line.max(1)), message),
        }
    }

    /// Return a result whose flaw stands here.
    pub fn place<T>(&self, result: std::result::Result<T, ScanError>) -> Result<T> {
        result.map_err(|ScanError { what, help }| self.error(what).help(help))
    }

    /// Return an error here with the advice about damaged files.
    pub fn damaged(&self, message: impl Into<String>) -> Error {
        self.error(message).help(DAMAGED)
    }

    fn ends_early(&self) -> Error {
        self.damaged("the file ends early")
    }

    /// Read the next line that is not blank, and return whether there is one.
    fn read_line(&mut self) -> Result<bool> {
        loop {
            self.record.clear();
            self.at = 0;
            let read = (&mut *self.input).take(LONGEST).read_until(b'\n', &mut self.record);
            let count = read.map_err(|cause| Error::file(self.path, "read", &cause))?;
            if count == 0 {
                return Ok(false);
            }
            self.line += 1;
            if count as u64 == LONGEST {
                return Err(self.damaged("this line is too long to be one of a mesh file"));
            }
            if !self.record.trim_ascii().is_empty() {
                return Ok(true);
            }
        }
    }

    /// Return the next line that is not blank, trimmed. Headers and names are lines in binary files, too.
    pub fn line(&mut self) -> Result<String> {
        if !self.read_line()? {
            return Err(self.ends_early());
        }
        match std::str::from_utf8(&self.record) {
            Ok(line) => Ok(line.trim().to_owned()),
            Err(_) => Err(self.damaged("this line is not text in UTF-8")),
        }
    }

    /// Enter the next section and return its name, or `None` at the end of the file.
    pub fn next_section(&mut self) -> Result<Option<String>> {
        if !self.read_line()? {
            return Ok(None);
        }
        let name =
            std::str::from_utf8(&self.record).ok().and_then(|line| line.trim().strip_prefix('$')).map(str::to_owned);
        let name = name.ok_or_else(|| self.damaged("a section such as `$Nodes` should begin here"))?;
        self.section.clone_from(&name);
        Ok(Some(name))
    }

    /// Leave the section by its closing line.
    pub fn leave(&mut self) -> Result<()> {
        let end = format!("$End{}", self.section);
        if !self.read_line()? || self.record.trim_ascii() != end.as_bytes() {
            return Err(self.damaged(format!("`{end}` should stand here")));
        }
        self.section.clear();
        Ok(())
    }

    /// Skip the rest of the section and leave it. Its bytes may be anything.
    pub fn skip_section(&mut self) -> Result<()> {
        let end = format!("$End{}", self.section);
        loop {
            self.record.clear();
            let read = self.input.read_until(b'\n', &mut self.record);
            if read.map_err(|cause| Error::file(self.path, "read", &cause))? == 0 {
                return Err(self.damaged(format!("`{end}` is missing")));
            }
            self.line += 1;
            if self.record.trim_ascii_end().ends_with(end.as_bytes()) {
                self.section.clear();
                return Ok(());
            }
        }
    }

    /// Begin binary numbers, the first of which is a one.
    pub fn begin_binary(&mut self) -> Result<()> {
        self.binary = true;
        self.begin(4)?;
        match self.int()? {
            1 => Ok(()),
            _ => Err(self
                .error("the bytes of the numbers are not in this machine's order")
                .help("save the mesh as text on the machine that made it")),
        }
    }

    /// Read a record: a line of text, or so many bytes.
    pub fn begin(&mut self, bytes: usize) -> Result<()> {
        if self.binary {
            self.record.clear();
            self.at = 0;
            return self.more(bytes);
        }
        if self.read_line()? { Ok(()) } else { Err(self.ends_early()) }
    }

    /// Read more of a binary record, `count` times `bytes` bytes. A line is read as a whole.
    pub fn append(&mut self, count: usize, bytes: usize) -> Result<()> {
        if self.binary { self.more(count.saturating_mul(bytes)) } else { Ok(()) }
    }

    fn more(&mut self, bytes: usize) -> Result<()> {
        let from = self.record.len();
        let read = match bytes {
            ..=TRUSTED => {
                self.record.resize(from + bytes, 0);
                self.input.read_exact(&mut self.record[from..])
            }
            _ => (&mut *self.input).take(bytes as u64).read_to_end(&mut self.record).map(drop),
        };
        match read {
            Err(cause) if cause.kind() != std::io::ErrorKind::UnexpectedEof => {
                Err(Error::file(self.path, "read", &cause))
            }
            Ok(()) if self.record.len() - from == bytes => Ok(()),
            _ => Err(self.ends_early()),
        }
    }

    /// End a record: a line of text must end here.
    pub fn end(&mut self) -> Result<()> {
        if self.binary || self.record[self.at..].trim_ascii().is_empty() {
            Ok(())
        } else {
            Err(self.damaged("this line has more entries than expected"))
        }
    }

    /// Skip `count` records of `bytes` bytes.
    pub fn skip(&mut self, count: usize, bytes: usize) -> Result<()> {
        for _ in 0..count {
            self.begin(bytes)?;
        }
        Ok(())
    }

    /// Return the next `N` bytes of a binary record.
    fn take<const N: usize>(&mut self) -> Result<[u8; N]> {
        let Some(&bytes) = self.record[self.at..].first_chunk() else { return Err(self.ends_early()) };
        self.at += N;
        Ok(bytes)
    }

    /// Return the next word of a line as a number. `what` names the expected kind in messages.
    fn number<T: std::str::FromStr>(&mut self, what: &str) -> Result<T> {
        let rest = self.record[self.at..].trim_ascii_start();
        let from = self.record.len() - rest.len();
        let length = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        if length == 0 {
            return Err(self.damaged("this line has too few entries"));
        }
        self.at = from + length;
        let word = String::from_utf8_lossy(&self.record[from..self.at]);
        word.parse().map_err(|_| {
            let shown: String = word.chars().take(40).collect();
            self.damaged(format!("`{shown}` should be {what}"))
        })
    }

    /// Return the next `int`.
    pub fn int(&mut self) -> Result<i32> {
        if self.binary { self.take().map(i32::from_le_bytes) } else { self.number("a whole number") }
    }

    /// Return the next `size_t`: a count or a tag.
    pub fn size(&mut self) -> Result<u64> {
        if self.binary { self.take().map(u64::from_le_bytes) } else { self.number("a whole number, not negative") }
    }

    /// Return the next `size_t` as a count of records, which end with the file.
    pub fn count(&mut self) -> Result<usize> {
        self.size().map(|count| usize::try_from(count).unwrap_or(usize::MAX))
    }

    /// Return the next `double`.
    pub fn real(&mut self) -> Result<f64> {
        if self.binary { self.take().map(f64::from_le_bytes) } else { self.number("a number") }
    }
}
