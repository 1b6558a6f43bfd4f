//! One run as a process of its own: its messages, its time and its memory.

use super::plan::{BenchArgs, BenchCase, usage};
use crate::error::{Error, Kind, Result};
use crate::file::digest;
use crate::interrupt::{self, Interrupt};
use crate::output::safe_name;
use crate::petsc::launcher;
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use serde_json::Value;
use std::fs::{self, File};
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::{Duration, Instant};
use wait4::{ResUse, Wait4};

/// The result of one run.
pub(super) struct ProcessRun {
    /// Status of the report, or `refused`, `timeout`, `killed` or `failed`.
    pub status: String,
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

impl ProcessRun {
    /// Return the number at a path of the report.
    pub fn number(&self, path: &str) -> Option<f64> {
        self.report.pointer(path).and_then(Value::as_f64)
    }

    /// Return the largest number of this name of the bodies of the report that have it.
    pub fn largest(&self, key: &str) -> Option<f64> {
        items(&self.report["bodies"]).iter().filter_map(|body| body[key].as_f64()).reduce(f64::max)
    }
}

/// Return the items of a list of a report; none if it is no list.
pub(super) fn items(list: &Value) -> &[Value] {
    list.as_array().map_or(&[], Vec::as_slice)
}

/// The program that starts runs, and their limits.
pub(super) struct Runner {
    program: PathBuf,
    /// Folder of the results of all runs.
    folder: PathBuf,
    timeout: Duration,
    /// Number of runs of each case.
    repeat: usize,
    interrupt: Interrupt,
}

/// Time that a process gets to end itself.
const GRACE: Duration = Duration::from_secs(5);

/// Time between checks for a signal.
const CHECK_INTERVAL: Duration = Duration::from_millis(100);

/// Name of the folder of the results of all runs.
pub(super) const RUNS: &str = "runs";

/// Longest name of the folder of a run. Half as many characters, of at most four bytes, and 13 of the
/// digest are 253 bytes of the 255 that file systems allow.
const LONGEST_NAME: usize = 120;

impl Runner {
    /// Return a runner of this program, for runs below `folder`.
    ///
    /// # Errors
    /// A time limit that is no time, a system on which the path of the program cannot be found.
    pub fn new(interrupt: &Interrupt, request: &BenchArgs, folder: &Path) -> Result<Self> {
        let timeout = Duration::try_from_secs_f64(request.timeout)
            .ok()
            .filter(|timeout| !timeout.is_zero())
            .ok_or_else(|| usage(format!("`--timeout {}` is no time in seconds", request.timeout)))?;
        let program =
            std::env::current_exe().map_err(|cause| Error::file(Path::new("this program"), "find", &cause))?;
        let (folder, interrupt) = (folder.join(RUNS), interrupt.clone());
        Ok(Self { program, folder, timeout, repeat: request.repeat, interrupt })
    }

    /// Return the folder of a run's results.
    pub fn folder(&self, case: &BenchCase) -> PathBuf {
        folder_of(&self.folder, &case.key)
    }

    /// Make the mesh of a run. A failure is not reported here, since the run itself fails in the same way.
    pub fn mesh(&self, case: &BenchCase) -> Result<()> {
        let mut command = Command::new(&self.program);
        command.arg("mesh").arg(&case.scene);
        command.args(case.mesh_overrides.iter().flat_map(|text| ["--set", text]));
        self.finish(command, &self.folder(case)).map(|_| ())
    }

    /// Run a case as often as asked for, or until it fails.
    pub fn repeat(&self, case: &BenchCase) -> Result<Vec<ProcessRun>> {
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

    fn run(&self, case: &BenchCase) -> Result<ProcessRun> {
        let folder = self.folder(case);
        let mut command = match case.ranks {
            1 => Command::new(&self.program),
            ranks => {
                let mut command = launcher();
                command.args(["-n", &ranks.to_string()]).arg(&self.program);
                command
            }
        };
        command.arg("solve").arg(&case.scene).arg("-o").arg(&folder);
        command.args(case.overrides.iter().flat_map(|text| ["--set", text])).args(&case.petsc);
        // one thread for each rank, unless the user has set another number: otherwise the threads of solvers are compared
        for name in ["OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"] {
            if std::env::var_os(name).is_none() {
                command.env(name, "1");
            }
        }
        // results of an earlier run must not be taken for those of this run; there may be none
        let _ = fs::remove_dir_all(&folder);
        let ended = self.finish(command, &folder)?;
        let report = fs::read(folder.join("report.json")).ok();
        let report: Value = report.and_then(|bytes| serde_json::from_slice(&bytes).ok()).unwrap_or_default();
        let (status, message) = match (ended.used.as_ref(), report["status"].as_str()) {
            (None, _) => ("failed".to_owned(), ended.output),
            _ if ended.is_late => ("timeout".to_owned(), format!("not ended after {:?}", self.timeout)),
            (_, Some(status)) => (status.to_owned(), report["message"].as_str().unwrap_or_default().to_owned()),
            (Some(used), None) => (status_of(used.status).to_owned(), message(&ended.output, used.status)),
        };
        Ok(ProcessRun {
            status,
            message,
            seconds: ended.seconds,
            cpu: ended.used.as_ref().map_or(f64::NAN, |used| (used.rusage.utime + used.rusage.stime).as_secs_f64()),
            memory: ended.used.map_or(0, |used| used.rusage.maxrss),
            report: if ended.is_late { Value::Null } else { report },
            last_sweep: last_sweep(&folder.join("history.csv")),
        })
    }

    /// Start a process, wait for it, and end it when its time is over. Its output goes to `output.txt` in the folder.
    fn finish(&self, mut command: Command, folder: &Path) -> Result<Ended> {
        fs::create_dir_all(folder).map_err(|cause| Error::file(folder, "create the folder", &cause))?;
        let path = folder.join("output.txt");
        let failed = |cause: std::io::Error| Error::file(&path, "write", &cause);
        // a file of this name is replaced: a pipe would keep its writer waiting
        let _ = fs::remove_file(&path);
        let file = File::create_new(&path).map_err(failed)?;
        let both = file.try_clone().map_err(failed)?;
        command.stdin(Stdio::null()).stdout(file).stderr(both);
        let began = Instant::now();
        let child = match command.spawn() {
            Ok(child) => child,
            Err(cause) => {
                let output = format!("cannot start {}: {cause}", command.get_program().display());
                return Ok(Ended { used: None, is_late: false, seconds: f64::NAN, output });
            }
        };
        let (answer, is_late) = self.wait(child, began);
        if let Some(signal) = self.interrupt.asked() {
            let message = format!("ended by {}: the rows so far are kept", interrupt::name(signal));
            return Err(Error::new(Kind::Stopped(signal), message).help("`--resume` makes those that are missing"));
        }
        let seconds = began.elapsed().as_secs_f64();
        let output = String::from_utf8_lossy(&fs::read(&path).unwrap_or_default()).into_owned();
        Ok(Ended { used: answer.ok().and_then(|used| used.ok()), is_late, seconds, output })
    }

    /// Wait for a process. If its time is over or a signal has come, it is ended. Return its answer, and whether it had to be ended.
    fn wait(&self, mut child: Child, began: Instant) -> (Answer, bool) {
        let id = Pid::from_raw(child.id() as i32);
        let (send, receive) = mpsc::channel();
        // the thread reports the end of the process at once, without polling
        std::thread::spawn(move || send.send(child.wait4()));
        let is_running = |answer: &Answer| matches!(answer, Err(RecvTimeoutError::Timeout));
        let mut answer = receive.recv_timeout(CHECK_INTERVAL.min(self.timeout));
        while is_running(&answer) && began.elapsed() < self.timeout && self.interrupt.asked().is_none() {
            answer = receive.recv_timeout(CHECK_INTERVAL.min(self.timeout.saturating_sub(began.elapsed())));
        }
        let is_late = is_running(&answer);
        for signal in [Signal::SIGTERM, Signal::SIGKILL] {
            if is_running(&answer) {
                // the process may have ended meanwhile
                let _ = kill(id, signal);
                answer = receive.recv_timeout(GRACE);
            }
        }
        (answer, is_late)
    }
}

/// Return the number of inner iterations between the last two rows of a history.
fn last_sweep(history: &Path) -> Option<f64> {
    let mut reader = csv::Reader::from_path(history).ok()?;
    let column = reader.headers().ok()?.iter().position(|name| name == "inner_iterations")?;
    let counts = reader.records().map(|row| row.ok()?.get(column)?.parse().ok()).collect::<Option<Vec<f64>>>()?;
    let [.., before, last] = counts[..] else { return None };
    Some(last - before)
}

/// The answer of the thread that waits for a process.
type Answer = Result<std::io::Result<ResUse>, RecvTimeoutError>;

/// Return the folder of the results of a run with a key, below the folder of all runs.
pub(super) fn folder_of(runs: &Path, key: &[String]) -> PathBuf {
    let name = safe_name(&key.join("_").replace(' ', "_"));
    if name.len() <= LONGEST_NAME {
        return runs.join(name);
    }
    let start: String = name.chars().take(LONGEST_NAME / 2).collect();
    runs.join(format!("{start}-{:.12}", digest(&name)))
}

struct Ended {
    /// Resources that it used; `None` if it could not be started or waited for.
    used: Option<ResUse>,
    is_late: bool,
    seconds: f64,
    /// Its standard output and standard error.
    output: String,
}

/// Return the status of a run without a report.
fn status_of(status: ExitStatus) -> &'static str {
    match (status.code(), status.signal()) {
        (_, Some(_)) => "killed",
        (Some(2..=6), _) => "refused",
        _ => "failed",
    }
}

/// Return the message of a process without a report: its errors with their advice, or else a line of its output.
fn message(output: &str, status: ExitStatus) -> String {
    let mut found: Vec<&str> = Vec::new();
    for line in output.lines() {
        let text = line.trim_start_matches([' ', '|', '=']).trim();
        let is_error = line.starts_with("error");
        if is_error || (!found.is_empty() && (text.starts_with("help:") || text.starts_with("note:"))) {
            found.push(text);
        }
    }
    let mut lines = output.lines().map(str::trim).filter(|line| line.contains(char::is_alphabetic));
    // messages of mpiexec begin with a rule, and their first line says what is wrong
    let line = if output.trim_start().starts_with("---") { lines.next() } else { lines.next_back() };
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
    fn refusals_are_reported_in_their_words() {
        let output = "-----\nmpiexec has detected an attempt to run as root.\n\nmore\n-----\n";
        assert!(
            message(output, ExitStatus::from_raw(1 << 8))
                .ends_with("1: mpiexec has detected an attempt to run as root.")
        );
        assert!(message("one\n  two\n---\n", ExitStatus::from_raw(1 << 8)).ends_with("1: two"));
        let output = "Title\nerror: PETSc knows no option -ksp_tpye\n |\n = help: did you mean -ksp_type?\n";
        let status = ExitStatus::from_raw(5 << 8);
        assert_eq!(message(output, status), "error: PETSc knows no option -ksp_tpye; help: did you mean -ksp_type?");
        assert_eq!(status_of(status), "refused");
        assert_eq!(status_of(ExitStatus::from_raw(9)), "killed");
        assert!(message("Terminated\n\n", ExitStatus::from_raw(9)).contains("Terminated"));
    }
}
