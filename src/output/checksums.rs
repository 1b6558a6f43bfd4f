//! `SHA256SUMS`: what the files of a run were when it wrote them, so that a damaged one is not taken for its results.
//!
//! `sha256sum -c SHA256SUMS` reads it, too. Its last line is a comment with the sum of the lines above.

use super::folder::Folder;
use super::leftovers::{SUMS as FILE, SUMS_TITLE as TITLE};
use crate::error::{Error, Kind, Result};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, Read};
use std::path::Path;

/// Sums of files, in hexadecimal digits, by their names.
#[derive(Debug, Default)]
pub struct Checksums(BTreeMap<String, String>);

impl Checksums {
    /// Writes the sums of these files of a folder, of those that are there.
    ///
    /// # Errors
    /// [`Kind::File`] when one cannot be read, or the sums cannot be written.
    pub fn save<'a>(folder: &Folder, names: impl Iterator<Item = &'a String>) -> Result<()> {
        let mut text = format!("{TITLE}\n");
        for name in names {
            let path = folder.path().join(name);
            // what is no file could not be written, which is said elsewhere; a pipe would keep its reader waiting
            if fs::symlink_metadata(&path).is_ok_and(|data| data.is_file()) {
                let sum = sum_of_file(&path).map_err(|cause| Error::file(&path, "read", &cause))?;
                text += &format!("{sum}  {name}\n");
            }
        }
        text += &format!("# {}\n", sum(text.as_bytes()));
        folder.write(FILE, |out| out.write_all(text.as_bytes()))
    }

    /// Removes the file, before those that it tells of change.
    pub fn withdraw(folder: &Path) {
        // without one there is nothing to withdraw; one that stays makes its files look damaged, never good
        let _ = fs::remove_file(folder.join(FILE));
    }

    /// The sums of a file with these bytes.
    ///
    /// # Errors
    /// [`Kind::File`] when it is damaged itself.
    pub fn parse(path: &Path, bytes: &[u8]) -> Result<Self> {
        let text = std::str::from_utf8(bytes).ok().and_then(|text| text.strip_suffix('\n'));
        let whole = text.and_then(|text| text.rsplit_once('\n')).filter(|(above, last)| {
            last.strip_prefix("# ").is_some_and(|digits| digits == sum(format!("{above}\n").as_bytes()))
        });
        let Some((lines, _)) = whole else { return Err(damaged(path)) };
        let lines = lines.lines().filter(|line| !line.starts_with('#'));
        Ok(Self(lines.filter_map(|line| line.split_once("  ")).map(|(sum, name)| (name.into(), sum.into())).collect()))
    }

    /// Checks the bytes of a file, if its sum is known.
    ///
    /// # Errors
    /// [`Kind::File`] when they are not those that were written.
    pub fn check(&self, folder: &Path, name: &str, bytes: &[u8]) -> Result<()> {
        match self.0.get(name) {
            Some(known) if *known != sum(bytes) => Err(damaged(&folder.join(name))),
            _ => Ok(()),
        }
    }
}

fn damaged(path: &Path) -> Error {
    Error::new(Kind::File, format!("{} is damaged", path.display()))
        .because(format!("it is not what the run wrote, by the sums in {FILE}"))
        .help("solve the scene again, with --vtu for pictures of bodies; `sha256sum -c` lists all files that have changed")
}

fn digits(sum: Sha256) -> String {
    sum.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

fn sum(bytes: &[u8]) -> String {
    digits(Sha256::new().chain_update(bytes))
}

/// The sum of a file of any size.
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
