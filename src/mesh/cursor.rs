//! A place in the bytes of a `.msh` file that reads numbers, written as text or binary, and says where it is.

use crate::error::{Error, Result};
use std::path::Path;

/// Reads a `.msh` file from front to back.
pub struct Cursor<'a> {
    /// The file that the user knows: it stands in messages.
    pub path: &'a Path,
    /// The whole file.
    bytes: &'a [u8],
    /// Where the next number starts.
    at: usize,
    /// Whether numbers are binary; the `$MeshFormat` section says so.
    pub binary: bool,
    /// Name of the section being read, without `$`; empty between sections.
    pub section: String,
    /// Whether `path` is a script that the bytes were made from, so that lines in them mean nothing to the user.
    made: bool,
}

impl<'a> Cursor<'a> {
    /// A cursor at the start of a file.
    pub fn new(path: &'a Path, bytes: &'a [u8], made: bool) -> Self {
        Cursor { path, bytes, at: 0, binary: false, section: String::new(), made }
    }

    /// Where the next number starts.
    pub fn position(&self) -> usize {
        self.at
    }

    /// An error at a position: it names the line of a text file, section and byte of a binary one.
    pub fn error_at(&self, position: usize, message: impl Into<String>) -> Error {
        let message = message.into();
        if self.made {
            return Error::mesh(self.path, None, message);
        }
        if self.binary {
            let section = if self.section.is_empty() { String::new() } else { format!(" in ${}", self.section) };
            return Error::mesh(self.path, None, format!("{message}{section}, at byte {position}"));
        }
        let before = &self.bytes[..position.min(self.bytes.len())];
        let line = 1 + before.iter().filter(|byte| **byte == b'\n').count();
        Error::mesh(self.path, Some(line), message)
    }

    /// An error where the cursor is.
    pub fn error(&self, message: impl Into<String>) -> Error {
        self.error_at(self.at, message)
    }

    fn ends_early(&self) -> Error {
        let section = if self.section.is_empty() { "its header" } else { self.section.as_str() };
        self.error(format!("the file ends within {section}")).help("it was cut short: save the mesh again with Gmsh")
    }

    /// Skips white space, lines too; tells whether the file ends there.
    pub fn at_end(&mut self) -> bool {
        while self.bytes.get(self.at).is_some_and(u8::is_ascii_whitespace) {
            self.at += 1;
        }
        self.at == self.bytes.len()
    }

    /// The rest of the line, trimmed, and on to the next one. Headers and names are lines in binary files too.
    pub fn line(&mut self) -> Result<&'a str> {
        // Longer lines are not text, and are not worth a search through the whole file.
        const LONGEST: usize = 1000;
        let rest = &self.bytes[self.at..];
        let end = rest.iter().take(LONGEST).position(|byte| *byte == b'\n');
        let end = match end {
            Some(end) => end,
            None if rest.len() < LONGEST => rest.len(),
            None => return Err(self.error("this line is too long to be one of a mesh file")),
        };
        let line = std::str::from_utf8(&rest[..end]).map_err(|_| self.error("this line is not text in UTF-8"))?;
        self.at = self.bytes.len().min(self.at + end + 1);
        Ok(line.trim())
    }

    /// Enters the section of this name.
    pub fn enter(&mut self, section: &str) {
        self.section.clear();
        self.section.push_str(section);
    }

    /// Leaves the section, over its closing line.
    pub fn leave(&mut self) -> Result<()> {
        let start = self.at;
        let ok = !self.at_end() && self.line().is_ok_and(|line| line.strip_prefix("$End") == Some(&*self.section));
        if !ok {
            let message = format!("`$End{}` should stand here", self.section);
            return Err(self.error_at(start, message).help("the file is damaged: save the mesh again with Gmsh"));
        }
        self.section.clear();
        Ok(())
    }

    /// Jumps over what is left of the section and leaves it.
    pub fn skip_section(&mut self) -> Result<()> {
        let end = format!("$End{}", self.section);
        let mut from = self.at;
        while let Some(dollar) = self.bytes[from..].iter().position(|byte| *byte == b'$') {
            from += dollar;
            if self.bytes[from..].starts_with(end.as_bytes()) {
                self.at = from;
                return self.leave();
            }
            from += 1;
        }
        Err(self.error(format!("`{end}` is missing")).help("the file was cut short: save the mesh again with Gmsh"))
    }

    /// Goes to the start of a record: in text, over blank lines.
    pub fn begin(&mut self) {
        if !self.binary {
            self.at_end();
        }
    }

    /// Ends a record: in text, the line must end here.
    pub fn end(&mut self) -> Result<()> {
        if self.binary {
            return Ok(());
        }
        self.skip_blanks();
        match self.bytes.get(self.at) {
            None => Ok(()),
            Some(b'\n') => {
                self.at += 1;
                Ok(())
            }
            Some(_) => Err(self.error("this line has more entries than expected")),
        }
    }

    fn skip_blanks(&mut self) {
        while matches!(self.bytes.get(self.at), Some(b' ' | b'\t' | b'\r')) {
            self.at += 1;
        }
    }

    /// The next bytes of a binary file.
    fn take<const N: usize>(&mut self) -> Result<[u8; N]> {
        let Some(bytes) = self.bytes[self.at..].first_chunk() else {
            return Err(self.ends_early());
        };
        self.at += N;
        Ok(*bytes)
    }

    /// The next word of a text file, on this line.
    fn word(&mut self) -> Result<&'a str> {
        self.skip_blanks();
        let rest = &self.bytes[self.at..];
        let length = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        if rest.is_empty() {
            return Err(self.ends_early());
        }
        if length == 0 {
            return Err(self.error("this line has too few entries"));
        }
        let word = std::str::from_utf8(&rest[..length]).map_err(|_| self.error("a number should stand here"))?;
        self.at += length;
        Ok(word)
    }

    fn number<T: std::str::FromStr>(&mut self, what: &str) -> Result<T> {
        let word = self.word()?;
        word.parse().map_err(|_| {
            let shown: String = word.chars().take(40).collect();
            self.error_at(self.at - word.len(), format!("`{shown}` should be {what}"))
        })
    }

    /// The next `int`.
    pub fn int(&mut self) -> Result<i32> {
        if self.binary { self.take().map(i32::from_le_bytes) } else { self.number("a whole number") }
    }

    /// The next `size_t`: a count or a tag.
    pub fn size(&mut self) -> Result<u64> {
        if self.binary { self.take().map(u64::from_le_bytes) } else { self.number("a whole number, not negative") }
    }

    /// The next `double`, finite.
    pub fn real(&mut self) -> Result<f64> {
        let start = self.at;
        let value: f64 = if self.binary { self.take().map(f64::from_le_bytes)? } else { self.number("a number")? };
        if value.is_finite() {
            return Ok(value);
        }
        Err(self.error_at(start, format!("a coordinate is {value}")))
    }

    /// Skips a `double` that need not be finite: the box around an entity without nodes is not.
    pub fn bound(&mut self) -> Result<()> {
        if self.binary { self.take::<8>().map(|_| ()) } else { self.number::<f64>("a number").map(|_| ()) }
    }

    /// The next `size_t` as the count of things that take at least so many `numbers` in text, `bytes` in binary: what
    /// the rest of the file cannot hold is refused before anything is allocated for it.
    pub fn count(&mut self, numbers: usize, bytes: usize) -> Result<usize> {
        let start = self.at;
        let count = self.size()?;
        // A number in text is a digit and a separator; the last separator may be missing.
        let each = if self.binary { bytes } else { 2 * numbers };
        let most = (self.bytes.len() - self.at + 1) / each.max(1);
        match usize::try_from(count) {
            Ok(count) if count <= most => Ok(count),
            _ => Err(self
                .error_at(start, format!("the file is too short for a count of {count}"))
                .help("it was cut short or damaged: save the mesh again with Gmsh")),
        }
    }

    /// Skips records that nobody needs: lines of a text file, `bytes` each in a binary one.
    pub fn skip_records(&mut self, count: usize, bytes: usize) -> Result<()> {
        if self.binary {
            let length = count.checked_mul(bytes).filter(|length| *length <= self.bytes.len() - self.at);
            self.at += length.ok_or_else(|| self.ends_early())?;
            return Ok(());
        }
        for _ in 0..count {
            self.begin();
            let rest = &self.bytes[self.at..];
            let line = rest.iter().position(|byte| *byte == b'\n').ok_or_else(|| self.ends_early())?;
            self.at += line + 1;
        }
        Ok(())
    }

    /// Goes back to a position seen before, for a closer look.
    pub fn rewind(&mut self, position: usize) {
        self.at = position;
    }
}
