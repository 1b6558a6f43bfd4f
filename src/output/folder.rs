//! The folder of results. One run at a time writes to it, no file is left half written, and a run removes and replaces
//! only files that this program has made, which it knows by what stands in them.

use crate::error::{Error, Kind, Result};
use serde::Deserialize;
use std::cell::RefCell;
use std::collections::BTreeSet;
use std::fs::{self, File, Permissions, TryLockError};
use std::io::{self, BufWriter, Read, Seek, SeekFrom, Write};
use std::os::unix::fs::PermissionsExt;
use std::path::{Component, Path, PathBuf};

/// A folder for the results of one run.
#[derive(Debug)]
pub struct Folder {
    path: PathBuf,
    /// Names of the files written so far.
    files: RefCell<BTreeSet<String>>,
    /// The open folder, locked for the process that writes the tables of a run.
    _lock: Option<Lock>,
}

/// What is read of the report of an earlier run.
#[derive(Default, Deserialize)]
struct EarlierReport {
    files: Vec<String>,
}

/// The name of the report in the folder.
pub const REPORT: &str = "report.json";

/// The folder of the fields of load steps in that of the results.
pub const STEPS: &str = "steps";

/// What stands at the beginning or the end of most files of this program.
pub const MARK: &str = "made by winkler";

/// A section of a `.msh` file, which all readers skip, with the mark.
pub const MARK_OF_MESH: &str = "$Comments\nmade by winkler\n$EndComments\n";

/// What stands at the beginning of the others: a checkpoint, a report, and columns of each kind of table.
const BEGINNINGS: [&str; 8] = [
    "winkler checkpoint ",
    "{\n  \"winkler\": \"",
    "iteration,residual,error,increment",
    ",status,iterations,residual",
    "surface_a,surface_b,points,closed",
    ",weight,gap,compression,pressure",
    ",weight,gap,slip,traction",
    ",status,message,method,dofs,points",
];

/// Return whether a file is one of this program. Links are none, wherever they lead.
pub fn is_made(path: &Path) -> bool {
    let ends = || {
        let mut file = File::open(path)?;
        let mut bytes = Vec::new();
        Read::by_ref(&mut file).take(2000).read_to_end(&mut bytes)?;
        file.seek(SeekFrom::Start(file.metadata()?.len().saturating_sub(100)))?;
        file.read_to_end(&mut bytes).map(|_| String::from_utf8_lossy(&bytes).into_owned())
    };
    let has_mark = |text: String| {
        let start = text.split_inclusive('\n').take(2).collect::<String>();
        text.contains(MARK) || BEGINNINGS.iter().any(|known| start.contains(known))
    };
    path.symlink_metadata().is_ok_and(|data| data.is_file()) && ends().is_ok_and(has_mark)
}

/// Refuse to replace what is no file of this program.
///
/// # Errors
/// A file, folder or link of another origin has this path.
pub fn refuse_foreign(path: &Path) -> Result<()> {
    if path.symlink_metadata().is_err() || is_made(path) {
        return Ok(());
    }
    Err(Error::new(Kind::File, format!("{} is there already, and winkler has not made it", path.display())).help(
        "rename or remove it, or name another file or folder with `-o`: only results of earlier runs are replaced",
    ))
}

/// A locked folder. A child of the process that has not begun its own program yet has the file, too, and closing it
/// would leave the lock to the child.
#[derive(Debug)]
struct Lock(File);

impl Drop for Lock {
    fn drop(&mut self) {
        // a lock that cannot be released ends with the process
        let _ = self.0.unlock();
    }
}

impl Folder {
    /// Open the folder, which is created with its parents if needed.
    ///
    /// # Errors
    /// A folder that cannot be made.
    pub fn create(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref().to_owned();
        make_folder(&path)?;
        Ok(Self { path, files: RefCell::default(), _lock: None })
    }

    /// Open the folder as [`Self::create`] does, and lock it for one run until this value is dropped.
    ///
    /// # Errors
    /// Those of [`Self::create`], and [`Kind::File`] while another process has the folder. A file system without locks
    /// has none.
    pub fn claim(path: impl AsRef<Path>) -> Result<Self> {
        let folder = Self::create(path)?;
        let file = File::open(&folder.path).map_err(|cause| failed(&folder.path, &cause))?;
        if let Err(TryLockError::WouldBlock) = file.try_lock() {
            let message = format!("another process is writing its results to {}", folder.path.display());
            return Err(Error::new(Kind::File, message)
                .help("name another folder with `-o FOLDER`, or wait until it has ended"));
        }
        Ok(Self { _lock: Some(Lock(file)), ..folder })
    }

    /// Remove the files of this program that the report of an earlier run lists, then the report, and nothing else.
    ///
    /// # Errors
    /// A file that cannot be removed.
    pub fn clear(&self) -> Result<()> {
        let listed = self.listed();
        for name in &listed {
            let path = self.path.join(name);
            // files below a link to another folder stay
            let is_inside = path.parent().is_some_and(|parent| parent == self.path || !parent.is_symlink());
            if is_inside && is_made(&path) {
                fs::remove_file(&path).map_err(|cause| Error::file(&path, "remove the old", &cause))?;
            }
        }
        if listed.iter().any(|name| name.starts_with(STEPS)) {
            // a folder that is not empty stays
            let _ = fs::remove_dir(self.path.join(STEPS));
        }
        Ok(())
    }

    /// Return the names of the files that the report of an earlier run lists, and last that of the report; none without
    /// a report of this program.
    fn listed(&self) -> Vec<String> {
        let path = self.path.join(REPORT);
        let text = fs::read(&path).ok().filter(|_| is_made(&path)).unwrap_or_default();
        let report: EarlierReport = serde_json::from_slice(&text).unwrap_or_default();
        let results = report.files.into_iter().filter(|name| may_be_result(name) && name != REPORT);
        let own = (!text.is_empty()).then(|| REPORT.to_owned());
        results.chain(own).collect()
    }

    /// Check that a run can write files of these names, and that none of its `inputs` is one of them or a result of the
    /// last run, which would be removed.
    ///
    /// # Errors
    /// A file of another origin has one of the names, [`STEPS`] is a link, or an input is a result.
    pub fn check(&self, names: &[String], inputs: &[PathBuf]) -> Result<()> {
        let (own, listed) = (self.path.canonicalize().unwrap_or_default(), self.listed());
        for input in inputs.iter().filter_map(|input| input.canonicalize().ok()) {
            let is_result = |name: &String| input.strip_prefix(&own).is_ok_and(|input| input == Path::new(name));
            if names.iter().chain(&listed).any(is_result) {
                let message = format!("{} is an input of this run, and has the name of a result", input.display());
                return Err(Error::new(Kind::File, message)
                    .help("name another folder with `-o FOLDER`: results would replace the input"));
            }
        }
        if names.iter().any(|name| name.starts_with(STEPS)) {
            refuse_link(&self.path.join(STEPS))?;
        }
        names.iter().try_for_each(|name| refuse_foreign(&self.path.join(name)))
    }

    /// Return the path of the folder, as it was given.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Return the names of the files written so far, sorted, each once.
    pub fn files(&self) -> Vec<String> {
        self.files.borrow().iter().cloned().collect()
    }

    /// Write a whole file `name` and replace one of this program.
    ///
    /// # Errors
    /// A file that cannot be written, or of another origin; the old one then stays.
    pub fn write(&self, name: &str, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<()> {
        write_whole(&self.path.join(name), fill)?;
        self.files.borrow_mut().insert(name.to_owned());
        Ok(())
    }

    /// Open a file `name` that grows while the program works, with [`MARK`] in it. It replaces one of this program.
    ///
    /// # Errors
    /// A file that cannot be written, or of another origin.
    pub fn open(&self, name: &str) -> Result<File> {
        let file = replace(&self.path.join(name), |out| writeln!(out, "{MARK}"))?;
        self.files.borrow_mut().insert(name.to_owned());
        Ok(file)
    }

    /// Create the folder [`STEPS`], unless it is there already.
    ///
    /// # Errors
    /// A link to another place, and a folder that cannot be made.
    pub fn make_steps(&self) -> Result<()> {
        let path = self.path.join(STEPS);
        refuse_link(&path)?;
        make_folder(&path)
    }
}

/// Refuse a link where a folder of results is to be.
///
/// # Errors
/// The path is a link.
pub fn refuse_link(path: &Path) -> Result<()> {
    if path.is_symlink() {
        return Err(Error::new(Kind::File, format!("{} is a link to another place", path.display()))
            .help("remove it: results stay in their folder"));
    }
    Ok(())
}

/// Return whether a run may have written a file of this name: in the folder itself or in [`STEPS`].
fn may_be_result(name: &str) -> bool {
    match Path::new(name).components().collect::<Vec<_>>()[..] {
        [Component::Normal(_)] => true,
        [Component::Normal(first), Component::Normal(_)] => first == STEPS,
        _ => false,
    }
}

/// Create a folder with its parents, unless it is there already.
///
/// # Errors
/// A folder that cannot be made.
pub fn make_folder(path: &Path) -> Result<()> {
    fs::create_dir_all(path).map_err(|cause| {
        Error::file(path, "create the folder", &cause).help("name a folder that you can write to (`-o FOLDER`)")
    })
}

/// Write a whole file or nothing: fill a temporary file beside `path` and rename it. Only a file of this program is
/// replaced.
///
/// # Errors
/// A file that cannot be written, and a path that something of another origin has.
pub fn write_whole(path: &Path, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<()> {
    replace(path, fill).map(|_| ())
}

/// Write a whole file as [`write_whole`] does, and return it, positioned at its end.
fn replace(path: &Path, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<File> {
    refuse_foreign(path)?;
    let folder = path.parent().filter(|folder| *folder != Path::new("")).unwrap_or(Path::new("."));
    let write = || {
        // a temporary file that cannot be finished is removed
        let part = tempfile::Builder::new()
            .prefix(".winkler-")
            .suffix(".part")
            .permissions(Permissions::from_mode(0o666))
            .tempfile_in(folder)?;
        let mut out = BufWriter::new(part);
        fill(&mut out)?;
        let part = out.into_inner().map_err(io::IntoInnerError::into_error)?;
        // network file systems and quotas may refuse the data only at this point
        part.as_file().sync_all()?;
        Ok(part.persist(path)?)
    };
    write().map_err(|cause: io::Error| failed(path, &cause))
}

/// Return the error for a file that could not be written.
pub(super) fn failed(path: &Path, cause: &io::Error) -> Error {
    let help = match cause.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
            "free some space, or name a folder on another disk with `-o FOLDER`"
        }
        io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => {
            "give yourself write permission, or name another folder with `-o FOLDER`"
        }
        _ => "name another folder with `-o FOLDER`",
    };
    Error::file(path, "write", cause).help(help)
}

/// Return `name` as a safe file name: characters other than letters, digits, `-`, `_` and `.` become `_`. An empty
/// name, or one that begins with a dot, gets a `_` in front.
pub fn safe_name(name: &str) -> String {
    let safe: String = name.chars().map(|c| if c.is_alphanumeric() || "-_.".contains(c) { c } else { '_' }).collect();
    if safe.is_empty() || safe.starts_with('.') { format!("_{safe}") } else { safe }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).unwrap();
        let mut names: Vec<_> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_failure_keeps_the_old_file_and_no_part() {
        let base = tempfile::tempdir().unwrap();
        let folder = Folder::create(base.path().join("a/b")).unwrap();
        folder.write("x.txt", |out| out.write_all(MARK.as_bytes())).unwrap();
        let full = |out: &mut dyn Write| {
            out.write_all(&[b'h'; 100_000])?;
            Err(io::ErrorKind::StorageFull.into())
        };
        let error = folder.write("x.txt", full).unwrap_err();
        assert!(error.message().contains("x.txt") && error.advice().unwrap().contains("space"), "{error}");
        assert_eq!(fs::read_to_string(folder.path().join("x.txt")).unwrap(), MARK);
        assert_eq!((names(folder.path()), folder.files()), (vec!["x.txt".to_owned()], vec!["x.txt".to_owned()]));
    }

    #[test]
    fn names_stay_in_the_folder() {
        assert_eq!(safe_name("upper bottom/../x"), "upper_bottom_.._x");
        assert_eq!([safe_name("..\\x"), safe_name(""), safe_name("größe-1")], ["_.._x", "_", "größe-1"]);
        let may = |name: &str| may_be_result(name);
        assert!(may("a.vtu") && may("steps/a-1.vtu"));
        assert!(!["../x.csv", "/etc/x.csv", "steps/../x.csv", "b/c.vtu", ""].into_iter().any(may));
    }

    #[test]
    fn what_the_last_report_lists_goes_and_nothing_else() {
        let base = tempfile::tempdir().unwrap();
        let (folder, path) = (Folder::claim(base.path()).unwrap(), |name: &str| base.path().join(name));
        assert!(Folder::claim(base.path()).is_err());
        folder.make_steps().unwrap();
        for name in ["a.vtu", "steps/a-1.vtu", "own.csv"] {
            folder.write(name, |out| writeln!(out, "<!-- {MARK} -->")).unwrap();
        }
        fs::write(path("thesis.tex"), "mine").unwrap();
        std::os::unix::fs::symlink(path("own.csv"), path("link.csv")).unwrap();
        let list = r#""files": ["a.vtu", "steps/a-1.vtu", "gone.csv", "thesis.tex", "link.csv"]"#;
        // the report of another program counts for nothing
        fs::write(path(REPORT), format!("{{{list}}}")).unwrap();
        folder.clear().unwrap();
        assert_eq!(names(base.path()), ["a.vtu", "link.csv", "own.csv", REPORT, "steps", "thesis.tex"]);
        let said = folder.check(&[REPORT.to_owned()], &[]).unwrap_err().to_string();
        assert!(said.contains("report.json is there already, and winkler has not made it"), "{said}");
        assert!(folder.write("link.csv", |_| Ok(())).is_err() && folder.check(&["own.csv".to_owned()], &[]).is_ok());
        let said = folder.check(&["own.csv".to_owned()], &[path("link.csv")]).unwrap_err().to_string();
        assert!(said.contains("own.csv is an input of this run"), "{said}");
        fs::write(path(REPORT), format!("{{\n  \"winkler\": \"0.1.0\",\n  {list}}}")).unwrap();
        folder.clear().unwrap();
        assert_eq!(names(base.path()), ["link.csv", "own.csv", "thesis.tex"]);
        drop(folder);
        assert!(Folder::claim(base.path()).is_ok());
    }
}
