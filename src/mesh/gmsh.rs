//! Calls of the program Gmsh, with a limit of time. Gmsh ends with this program.

use crate::error::{Error, Located, Result};
use crate::interrupt::{self, Interrupt};
use crate::problem::{Guard, Order};
use serde::Serialize;
use signal_hook::consts::SIGXFSZ;
use std::io::Read;
use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant, UNIX_EPOCH};

/// The installed Gmsh.
pub struct Gmsh {
    program: PathBuf,
}

/// The algorithm of Gmsh for tetrahedra, unless the script sets one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum Algorithm {
    /// The fastest one. It cannot mesh beside facets with four corners.
    Hxt,
    /// That of a Gmsh without settings.
    Default,
}

/// What Gmsh says if HXT has made no mesh, or if this Gmsh does not have it.
const NO_HXT: &str = "HXT 3D mesh failed";

/// A script for Gmsh to mesh, with the settings of the run.
pub struct MeshingTask<'a> {
    /// The script.
    pub script: &'a Path,
    /// The file that the user named.
    pub shown: &'a Path,
    /// Names and values of the numbers to set in the script.
    pub set: &'a [(Located<String>, f64)],
    /// Whether the script is already a mesh, which is only to be written in another form.
    pub is_mesh: bool,
    /// Dimension of the cells.
    pub dimension: usize,
    /// Order of the elements.
    pub order: Order,
    /// Algorithm for tetrahedra.
    pub algorithm: Algorithm,
    /// Limit of time and settings.
    pub guard: &'a Guard,
    /// Signals that may end the run.
    pub interrupt: &'a Interrupt,
}

/// The way in which Gmsh ended.
enum ProcessEnd {
    Itself(ExitStatus),
    /// It exceeded the limit of time.
    TimedOut,
    /// This signal requested the end.
    Asked(i32),
}

/// Bytes of Gmsh's errors that are read. It repeats some errors for ever, and ends when nobody reads them.
const MOST: u64 = 1 << 20;

/// Longest pause between two looks at Gmsh.
const PAUSE: Duration = Duration::from_millis(100);

impl Gmsh {
    /// Find `gmsh` in $PATH.
    pub fn find() -> Option<Gmsh> {
        find("gmsh").map(|program| Gmsh { program })
    }

    /// Find `gmsh` in $PATH for a script or file to mesh or convert.
    ///
    /// # Errors
    /// There is no Gmsh.
    pub fn found(path: &Path) -> Result<Gmsh> {
        let missing = || {
            Error::mesh(path, None, "the cache has no mesh of it, and there is no `gmsh` in $PATH to make one").help(
                "put Gmsh 4.8 or newer into $PATH (Debian: gmsh), or make the mesh where there is one: \
                 `winkler mesh SCENE` there keeps it in the cache, and WINKLER_CACHE names a folder that both see",
            )
        };
        Gmsh::find().ok_or_else(missing)
    }

    /// Return a text that distinguishes this Gmsh from others: its path, size and time of change. To ask for its
    /// version would take longer than to read a mesh from the cache.
    pub fn identity(&self) -> String {
        let data = std::fs::metadata(&self.program).ok();
        let time = data.as_ref().and_then(|data| data.modified().ok()?.duration_since(UNIX_EPOCH).ok());
        let size = data.map_or(0, |data| data.len());
        format!("{} {size} {}", self.program.display(), time.unwrap_or_default().as_nanos())
    }

    /// Return whether HXT makes the same mesh in every run, on one thread. Before version 4.12 it depends on addresses
    /// in memory ([issue 2255](https://gitlab.onelab.info/gmsh/gmsh/-/issues/2255)).
    pub fn has_steady_hxt(&self) -> bool {
        let said = Command::new(&self.program).arg("--version").stdin(Stdio::null()).output();
        // versions 4.8 to 4.15 say it in either stream
        said.is_ok_and(|said| is_steady(&String::from_utf8_lossy(&[said.stdout, said.stderr].concat())))
    }

    /// Mesh a script into the file `output`. A signal ends Gmsh and gives an error.
    ///
    /// `home` is an empty folder that Gmsh reads instead of the user's own Gmsh options, which would change meshes
    /// without a change of the key in the cache.
    ///
    /// # Errors
    /// Gmsh fails; its own messages are the causes. It exceeds its limit of time. A signal, or a limit on the size of
    /// files, ends it.
    pub fn run(&self, task: &MeshingTask, output: &Path, home: &Path) -> Result<()> {
        task.interrupt.hold();
        let cannot = |cause: &std::io::Error| Error::file(&self.program, "run", cause);
        let mut child = self.command(task, output, home)?.spawn().map_err(|cause| cannot(&cause))?;
        let errors = child.stderr.take();
        let reader = std::thread::spawn(move || {
            let mut said = Vec::new();
            // what cannot be read is only missing in a message
            let _ = errors.map(|errors| errors.take(MOST).read_to_end(&mut said));
            String::from_utf8_lossy(&said).into_owned()
        });
        let end = wait(&mut child, task).map_err(|cause| cannot(&cause))?;
        match end {
            ProcessEnd::TimedOut => {
                let message = format!("Gmsh has not finished this script after {} s", task.guard.seconds);
                return Err(Error::mesh(task.shown, None, message).help(
                    "a number in it may be far too large, or not a number; to wait longer set `timeout` in `mesh`",
                ));
            }
            ProcessEnd::Asked(signal) => return Err(interrupt::ended(signal)),
            ProcessEnd::Itself(status) if status.signal() == Some(SIGXFSZ) => {
                return Err(Error::file(output, "write", &std::io::ErrorKind::FileTooLarge.into())
                    .help("there is a limit on the size of files (ulimit -f)"));
            }
            ProcessEnd::Itself(status) => {
                let said = reader.join().unwrap_or_default();
                // the Gmsh of Python ends with success even so
                if !(status.success() && output.is_file()) || said.contains(NO_HXT) {
                    return Err(failure(task, status, &said));
                }
            }
        }
        task.interrupt.release()
    }

    /// Return the command that meshes a script. A tool of util-linux, where it is there, lets the system end Gmsh with
    /// this program.
    fn command(&self, task: &MeshingTask, output: &Path, home: &Path) -> Result<Command> {
        let mut command = match find("setpriv") {
            Some(tool) => {
                let mut command = Command::new(tool);
                command.args(["--pdeathsig", "KILL"]).arg(&self.program);
                command
            }
            None => Command::new(&self.program),
        };
        if task.is_mesh {
            command.arg("-save")
        } else {
            command.arg(format!("-{}", task.dimension)).args(["-order", &task.order.degree().to_string()])
        };
        command.args(["-format", "msh41", "-bin", "-v", "2"]);
        if task.algorithm == Algorithm::Hxt {
            // read before the script, which may choose another one
            command.args(["-algo", "hxt"]);
        }
        command.args(["-nt", &task.guard.threads.unwrap_or(1).to_string()]);
        for (name, value) in task.set {
            command.args(["-setnumber", &name.value, &value.to_string()]);
        }
        // An absolute path cannot be mistaken for an option.
        let script = std::path::absolute(task.script).map_err(|cause| Error::file(task.script, "find", &cause))?;
        command.arg("-o").arg(output).arg(script);
        command.env("GMSH_HOME", home).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
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

/// Wait until Gmsh ends, a signal arrives, or its time is over.
fn wait(child: &mut Child, task: &MeshingTask) -> std::io::Result<ProcessEnd> {
    let began = Instant::now();
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(ProcessEnd::Itself(status));
        }
        let elapsed = began.elapsed();
        let late = (elapsed.as_secs_f64() > task.guard.seconds).then_some(ProcessEnd::TimedOut);
        if let Some(end) = task.interrupt.asked().map(ProcessEnd::Asked).or(late) {
            child.kill()?;
            child.wait()?;
            return Ok(end);
        }
        // At most a twentieth of the time so far is lost.
        std::thread::sleep((elapsed / 20).clamp(Duration::from_millis(1), PAUSE));
    }
}

/// Return whether the HXT of a version is steady.
fn is_steady(version: &str) -> bool {
    let mut numbers = version.trim().split('.').map(|number| number.parse::<usize>().ok());
    numbers.next().flatten().zip(numbers.next().flatten()) >= Some((4, 12))
}

/// Return whether HXT is what has failed.
pub fn is_of_hxt(error: &Error) -> bool {
    error.causes().iter().any(|cause| cause.contains(NO_HXT))
}

/// Return the error of a Gmsh that ended by itself without a mesh. `said` has its errors.
fn failure(task: &MeshingTask, status: ExitStatus, said: &str) -> Error {
    let error = Error::mesh(
        task.shown,
        None,
        match (status.success(), task.is_mesh) {
            (true, false) => "Gmsh ran this script to its end but wrote no mesh".to_owned(),
            (true, true) => "Gmsh finds no mesh in this file".to_owned(),
            (false, false) => format!("Gmsh cannot mesh this script ({status})"),
            (false, true) => format!("Gmsh cannot read this mesh ({status})"),
        },
    );
    let way = if task.is_mesh { String::new() } else { format!("-{} ", task.dimension) };
    match &complaints(said)[..] {
        [] if task.is_mesh && status.signal().is_some() => {
            error.help("this Gmsh crashes on the file, as 4.8 does on groups of .unv: take a newer one, or convert the file to .msh by another program")
        }
        [] => error.help(format!("see what it says: gmsh {way}{}", task.shown.display())),
        causes => causes.iter().fold(error, Error::because),
    }
}

/// Return Gmsh's errors, each once, without its summary, which comes last and repeats earlier messages.
fn complaints(said: &str) -> Vec<String> {
    const MOST: usize = 8;
    let texts = said.lines().filter_map(|line| line.strip_prefix("Error")?.trim_start().strip_prefix(':'));
    let mut found: Vec<String> = Vec::new();
    for text in texts.map(str::trim).take_while(|text| !text.starts_with("----")) {
        if found.len() < MOST && !found.iter().any(|known| known == text) {
            found.push(text.to_owned());
        }
    }
    found
}

/// Return the path of a program in $PATH: a file that somebody may execute.
fn find(name: &str) -> Option<PathBuf> {
    let is_program = |path: &PathBuf| {
        std::fs::metadata(path).is_ok_and(|data| data.is_file() && data.permissions().mode() & 0o111 != 0)
    };
    let path = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&path).map(|folder| folder.join(name)).find(is_program)
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
    fn versions_are_compared_by_their_numbers() {
        let verdicts = ["4.8.4\n", "4.11.1", "4.12.0-git-abc", "4.15.2", "5.0", "", "no"].map(is_steady);
        assert_eq!(verdicts, [false, false, true, true, true, false, false]);
    }
}
