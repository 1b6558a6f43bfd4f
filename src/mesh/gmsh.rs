//! Calls the program Gmsh.

use crate::error::{Error, Kind, Result};
use crate::interrupt::{self, Interrupt};
use crate::problem::order::Order;
use signal_hook::consts::SIGXFSZ;
use std::fs::File;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, UNIX_EPOCH};

/// Time between looks at a Gmsh at work.
const LOOK: Duration = Duration::from_millis(5);

/// The installed Gmsh.
pub struct Gmsh {
    program: PathBuf,
}

impl Gmsh {
    /// Looks for `gmsh` in $PATH.
    ///
    /// # Errors
    /// It is not there.
    pub fn find() -> Result<Gmsh> {
        let path = std::env::var_os("PATH").unwrap_or_default();
        let program = std::env::split_paths(&path).map(|folder| folder.join("gmsh")).find(|program| program.is_file());
        program.map(|program| Gmsh { program }).ok_or_else(|| {
            Error::new(Kind::Mesh, "Gmsh is not installed: there is no `gmsh` in $PATH")
                .help("run scripts/setup, or `apt-get install gmsh`")
        })
    }

    /// What tells this Gmsh from others: its path, size and time of change. Asking for its version would take longer
    /// than to read a mesh from the cache.
    pub fn identity(&self) -> String {
        let data = std::fs::metadata(&self.program).ok();
        let time =
            data.as_ref().and_then(|data| data.modified().ok()).and_then(|time| time.duration_since(UNIX_EPOCH).ok());
        let size = data.map_or(0, |data| data.len());
        format!("{} {size} {}", self.program.display(), time.unwrap_or_default().as_nanos())
    }

    /// Meshes a script into the file `output`, with elements `times` as large as it asks for. `home` is an empty folder, read instead of the user's own Gmsh options:
    /// they would change meshes without changing the key in the cache.
    ///
    /// # Errors
    /// Gmsh fails; its own messages are the causes. A signal, or a limit on the size of files, ends it.
    pub fn run(
        &self,
        script: &Path,
        set: &[(String, f64)],
        times: f64,
        (dimension, order): (usize, Order),
        (output, home): (&Path, &Path),
        interrupt: &Interrupt,
    ) -> Result<()> {
        let mut command = Command::new(&self.program);
        command.arg(format!("-{dimension}"));
        command.args(["-order", if order == Order::P1 { "1" } else { "2" }, "-format", "msh41", "-bin", "-v", "2"]);
        if times != 1.0 {
            command.args(["-clscale", &times.to_string()]);
        }
        for (name, value) in set {
            command.args(["-setnumber", name, &value.to_string()]);
        }
        // An absolute path cannot be taken for an option.
        let script_path = std::path::absolute(script).map_err(|cause| Error::file(script, "find", &cause))?;
        command.arg("-o").arg(output).arg(script_path);
        command.env("GMSH_HOME", home).stdin(Stdio::null());
        // A Gmsh built with MPI must not think that it is one of our ranks.
        for (name, _) in std::env::vars_os() {
            let text = name.to_string_lossy();
            if ["OMPI_", "PMIX_", "PMI_", "PRTE_", "HYDI_", "MPIR_"].iter().any(|prefix| text.starts_with(prefix)) {
                command.env_remove(&name);
            }
        }
        // a file, unlike a pipe, takes all it says without anybody reading
        let said = home.join("said");
        let file = File::create(&said).map_err(|cause| Error::file(&said, "write", &cause))?;
        let both = file.try_clone().map_err(|cause| Error::file(&said, "write", &cause))?;
        command.stdout(file).stderr(both);
        let failed = |cause: std::io::Error| Error::file(&self.program, "run", &cause);
        let status = wait(command.spawn().map_err(failed)?, interrupt)?;
        if status.success() && output.is_file() {
            return Ok(());
        }
        if status.signal() == Some(SIGXFSZ) {
            return Err(Error::file(output, "write", &std::io::ErrorKind::FileTooLarge.into())
                .help("there is a limit on the size of files (ulimit -f)"));
        }
        let said = std::fs::read(&said).unwrap_or_default();
        let mut error = Error::mesh(script, None, format!("Gmsh cannot mesh this script ({status})"));
        let causes = complaints(&String::from_utf8_lossy(&said));
        for cause in &causes {
            error = error.because(cause);
        }
        let again = format!("gmsh -{dimension} {}", script.display());
        Err(if causes.is_empty() { error.help(format!("see what it says: {again}")) } else { error })
    }
}

/// Waits for a child, which a signal ends.
fn wait(mut child: Child, interrupt: &Interrupt) -> Result<ExitStatus> {
    let failed = |cause: std::io::Error| Error::new(Kind::Mesh, "Gmsh cannot be waited for").because(cause.to_string());
    loop {
        if let Some(status) = child.try_wait().map_err(failed)? {
            return Ok(status);
        }
        if let Some(signal) = interrupt.asked() {
            // one that has just ended needs no end
            let _ = child.kill();
            child.wait().map_err(failed)?;
            return Err(interrupt::ended(signal));
        }
        std::thread::sleep(LOOK);
    }
}

/// Gmsh's errors, each once, without its summary.
fn complaints(said: &str) -> Vec<String> {
    const MOST: usize = 8;
    let mut found: Vec<String> = Vec::new();
    for line in said.lines() {
        let Some(text) = line.strip_prefix("Error").and_then(|rest| rest.trim_start().strip_prefix(':')) else {
            continue;
        };
        let text = text.trim();
        if text.starts_with("----") {
            // The summary repeats what was said, and comes last.
            break;
        }
        if found.len() < MOST && !found.iter().any(|known| known == text) {
            found.push(text.to_owned());
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn complaints_are_errors_once_without_the_summary() {
        let said = "Warning : odd\nError   : 'a.geo', line 3: no\nError   : 'a.geo', line 3: no\nError   : -----\nError   : sum\n";
        assert_eq!(complaints(said), ["'a.geo', line 3: no"]);
    }
}
