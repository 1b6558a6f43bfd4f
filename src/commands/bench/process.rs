//! One run as a process of its own: its words, its time, its memory.

use super::plan::Case;
use super::request::{Request, usage};
use crate::error::{Error, Kind, Result};
use crate::file::digest;
use crate::interrupt::{self, Interrupt};
use crate::output::safe_name;
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use serde_json::Value;
use std::fs::{self, File};
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::{Duration, Instant};
use wait4::{ResUse, Wait4};

/// What came of one run.
pub(super) struct Run {
    /// Status of the report, or `refused`, `timeout`, `killed`, `failed`.
    pub status: String,
    /// The status in words.
    pub message: String,
    /// Wall seconds from start to end of the process.
    pub seconds: f64,
    /// CPU seconds, user and system, of all its ranks.
    pub cpu: f64,
    /// Largest resident memory of one of its processes, in bytes.
    pub memory: u64,
    /// `report.json`; null if there is none.
    pub report: Value,
    /// Inner iterations of its last sweep; `None` without a history of two rows.
    pub last_sweep: Option<f64>,
}

/// Starts runs.
pub(super) struct Runner {
    program: PathBuf,
    folder: PathBuf,
    timeout: Duration,
    repeat: usize,
    interrupt: Interrupt,
}

/// Seconds that a process gets to end itself.
const GRACE: Duration = Duration::from_secs(5);

/// Time between looks for a signal.
const LOOK: Duration = Duration::from_millis(100);

/// Folder of the results of all runs.
pub(super) const RUNS: &str = "runs";

/// Longest name of a folder of a run.
const NAME: usize = 120;

impl Runner {
    /// A runner of this very program, for runs below `folder`.
    ///
    /// # Errors
    /// A time limit that is no time, a system that does not tell where the program lies.
    pub fn new(interrupt: &Interrupt, request: &Request, folder: &Path) -> Result<Self> {
        let timeout = Duration::try_from_secs_f64(request.timeout)
            .ok()
            .filter(|timeout| !timeout.is_zero())
            .ok_or_else(|| usage(format!("`--timeout {}` is no time in seconds", request.timeout)))?;
        let program =
            std::env::current_exe().map_err(|cause| Error::file(Path::new("this program"), "find", &cause))?;
        let (folder, interrupt) = (folder.join(RUNS), interrupt.clone());
        Ok(Self { program, folder, timeout, repeat: request.repeat, interrupt })
    }

    /// Folder of a run's results.
    pub fn folder(&self, case: &Case) -> PathBuf {
        folder_of(&self.folder, &case.key)
    }

    /// Makes the mesh of a run. Whatever goes wrong, the run itself will say it.
    ///
    /// # Errors
    /// A file system that refuses.
    pub fn mesh(&self, case: &Case) -> Result<()> {
        let mut command = Command::new(&self.program);
        command.arg("mesh").arg(&case.scene);
        command.args(case.mesh_overrides.iter().flat_map(|text| ["--set", text]));
        self.finish(command, &self.folder(case)).map(|_| ())
    }

    /// Runs a case as often as asked for, or until it fails.
    ///
    /// # Errors
    /// A file system that refuses.
    pub fn repeat(&self, case: &Case) -> Result<Vec<Run>> {
        let mut runs = Vec::new();
        for _ in 0..self.repeat {
            let run = self.run(case)?;
            let has_report = !run.report.is_null();
            runs.push(run);
            if !has_report {
                break;
            }
        }
        Ok(runs)
    }

    fn run(&self, case: &Case) -> Result<Run> {
        let folder = self.folder(case);
        let mut command = match case.ranks {
            1 => Command::new(&self.program),
            ranks => {
                let mut command = Command::new("mpiexec");
                let cores = std::thread::available_parallelism().map_or(1, |cores| cores.get());
                command.args((ranks > cores).then_some("--oversubscribe"));
                command.args(["-n", &ranks.to_string()]).arg(&self.program);
                command
            }
        };
        command.arg("solve").arg(&case.scene).arg("-o").arg(&folder);
        command.args(case.overrides.iter().flat_map(|text| ["--set", text])).args(&case.words);
        // one thread a rank unless the user says something else: otherwise solvers compare by their threads
        for name in ["OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"] {
            if std::env::var_os(name).is_none() {
                command.env(name, "1");
            }
        }
        // what an earlier run left must not be taken for this one's; there may be nothing
        let _ = fs::remove_dir_all(&folder);
        let ended = self.finish(command, &folder)?;
        let report = fs::read(folder.join("report.json")).ok();
        let report: Value = report.and_then(|bytes| serde_json::from_slice(&bytes).ok()).unwrap_or_default();
        let (status, message) = match (ended.used.as_ref(), report["status"].as_str()) {
            (None, _) => ("failed".to_owned(), ended.said),
            _ if ended.late => ("timeout".to_owned(), format!("not ended after {:?}", self.timeout)),
            (_, Some(status)) => (status.to_owned(), report["message"].as_str().unwrap_or_default().to_owned()),
            (Some(used), None) => (kind(used.status).to_owned(), words(&ended.said, used.status)),
        };
        Ok(Run {
            status,
            message,
            seconds: ended.seconds,
            cpu: ended.used.as_ref().map_or(f64::NAN, |used| (used.rusage.utime + used.rusage.stime).as_secs_f64()),
            memory: ended.used.map_or(0, |used| used.rusage.maxrss),
            report: if ended.late { Value::Null } else { report },
            last_sweep: last_sweep(&folder.join("history.csv")),
        })
    }

    /// Waits for a process, which is ended when its time is over; its output goes to `output.txt` in the folder.
    fn finish(&self, mut command: Command, folder: &Path) -> Result<Ended> {
        fs::create_dir_all(folder).map_err(|cause| Error::file(folder, "create the folder", &cause))?;
        let path = folder.join("output.txt");
        let failed = |cause: &std::io::Error| Error::file(&path, "write", cause);
        // what has this name is replaced: a pipe would keep its writer waiting
        let _ = fs::remove_file(&path);
        let file = File::create_new(&path).map_err(|cause| failed(&cause))?;
        let both = file.try_clone().map_err(|cause| failed(&cause))?;
        command.stdin(Stdio::null()).stdout(file).stderr(both);
        let began = Instant::now();
        let mut child = match command.spawn() {
            Ok(child) => child,
            Err(cause) => {
                let said = format!("cannot start {}: {cause}", command.get_program().display());
                return Ok(Ended { used: None, late: false, seconds: f64::NAN, said });
            }
        };
        let id = Pid::from_raw(child.id() as i32);
        let (send, receive) = mpsc::channel();
        // a process that ended is told at once, without asking again and again
        std::thread::spawn(move || send.send(child.wait4()));
        let mut answer = receive.recv_timeout(LOOK.min(self.timeout));
        while matches!(answer, Err(RecvTimeoutError::Timeout))
            && began.elapsed() < self.timeout
            && self.interrupt.asked().is_none()
        {
            answer = receive.recv_timeout(LOOK.min(self.timeout.saturating_sub(began.elapsed())));
        }
        let is_late = |answer: &Answer| matches!(answer, Err(RecvTimeoutError::Timeout));
        let late = is_late(&answer);
        for signal in [Signal::SIGTERM, Signal::SIGKILL] {
            if is_late(&answer) {
                // a process that is gone needs no signal
                let _ = kill(id, signal);
                answer = receive.recv_timeout(GRACE);
            }
        }
        if let Some(signal) = self.interrupt.asked() {
            let message = format!("ended by {}: the rows so far are kept", interrupt::name(signal));
            return Err(Error::new(Kind::Stopped(signal), message).help("`--resume` makes those that are missing"));
        }
        let seconds = began.elapsed().as_secs_f64();
        let said = String::from_utf8_lossy(&fs::read(&path).unwrap_or_default()).into_owned();
        Ok(Ended { used: answer.ok().and_then(|used| used.ok()), late, seconds, said })
    }
}

/// Inner iterations between the last two rows of a history.
fn last_sweep(history: &Path) -> Option<f64> {
    let mut reader = csv::Reader::from_path(history).ok()?;
    let column = reader.headers().ok()?.iter().position(|name| name == "inner_iterations")?;
    let counts = reader.records().map(|row| row.ok()?.get(column)?.parse().ok()).collect::<Option<Vec<f64>>>()?;
    let [.., before, last] = counts[..] else { return None };
    Some(last - before)
}

/// What the waiting thread tells.
type Answer = Result<std::io::Result<ResUse>, RecvTimeoutError>;

/// Folder of the results of a run with some key, below that of all runs.
pub(super) fn folder_of(runs: &Path, key: &[String]) -> PathBuf {
    let name = safe_name(&key.join("_").replace(' ', "_"));
    if name.len() <= NAME {
        return runs.join(name);
    }
    let start: String = name.chars().take(NAME / 2).collect();
    runs.join(format!("{start}-{:.12}", digest(&name)))
}

/// How a process ended.
struct Ended {
    /// What it used; `None` if it could not be started or waited for.
    used: Option<ResUse>,
    /// Whether its time was over.
    late: bool,
    seconds: f64,
    said: String,
}

fn kind(status: ExitStatus) -> &'static str {
    match (status.code(), status.signal()) {
        (_, Some(_)) => "killed",
        (Some(2..=6), _) => "refused",
        _ => "failed",
    }
}

/// What a process that ended without a report said: its errors with their advice.
fn words(said: &str, status: ExitStatus) -> String {
    let mut found: Vec<&str> = Vec::new();
    for line in said.lines() {
        let text = line.trim_start_matches([' ', '|', '=']).trim();
        let is_error = line.starts_with("error");
        if is_error || (!found.is_empty() && (text.starts_with("help:") || text.starts_with("note:"))) {
            found.push(text);
        }
    }
    let mut lines = said.lines().map(str::trim).filter(|line| line.contains(char::is_alphabetic));
    // mpiexec begins what it says with a rule, and comes to the point at once
    let line = if said.trim_start().starts_with("---") { lines.next() } else { lines.next_back() };
    match (found.is_empty(), line) {
        (false, _) => found.join("; "),
        (true, Some(line)) => format!("{status}: {line}"),
        (true, None) => status.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn refusals_are_told_in_their_words() {
        let said = "-----\nmpiexec has detected an attempt to run as root.\n\nmore\n-----\n";
        assert!(
            words(said, ExitStatus::from_raw(1 << 8)).ends_with("1: mpiexec has detected an attempt to run as root.")
        );
        assert!(words("one\n  two\n---\n", ExitStatus::from_raw(1 << 8)).ends_with("1: two"));
        let said = "Title\nerror: PETSc knows no option -ksp_tpye\n |\n = help: did you mean -ksp_type?\n";
        let status = ExitStatus::from_raw(5 << 8);
        assert_eq!(words(said, status), "error: PETSc knows no option -ksp_tpye; help: did you mean -ksp_type?");
        assert_eq!(kind(status), "refused");
        assert_eq!(kind(ExitStatus::from_raw(9)), "killed");
        assert!(words("Terminated\n\n", ExitStatus::from_raw(9)).contains("Terminated"));
    }
}
