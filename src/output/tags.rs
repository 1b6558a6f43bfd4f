//! What the files of vtkio lack: names of components, and an end that is told of on a full disk.

use std::io::{self, Write};

/// Names of the components of arrays that have several.
const COMPONENTS: [(&str, &[&str]); 4] = [
    ("displacement", &["x", "y", "z"]),
    ("stress", &["xx", "yy", "zz", "xy", "yz", "xz"]),
    ("principal", &["first", "second", "third"]),
    ("normal", &["x", "y", "z"]),
];

/// Passes all bytes on, gives arrays the names of their components, and keeps the first failure: vtkio 0.7.0-rc2 has no such names,
/// ignores short writes, and failures of its last flush, which on a full disk would leave half a file without a word.
pub struct Whole<'a> {
    out: &'a mut dyn Write,
    /// The tag that has begun, from its `<` on.
    tag: Option<Vec<u8>>,
    failure: Option<io::Error>,
}

impl<'a> Whole<'a> {
    /// Passes on to `out`.
    pub fn new(out: &'a mut dyn Write) -> Self {
        Self { out, tag: None, failure: None }
    }

    /// The first failure.
    pub fn failure(self) -> Option<io::Error> {
        self.failure
    }

    /// Base64 has no `<`, so that tags are all between that and `>`.
    fn pass(&mut self, mut bytes: &[u8]) -> io::Result<()> {
        while !bytes.is_empty() {
            let end = if self.tag.is_some() { b'>' } else { b'<' };
            let at = bytes.iter().position(|&byte| byte == end);
            let (here, rest) = bytes.split_at(at.unwrap_or(bytes.len()));
            bytes = rest;
            match &mut self.tag {
                Some(tag) => tag.extend_from_slice(here),
                None => self.out.write_all(here)?,
            }
            match (at, self.tag.take()) {
                (Some(_), None) => self.tag = Some(Vec::new()),
                (Some(_), Some(tag)) => self.out.write_all(&named(&tag))?,
                (None, tag) => self.tag = tag,
            }
        }
        Ok(())
    }
}

/// The tag of an array with the names of its components behind its own.
fn named(tag: &[u8]) -> Vec<u8> {
    let mut text = String::from_utf8_lossy(tag).into_owned();
    for (array, components) in COMPONENTS {
        let name = format!(" Name=\"{array}\"");
        let is_array = text.starts_with("<DataArray ") || text.starts_with("<PDataArray ");
        if let Some(at) = text.find(&name).filter(|_| is_array) {
            let names =
                components.iter().enumerate().map(|(i, component)| format!(" ComponentName{i}=\"{component}\""));
            text.insert_str(at + name.len(), &names.collect::<String>());
        }
    }
    text.into_bytes()
}

impl Write for Whole<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.failure.is_none() {
            self.failure = self.pass(bytes).err();
        }
        match &self.failure {
            None => Ok(bytes.len()),
            Some(failure) => Err(failure.kind().into()),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}
