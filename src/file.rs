//! Reading of files that the user names, and digests of data.

use crate::error::{Error, Kind, Result};
use serde::Serialize;
use sha2::{Digest, Sha256};
use std::fs::{File, FileType};
use std::io::{self, Read, Seek};
use std::os::unix::fs::FileTypeExt;
use std::path::Path;

/// What a pointer of Git LFS begins with.
const LFS: &[u8] = b"version https://git-lfs.github.com/spec/";

/// Return all bytes of a regular file.
///
/// # Errors
/// Those of [`open`], and [`Kind::File`] if reading fails.
pub fn read(path: &Path) -> Result<Vec<u8>> {
    let (mut file, mut bytes) = (open(path)?, Vec::new());
    file.read_to_end(&mut bytes).map_err(|cause| Error::file(path, "read", &cause)).map(|_| bytes)
}

/// Open a regular file. Others are refused: devices and pipes may have no end, or keep a reader waiting for ever. So is
/// what Git LFS leaves in the place of a large file that was not fetched.
///
/// # Errors
/// [`Kind::File`]: the path is no regular file, or cannot be read, or is a pointer of Git LFS.
pub fn open(path: &Path) -> Result<File> {
    let failed = |cause| Error::file(path, "read", &cause);
    let kind = std::fs::metadata(path).map_err(failed)?.file_type();
    if kind.is_file() {
        let (mut file, mut start) = (File::open(path).map_err(failed)?, Vec::new());
        file.by_ref().take(LFS.len() as u64).read_to_end(&mut start).map_err(failed)?;
        if start == LFS {
            return Err(Error::new(
                Kind::File,
                format!("{} is a pointer of Git LFS, not the file itself", path.display()),
            )
            .help("fetch the file: git lfs pull"));
        }
        return file.rewind().map_err(failed).map(|()| file);
    }
    Err(Error::new(Kind::File, format!("{} is {}, not a file", path.display(), kind_of(kind)))
        .help("name a regular file; what a pipe gives can be saved as one"))
}

/// Write a file.
///
/// # Errors
/// The file system refuses.
pub fn write(path: &Path, bytes: impl AsRef<[u8]>) -> Result<()> {
    std::fs::write(path, bytes).map_err(|cause| Error::file(path, "write", &cause))
}

/// Return the kind of a directory entry in words.
pub fn kind_of(kind: FileType) -> &'static str {
    match () {
        _ if kind.is_file() => "a file, not a folder",
        _ if kind.is_dir() => "a folder",
        _ if kind.is_fifo() => "a pipe",
        _ if kind.is_socket() => "a socket",
        _ => "a device",
    }
}

/// Return why bytes are no UTF-8 text, as the rest of a sentence about their file; none if nothing is obviously wrong.
pub fn other_encoding(bytes: &[u8]) -> Option<&'static str> {
    match bytes {
        [0xff, 0xfe, ..] | [0xfe, 0xff, ..] => Some("is UTF-16 text, not UTF-8"),
        _ if bytes.contains(&0) => Some("has zero bytes, so it is no text"),
        _ => None,
    }
}

/// Return the bytes that programs can still take without swapping, as Linux reports them. On other systems there is no
/// limit.
pub fn available_memory() -> usize {
    bytes_in_proc("/proc/meminfo", "MemAvailable").map_or(usize::MAX, |bytes| bytes as usize)
}

/// Return the number of bytes on a line of a file of /proc, such as `MemAvailable` of /proc/meminfo; none where there
/// is no such file or line.
pub fn bytes_in_proc(file: &str, line: &str) -> Option<u64> {
    bytes_on_line(&std::fs::read_to_string(file).ok()?, line)
}

fn bytes_on_line(text: &str, line: &str) -> Option<u64> {
    let rest = text.lines().find_map(|other| other.strip_prefix(line)?.strip_prefix(':'))?;
    rest.split_whitespace().next()?.parse::<u64>().ok().map(|kibibytes| kibibytes * 1024)
}

/// A source of bytes that are digested while they are read.
pub struct Digested<R> {
    source: R,
    sum: Sha256,
}

impl<R: Read> Digested<R> {
    /// Start at the first byte of a source.
    pub fn new(source: R) -> Self {
        Self { source, sum: Sha256::new() }
    }

    /// Return the SHA-256 of the bytes that were read, in hexadecimal digits.
    pub fn digest(self) -> String {
        hexadecimal(&self.sum.finalize())
    }
}

impl<R: Read> Read for Digested<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.source.read(buffer)?;
        self.sum.update(&buffer[..count]);
        Ok(count)
    }
}

/// Return the SHA-256 of numbers, texts, and lists and tuples of such, in hexadecimal digits. Lengths are part of the
/// digested bytes, so that different divisions of the same text differ.
pub fn digest(data: &impl Serialize) -> String {
    // data of these kinds can always be packed
    digest_of_bytes(&postcard::to_allocvec(data).unwrap_or_default())
}

/// Return the SHA-256 of bytes, in hexadecimal digits.
pub fn digest_of_bytes(bytes: &[u8]) -> String {
    hexadecimal(&Sha256::digest(bytes))
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_of_a_digest_do_not_run_together() {
        assert_eq!(digest(&("ab", "c")), digest(&("ab".to_owned(), "c")));
        assert_ne!(digest(&("ab", "c")), digest(&("a", "bc")));
        assert_ne!(digest(&[2.0, 1.0]), digest(&[2.0, 1.0 + f64::EPSILON]));
        assert!(digest(&()).starts_with("e3b0c442"), "that of no byte");
    }

    #[test]
    fn other_encodings_are_found() {
        assert_eq!(other_encoding(b"\xff\xfea\0"), Some("is UTF-16 text, not UTF-8"));
        assert_eq!(other_encoding(b"a"), None);
        assert!(other_encoding(b"a\0").is_some());
    }

    #[test]
    fn the_line_of_linux_is_read() {
        let text = "MemTotal:       24000000 kB\nMemFree:  5 kB\nMemAvailable:   20000 kB\n";
        assert_eq!(bytes_on_line(text, "MemAvailable"), Some(20_480_000));
        assert_eq!(bytes_on_line("MemFree: 1 kB", "MemAvailable"), None);
        assert!(bytes_in_proc("/proc/meminfo", "MemAvailable").is_some_and(|bytes| bytes > 1_000_000));
    }
}
