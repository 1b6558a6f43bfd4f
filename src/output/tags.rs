//! A writer that adds what vtkio lacks: names of components, and an error when the disk is full.

use std::io::{self, Write};

/// Names of the components of arrays that have several.
const COMPONENTS: [(&str, &[&str]); 4] = [
    ("displacement", &["x", "y", "z"]),
    ("stress", &["xx", "yy", "zz", "xy", "yz", "xz"]),
    ("principal", &["first", "second", "third"]),
    ("normal", &["x", "y", "z"]),
];

/// A writer that passes all bytes on, adds the names of components to the tags of arrays, and keeps the first failure.
///
/// vtkio 0.7.0-rc2 writes no such names. It also ignores short writes and failures of its last flush, which on a full disk would
/// leave half a file without an error.
pub struct TagWriter<'a> {
    out: &'a mut dyn Write,
    /// Bytes of the current tag from its `<` on, none outside of tags.
    tag: Option<Vec<u8>>,
    failure: Option<io::Error>,
}

impl<'a> TagWriter<'a> {
    /// Return a writer that passes its bytes on to `out`.
    pub fn new(out: &'a mut dyn Write) -> Self {
        Self { out, tag: None, failure: None }
    }

    /// Return the first failure.
    pub fn failure(self) -> Option<io::Error> {
        self.failure
    }

    /// Pass bytes on, with names in the tags. Base64 has no `<`, so every `<` begins a tag that ends at the next `>`.
    fn pass(&mut self, mut bytes: &[u8]) -> io::Result<()> {
        while !bytes.is_empty() {
            let end = if self.tag.is_some() { b'>' } else { b'<' };
            let at = bytes.iter().position(|&byte| byte == end);
            let (head, rest) = bytes.split_at(at.unwrap_or(bytes.len()));
            bytes = rest;
            match &mut self.tag {
                Some(tag) => tag.extend_from_slice(head),
                None => self.out.write_all(head)?,
            }
            match (at, self.tag.take()) {
                (Some(_), None) => self.tag = Some(Vec::new()),
                (Some(_), Some(tag)) => self.out.write_all(&with_component_names(&tag))?,
                (None, tag) => self.tag = tag,
            }
        }
        Ok(())
    }
}

/// Return a tag; that of an array gets the names of its components after the name of the array.
fn with_component_names(tag: &[u8]) -> Vec<u8> {
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

impl Write for TagWriter<'_> {
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
