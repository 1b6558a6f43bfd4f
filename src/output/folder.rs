//! The folder of results. It is made before the work starts, and one run at a time writes to it, which a lock ensures. No file is left half
//! written. Files of earlier runs are removed before the first new one is written, so that old and new results are never mixed, and a list of
//! checksums (`SHA256SUMS`) shows which files were damaged later.

use crate::error::{Error, Kind, Result};
use crate::file::{digest_of_bytes as sum, digest_of_file, kind_of};
use serde_json::Value;
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, BufWriter, Read, Seek, Write};
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
use std::path::{Component, Path, PathBuf};

/// A folder for the results of one run.
#[derive(Debug)]
pub struct Folder {
    path: PathBuf,
    files: RefCell<BTreeSet<PathBuf>>,
    /// The lock of the process that writes the tables of a run.
    _lock: Option<Lock>,
}

impl Folder {
    /// Open the folder, which is created with its parents if needed, and check that it can be written.
    pub fn create(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref().to_owned();
        make_folder(&path)?;
        let probe = path.join(format!(".winkler-{}", std::process::id()));
        let owner = create_new(&probe).and_then(|file| file.metadata()).map(|data| data.uid());
        let _ = fs::remove_file(&probe);
        let owner = owner.map_err(|cause| {
            Error::file(&path, "write to the folder", &cause)
                .help("give yourself write permission, or name another folder with `-o FOLDER`")
        })?;
        refuse_foreign(&path, owner)?;
        Ok(Self { path, files: RefCell::default(), _lock: None })
    }

    /// Open the folder as [`Self::create`] does, and lock it for one run until this value is dropped. Temporary files of
    /// killed processes are removed.
    ///
    /// # Errors
    /// Those of [`Self::create`], and [`Kind::File`] while another process has the folder.
    pub fn claim(path: impl AsRef<Path>) -> Result<Self> {
        let folder = Self::create(path)?;
        let lock = Lock::take(&folder.path)?;
        remove_parts(&folder.path);
        remove_parts(&folder.path.join(STEPS));
        Ok(Self { _lock: Some(lock), ..folder })
    }

    /// Remove the files that an earlier run left, and nothing else.
    pub fn clear(&self) -> Result<()> {
        for name in files_of_runs(&self.path) {
            let path = self.path.join(&name);
            // Files below a link to another folder stay. A folder is never a result.
            let is_inside = path.parent().is_some_and(|parent| parent == self.path || !parent.is_symlink());
            if is_inside && fs::symlink_metadata(&path).is_ok_and(|data| !data.is_dir()) {
                fs::remove_file(&path).map_err(|cause| Error::file(&path, "remove the old", &cause))?;
            }
        }
        // A folder that is not empty stays.
        let _ = fs::remove_dir(self.path.join(STEPS));
        Ok(())
    }

    /// Return the path of the folder, as it was given.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Return the files written so far, sorted by name, each once. Paths begin with [`Folder::path`].
    pub fn files(&self) -> Vec<PathBuf> {
        self.files.borrow().iter().cloned().collect()
    }

    /// Write a whole file `name` and replace one of this name.
    ///
    /// The text goes to a temporary file in the same folder, which is renamed when it is complete.
    pub fn write(&self, name: &str, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<()> {
        let path = self.path.join(name);
        write_whole(&path, fill)?;
        self.files.borrow_mut().insert(path);
        Ok(())
    }

    /// Open a file `name` that begins with `start` and grows while the program works. It replaces one of this name.
    pub fn open(&self, name: &str, start: &[u8]) -> Result<(PathBuf, File)> {
        let path = self.path.join(name);
        let file = replace(&path, |out| out.write_all(start))?;
        self.files.borrow_mut().insert(path.clone());
        Ok((path, file))
    }

    /// Create a folder inside this one, unless it is there already.
    pub fn subfolder(&self, name: &str) -> Result<()> {
        let path = self.path.join(name);
        if path.is_symlink() {
            return Err(Error::new(Kind::File, format!("{} is a link to another place", path.display()))
                .help("remove it: results stay in their folder"));
        }
        make_folder(&path)
    }
}

/// Create a folder with its parents, unless it is there already.
pub fn make_folder(path: &Path) -> Result<()> {
    // the nearest existing ancestor must be a folder
    let in_the_way = path.ancestors().find(|part| part.symlink_metadata().is_ok()).filter(|part| !part.is_dir());
    if let Some(part) = in_the_way {
        let part_is = match (fs::read_link(part), fs::metadata(part)) {
            (Ok(target), Err(_)) => format!("a link to {}, which is not there", target.display()),
            (_, Ok(data)) => kind_of(data.file_type()).to_owned(),
            (Err(_), Err(_)) => "no folder".to_owned(),
        };
        return Err(Error::new(Kind::File, format!("cannot create the folder {}", path.display()))
            .because(format!("{} is {part_is}", part.display()))
            .help("remove it, or name another folder (`-o FOLDER`)"));
    }
    fs::create_dir_all(path).map_err(|cause| {
        Error::file(path, "create the folder", &cause).help("name a folder that you can write to (`-o FOLDER`)")
    })
}

/// Refuse to write into a folder of another user, as root could do by mistake. A folder that its owner lets a group or
/// everybody write to is accepted. `user` owns the files that this process creates there.
fn refuse_foreign(path: &Path, user: u32) -> Result<()> {
    const SHARED: u32 = 0o022;
    match fs::metadata(path) {
        Ok(data) if data.uid() != user && data.mode() & SHARED == 0 => {
            Err(Error::new(Kind::File, format!("the folder {} belongs to another user", path.display()))
                .because(format!("its owner has the number {}, you have {user}", data.uid()))
                .help("name a folder of your own with `-o FOLDER`, or let its owner share it: chmod g+w"))
        }
        _ => Ok(()),
    }
}

/// Create a new file, never through a link.
fn create_new(path: &Path) -> io::Result<File> {
    // a killed process with the same id may have left one
    let _ = fs::remove_file(path);
    OpenOptions::new().write(true).create_new(true).open(path)
}

/// Write a whole file or nothing: fill a temporary file beside `path` and rename it. A link of this name is replaced, not
/// followed.
pub fn write_whole(path: &Path, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<()> {
    replace(path, fill).map(|_| ())
}

/// Write a whole file as [`write_whole`] does, and return it, positioned at its end.
fn replace(path: &Path, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<File> {
    // A folder cannot be replaced, and a file would not serve the purpose of a pipe or a device.
    if let Some(kind) = fs::metadata(path).ok().map(|data| data.file_type()).filter(|kind| !kind.is_file()) {
        return Err(Error::new(Kind::File, format!("{} is {}, not a file", path.display(), kind_of(kind)))
            .help("rename or remove it, or name another file or folder with `-o`"));
    }
    let mut temporary = std::ffi::OsString::from(".");
    temporary.push(path.file_name().unwrap_or_default());
    temporary.push(format!(".{}.part", std::process::id()));
    let part = path.with_file_name(temporary);
    fill_and_rename(&part, path, fill).map_err(|cause| {
        // The first failure is reported; the temporary file may not even exist.
        let _ = fs::remove_file(&part);
        failed(path, &cause)
    })
}

/// Create the file `part`, fill it, rename it to `path`, and return it.
fn fill_and_rename(part: &Path, path: &Path, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<File> {
    let mut out = BufWriter::new(create_new(part)?);
    fill(&mut out)?;
    let file = out.into_inner().map_err(io::IntoInnerError::into_error)?;
    // Network file systems and quotas may refuse the data only at this point.
    file.sync_all()?;
    fs::rename(part, path)?;
    Ok(file)
}

/// Remove the temporary files of processes that were killed while they wrote. A file that cannot be removed is no error.
fn remove_parts(folder: &Path) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        let hidden = name.strip_prefix('.').unwrap_or_default();
        let process = hidden.strip_suffix(".part").and_then(|name| name.rsplit_once('.'));
        let process = process.map(|(_, id)| id).or(hidden.strip_prefix("winkler-"));
        let is_dead = |id: &str| id.parse::<u32>().is_ok() && !Path::new("/proc").join(id).exists();
        if process.is_some_and(is_dead) {
            let _ = fs::remove_file(entry.path());
        }
    }
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

/// Return `name` as a safe file name: characters other than letters, digits, `-`, `_` and `.` become `_`. An empty name, or
/// one that begins with a dot, gets a `_` in front.
pub fn safe_name(name: &str) -> String {
    let safe: String = name.chars().map(|c| if c.is_alphanumeric() || "-_.".contains(c) { c } else { '_' }).collect();
    if safe.is_empty() || safe.starts_with('.') { format!("_{safe}") } else { safe }
}

/// Name of the lock file in the folder.
const LOCK: &str = ".winkler.lock";

/// Most bytes of a holder's text: a process id and the longest name of a host.
const LONGEST: u64 = 300;

/// A folder that is locked until this value is dropped.
#[derive(Debug)]
pub struct Lock {
    path: PathBuf,
    /// The open file, whose closing releases the lock.
    _file: File,
}

#[derive(Debug, PartialEq, Eq)]
struct Holder {
    process: u32,
    host: String,
}

impl Lock {
    /// Lock a folder.
    ///
    /// # Errors
    /// [`Kind::File`] when another process writes there or may do so, or the lock file cannot be written.
    pub fn take(folder: &Path) -> Result<Self> {
        let path = folder.join(LOCK);
        let failed = |cause: io::Error| {
            Error::file(&path, "lock", &cause).help("remove this file, or name another folder with `-o FOLDER`")
        };
        loop {
            let mut file = open(&path).map_err(failed)?;
            let previous = Holder::read(&mut file);
            match file.try_lock() {
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => return Err(in_use(folder, previous.as_ref())),
                // without locks, a name counts unless its process has certainly ended
                Err(TryLockError::Error(_)) => match previous.filter(Holder::may_live) {
                    Some(holder) if holder != Holder::this() => return Err(may_be_in_use(folder, &path, &holder)),
                    _ => {}
                },
            }
            // The previous holder may have removed the file since it was opened. A lock on a removed file excludes nobody.
            let is_same = |found: fs::Metadata| file.metadata().is_ok_and(|own| own.ino() == found.ino());
            if fs::symlink_metadata(&path).is_ok_and(is_same) {
                Holder::this().write(&mut file).map_err(failed)?;
                return Ok(Self { path, _file: file });
            }
        }
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        // The lock is still held, so this cannot remove the file of another holder. A file that stays excludes nobody.
        let _ = fs::remove_file(&self.path);
    }
}

/// Open the lock file, never through a link. Opening for reading and writing does not block on a pipe.
fn open(path: &Path) -> io::Result<File> {
    let file = OpenOptions::new().read(true).write(true).create(true).custom_flags(libc::O_NOFOLLOW).open(path)?;
    match file.metadata()?.is_file() {
        true => Ok(file),
        false => Err(io::Error::other("it is no regular file")),
    }
}

/// Return the error for a folder that another process has locked.
fn in_use(folder: &Path, holder: Option<&Holder>) -> Error {
    let who = holder.map_or("another process".to_owned(), Holder::in_words);
    Error::new(Kind::File, format!("{who} is writing its results to {}", folder.display()))
        .help("name another folder with `-o FOLDER`, or wait until it has ended")
}

/// Return the error for a folder whose holder may still run.
fn may_be_in_use(folder: &Path, path: &Path, holder: &Holder) -> Error {
    Error::new(Kind::File, format!("{} may be writing its results to {}", holder.in_words(), folder.display()))
        .because("the file system has no locks that would tell whether it still runs")
        .help(format!("name another folder with `-o FOLDER`, or remove {} if it has ended", path.display()))
}

impl Holder {
    /// Return the holder that stands for this process.
    fn this() -> Self {
        let host = fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
        Self { process: std::process::id(), host: host.trim().to_owned() }
    }

    /// Read the holder that a lock file names, if any.
    fn read(file: &mut File) -> Option<Self> {
        let mut text = String::new();
        Read::take(file, LONGEST).read_to_string(&mut text).ok()?;
        let (process, host) = text.trim().split_once(' ')?;
        Some(Self { process: process.parse().ok()?, host: host.to_owned() })
    }

    /// Replace the text of a lock file by this holder.
    fn write(&self, file: &mut File) -> io::Result<()> {
        file.set_len(0)?;
        file.rewind()?;
        file.write_all(format!("{} {}\n", self.process, self.host).as_bytes())
    }

    /// Whether the process may still run; on another host this is unknown.
    fn may_live(&self) -> bool {
        self.host != Self::this().host || Path::new("/proc").join(self.process.to_string()).exists()
    }

    /// Return the holder in words, with its host if that is another one.
    fn in_words(&self) -> String {
        match self.host == Self::this().host {
            true => format!("process {}", self.process),
            false => format!("process {} on host {}", self.process, self.host),
        }
    }
}

/// Files with a fixed name. A file counts as a result if its first line contains one of these texts.
const TABLES: [(&str, &[&str]); 5] = [
    ("history.csv", &["iteration,residual,error,increment"]),
    ("steps.csv", &["step,time,"]),
    ("contacts.csv", &["a,b,surface_a,surface_b"]),
    ("sweep.csv", &[",status,iterations,sweeps,factorizations,"]),
    (SUMS, &[SUMS_TITLE]),
];

/// The list of the checksums of all files of a run.
pub const SUMS: &str = "SHA256SUMS";

/// First line of [`SUMS`].
const SUMS_TITLE: &str = "# the files of this run as it wrote them: sha256sum -c SHA256SUMS";

/// Page and pictures that belong to a report.
const WITH_REPORT: [&str; 3] = ["report.html", "convergence.svg", "force-approach.svg"];

const REPORT: &str = "report.json";

/// The collection of the fields of a run.
const COLLECTION: &str = "bodies.pvd";

/// Extensions of the files that reports and tables name.
const EXTENSIONS: [&str; 6] = ["csv", "svg", "vtu", "pvtu", "pvd", "msh"];

/// Folder of the fields of load steps.
pub const STEPS: &str = "steps";

/// Return the names of the files that `solve` or `sweep` left in a folder. Lists come after the files that they name, so that
/// the next removal can complete one that was cut short.
fn files_of_runs(folder: &Path) -> Vec<String> {
    let is_result = |(name, starts): &&(&str, &[&str])| {
        let text = text(folder, name);
        let first = text.lines().next().unwrap_or_default();
        starts.iter().any(|start| first.contains(start))
    };
    let tables: Vec<&str> = TABLES.iter().filter(is_result).map(|(name, _)| *name).collect();
    let report: Value = serde_json::from_str(&text(folder, REPORT)).unwrap_or_default();
    let is_report = report["status"].is_string() && report["files"].is_array();
    let mut lists = tables.clone();
    let mut named = Vec::new();
    // fields of load steps are written before the first report
    if is_report || tables.contains(&"history.csv") {
        named.extend(listed_in_collection(folder));
    }
    if !named.is_empty() {
        lists.push(COLLECTION);
    }
    if is_report {
        named.extend(report["files"].as_array().into_iter().flatten().filter_map(|f| f.as_str().map(str::to_owned)));
        lists.extend(WITH_REPORT);
        lists.push(REPORT);
    }
    if tables.contains(&"contacts.csv") {
        named.extend(listed_in_contacts(folder));
    }
    if tables.contains(&"sweep.csv") {
        named.extend(["convergence.svg", "pressure.svg"].map(str::to_owned));
        named.extend(numbered(folder, "pressure"));
    }
    named.retain(|name| may_be_result(name) && !lists.contains(&name.as_str()));
    named.sort();
    named.dedup();
    named.extend(lists.into_iter().map(str::to_owned));
    named
}

/// Whether a run may have written a file of this name: in the folder itself or in [`STEPS`], with the extension of a result.
fn may_be_result(name: &str) -> bool {
    let parts: Vec<Component> = Path::new(name).components().collect();
    let is_inside = match parts[..] {
        [Component::Normal(_)] => true,
        [Component::Normal(first), Component::Normal(_)] => first == STEPS,
        _ => false,
    };
    let extension = Path::new(name).extension().and_then(|extension| extension.to_str());
    is_inside && extension.is_some_and(|extension| EXTENSIONS.contains(&extension))
}

/// Return the text of a regular file, or an empty text if there is none.
fn text(folder: &Path, name: &str) -> String {
    let path = folder.join(name);
    let is_file = fs::symlink_metadata(&path).is_ok_and(|data| data.is_file());
    let bytes = if is_file { fs::read(&path).unwrap_or_default() } else { Vec::new() };
    String::from_utf8_lossy(&bytes).into_owned()
}

/// Return the names of the fields of all load steps from the collection.
fn listed_in_collection(folder: &Path) -> Vec<String> {
    let text = text(folder, COLLECTION);
    let lines = text.lines().filter(|line| line.contains(r#" group="" part=""#));
    let names = lines.flat_map(|line| line.split(" file=\"").skip(1)).filter_map(|rest| rest.split_once('"'));
    let mut names: Vec<String> = names.map(|(name, _)| name.to_owned()).collect();
    // a `.pvtu` file lists the parts that the ranks wrote
    for joined in names.clone().into_iter().filter(|name| name.ends_with(".pvtu") && may_be_result(name)) {
        let base = joined.rsplit_once('/').map_or(String::new(), |(base, _)| format!("{base}/"));
        let parts = self::text(folder, &joined);
        let parts = parts.split(" Source=\"").skip(1).filter_map(|rest| rest.split_once('"'));
        names.extend(parts.map(|(part, _)| format!("{base}{part}")));
    }
    names
}

/// Return the names of the tables and plots of pairs, which are written before the report.
fn listed_in_contacts(folder: &Path) -> Vec<String> {
    let text = text(folder, "contacts.csv");
    let mut table = csv::Reader::from_reader(text.as_bytes());
    let columns = table.headers().map(|header| ["table", "plot"].map(|name| header.iter().position(|h| h == name)));
    let columns: Vec<usize> = columns.into_iter().flatten().flatten().collect();
    let rows = table.records().map_while(Result::ok);
    let names = rows.flat_map(|row| columns.iter().filter_map(|&k| row.get(k).map(str::to_owned)).collect::<Vec<_>>());
    names.filter(|name| !name.is_empty()).collect()
}

/// Return the pictures `stem-2.svg`, `stem-3.svg` and so on, up to the first that is missing.
fn numbered(folder: &Path, stem: &str) -> Vec<String> {
    let names = (2..).map(|number| format!("{stem}-{number}.svg"));
    names.take_while(|name| folder.join(name).symlink_metadata().is_ok()).collect()
}

/// The checksums of files in hexadecimal digits, by file name.
#[derive(Debug, Default)]
pub struct Checksums(BTreeMap<String, String>);

impl Checksums {
    /// Write the checksums of the named files of a folder. Names without a file are skipped.
    pub fn save<'a>(folder: &Folder, names: impl Iterator<Item = &'a String>) -> Result<()> {
        let mut text = format!("{SUMS_TITLE}\n");
        for name in names {
            let path = folder.path().join(name);
            // A missing file could not be written, which is reported elsewhere. A pipe would block its reader.
            if fs::symlink_metadata(&path).is_ok_and(|data| data.is_file()) {
                let sum = digest_of_file(&path).map_err(|cause| Error::file(&path, "read", &cause))?;
                text += &format!("{sum}  {name}\n");
            }
        }
        text += &format!("# {}\n", sum(text.as_bytes()));
        folder.write(SUMS, |out| out.write_all(text.as_bytes()))
    }

    /// Remove the list, before the files that it names change.
    pub fn withdraw(folder: &Path) {
        // A missing list needs no removal. A list that cannot be removed makes its files look damaged, never good.
        let _ = fs::remove_file(folder.join(SUMS));
    }

    /// Parse a list of checksums; `path` names the list in the error.
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
        .because(format!("it is not what the run wrote, by the sums in {SUMS}"))
        .help("solve the scene again, with --vtu for pictures of bodies; `sha256sum -c` lists all files that have changed")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<_> =
            fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn makes_parents_and_lists_files_once() {
        let base = tempfile::tempdir().unwrap();
        let folder = Folder::create(base.path().join("a/b")).unwrap();
        assert!(names(folder.path()).is_empty());
        for text in ["first", "second"] {
            folder.write("x.txt", |out| write!(out, "{text}")).unwrap();
        }
        assert_eq!(fs::read_to_string(folder.path().join("x.txt")).unwrap(), "second");
        assert_eq!(folder.files(), [folder.path().join("x.txt")]);
        assert_eq!(names(folder.path()), ["x.txt"]);
    }

    #[test]
    fn a_failure_keeps_the_old_file_and_no_part() {
        let base = tempfile::tempdir().unwrap();
        let folder = Folder::create(base.path()).unwrap();
        folder.write("x.txt", |out| out.write_all(b"whole")).unwrap();
        let error = folder
            .write("x.txt", |out| {
                out.write_all(&[b'h'; 100_000])?;
                Err(io::ErrorKind::StorageFull.into())
            })
            .unwrap_err();
        assert_eq!(error.kind(), Kind::File);
        assert!(error.message().contains("x.txt"), "{error}");
        assert!(error.advice().unwrap().contains("space"), "{error}");
        assert_eq!(fs::read_to_string(folder.path().join("x.txt")).unwrap(), "whole");
        assert_eq!(names(folder.path()), ["x.txt"]);
    }

    #[test]
    fn names_stay_in_the_folder() {
        assert_eq!(safe_name("upper bottom/../x"), "upper_bottom_.._x");
        assert_eq!(safe_name("..\\x"), "_.._x");
        assert_eq!(safe_name(""), "_");
        assert_eq!(safe_name("größe-1"), "größe-1");
    }

    #[test]
    fn files_that_lists_name_are_ours_and_no_others() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
        fs::create_dir(folder.path().join(STEPS)).unwrap();
        write("bodies.pvd", r#"<DataSet timestep="0" group="" part="0" name="a" file="steps/a-1.pvtu"/>"#);
        write("steps/a-1.pvtu", r#"<Piece Source="a-1-r0.vtu"/>"#);
        write(
            "contacts.csv",
            "a,b,surface_a,surface_b,table,plot\n1,2,3,4,contact-a-b.csv,pressure-3.svg\n1,2,3,4,,\n",
        );
        write("history.csv", "step,iteration,residual,error,increment\n");
        // a file of a user
        write("steps.csv", "time,factor\n");
        let found = || files_of_runs(folder.path());
        let fields = ["contact-a-b.csv", "pressure-3.svg", "steps/a-1-r0.vtu", "steps/a-1.pvtu"];
        assert_eq!(found(), [&fields[..], &["history.csv", "contacts.csv", COLLECTION]].concat());
        let foreign = ["../x.csv", "/etc/x.csv", "steps/../x.csv", "scene.toml", "b/c.vtu"];
        let files = [&foreign[..], &["a.vtu"]].concat();
        write("report.json", &serde_json::json!({ "status": "converged", "files": files }).to_string());
        let all = found();
        assert!(
            all.contains(&"a.vtu".to_owned()) && foreign.iter().all(|name| !all.contains(&(*name).to_owned())),
            "{all:?}"
        );
        assert_eq!(all.last().unwrap(), REPORT);
        assert!(!all.contains(&"steps.csv".to_owned()));
    }
}
