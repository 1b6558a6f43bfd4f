//! Calls of the program Gmsh, with limits of time and memory. It ends with this program.

use crate::error::{Error, Result};
use crate::file::bytes_in_proc;
use crate::interrupt::{self, Interrupt};
use crate::problem::{Guard, Order};
use signal_hook::consts::SIGXFSZ;
use std::fs::File;
use std::io;
use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::time::{Duration, Instant, UNIX_EPOCH};

/// The installed Gmsh.
pub struct Gmsh {
    program: PathBuf,
}

/// A script for Gmsh to mesh, with the settings of the run.
pub struct MeshingTask<'a> {
    /// The script.
    pub script: &'a Path,
    /// The script that the user wrote.
    pub shown: &'a Path,
    /// Names and values of the numbers to set in the script.
    pub set: &'a [(String, f64)],
    /// Whether the script is already a mesh, which is only to be written in another form.
    pub is_mesh: bool,
    /// Dimension of the cells.
    pub dimension: usize,
    /// Order of the elements.
    pub order: Order,
    /// Limits of time and memory.
    pub guard: &'a Guard,
    /// Signals that may end the run.
    pub interrupt: &'a Interrupt,
}

impl Gmsh {
    /// Find `gmsh` in $PATH.
    pub fn find() -> Option<Gmsh> {
        find("gmsh").map(|program| Gmsh { program })
    }

    /// Return the error of a script or file that cannot be meshed or converted, because there is no Gmsh.
    pub fn missing(path: &Path) -> Error {
        Error::mesh(path, None, "the cache has no mesh of it, and there is no `gmsh` in $PATH to make one").help(
            "put Gmsh 4.8 or newer into $PATH (Debian: gmsh), or make the mesh where there is one: \
             `winkler mesh SCENE` there keeps it in the cache, and WINKLER_CACHE names a folder that both see",
        )
    }

    /// Return a text that distinguishes this Gmsh from others: its path, size and time of change. To ask for its version would
    /// take longer than to read a mesh from the cache.
    pub fn identity(&self) -> String {
        let data = std::fs::metadata(&self.program).ok();
        let time =
            data.as_ref().and_then(|data| data.modified().ok()).and_then(|time| time.duration_since(UNIX_EPOCH).ok());
        let size = data.map_or(0, |data| data.len());
        format!("{} {size} {}", self.program.display(), time.unwrap_or_default().as_nanos())
    }

    /// Mesh a script into the file `output`.
    ///
    /// `home` is an empty folder that Gmsh reads instead of the user's own Gmsh options, which would change meshes without a
    /// change of the key in the cache. The output of Gmsh goes to a file there.
    ///
    /// # Errors
    /// Gmsh fails; its own messages are the causes. It exceeds its limit of time or memory. A signal, or a limit on the size of
    /// files, ends it.
    pub fn run(&self, task: &MeshingTask, output: &Path, home: &Path) -> Result<()> {
        let bytes = bytes(task.guard);
        let said = home.join("said");
        let mut command = self.command(task, output, home, bytes)?;
        let file = |cause| Error::file(&said, "write", &cause);
        let out = File::create(&said).map_err(file)?;
        command.stderr(out.try_clone().map_err(file)?).stdout(out);
        let end = run(&mut command, task.guard.seconds, &said, task.interrupt)
            .map_err(|cause| Error::file(&self.program, "run", &cause))?;
        let refuse = |message: String| Error::mesh(task.shown, None, message);
        match end {
            ProcessEnd::TimedOut => {
                Err(refuse(format!("Gmsh has not finished this script after {} s", task.guard.seconds)).help(
                    "a number in it may be far too large, or not a number; to wait longer set `timeout` in `mesh`",
                ))
            }
            ProcessEnd::Talked => {
                let repeated = "Gmsh repeats its errors about this script without end".to_owned();
                let help = "end each file that it merges with a line break, without which Gmsh reads beyond the end";
                Err(because(refuse(repeated), &complaints(&words(&said))).help(help))
            }
            ProcessEnd::Asked(signal) => Err(interrupt::ended(signal)),
            ProcessEnd::Itself(status) if status.signal() == Some(SIGXFSZ) => {
                Err(Error::file(output, "write", &std::io::ErrorKind::FileTooLarge.into())
                    .help("there is a limit on the size of files (ulimit -f)"))
            }
            ProcessEnd::Itself(status) if status.success() && output.is_file() => Ok(()),
            ProcessEnd::Itself(status) => Err(failure(task, status, &words(&said), bytes)),
        }
    }

    /// Return the command that meshes a script with at most `bytes` of memory.
    fn command(&self, task: &MeshingTask, output: &Path, home: &Path, bytes: Option<u64>) -> Result<Command> {
        let mut command = command(&self.program, bytes);
        let order = if task.order == Order::P1 { "1" } else { "2" };
        match task.is_mesh {
            true => command.arg("-save"),
            false => command.arg(format!("-{}", task.dimension)).args(["-order", order]),
        };
        command.args(["-format", "msh41", "-bin", "-v", "2"]);
        if let Some(threads) = task.guard.threads {
            command.args(["-algo", "hxt", "-nt", &threads.to_string()]);
        }
        for (name, value) in task.set {
            command.args(["-setnumber", name, &value.to_string()]);
        }
        // An absolute path cannot be mistaken for an option.
        let script = std::path::absolute(task.script).map_err(|cause| Error::file(task.script, "find", &cause))?;
        command.arg("-o").arg(output).arg(script);
        command.env("GMSH_HOME", home).stdin(Stdio::null());
        // A Gmsh that is built with MPI must not take itself for one of our ranks.
        for (name, _) in std::env::vars_os() {
            let text = name.to_string_lossy();
            if ["OMPI_", "PMIX_", "PMI_", "PRTE_", "HYDI_", "MPIR_"].iter().any(|prefix| text.starts_with(prefix)) {
                command.env_remove(&name);
            }
        }
        Ok(command)
    }
}

/// Return the error of a Gmsh that ended by itself without a mesh. `said` is its output, and `bytes` the memory that it was
/// allowed.
fn failure(task: &MeshingTask, status: ExitStatus, said: &str, bytes: Option<u64>) -> Error {
    let refuse = |message: String| Error::mesh(task.shown, None, message);
    if is_out_of_memory(status, said) {
        let most = bytes.map_or(String::new(), |bytes| format!(" of {:.1} GB", bytes as f64 / 1e9));
        return refuse(format!("Gmsh needs more memory for this script than it may take{most}"))
            .help("ask for fewer elements; to give it more set `memory`, in GB, in `mesh`");
    }
    let error = refuse(match (status.success(), task.is_mesh) {
        (true, false) => "Gmsh ran this script to its end but wrote no mesh".to_owned(),
        (true, true) => "Gmsh finds no mesh in this file".to_owned(),
        (false, false) => format!("Gmsh cannot mesh this script ({status})"),
        (false, true) => format!("Gmsh cannot read this mesh ({status})"),
    });
    let again = match task.is_mesh {
        true => format!("gmsh {}", task.shown.display()),
        false => format!("gmsh -{} {}", task.dimension, task.shown.display()),
    };
    match &complaints(said)[..] {
        [] => error.help(format!("see what it says: {again}")),
        causes => because(error, causes),
    }
}

/// Return the output that a program wrote into a file.
fn words(said: &Path) -> String {
    String::from_utf8_lossy(&std::fs::read(said).unwrap_or_default()).into_owned()
}

fn because(error: Error, causes: &[String]) -> Error {
    causes.iter().fold(error, Error::because)
}

/// Return whether a program ended for lack of memory. The C++ library, the loader or the system may have ended it.
fn is_out_of_memory(status: ExitStatus, said: &str) -> bool {
    const WORDS: [&str; 4] = ["bad_alloc", "failed to map segment", "annot allocate memory", "ut of memory"];
    !status.success() && (status.signal() == Some(9) || WORDS.iter().any(|words| said.contains(words)))
}

/// Return Gmsh's errors, each once, without its summary.
fn complaints(said: &str) -> Vec<String> {
    const MOST: usize = 8;
    let mut found: Vec<String> = Vec::new();
    for line in said.lines() {
        let Some(text) = line.strip_prefix("Error").and_then(|rest| rest.trim_start().strip_prefix(':')) else {
            continue;
        };
        let text = text.trim();
        if text.starts_with("----") {
            // The summary comes last and repeats earlier messages.
            break;
        }
        if found.len() < MOST && !found.iter().any(|known| known == text) {
            found.push(text.to_owned());
        }
    }
    found
}

/// The way in which a guarded program ended.
pub enum ProcessEnd {
    /// It ended by itself.
    Itself(ExitStatus),
    /// It exceeded the limit of time.
    TimedOut,
    /// It wrote more output than anybody reads.
    Talked,
    /// This signal requested the end.
    Asked(i32),
}

/// Return the path of a program in $PATH.
pub fn find(name: &str) -> Option<PathBuf> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&path).map(|folder| folder.join(name)).find(|program| is_program(program))
}

/// Return whether a path is a file that somebody may execute.
fn is_program(path: &Path) -> bool {
    std::fs::metadata(path).is_ok_and(|data| data.is_file() && data.permissions().mode() & 0o111 != 0)
}

/// Return the bytes of memory that a guarded program may take: the user's limit, or else the memory that is available. Return
/// `None`, which is no limit, if the system does not tell.
pub fn bytes(guard: &Guard) -> Option<u64> {
    match guard.gigabytes {
        Some(gigabytes) => Some((gigabytes * 1e9) as u64),
        // This is what programs can take without swapping.
        None => bytes_in_proc("/proc/meminfo", "MemAvailable"),
    }
}

/// Return a command for a program that may take at most `bytes` of memory. The system ends the program with the thread that
/// starts it. Tools of util-linux do both, and a limit whose tool is missing is omitted.
pub fn command(program: &Path, bytes: Option<u64>) -> Command {
    let mut words: Vec<PathBuf> = Vec::new();
    if let (Some(tool), Some(bytes)) = (find("prlimit"), bytes) {
        words.extend([tool, format!("--as={bytes}").into()]);
    }
    if let Some(tool) = find("setpriv") {
        words.extend([tool, "--pdeathsig".into(), "KILL".into()]);
    }
    words.push(program.to_owned());
    let mut command = Command::new(&words[0]);
    command.args(&words[1..]);
    command
}

/// Longest pause between two checks of the program.
const PAUSE: Duration = Duration::from_millis(100);

/// Largest number of bytes of output, which is half a million lines. Gmsh repeats some errors for ever, with 25 MB of them in a
/// second.
const MOST_SAID: u64 = 1 << 25;

/// Run a command until it ends, a signal arrives, it exceeds `limit` seconds, or its output is too long. The output goes to the
/// file `said`.
///
/// # Errors
/// The program cannot be started.
pub fn run(command: &mut Command, limit: f64, said: &Path, interrupt: &Interrupt) -> io::Result<ProcessEnd> {
    let began = Instant::now();
    let mut child = command.spawn()?;
    let end = loop {
        if let Some(status) = child.try_wait()? {
            break ProcessEnd::Itself(status);
        }
        let elapsed = began.elapsed();
        let asked = interrupt.asked().map(ProcessEnd::Asked);
        let talked = || std::fs::metadata(said).is_ok_and(|data| data.len() > MOST_SAID).then_some(ProcessEnd::Talked);
        let late = || (elapsed.as_secs_f64() > limit).then_some(ProcessEnd::TimedOut);
        if let Some(end) = asked.or_else(talked).or_else(late) {
            child.kill()?;
            child.wait()?;
            break end;
        }
        // At most a twentieth of the time so far is lost.
        std::thread::sleep((elapsed / 20).clamp(Duration::from_millis(1), PAUSE));
    };
    Ok(end)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn complaints_are_errors_once_without_the_summary() {
        let said = "Warning : odd\nError   : 'a.geo', line 3: no\nError   : 'a.geo', line 3: no\nError   : -----\nError   : sum\n";
        assert_eq!(complaints(said), ["'a.geo', line 3: no"]);
    }

    #[test]
    fn programs_can_be_executed() {
        let file = tempfile::NamedTempFile::new().expect("a file");
        let set = |mode| std::fs::set_permissions(file.path(), std::fs::Permissions::from_mode(mode)).expect("a mode");
        set(0o644);
        assert!(!is_program(file.path()));
        set(0o755);
        assert!(is_program(file.path()) && !is_program(Path::new("/bin")));
    }

    #[test]
    fn what_never_stops_to_talk_is_ended() {
        let said = tempfile::NamedTempFile::new().expect("a file");
        let mut yes = command(Path::new("/usr/bin/yes"), None);
        yes.stdout(said.reopen().expect("a file"));
        assert!(matches!(run(&mut yes, 60.0, said.path(), &Interrupt::default()), Ok(ProcessEnd::Talked)));
    }
}
