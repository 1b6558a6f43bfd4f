//! `SHA256SUMS`: the checksums of the files of a run as it wrote them, so that a damaged file is not taken for a result.
//!
//! `sha256sum -c SHA256SUMS` can read the list. Its last line is a comment with the checksum of the lines above.

use super::folder::Folder;
use super::leftovers::{SUMS as FILE, SUMS_TITLE as TITLE};
use crate::error::{Error, Kind, Result};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, Read};
use std::path::Path;

/// The checksums of files in hexadecimal digits, by file name.
#[derive(Debug, Default)]
pub struct Checksums(BTreeMap<String, String>);

impl Checksums {
    /// Write the checksums of the named files of a folder. Names without a file are skipped.
    ///
    /// # Errors
    /// [`Kind::File`] when a file cannot be read, or the list cannot be written.
    pub fn save<'a>(folder: &Folder, names: impl Iterator<Item = &'a String>) -> Result<()> {
        let mut text = format!("{TITLE}\n");
        for name in names {
            let path = folder.path().join(name);
            // A missing file could not be written, which is reported elsewhere. A pipe would block its reader.
            if fs::symlink_metadata(&path).is_ok_and(|data| data.is_file()) {
                let sum = sum_of_file(&path).map_err(|cause| Error::file(&path, "read", &cause))?;
                text += &format!("{sum}  {name}\n");
            }
        }
        text += &format!("# {}\n", sum(text.as_bytes()));
        folder.write(FILE, |out| out.write_all(text.as_bytes()))
    }

    /// Remove the list, before the files that it names change.
    pub fn withdraw(folder: &Path) {
        // A missing list needs no removal. A list that cannot be removed makes its files look damaged, never good.
        let _ = fs::remove_file(folder.join(FILE));
    }

    /// Parse a list of checksums; `path` names the list in the error.
    ///
    /// # Errors
    /// [`Kind::File`] when the list itself is damaged.
    pub fn parse(path: &Path, bytes: &[u8]) -> Result<Self> {
        let text = std::str::from_utf8(bytes).ok().and_then(|text| text.strip_suffix('\n'));
        let intact = text.and_then(|text| text.rsplit_once('\n')).filter(|(above, last)| {
            last.strip_prefix("# ").is_some_and(|digits| digits == sum(format!("{above}\n").as_bytes()))
        });
        let Some((lines, _)) = intact else { return Err(damaged(path)) };
        let lines = lines.lines().filter(|line| !line.starts_with('#'));
        Ok(Self(lines.filter_map(|line| line.split_once("  ")).map(|(sum, name)| (name.into(), sum.into())).collect()))
    }

    /// Check the bytes of a file against its checksum. A file without a checksum passes.
    ///
    /// # Errors
    /// [`Kind::File`] when the bytes are not those that the run wrote.
    pub fn check(&self, folder: &Path, name: &str, bytes: &[u8]) -> Result<()> {
        match self.0.get(name) {
            Some(expected) if *expected != sum(bytes) => Err(damaged(&folder.join(name))),
            _ => Ok(()),
        }
    }
}

/// Return the error for a file that is not what the run wrote.
fn damaged(path: &Path) -> Error {
    Error::new(Kind::File, format!("{} is damaged", path.display()))
        .because(format!("it is not what the run wrote, by the sums in {FILE}"))
        .help("solve the scene again, with --vtu for pictures of bodies; `sha256sum -c` lists all files that have changed")
}

/// Return a finished checksum in hexadecimal digits.
fn digits(sum: Sha256) -> String {
    sum.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Return the checksum of bytes in memory.
fn sum(bytes: &[u8]) -> String {
    digits(Sha256::new().chain_update(bytes))
}

/// Return the checksum of a file, which is read in blocks.
fn sum_of_file(path: &Path) -> io::Result<String> {
    let (mut file, mut sum, mut block) = (File::open(path)?, Sha256::new(), vec![0; 1 << 16]);
    loop {
        match file.read(&mut block)? {
            0 => return Ok(digits(sum)),
            length => sum.update(&block[..length]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_change_is_seen() {
        let base = tempfile::tempdir().unwrap();
        let folder = Folder::create(base.path()).unwrap();
        folder.write("a.csv", |out| out.write_all(b"abc")).unwrap();
        Checksums::save(&folder, ["a.csv".to_owned(), "none.csv".to_owned()].iter()).unwrap();
        let path = base.path().join(FILE);
        let bytes = fs::read(&path).unwrap();
        let sums = Checksums::parse(&path, &bytes).unwrap();
        // FIPS 180-2, B.1
        assert_eq!(sums.0["a.csv"], "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
        sums.check(base.path(), "a.csv", b"abc").unwrap();
        sums.check(base.path(), "b.csv", b"what was not written by the run").unwrap();
        let error = sums.check(base.path(), "a.csv", b"abd").unwrap_err();
        assert!(error.message().ends_with("a.csv is damaged"), "{error}");
        for place in 0..bytes.len() {
            let mut other = bytes.clone();
            other[place] ^= 1;
            assert!(Checksums::parse(&path, &other).is_err(), "byte {place}");
            assert!(Checksums::parse(&path, &bytes[..place]).is_err(), "cut at {place}");
        }
    }
}
