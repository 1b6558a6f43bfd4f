//! A reader of the numbers of a `.msh` file, text or binary, that knows its position for messages.

use crate::error::{Error, Result};
use std::cell::RefCell;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::path::Path;

/// A reader of a `.msh` file from front to back, one window at a time.
pub struct Cursor<'a> {
    /// The file that the user knows, for messages.
    pub path: &'a Path,
    /// The file, or its bytes.
    source: RefCell<Box<dyn ReadSeek + 'a>>,
    /// Size of the whole file in bytes.
    length: usize,
    /// The part of the file that is in memory.
    window: Vec<u8>,
    /// Position of the window in the file.
    first: usize,
    /// Position of the next number in the window.
    at: usize,
    /// Whether numbers are binary, as the `$MeshFormat` section says.
    pub binary: bool,
    /// Name of the section being read, without `$`; empty between sections.
    section: String,
    /// Names of the needed sections so far.
    seen: Vec<String>,
    /// Whether the bytes were made from the file at `path`, so that lines in them mean nothing to the user.
    made: bool,
    /// The reason why the file cannot be read any more, if there is one.
    failed: Option<io::Error>,
}

/// A file, or bytes that are read like a file.
pub trait ReadSeek: Read + Seek {}

impl<T: Read + Seek> ReadSeek for T {}

/// Bytes of a window. From 2^12 to 2^24, two cubes of 48^3 are read and checked in 1.41 to 1.43 s. With 2^28 it takes 1.47 s
/// and 13 MB more.
const WINDOW: usize = 1 << 20;

/// Largest number of bytes of a line or word. Gmsh itself reads no more of a line, and a longer one is not worth a search
/// through the whole file.
const LONGEST: usize = 1024;

impl<'a> Cursor<'a> {
    /// Make a cursor at the start of a file. `made` tells whether the bytes were made from the file at `path`.
    pub fn new(path: &'a Path, mut source: Box<dyn ReadSeek + 'a>, made: bool) -> Self {
        let (length, failed) = match source.seek(SeekFrom::End(0)) {
            Ok(length) => (length as usize, None),
            Err(cause) => (0, Some(cause)),
        };
        Cursor {
            path,
            source: RefCell::new(source),
            length,
            window: Vec::new(),
            first: 0,
            at: 0,
            binary: false,
            section: String::new(),
            seen: Vec::new(),
            made,
            failed,
        }
    }

    /// Return the position in the file at which the next number starts.
    pub fn position(&self) -> usize {
        self.first + self.at
    }

    /// Return the bytes that follow: at least `count`, unless the file ends before.
    fn ahead(&mut self, count: usize) -> &[u8] {
        if self.window.len() - self.at < count && self.first + self.window.len() < self.length {
            self.window.drain(..self.at);
            self.first += self.at;
            self.at = 0;
            let (start, wanted) = ((self.first + self.window.len()) as u64, (WINDOW + count) as u64);
            let source = self.source.get_mut();
            let read =
                source.seek(SeekFrom::Start(start)).and_then(|_| source.take(wanted).read_to_end(&mut self.window));
            if !matches!(read, Ok(1..)) {
                // The file was cut meanwhile, or cannot be read.
                self.length = self.first + self.window.len();
                self.failed = read.err();
            }
        }
        &self.window[self.at..]
    }

    /// Return an error at a position. It names the line of a text file, or the section and byte of a binary one.
    pub fn error_at(&self, position: usize, message: impl Into<String>) -> Error {
        let message = message.into();
        if let Some(cause) = &self.failed {
            return Error::file(self.path, "read", cause);
        }
        if self.made {
            return Error::mesh(self.path, None, message);
        }
        if self.binary {
            let section = if self.section.is_empty() { String::new() } else { format!(" in ${}", self.section) };
            return Error::mesh(self.path, None, format!("{message}{section}, at byte {position}"));
        }
        Error::mesh(self.path, self.line_at(position).ok(), message)
    }

    /// Return the line of a position, counted from the start of the file.
    fn line_at(&self, position: usize) -> io::Result<usize> {
        let mut source = self.source.borrow_mut();
        source.seek(SeekFrom::Start(0))?;
        let before = BufReader::new(source.by_ref().take(position as u64)).bytes();
        before.filter(|byte| matches!(byte, Ok(b'\n'))).try_fold(1, |line, byte| byte.map(|_| line + 1))
    }

    /// Return an error at the position of the cursor.
    pub fn error(&self, message: impl Into<String>) -> Error {
        self.error_at(self.position(), message)
    }

    fn ends_early(&self) -> Error {
        let section = if self.section.is_empty() { "its header" } else { self.section.as_str() };
        self.error(format!("the file ends within {section}")).help("it was cut short: save the mesh again with Gmsh")
    }

    /// Skip white space, including line breaks, and return whether the file ends there.
    pub fn at_end(&mut self) -> bool {
        loop {
            match self.ahead(1).first() {
                None => return true,
                Some(byte) if byte.is_ascii_whitespace() => self.at += 1,
                Some(_) => return false,
            }
        }
    }

    /// Return the rest of the line, trimmed, and go to the next one. Headers and names are lines in binary files, too.
    pub fn line(&mut self) -> Result<String> {
        let rest = self.ahead(LONGEST);
        let (length, end) = (rest.len(), rest.iter().take(LONGEST).position(|byte| *byte == b'\n'));
        let end = match end {
            Some(end) => end,
            None if length < LONGEST => length,
            None => return Err(self.error("this line is too long to be one of a mesh file")),
        };
        let Ok(line) = std::str::from_utf8(&rest[..end]) else {
            return Err(self.error("this line is not text in UTF-8"));
        };
        let line = line.trim().to_owned();
        self.at += length.min(end + 1);
        Ok(line)
    }

    /// Enter the next section that is one of `needed`, each of which may occur once, and skip others before it. Return its position and
    /// name, or `None` at the end of the file.
    pub fn next_section(&mut self, needed: &[&str]) -> Result<Option<(usize, String)>> {
        while !self.at_end() {
            let start = self.position();
            let line = self.line()?;
            let Some(section) = line.strip_prefix('$') else {
                return Err(self
                    .error_at(start, "a section such as `$Nodes` should begin here")
                    .help("the file is damaged, or has something behind its end: save the mesh again with Gmsh"));
            };
            self.enter(section);
            if !needed.contains(&section) {
                self.skip_section()?;
                continue;
            }
            if self.has(section) {
                return Err(self.error_at(start, format!("the section ${section} stands twice")));
            }
            self.seen.push(section.to_owned());
            return Ok(Some((start, section.to_owned())));
        }
        self.failed.take().map_or(Ok(None), |cause| Err(Error::file(self.path, "read", &cause)))
    }

    /// Return whether a needed section of this name was found.
    pub fn has(&self, section: &str) -> bool {
        self.seen.iter().any(|seen| seen == section)
    }

    /// Begin binary numbers, the first of which is a one.
    pub fn begin_binary(&mut self) -> Result<()> {
        self.binary = true;
        let start = self.position();
        match self.int()? {
            1 => Ok(()),
            _ => Err(self
                .error_at(start, "the bytes of the numbers are not in this machine's order")
                .help("save the mesh as text on the machine that made it")),
        }
    }

    /// Enter the section of this name.
    pub fn enter(&mut self, section: &str) {
        self.section.clear();
        self.section.push_str(section);
    }

    /// Leave the section by its closing line.
    pub fn leave(&mut self) -> Result<()> {
        let start = self.position();
        let ok = !self.at_end() && self.line().is_ok_and(|line| line.strip_prefix("$End") == Some(&*self.section));
        if !ok {
            let message = format!("`$End{}` should stand here", self.section);
            return Err(self.error_at(start, message).help("the file is damaged: save the mesh again with Gmsh"));
        }
        self.section.clear();
        Ok(())
    }

    /// Skip the rest of the section and leave it.
    pub fn skip_section(&mut self) -> Result<()> {
        let (end, start) = (format!("$End{}", self.section), self.position());
        loop {
            let rest = self.ahead(end.len());
            if rest.starts_with(end.as_bytes()) {
                return self.leave();
            }
            let others = rest.iter().skip(1).take_while(|byte| **byte != b'$').count();
            if rest.is_empty() {
                let error = self.error_at(start, format!("`{end}` is missing"));
                return Err(error.help("the file was cut short: save the mesh again with Gmsh"));
            }
            self.at += 1 + others;
        }
    }

    /// Go to the start of a record. In text this skips blank lines.
    pub fn begin(&mut self) {
        if !self.binary {
            self.at_end();
        }
    }

    /// End a record. In text the line must end here.
    pub fn end(&mut self) -> Result<()> {
        if self.binary {
            return Ok(());
        }
        self.skip_blanks();
        match self.ahead(1).first() {
            None => Ok(()),
            Some(b'\n') => {
                self.at += 1;
                Ok(())
            }
            Some(_) => Err(self.error("this line has more entries than expected")),
        }
    }

    fn skip_blanks(&mut self) {
        while matches!(self.ahead(1).first(), Some(b' ' | b'\t' | b'\r')) {
            self.at += 1;
        }
    }

    /// Return the next `N` bytes of a binary file.
    fn take<const N: usize>(&mut self) -> Result<[u8; N]> {
        let Some(&bytes) = self.ahead(N).first_chunk() else {
            return Err(self.ends_early());
        };
        self.at += N;
        Ok(bytes)
    }

    /// Return the next word on this line of a text file as a number. `what` names the expected kind in messages.
    fn number<T: std::str::FromStr>(&mut self, what: &str) -> Result<T> {
        self.skip_blanks();
        let rest = self.ahead(LONGEST);
        let length = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        if rest.is_empty() {
            return Err(self.ends_early());
        }
        if length == 0 {
            return Err(self.error("this line has too few entries"));
        }
        let Ok(word) = std::str::from_utf8(&rest[..length]) else {
            return Err(self.error("a number should stand here"));
        };
        let Ok(number) = word.parse() else {
            let shown: String = word.chars().take(40).collect();
            return Err(self.error(format!("`{shown}` should be {what}")));
        };
        self.at += length;
        Ok(number)
    }

    /// Read the next `int`.
    pub fn int(&mut self) -> Result<i32> {
        if self.binary { self.take().map(i32::from_le_bytes) } else { self.number("a whole number") }
    }

    /// Read the next `size_t`: a count or a tag.
    pub fn size(&mut self) -> Result<u64> {
        if self.binary { self.take().map(u64::from_le_bytes) } else { self.number("a whole number, not negative") }
    }

    /// Read the next `double`, which must be finite.
    pub fn real(&mut self) -> Result<f64> {
        let start = self.position();
        let value: f64 = if self.binary { self.take().map(f64::from_le_bytes)? } else { self.number("a number")? };
        if value.is_finite() {
            return Ok(value);
        }
        Err(self.error_at(start, format!("a coordinate is {value}")))
    }

    /// Skip a `double` that need not be finite. The box around an entity without nodes is not finite.
    pub fn bound(&mut self) -> Result<()> {
        if self.binary { self.take::<8>().map(|_| ()) } else { self.number::<f64>("a number").map(|_| ()) }
    }

    /// Read the next `size_t` as a count of records. Each takes at least `numbers` numbers in text, or `bytes` bytes in binary.
    /// A count that the rest of the file cannot hold is refused before anything is allocated for it.
    pub fn count(&mut self, numbers: usize, bytes: usize) -> Result<usize> {
        let start = self.position();
        let count = self.size()?;
        // A number in text is at least a digit and a separator; the last separator may be missing.
        let each = if self.binary { bytes } else { 2 * numbers };
        let most = (self.length - self.position() + 1) / each.max(1);
        match usize::try_from(count) {
            Ok(count) if count <= most => Ok(count),
            _ => Err(self
                .error_at(start, format!("the file is too short for a count of {count}"))
                .help("it was cut short or damaged: save the mesh again with Gmsh")),
        }
    }

    /// Skip records that nobody needs: `count` lines of a text file, or `count` times `bytes` bytes of a binary one.
    pub fn skip_records(&mut self, count: usize, bytes: usize) -> Result<()> {
        if self.binary {
            let length = count.checked_mul(bytes).filter(|length| *length <= self.length - self.position());
            let length = length.ok_or_else(|| self.ends_early())?;
            self.rewind(self.position() + length);
            return Ok(());
        }
        for _ in 0..count {
            self.begin();
            loop {
                let rest = self.ahead(1);
                match rest.iter().position(|byte| *byte == b'\n') {
                    Some(line) => break self.at += line + 1,
                    None if rest.is_empty() => return Err(self.ends_early()),
                    None => self.at += rest.len(),
                }
            }
        }
        Ok(())
    }

    /// Go to another position in the file, such as an earlier one that needs a closer look.
    pub fn rewind(&mut self, position: usize) {
        match position.checked_sub(self.first).filter(|at| *at <= self.window.len()) {
            Some(at) => self.at = at,
            None => {
                self.window.clear();
                (self.first, self.at) = (position, 0);
            }
        }
    }
}
