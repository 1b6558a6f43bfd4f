//! Files of PETSc options: which of them PETSc is to read, and a check of them before it does.
//!
//! By itself PETSc reads `.petscrc` of the home folder, and `.petscrc` and `petscrc` of the current folder. Options can load libraries and
//! start programs, and the current folder may belong to anybody. So its files are skipped unless `-options_file` names them. The check is
//! needed because PETSc follows files that name each other until its stack overflows, and waits for ever at a pipe.

use super::library::NO_FILES;
use crate::error::{Error, Kind, Result};
use std::collections::BTreeSet;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

/// The files of options that PETSc looks for in the current folder by itself.
const OF_FOLDER: [&str; 2] = [".petscrc", "petscrc"];

/// The largest size of a file in bytes. PETSc's table has 512 options, so this is 2 kB for each.
const MOST_BYTES: u64 = 1 << 20;

/// The largest number of files that lead to each other. Each takes some 15 kB of PETSc's stack of 8 MB.
const MOST_FILES: usize = 100;

/// The files that PETSc is to read by itself, and those it is not.
#[derive(Debug, Default)]
pub(super) struct OptionFiles {
    /// The file of the home folder, if it exists and is to be read.
    pub home: Option<PathBuf>,
    /// The files of the current folder that are not read.
    pub left_out: Vec<String>,
}

impl OptionFiles {
    /// Check all files of options that PETSc reads with these `words` of the command line.
    ///
    /// # Errors
    /// When one is not a regular text file, is too large, or leads back to itself.
    pub fn check(words: &[String]) -> Result<Self> {
        let skips = skips_files(words);
        let home =
            std::env::var_os("HOME").filter(|home| !home.is_empty()).map(|home| Path::new(&home).join(".petscrc"));
        let home = home.filter(|path| !skips && path.is_file() && File::open(path).is_ok());
        let mut check = Check::default();
        if let Some(path) = &home {
            check.file(&path.to_string_lossy())?;
        }
        check.words(tokens(&std::env::var("PETSC_OPTIONS").unwrap_or_default()))?;
        check.words(words.iter().map(String::as_str))?;
        let is_left_out = |name: &str| {
            let path = Path::new(name);
            !skips && path.is_file() && path.canonicalize().is_ok_and(|path| !check.seen.contains(&path))
        };
        let left_out = OF_FOLDER.into_iter().filter(|name| is_left_out(name)).map(str::to_owned).collect();
        Ok(Self { home, left_out })
    }
}

/// Return whether the command line keeps PETSc from looking for files of options. The last occurrence of the switch counts.
fn skips_files(words: &[String]) -> bool {
    let Some(at) = words.iter().rposition(|word| word.eq_ignore_ascii_case(NO_FILES)) else { return false };
    let value = words.get(at + 1).map(|value| value.to_lowercase()).unwrap_or_default();
    !["0", "no", "off", "false"].contains(&value.as_str())
}

/// A check of files that lead to each other.
#[derive(Default)]
struct Check {
    /// The files from the first one to the current one, each named in the one before.
    chain: Vec<PathBuf>,
    /// All files so far.
    seen: BTreeSet<PathBuf>,
    /// The number of files read so far, repetitions included.
    count: usize,
}

impl Check {
    /// Check the files that options name.
    fn words<'a>(&mut self, words: impl IntoIterator<Item = &'a str>) -> Result<()> {
        let mut words = words.into_iter();
        while let Some(word) = words.next() {
            if ["-options_file", "-options_file_yaml"].iter().any(|name| word.eq_ignore_ascii_case(name)) {
                let name = words.next().filter(|name| !name.is_empty() && !name.starts_with('-'));
                let name = name.ok_or_else(|| wrong(format!("{word} names no file"), &self.chain))?;
                self.file(name)?;
            }
        }
        Ok(())
    }

    /// Check a file. A missing one is left to PETSc, which reports it.
    fn file(&mut self, name: &str) -> Result<()> {
        if name.contains("${") {
            return Err(wrong(format!("the name of the options file `{name}` is not written out"), &self.chain)
                .help("write the name of the file itself: winkler looks at it before PETSc does"));
        }
        // PETSc replaces them, too
        let name = name.replace('\\', "/");
        let path = Path::new(name.strip_suffix(":yaml").unwrap_or(&name));
        let Ok(place) = path.canonicalize() else { return Ok(()) };
        if self.chain.contains(&place) {
            return Err(wrong(format!("the options file {} leads back to itself", path.display()), &self.chain)
                .help("take -options_file out of one of these files"));
        }
        self.count += 1;
        if self.count > MOST_FILES {
            return Err(wrong(format!("more than {MOST_FILES} options files lead to each other"), &self.chain)
                .help("write the options into one file"));
        }
        let text = text(path)?;
        self.seen.insert(place.clone());
        self.chain.push(place);
        let is_yaml = name != path.to_string_lossy()
            || [".yaml", ".yml", ".json"].iter().any(|end| name.ends_with(end))
            || ["%YAML ", "---"].iter().any(|start| text.starts_with(start));
        if !is_yaml {
            // PETSc joins the lines of the file into one string
            let lines: String = text.lines().map(joined).collect();
            self.words(tokens(&lines))?;
        }
        self.chain.pop();
        Ok(())
    }
}

/// Return an error about an option of the command line, or of the last file of `chain`.
fn wrong(message: String, chain: &[PathBuf]) -> Error {
    chain
        .iter()
        .rev()
        .fold(Error::new(Kind::Solver, message), |error, file| error.because(format!("named in {}", file.display())))
}

/// Return the text of a file of options.
fn text(path: &Path) -> Result<String> {
    let failed = |cause| Error::file(path, "read", &cause);
    // opening a pipe would wait for its other end
    let kind = path.metadata().map_err(failed)?;
    if !kind.is_file() {
        let odd = if kind.is_dir() { "a folder" } else { "a pipe or a device" };
        return Err(Error::new(Kind::File, format!("{} is {odd}, not a file", path.display()))
            .help("name a regular file; what a pipe gives can be saved as one"));
    }
    let (file, mut bytes) = (File::open(path).map_err(failed)?, Vec::new());
    file.take(MOST_BYTES + 1).read_to_end(&mut bytes).map_err(failed)?;
    let is_text = |byte: &u8| !byte.is_ascii_control() || b"\t\n\r\x0c".contains(byte);
    let wrong = match () {
        _ if bytes.len() as u64 > MOST_BYTES => format!("has more than {} kB", MOST_BYTES >> 10),
        _ if !bytes.iter().all(is_text) => "is no text".to_owned(),
        _ => return Ok(String::from_utf8_lossy(&bytes).into_owned()),
    };
    Err(Error::new(Kind::File, format!("the options file {} {wrong}", path.display()))
        .help("-options_file names a text file with one PETSc option a line"))
}

/// Return the option of a line as PETSc joins it with those of other lines.
fn joined(line: &str) -> String {
    let line = line.split('#').next().unwrap_or_default().replace(['\t', '\r'], " ");
    let words: Vec<&str> = tokens(line.trim_start_matches(' ')).collect();
    match words[..] {
        [] => String::new(),
        [name] => format!("{name} "),
        [name, value, ..] => format!("{name} \"{value}\" "),
    }
}

/// Return the words of a string as PETSc finds them: between blanks, or from a double quote to the next one.
fn tokens(text: &str) -> impl Iterator<Item = &str> {
    let mut rest = text;
    std::iter::from_fn(move || {
        if rest.is_empty() {
            return None;
        }
        let (from, end) = rest.strip_prefix('"').map_or((rest, ' '), |quoted| (quoted, '"'));
        let (word, after) = from.split_once(end).unwrap_or((from, ""));
        rest = after.trim_start_matches(' ');
        Some(word)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    fn checked(text: &str) -> Result<()> {
        Check::default().words(tokens(text))
    }

    #[test]
    fn words_are_those_of_petsc() {
        let of = |text| tokens(text).collect::<Vec<_>>();
        assert_eq!(of("-a  1 \"b c\"  -d"), ["-a", "1", "b c", "-d"]);
        assert_eq!(of("\"open end"), ["open end"]);
        let lines = ["  -a\t1 # b", "# all", "", "-c", "\"-options_file x\""];
        assert_eq!(lines.map(joined).concat(), "-a \"1\" -c -options_file x ");
    }

    #[test]
    fn chains_and_names_that_are_not_written_out_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name).display().to_string();
        let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
        write("good", &format!("-ksp_type cg # -options_file {}\n", path("self")));
        write("twice", &format!("-options_file {0}\n-options_file {0}\n", path("good")));
        write("open", "-options_file\n");
        write("hidden", "-options_file ${HOME}/x\n");
        write("ring.yaml", &format!("options_file: {}\n", path("ring.yaml")));
        for name in ["good", "twice", "missing", "ring.yaml"] {
            assert!(checked(&format!("-options_file {}", path(name))).is_ok(), "{name}");
        }
        for (name, words) in [("open", "names no file"), ("hidden", "not written out")] {
            let error = checked(&format!("-ksp_rtol 1 -options_file {}", path(name))).unwrap_err();
            assert!(error.message().contains(words), "{name}: {}", error.message());
        }
        assert!(checked("-options_file").is_err() && checked("-options_file -ksp_view").is_err());
        for k in 0..200 {
            write(&format!("chain{k}"), &format!("-options_file {}\n", path(&format!("chain{}", k + 1))));
        }
        assert!(checked(&format!("-options_file {}", path("chain150"))).is_ok());
        assert!(checked(&format!("-options_file {}", path("chain0"))).is_err());
    }

    #[test]
    fn the_last_switch_counts() {
        let of = |text: &str| skips_files(&text.split(' ').map(str::to_owned).collect::<Vec<_>>());
        assert!(of("-skip_petscrc") && of("-a -Skip_PetscRC 1") && of("-skip_petscrc no -skip_petscrc -x"));
        assert!(!of("-a") && !of("-skip_petscrc -skip_petscrc False"));
    }
}
